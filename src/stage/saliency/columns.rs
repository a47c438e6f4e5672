//! What stands is one surface from its foot to its top.

use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, mask32x16, padded, prelude::*, store_inside};
use crate::stage::ground::height::{HIGH_M, LEAST_DISPARITY, NOISE_PX};
use crate::stage::ground::{Plane, cell_centre};
use crate::stage::saliency::lateral;

/// Height in metres (of a road scene) where things begin.
pub const LOW_M: f32 = 0.15;
/// Metres (of a road scene) above that over which they fade in.
pub const FADE_IN_M: f32 = 0.25;
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

/// Columns that are taken at once.
const LANES: usize = 16;
type Lanes = [f32; LANES];

/// Cells side by side: one bit for each that is of a surface, and for each of those
/// that goes on from the one below it.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    on: u16,
    goes_on: u16,
}

/// Upright surfaces, column by column: cells above the ground, one above the
/// other, of one disparity (stixels: Badino, Franke and Pfeiffer, "The Stixel
/// World", DAGM 2009).
#[derive(Debug)]
pub struct Columns {
    level: Level,
    /// Of every [`LANES`] columns, row by row.
    parts: Vec<Part>,
    /// Of the columns that are looked at: per row the mean disparity of the surfaces up to
    /// there, or the sum of a cue and the number of cells. Only rows with surfaces have them.
    means: Vec<Lanes>,
    sums: Vec<[Lanes; 2]>,
}

