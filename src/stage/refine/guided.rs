//! Weighted median of disparities, guided by the brightness of the view.
//!
//! A disparity is replaced by the weighted median of five along its row, then of
//! five along its column. What is as bright as the pixel weighs most, so that
//! outlines of disparity follow those of the image: the matcher's windows carry a
//! near thing's disparity one to three pixels beyond its outline. (Ma, He, Wei, Sun
//! and Wu 2013 filter disparity by weighted medians of whole windows; along the two
//! axes ten pixels are asked instead of 81, for nearly the same gain.)

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
        let (mut d, mut g) = ([&[][..]; TAPS.len()], [&[][..]; TAPS.len()]);
        for (i, k) in TAPS.into_iter().enumerate() {
            let from = x.wrapping_add_signed(k);
            d[i] = &disparity[from..from + LANES];
            g[i] = &gray[from..from + LANES];
        }
        medians(simd, &d, &g, &mut out[x..x + LANES]);
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
        let x = x.min(width - LANES);
        let (mut d, mut g) = ([&[][..]; TAPS.len()], [&[][..]; TAPS.len()]);
        for i in 0..TAPS.len() {
            d[i] = &disparity[i][x..x + LANES];
            g[i] = &gray[i][x..x + LANES];
        }
        medians(simd, &d, &g, &mut out[x..x + LANES]);
    }
}

/// The medians of one block. (Loops, as what arrays are mapped with is called, not
/// inlined, and is then compiled without the wide instructions.)
#[inline(always)]
fn medians<S: Simd>(simd: S, disparity: &Taps<&[i16]>, gray: &Taps<&[u8]>, out: &mut [i16]) {
    let none = i16x16::splat(simd, NO_MATCH);
    let (first, second) = disparity[CENTRE].split_at(HALF);
    let holes = i16x16::from_slice(simd, first).simd_eq(none);
    if holes.all_true() && i16x16::from_slice(simd, second).simd_eq(none).all_true() {
        out.fill(NO_MATCH);
        return;
    }
    let centre = load(simd, gray[CENTRE], 0);
    let unlike = u8x32::splat(simd, UNLIKE);
    let nothing = u16x16::splat(simd, 0);
    let mut weights = [[nothing; TAPS.len()]; 2];
    let mut d = [[none; TAPS.len()]; 2];
    for i in 0..TAPS.len() {
        let weight = unlike.saturating_sub(abs_diff(load(simd, gray[i], 0), centre));
        let (first, second) = weight.widen();
        for (half, weight) in [first, second].into_iter().enumerate() {
            let disparity = &disparity[i][half * HALF..(half + 1) * HALF];
            d[half][i] = i16x16::from_slice(simd, disparity);
            weights[half][i] = d[half][i].simd_eq(none).select(nothing, weight);
        }
    }
    for half in 0..2 {
        let medians = median_lanes(simd, &d[half], &weights[half]);
        medians.store_slice(&mut out[half * HALF..(half + 1) * HALF]);
    }
}

/// The least disparity of those that weigh half of all together with what is below
/// them; holes weigh nothing.
#[inline(always)]
fn median_lanes<S: Simd>(simd: S, d: &Taps<i16x16<S>>, weights: &Taps<u16x16<S>>) -> i16x16<S> {
    let nothing = u16x16::splat(simd, 0);
    let mut total = nothing;
    // Of two equal ones the earlier counts what the later weighs.
    let mut below = *weights;
    for i in 0..TAPS.len() {
        total += weights[i];
        for j in i + 1..TAPS.len() {
            let lower: mask16x16<S> = d[j].simd_le(d[i]);
            below[i] += lower.select(weights[j], nothing);
            below[j] += lower.select(nothing, weights[i]);
        }
    }
    let most = i16x16::splat(simd, i16::MAX);
    let mut least = most;
    for i in 0..TAPS.len() {
        least = least.min((below[i] + below[i]).simd_ge(total).select(d[i], most));
    }
    let none = i16x16::splat(simd, NO_MATCH);
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

// All weights together fit into a byte.
const _: () = assert!(TAPS.len() * UNLIKE as usize <= u8::MAX as usize);
