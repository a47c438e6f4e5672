//! Gray from colours and colours from gray.

use rayon::prelude::*;

use crate::image::Image;
use crate::simd::{Level, dispatch};

/// Weights of red, green and blue in 1/256.
const WEIGHTS: [u16; 3] = [77, 150, 29];

// They sum to one, so that white stays white and nothing overflows.
const _: () = assert!(WEIGHTS[0] + WEIGHTS[1] + WEIGHTS[2] == 256);

/// Luma of ITU-R BT.601, Y = 0.299 R + 0.587 G + 0.114 B, in 1/256.
pub fn luma(level: Level, rgb: &Image<[u8; 3]>, out: &mut Image<u8>) {
    out.resize(rgb.size());
    let width = rgb.width().max(1);
    let rows = rgb.pixels().par_chunks_exact(width);
    rows.zip(out.pixels_mut().par_chunks_exact_mut(width))
        .with_min_len(32)
        .for_each(|(rgb, out)| dispatch!(level, _simd => luma_row(rgb, out)));
}

#[inline(always)]
fn luma_row(rgb: &[[u8; 3]], out: &mut [u8]) {
    for (&[r, g, b], y) in rgb.iter().zip(out) {
        let [wr, wg, wb] = WEIGHTS;
        let sum = wr * u16::from(r) + wg * u16::from(g) + wb * u16::from(b);
        *y = ((sum + 128) >> 8) as u8;
    }
}

/// Equal channels from gray.
pub fn spread(gray: &Image<u8>, out: &mut Image<[u8; 3]>) {
    out.resize(gray.size());
    let width = gray.width().max(1);
    let rows = gray.pixels().par_chunks_exact(width);
    rows.zip(out.pixels_mut().par_chunks_exact_mut(width)).with_min_len(32).for_each(
        |(gray, out)| {
            for (&y, rgb) in gray.iter().zip(out) {
                *rgb = [y; 3];
            }
        },
    );
}
