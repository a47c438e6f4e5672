//! Weighted median of disparities, guided by the brightness of the view.
//!
//! A disparity is replaced by the weighted median of five along its row, then of
//! five along its column. What is as bright as the pixel weighs most, so that
//! outlines of disparity follow those of the image: the matcher's windows carry a
//! near thing's disparity one to three pixels beyond its outline. (Ma, He, Wei, Sun
//! and Wu 2013 filter disparity by weighted medians of whole windows; along the two
//! axes it costs a tenth and gains nearly the same.)

use crate::simd::prelude::*;
use crate::simd::{LANES, Simd, abs_diff, i16x16, load, mask16x16, u8x32, u16x16};
use crate::stage::stereo::NO_MATCH;

/// Pixels that are asked, as seen from the centre.
pub const TAPS: [isize; 5] = [-4, -2, 0, 2, 4];

/// A pixel weighs what is missing between its and the centre's brightness to this.
pub const UNLIKE: u8 = 32;

/// Pixels from the centre to the outermost one.
const REACH: usize = 4;

/// Index of the centre.
const CENTRE: usize = TAPS.len() / 2;

/// Disparities in one vector; a block has two of them.
const HALF: usize = LANES / 2;

/// One value per pixel that is asked.
type Taps<T> = [T; TAPS.len()];

/// Weighted medians along a row; holes stay holes and weigh nothing.
///
/// # Panics
/// Unless all rows have the same length.
#[inline(always)]
pub fn across<S: Simd>(simd: S, disparity: &[i16], gray: &[u8], out: &mut [i16]) {
    let width = out.len();
    assert!(disparity.len() == width && gray.len() == width);
    let at = |x: usize| {
        median_at(TAPS.map(|k| {
            let x = x.checked_add_signed(k).filter(|&x| x < width);
            x.map_or((NO_MATCH, 0), |x| (disparity[x], gray[x]))
        }))
    };
    let inner = REACH..width.saturating_sub(REACH);
    if inner.len() < LANES {
        (0..width).for_each(|x| out[x] = at(x));
        return;
    }
    (0..inner.start).chain(inner.end..width).for_each(|x| out[x] = at(x));
    for x in inner.clone().step_by(LANES) {
        // The last ones overlap those before.
        let x = x.min(inner.end - LANES);
        let spans = TAPS.map(|k| x.wrapping_add_signed(k)).map(|x| x..x + LANES);
        let disparity = spans.clone().map(|span| &disparity[span]);
        medians(simd, disparity, spans.map(|span| &gray[span]), &mut out[x..x + LANES]);
    }
}

/// Weighted medians along the columns of five rows, which stand [`TAPS`] from the
/// middle one.
///
/// # Panics
/// Unless all rows have the same length.
#[inline(always)]
pub fn down<S: Simd>(simd: S, disparity: Taps<&[i16]>, gray: Taps<&[u8]>, out: &mut [i16]) {
    let width = out.len();
    assert!(disparity.iter().all(|row| row.len() == width));
    assert!(gray.iter().all(|row| row.len() == width));
    if width < LANES {
        for (x, out) in out.iter_mut().enumerate() {
            *out = median_at(std::array::from_fn(|k| (disparity[k][x], gray[k][x])));
        }
        return;
    }
    for x in (0..width).step_by(LANES) {
        // The last ones overlap those before.
        let span = x.min(width - LANES)..(x + LANES).min(width);
        let disparity = disparity.map(|row| &row[span.clone()]);
        medians(simd, disparity, gray.map(|row| &row[span.clone()]), &mut out[span.clone()]);
    }
}

/// The medians of one block.
#[inline(always)]
fn medians<S: Simd>(simd: S, disparity: Taps<&[i16]>, gray: Taps<&[u8]>, out: &mut [i16]) {
    let none = i16x16::splat(simd, NO_MATCH);
    let is_hole = |d: &[i16]| i16x16::from_slice(simd, d).simd_eq(none).all_true();
    let (first, second) = disparity[CENTRE].split_at(HALF);
    if is_hole(first) && is_hole(second) {
        out.fill(NO_MATCH);
        return;
    }
    let centre = load(simd, gray[CENTRE], 0);
    let unlike = u8x32::splat(simd, UNLIKE);
    let weights = gray.map(|gray| unlike.saturating_sub(abs_diff(load(simd, gray, 0), centre)));
    let weights = weights.map(SimdWiden::widen);
    for (at, weights) in [(0, weights.map(|w| w.0)), (HALF, weights.map(|w| w.1))] {
        let d = disparity.map(|d| i16x16::from_slice(simd, &d[at..at + HALF]));
        median_lanes(simd, d, weights).store_slice(&mut out[at..at + HALF]);
    }
}

/// The least disparity of those that weigh half of all together with what is below them.
#[inline(always)]
fn median_lanes<S: Simd>(simd: S, d: Taps<i16x16<S>>, weights: Taps<u16x16<S>>) -> i16x16<S> {
    let (nothing, none) = (u16x16::splat(simd, 0), i16x16::splat(simd, NO_MATCH));
    let mut weights = weights;
    for (weight, d) in weights.iter_mut().zip(&d) {
        *weight = d.simd_eq(none).select(nothing, *weight);
    }
    let total = weights.iter().fold(nothing, |sum, &weight| sum + weight);
    // Of two equal ones the earlier counts what the later weighs.
    let mut below = weights;
    for i in 0..TAPS.len() {
        for j in i + 1..TAPS.len() {
            let lower: mask16x16<S> = d[j].simd_le(d[i]);
            below[i] += lower.select(weights[j], nothing);
            below[j] += lower.select(nothing, weights[i]);
        }
    }
    let most = i16x16::splat(simd, i16::MAX);
    let least = d
        .iter()
        .zip(below)
        .fold(most, |least, (&d, below)| least.min((below + below).simd_ge(total).select(d, most)));
    d[CENTRE].simd_eq(none).select(none, least)
}

/// The median of one pixel from disparity and brightness.
fn median_at(mut taps: Taps<(i16, u8)>) -> i16 {
    let (here, centre) = taps[CENTRE];
    if here == NO_MATCH {
        return NO_MATCH;
    }
    for (d, weight) in &mut taps {
        let like = UNLIKE.saturating_sub(weight.abs_diff(centre));
        *weight = if *d == NO_MATCH { 0 } else { like };
    }
    taps.sort_unstable();
    let total: u8 = taps.iter().map(|tap| tap.1).sum();
    let mut below = 0;
    // The centre weighs something: one of them is found.
    let median = taps.into_iter().find(|&(_, weight)| {
        below += weight;
        2 * u16::from(below) >= u16::from(total)
    });
    median.map_or(here, |(d, _)| d)
}
const _: () = assert!(TAPS.len() * UNLIKE as usize <= u8::MAX as usize);
