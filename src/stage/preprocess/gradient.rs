//! Gradient magnitude.

use rayon::prelude::*;

use crate::image::Image;
use crate::simd::{Level, dispatch};

/// (|Sobel x| + |Sobel y|) / 8, rounded down: 0..=255. Beyond the image's edge
/// its outermost pixels continue.
pub fn gradient(level: Level, gray: &Image<u8>, out: &mut Image<u8>) {
    out.resize(gray.size());
    let (width, height) = (gray.width(), gray.height());
    if gray.size().is_empty() {
        return;
    }
    out.pixels_mut().par_chunks_exact_mut(width).with_min_len(32).enumerate().for_each(
        |(y, out)| {
            let up = gray.row(y.saturating_sub(1));
            let here = gray.row(y);
            let down = gray.row((y + 1).min(height - 1));
            dispatch!(level, _simd => gradient_row(up, here, down, out));
        },
    );
}

#[inline(always)]
fn gradient_row(up: &[u8], here: &[u8], down: &[u8], out: &mut [u8]) {
    let width = here.len();
    let at = |l: usize, c: usize, r: usize| {
        let p = |row: &[u8], x: usize| i16::from(row[x]);
        let gx = p(up, r) - p(up, l) + 2 * (p(here, r) - p(here, l)) + p(down, r) - p(down, l);
        let gy = p(down, l) - p(up, l) + 2 * (p(down, c) - p(up, c)) + p(down, r) - p(up, r);
        ((gx.abs() + gy.abs()) / 8) as u8
    };
    out[0] = at(0, 0, 1.min(width - 1));
    out[width - 1] = at(width.saturating_sub(2), width - 1, width - 1);
    if width < 3 {
        return;
    }
    let inner = width - 2;
    // Slices of one length let the compiler drop the bounds checks and vectorise.
    let (ul, uc, ur) = (&up[..inner], &up[1..=inner], &up[2..]);
    let (hl, hr) = (&here[..inner], &here[2..]);
    let (dl, dc, dr) = (&down[..inner], &down[1..=inner], &down[2..]);
    let (ur, hr, dr) = (&ur[..inner], &hr[..inner], &dr[..inner]);
    let out = &mut out[1..=inner];
    for x in 0..inner {
        let p = i16::from;
        let gx = p(ur[x]) - p(ul[x]) + 2 * (p(hr[x]) - p(hl[x])) + p(dr[x]) - p(dl[x]);
        let gy = p(dl[x]) - p(ul[x]) + 2 * (p(dc[x]) - p(uc[x])) + p(dr[x]) - p(ur[x]);
        out[x] = ((gx.abs() + gy.abs()) / 8) as u8;
    }
}
