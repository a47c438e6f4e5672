//! 3x3 median of disparities with holes.

use crate::simd::prelude::*;
use crate::simd::{Simd, i16x16};
use crate::stage::stereo::NO_MATCH;

const LANES: usize = 16;

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
    let inner = 1..width - 1;
    for x in inner.clone().step_by(LANES) {
        // The last ones overlap those before.
        let last = inner.end.saturating_sub(LANES);
        if last < inner.start {
            inner.clone().for_each(|x| out[x] = median_at(above, here, below, x));
            break;
        }
        median_lanes(simd, above, here, below, x.min(last), out);
    }
    out[0] = median_at(above, here, below, 0);
    out[width - 1] = median_at(above, here, below, width - 1);
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
    let hole = centre.simd_eq(none);
    if hole.all_true() {
        none.store_slice(&mut out[x..x + LANES]);
        return;
    }
    // Of nine values in sorted columns, the median is the median of the
    // largest minimum, the middle median and the smallest maximum (Smith 1996).
    let rows = [above, here, below];
    let left = column(simd, rows, x - 1, centre, none);
    let middle = column(simd, rows, x, centre, none);
    let right = column(simd, rows, x + 1, centre, none);
    let least = left[0].max(middle[0]).max(right[0]);
    let [_, median, _] = sorted(left[1], middle[1], right[1]);
    let most = left[2].min(middle[2]).min(right[2]);
    let [_, median, _] = sorted(least, median, most);
    // Holes stay holes.
    hole.select(none, median).store_slice(&mut out[x..x + LANES]);
}

/// The sorted values of the three rows from column `x` on, `centre` for holes.
#[inline(always)]
fn column<S: Simd>(
    simd: S,
    [above, here, below]: [&[i16]; 3],
    x: usize,
    centre: i16x16<S>,
    none: i16x16<S>,
) -> [i16x16<S>; 3] {
    let above = i16x16::from_slice(simd, &above[x..x + LANES]);
    let here = i16x16::from_slice(simd, &here[x..x + LANES]);
    let below = i16x16::from_slice(simd, &below[x..x + LANES]);
    sorted(
        above.simd_eq(none).select(centre, above),
        here.simd_eq(none).select(centre, here),
        below.simd_eq(none).select(centre, below),
    )
}

#[inline(always)]
fn sorted<S: Simd>(a: i16x16<S>, b: i16x16<S>, c: i16x16<S>) -> [i16x16<S>; 3] {
    let (a, b) = (a.min(b), a.max(b));
    let (b, c) = (b.min(c), b.max(c));
    let (a, b) = (a.min(b), a.max(b));
    [a, b, c]
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
