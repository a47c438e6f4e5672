//! What stands is one surface from its foot to its top.

use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, padded, prelude::*, store_inside};
use crate::stage::ground::{Plane, cell_centre};
use crate::stage::saliency::lateral;

/// Height in metres (of a road scene) where things begin.
pub const LOW_M: f32 = 0.15;
/// Metres (of a road scene) above that over which they fade in.
pub const FADE_IN_M: f32 = 0.25;
/// Height in metres where the following of a surface ends.
const HIGH_M: f32 = 2.6;
/// Uncertainty of a cell's disparity in pixels; it lifts the lower limit far away.
const NOISE_PX: f32 = 0.4;
/// Disparity in pixels below which heights are noise.
pub const LEAST_DISPARITY: f32 = 1.2;
/// Largest difference in disparity from the cell below: pixels, and in parts.
const NEXT_PX: f32 = 0.7;
const NEXT_PART: f32 = 0.05;
/// The same from the mean of the surface, in parts.
const MEAN_PART: f32 = 0.12;
/// The same of a surface's foot, which is too low to be evidence of a thing.
const FOOT_PART: f32 = 0.08;
/// Least height in metres (of a road scene) of a cell that is.
const EVIDENCE_M: f32 = 0.2;

/// What a surface gains that ends against something farther: what people make and
/// what they are is lower than 2.6 m, a wall goes on.
const RISE: f32 = 0.2;

/// Where in a surface a cell is.
const OUTSIDE: f32 = 0.0;
const BASE: f32 = 1.0;
const ABOVE: f32 = 2.0;

/// Upright surfaces, column by column: cells above the ground, one above the
/// other, of one disparity (stixels: Badino, Franke and Pfeiffer, "The Stixel
/// World", DAGM 2009).
#[derive(Debug)]
pub struct Columns {
    level: Level,
    /// Per cell [`OUTSIDE`], [`BASE`] or [`ABOVE`].
    part: Image<f32>,
    /// Running means of what was averaged last, from the base up.
    mean: Image<f32>,
    /// What one row hands on to the next.
    state: [Vec<f32>; 4],
}

impl Columns {
    /// The finder at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, part: Image::default(), mean: Image::default(), state: Default::default() }
    }

    /// Finds the surfaces in `disparity` (full-size pixels, `cx_l - cx_r`
    /// subtracted, no NaN) and replaces it on each of them by its mean.
    pub fn find(&mut self, disparity: &mut Image<f32>, plane: &Plane) {
        let size = disparity.size();
        self.part.resize(size);
        self.mean.resize(size);
        self.clear_state(size.width);
        let Self { level, part, mean, state: [sum, count, last, so_far] } = self;
        dispatch!(*level, _simd => {
            for y in (0..size.height).rev() {
                let below = Surface { sum, count, last, so_far };
                climb(below, disparity.row(y), plane, y, part.row_mut(y), mean.row_mut(y));
            }
        });
        self.clear_state(size.width);
        let Self { level, part, mean, state: [carried, inside, ..] } = self;
        dispatch!(*level, simd => {
            for y in 0..size.height {
                hand_down(simd, part.row(y), mean.row(y), disparity.row_mut(y), carried, inside);
            }
        });
    }

    /// A surface is as salient as its parts: no cell of it counts less than the
    /// mean of `cue` over it, and .2 of the contrast to what is seen above its top
    /// (the drop of disparity, measured as that to the sides), down to where it meets
    /// the ground, if it is high enough to be a thing. `disparity` is that of
    /// [`Columns::find`].
    pub fn even_out(
        &mut self,
        disparity: &Image<f32>,
        plane: &Plane,
        cue: &Image<f32>,
        out: &mut Image<f32>,
    ) {
        let size = disparity.size();
        self.clear_state(size.width);
        let Self { level, part, mean, state: [sum, count, ..] } = self;
        dispatch!(*level, simd => {
            for y in (0..size.height).rev() {
                average(simd, part.row(y), cue.row(y), mean.row_mut(y), sum, count);
            }
        });
        self.clear_state(size.width);
        let Self { level, part, mean, state: [value, of, place, _] } = self;
        dispatch!(*level, _simd => {
            for y in 0..size.height {
                let above = Carried { value, of, place };
                let cells = Cells {
                    part: part.row(y),
                    mean: mean.row(y),
                    disparity: disparity.row(y),
                    // Above the image nothing is known.
                    upper: disparity.row(y.saturating_sub(1)),
                };
                descend(above, &cells, plane, y, out.row_mut(y));
            }
        });
    }

    fn clear_state(&mut self, width: usize) {
        for buffer in &mut self.state {
            buffer.clear();
            buffer.resize(width.next_multiple_of(LANES), 0.0);
        }
    }
}

/// Columns that are taken at once.
const LANES: usize = 16;

