//! 3x3 noise filters. Beyond the image's edge its outermost pixels continue.

use rayon::prelude::*;

use crate::simd::{Level, dispatch};

/// Median over 3x3 pixels of `C` interleaved channels, each by itself.
pub fn median3<const C: usize>(level: Level, pixels: &[u8], width: usize, out: &mut [u8]) {
    filter3::<C>(level, pixels, width, out, |p| {
        // The median of nine is the median of: the largest of the columns'
        // minima, the median of their medians, the smallest of their maxima.
        let column = |i: usize| sorted(p[i], p[i + 3], p[i + 6]);
        let ([l0, m0, h0], [l1, m1, h1], [l2, m2, h2]) = (column(0), column(1), column(2));
        let low = l0.max(l1).max(l2);
        let high = h0.min(h1).min(h2);
        sorted(low, sorted(m0, m1, m2)[1], high)[1]
    });
}

/// Binomial filter (1 2 1)^2 / 16 over `C` interleaved channels, rounded to nearest.
pub fn gaussian3<const C: usize>(level: Level, pixels: &[u8], width: usize, out: &mut [u8]) {
    filter3::<C>(level, pixels, width, out, |p| {
        let w = |i: usize| u16::from(p[i]);
        let corners = w(0) + w(2) + w(6) + w(8);
        let sides = w(1) + w(3) + w(5) + w(7);
        ((corners + 2 * sides + 4 * w(4) + 8) >> 4) as u8
    });
}

/// Three values in ascending order.
#[inline(always)]
fn sorted(a: u8, b: u8, c: u8) -> [u8; 3] {
    let (low, high) = (a.min(b), a.max(b));
    let (middle, high) = (high.min(c), high.max(c));
    [low.min(middle), low.max(middle), high]
}

/// `kernel` of the nine values around each value, row by row.
fn filter3<const C: usize>(
    level: Level,
    pixels: &[u8],
    width: usize,
    out: &mut [u8],
    kernel: impl Fn([u8; 9]) -> u8 + Sync,
) {
    let stride = width * C;
    if pixels.is_empty() || stride == 0 {
        return;
    }
    let height = pixels.len() / stride;
    let row = |y: usize| &pixels[y * stride..(y + 1) * stride];
    out.par_chunks_exact_mut(stride).with_min_len(16).enumerate().for_each(|(y, out)| {
        let rows = [row(y.saturating_sub(1)), row(y), row((y + 1).min(height - 1))];
        dispatch!(level, _simd => filter_row::<C>(rows, out, &kernel));
    });
}

#[inline(always)]
fn filter_row<const C: usize>(rows: [&[u8]; 3], out: &mut [u8], kernel: &impl Fn([u8; 9]) -> u8) {
    let stride = out.len();
    let [up, here, down] = rows;
    let at = |l: usize, c: usize, r: usize| {
        kernel([up[l], up[c], up[r], here[l], here[c], here[r], down[l], down[c], down[r]])
    };
    for c in 0..C {
        let (last, right) = (stride - C + c, (C + c).min(stride - C + c));
        out[c] = at(c, c, right);
        out[last] = at(last.saturating_sub(C).max(c), last, last);
    }
    if stride < 3 * C {
        return;
    }
    let inner = stride - 2 * C;
    // Slices of one length let the compiler drop the bounds checks and vectorise.
    let [ul, uc, ur, hl, hc, hr, dl, dc, dr] = [
        &up[..inner],
        &up[C..C + inner],
        &up[2 * C..2 * C + inner],
        &here[..inner],
        &here[C..C + inner],
        &here[2 * C..2 * C + inner],
        &down[..inner],
        &down[C..C + inner],
        &down[2 * C..2 * C + inner],
    ];
    let out = &mut out[C..C + inner];
    for x in 0..inner {
        out[x] = kernel([ul[x], uc[x], ur[x], hl[x], hc[x], hr[x], dl[x], dc[x], dr[x]]);
    }
}
