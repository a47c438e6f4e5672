//! 3x3 median of disparities with holes.

use crate::simd::prelude::*;
use crate::simd::{Simd, i16x16};
use crate::stage::stereo::NO_MATCH;

const LANES: usize = 16;

/// The exchange network of Paeth, Graphics Gems (1990): leaves the median of
/// nine values in the fifth place.
const EXCHANGES: [(usize, usize); 19] = [
    (1, 2),
    (4, 5),
    (7, 8),
    (0, 1),
    (3, 4),
    (6, 7),
    (1, 2),
    (4, 5),
    (7, 8),
    (0, 3),
    (5, 8),
    (4, 7),
    (3, 6),
    (1, 4),
    (2, 5),
    (4, 7),
    (4, 2),
    (6, 4),
    (4, 2),
];

/// Median of the 3x3 window of every pixel of `here` that has a disparity;
/// neighbours without one, or outside the rows, count as the pixel itself.
///
/// # Panics
/// Unless all rows have the same length.
#[inline(always)]
pub fn median_row<S: Simd>(simd: S, above: &[i16], here: &[i16], below: &[i16], out: &mut [i16]) {
    let width = here.len();
    assert!(above.len() == width && below.len() == width && out.len() == width);
    if width == 0 {
        return;
    }
    let mut x = 1;
    while x + LANES < width {
        median_lanes(simd, above, here, below, x, out);
        x += LANES;
    }
    out[0] = median_at(above, here, below, 0);
    for (x, out) in out.iter_mut().enumerate().skip(x) {
        *out = median_at(above, here, below, x);
    }
}

/// 16 medians from column `x` on; columns `x - 1 .. x + 17` exist.
#[inline(always)]
fn median_lanes<S: Simd>(
    simd: S,
    above: &[i16],
    here: &[i16],
    below: &[i16],
    x: usize,
    out: &mut [i16],
) {
    let none = i16x16::splat(simd, NO_MATCH);
    let centre = i16x16::from_slice(simd, &here[x..x + LANES]);
    let mut p = [centre; 9];
    for (k, row) in [above, here, below].into_iter().enumerate() {
        for column in 0..3 {
            let value = i16x16::from_slice(simd, &row[x + column - 1..x + column - 1 + LANES]);
            p[3 * k + column] = value.simd_eq(none).select(centre, value);
        }
    }
    for (a, b) in EXCHANGES {
        let (low, high) = (p[a].min(p[b]), p[a].max(p[b]));
        p[a] = low;
        p[b] = high;
    }
    // Holes stay holes.
    let median = centre.simd_eq(none).select(none, p[4]);
    median.store_slice(&mut out[x..x + LANES]);
}

/// The median of one pixel, anywhere in the row.
fn median_at(above: &[i16], here: &[i16], below: &[i16], x: usize) -> i16 {
    let centre = here[x];
    if centre == NO_MATCH {
        return NO_MATCH;
    }
    let mut p = [centre; 9];
    for (k, row) in [above, here, below].into_iter().enumerate() {
        for column in 0..3 {
            let value = (x + column).checked_sub(1).and_then(|x| row.get(x)).copied();
            p[3 * k + column] = value.filter(|&d| d != NO_MATCH).unwrap_or(centre);
        }
    }
    p.sort_unstable();
    p[4]
}