/// Puts on the cells of surfaces the value of their highest one, which is `carried`
/// down, where the row above is `inside` of a surface that goes on.
#[inline(always)]
fn hand_down<S: Simd>(
    simd: S,
    part: &[f32],
    mean: &[f32],
    disparity: &mut [f32],
    carried: &mut [f32],
    inside: &mut [f32],
) {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    for x in (0..disparity.len()).step_by(LANES) {
        let part: f32x16<S> = padded(simd, part, x, OUTSIDE);
        let own: f32x16<S> = padded(simd, disparity, x, 0.0);
        let goes_on = padded::<S, f32x16<S>>(simd, inside, x, 0.0).simd_gt(0.0);
        let surface = goes_on.select(padded(simd, carried, x, 0.0), padded(simd, mean, x, 0.0));
        store_inside(disparity, x, part.simd_gt(OUTSIDE).select(surface, own));
        store_inside(carried, x, surface);
        store_inside(inside, x, part.simd_gt(BASE).select(one, zero));
    }
}

/// Means of `cue` over surfaces, from their lowest cells up.
#[inline(always)]
fn average<S: Simd>(
    simd: S,
    part: &[f32],
    cue: &[f32],
    mean: &mut [f32],
    sum: &mut [f32],
    count: &mut [f32],
) {
    let one = f32x16::splat(simd, 1.0);
    for x in (0..mean.len()).step_by(LANES) {
        let cue: f32x16<S> = padded(simd, cue, x, 0.0);
        let goes_on = padded::<S, f32x16<S>>(simd, part, x, OUTSIDE).simd_gt(BASE);
        let sums = goes_on.select(padded::<S, f32x16<S>>(simd, sum, x, 0.0) + cue, cue);
        let counts = goes_on.select(padded::<S, f32x16<S>>(simd, count, x, 0.0) + one, one);
        store_inside(mean, x, sums / counts);
        store_inside(sum, x, sums);
        store_inside(count, x, counts);
    }
}

/// The surface that ends in the row below, per column; none where `count` is 0.
struct Surface<'a> {
    sum: &'a mut [f32],
    count: &'a mut [f32],
    last: &'a mut [f32],
    /// Its mean.
    so_far: &'a mut [f32],
}

#[inline(always)]
fn climb(
    below: Surface<'_>,
    disparity: &[f32],
    plane: &Plane,
    y: usize,
    part: &mut [f32],
    mean: &mut [f32],
) {
    let (lowest, noise) = (EVIDENCE_M * plane.scale(), NOISE_PX * plane.camera_height_m);
    let state = below.sum.iter_mut().zip(below.count).zip(below.last).zip(below.so_far);
    let cells = disparity.iter().zip(part).zip(mean);
    for (x, (((&d, part), mean), (((sum, count), last), so_far))) in cells.zip(state).enumerate() {
        let (u, v) = cell_centre(x, y);
        // Heights multiplied by d.
        let height = plane.camera_height_m * (d - plane.disparity(u, v));
        let stands = d > LEAST_DISPARITY && height >= lowest * d + noise && height <= HIGH_M * d;
        let goes_on = stands
            && *count > 0.0
            && (d - *last).abs() <= (NEXT_PART * d).max(NEXT_PX)
            && (d - *so_far).abs() <= MEAN_PART * d;
        let begun = if stands { 1.0 } else { 0.0 };
        *sum = if goes_on { *sum + d } else { d };
        *count = if goes_on { *count + 1.0 } else { begun };
        *last = d;
        *part = if goes_on { ABOVE } else { begun };
        *so_far = *sum / count.max(1.0);
        *mean = *so_far;
    }
}

/// What comes down from the row above, per column: the value of a surface, its
/// disparity, and 1 inside of it, 0.5 in its foot, 0 outside.
struct Carried<'a> {
    value: &'a mut [f32],
    of: &'a mut [f32],
    place: &'a mut [f32],
}

/// One row of what is known.
struct Cells<'a> {
    part: &'a [f32],
    mean: &'a [f32],
    disparity: &'a [f32],
    /// Disparity in the row above.
    upper: &'a [f32],
}

#[inline(always)]
fn descend(above: Carried<'_>, cells: &Cells<'_>, plane: &Plane, y: usize, out: &mut [f32]) {
    let scale = plane.scale();
    let (lowest, fade_in) = (LOW_M * scale, 1.0 / (FADE_IN_M * scale));
    let state = above.value.iter_mut().zip(above.of).zip(above.place);
    let depths = cells.disparity.iter().zip(cells.upper);
    let cells = cells.part.iter().zip(cells.mean).zip(depths).zip(out);
    for (x, ((((&part, &mean), (&d, &upper)), out), ((value, of), place))) in
        cells.zip(state).enumerate()
    {
        let (u, v) = cell_centre(x, y);
        let at = plane.disparity(u, v);
        let on = part > OUTSIDE;
        let top = on && *place < 1.0;
        let height = plane.camera_height_m * (d - at) / d.max(LEAST_DISPARITY);
        let gate = ((height - lowest) * fade_in).clamp(0.0, 1.0);
        let rise = lateral::contrast(d - upper - lateral::NOISE_PX, d).max(0.0);
        *value = if top { (gate * (mean + RISE * rise)).min(1.0) } else { *value };
        *of = if top { d } else { *of };
        let foot = *place > 0.0 && (d - *of).abs() <= FOOT_PART * *of && at < *of;
        let ends = if on || foot { 0.5 } else { 0.0 };
        *place = if part > BASE { 1.0 } else { ends };
        *out = if *place > 0.0 { out.max(*value) } else { *out };
    }
}