impl Columns {
    /// The finder at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, parts: Vec::new(), means: Vec::new(), sums: Vec::new() }
    }

    /// Finds the surfaces in `disparity` (full-size pixels, `cx_l - cx_r`
    /// subtracted, no NaN) and replaces it on each of them by its mean.
    pub fn find(&mut self, disparity: &mut Image<f32>, plane: &Plane) {
        let height = disparity.height();
        self.parts.resize(disparity.width().div_ceil(LANES) * height, Part::default());
        self.means.resize(height, [0.0; LANES]);
        let Self { level, parts, means, .. } = self;
        dispatch!(*level, simd => {
            for (i, parts) in parts.chunks_exact_mut(height.max(1)).enumerate() {
                climb(simd, i * LANES, disparity, plane, parts, means);
                hand_down(simd, i * LANES, parts, means, disparity);
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
        let height = disparity.height();
        self.sums.resize(height, [[0.0; LANES]; 2]);
        let Self { level, parts, sums, .. } = self;
        dispatch!(*level, simd => {
            for (i, parts) in parts.chunks_exact(height.max(1)).enumerate() {
                add_up(simd, i * LANES, parts, cue, sums);
                descend(simd, i * LANES, (parts, sums), disparity, plane, out);
            }
        });
    }
}

/// Disparity of the ground in a row of [`LANES`] columns, as [`Plane::disparity`] reckons.
struct Ground<S: Simd> {
    slope: f32x16<S>,
    a: f32,
    c: f32,
}

impl<S: Simd> Ground<S> {
    #[inline(always)]
    fn new(simd: S, x: usize, plane: &Plane) -> Self {
        let u = f32x16::from_fn(simd, |i| cell_centre(x + i, 0).0);
        Self { slope: u * plane.b, a: plane.a, c: plane.c }
    }

    #[inline(always)]
    fn at(&self, y: usize) -> f32x16<S> {
        self.slope + self.a * cell_centre(0, y).1 + self.c
    }
}

#[inline(always)]
fn mask<S: Simd>(simd: S, bits: u16) -> mask32x16<S> {
    mask32x16::from_bitmask(simd, u64::from(bits))
}

/// Upward through the columns from `x` on: which cells are of surfaces.
#[inline(always)]
fn climb<S: Simd>(
    simd: S,
    x: usize,
    disparity: &Image<f32>,
    plane: &Plane,
    parts: &mut [Part],
    means: &mut [Lanes],
) {
    let (lowest, noise) = (EVIDENCE_M * plane.scale(), NOISE_PX * plane.camera_height_m);
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let ground = Ground::new(simd, x, plane);
    // The surface that ends in the row below; none where `count` is 0.
    let [mut sum, mut count, mut last, mut mean] = [zero; 4];
    for (y, (part, out)) in parts.iter_mut().zip(means).enumerate().rev() {
        let d: f32x16<S> = padded(simd, disparity.row(y), x, 0.0);
        // Heights multiplied by d.
        let height = (d - ground.at(y)) * plane.camera_height_m;
        let above = d.simd_gt(LEAST_DISPARITY) & height.simd_ge(d * lowest + noise);
        let on = above & height.simd_le(d * HIGH_M);
        let next = (d - last).abs().simd_le((d * NEXT_PART).max(NEXT_PX));
        let same = (d - mean).abs().simd_le(d * MEAN_PART);
        let goes_on = on & count.simd_gt(0.0) & next & same;
        *part = Part { on: on.to_bitmask() as u16, goes_on: goes_on.to_bitmask() as u16 };
        sum = goes_on.select(sum + d, d);
        count = goes_on.select(count + one, on.select(one, zero));
        last = d;
        // What begins is its own mean.
        mean = d;
        if part.goes_on != 0 {
            mean = sum / count.max(1.0);
        }
        if part.on != 0 {
            mean.store_slice(out);
        }
    }
}

/// Puts on the cells of surfaces the value of their highest one.
#[inline(always)]
fn hand_down<S: Simd>(
    simd: S,
    x: usize,
    parts: &[Part],
    means: &[Lanes],
    disparity: &mut Image<f32>,
) {
    let mut value = f32x16::splat(simd, 0.0);
    // Where the surface of the row above goes on.
    let mut inside = 0;
    for (y, (part, mean)) in parts.iter().zip(means).enumerate() {
        if part.on != 0 {
            let row = disparity.row_mut(y);
            let own: f32x16<S> = padded(simd, row, x, 0.0);
            value = mask(simd, inside).select(value, f32x16::load_array_ref(simd, mean));
            store_inside(row, x, mask(simd, part.on).select(value, own));
        }
        inside = part.goes_on;
    }
}

/// Sums of `cue` over surfaces, from their lowest cells up, and numbers of cells.
#[inline(always)]
fn add_up<S: Simd>(simd: S, x: usize, parts: &[Part], cue: &Image<f32>, sums: &mut [[Lanes; 2]]) {
    let one = f32x16::splat(simd, 1.0);
    let [mut sum, mut count] = [one; 2];
    for (y, (part, [out, cells])) in parts.iter().zip(sums).enumerate().rev() {
        if part.on == 0 {
            continue;
        }
        let cue: f32x16<S> = padded(simd, cue.row(y), x, 0.0);
        let goes_on = mask(simd, part.goes_on);
        sum = goes_on.select(sum + cue, cue);
        count = goes_on.select(count + one, one);
        sum.store_slice(out);
        count.store_slice(cells);
    }
}

/// Down through the columns from `x` on: what their surfaces are worth.
#[inline(always)]
fn descend<S: Simd>(
    simd: S,
    x: usize,
    (parts, sums): (&[Part], &[[Lanes; 2]]),
    disparity: &Image<f32>,
    plane: &Plane,
    out: &mut Image<f32>,
) {
    let scale = plane.scale();
    let (lowest, fade_in) = (LOW_M * scale, 1.0 / (FADE_IN_M * scale));
    let ground = Ground::new(simd, x, plane);
    // Value and disparity of the surface that comes down from the row above, where it
    // was inside of it and where at all: its foot belongs to it.
    let [mut value, mut of] = [f32x16::splat(simd, 0.0); 2];
    let [mut inside, mut before] = [0; 2];
    for (y, (part, [sum, cells])) in parts.iter().zip(sums).enumerate() {
        if part.on | before == 0 {
            inside = 0;
            continue;
        }
        let d: f32x16<S> = padded(simd, disparity.row(y), x, 0.0);
        let at = ground.at(y);
        let top = part.on & !inside;
        if top != 0 {
            // Above the image nothing is known.
            let upper: f32x16<S> = padded(simd, disparity.row(y.saturating_sub(1)), x, 0.0);
            let height = (d - at) * plane.camera_height_m / d.max(LEAST_DISPARITY);
            let gate = ((height - lowest) * fade_in).max(0.0).min(1.0);
            let rise = lateral::contrast(d - upper - lateral::NOISE_PX, d).max(0.0);
            let mean = f32x16::load_array_ref(simd, sum) / f32x16::load_array_ref(simd, cells);
            let top = mask(simd, top);
            value = top.select((gate * (mean + rise * RISE)).min(1.0), value);
            of = top.select(d, of);
        }
        let foot = (d - of).abs().simd_le(of * FOOT_PART) & at.simd_lt(of);
        before = part.on | before & foot.to_bitmask() as u16;
        inside = part.goes_on;
        let own: f32x16<S> = padded(simd, out.row(y), x, 0.0);
        let own = mask(simd, before).select(own.max(value), own);
        store_inside(out.row_mut(y), x, own);
    }
}
