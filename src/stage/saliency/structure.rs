//! What is higher than any thing: walls, trees, whatever goes on above.

use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, padded, prelude::*, store_inside};
use crate::stage::ground::{Plane, cell_centre};

/// Height above the ground in metres over which a surface is no thing's.
const TALL_M: f32 = 3.4;
/// What the image's upper edge cuts above this height goes on, for all one knows.
const CUT_M: f32 = 2.6;
/// Largest distance of a cell from its surface: pixels, and in parts of its disparity.
const SAME_PX: f32 = 0.6;
const SAME_PART: f32 = 0.08;
/// Share of the next cell in the surface's running disparity.
const RENEWAL: f32 = 0.3;
/// Cells in a row that may be farther away than the surface (a window, a
/// mismatch) without ending it, and one.
const LIVES: f32 = 3.0;
/// Cells on either side that are asked as well.
const REACH: usize = 2;

/// Columns that are followed at once.
const LANES: usize = 16;

/// The share of structure, with its buffer.
#[derive(Debug)]
pub struct Structure {
    level: Level,
    /// One row of zeros and ones, with its ends repeated.
    row: Vec<f32>,
}

impl Structure {
    /// The cue at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, row: Vec::new() }
    }

    /// Share of structure, 0..=1: the mean over five cells side by side of
    /// whether a cell's surface goes on, up its column, to more than 3.4 m above
    /// the ground. A surface stands upright: its cells have one disparity. A
    /// thing in front of it has a larger one, and ends it.
    ///
    /// `disparity` (full-size pixels, `cx_l - cx_r` subtracted) has no NaN.
    pub fn run(&mut self, disparity: &Image<f32>, plane: &Plane, out: &mut Image<f32>) {
        let width = disparity.width();
        out.resize(disparity.size());
        self.row.resize(width + 2 * REACH, 0.0);
        let Self { level, row } = self;
        dispatch!(*level, simd => {
            for x in (0..width).step_by(LANES) {
                descend(simd, x, disparity, plane, out);
            }
            for y in 0..disparity.height() {
                let row = &mut row[..width + 2 * REACH];
                row[REACH..REACH + width].copy_from_slice(out.row(y));
                let first = row[REACH];
                row[..REACH].fill(first);
                let last = row[width + REACH - 1];
                row[width + REACH..].fill(last);
                average(row, out.row_mut(y));
            }
        });
    }
}

/// Down the columns from `x` on: 1 where a surface from above the limit is still there.
#[inline(always)]
fn descend<S: Simd>(
    simd: S,
    x: usize,
    disparity: &Image<f32>,
    plane: &Plane,
    out: &mut Image<f32>,
) {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let full = f32x16::splat(simd, LIVES);
    let slope = f32x16::from_fn(simd, |i| cell_centre(x + i, 0).0) * plane.b;
    // The disparity of the surface that comes down from above, and how much it still
    // takes to end it (0: there is none).
    let [mut mean, mut lives] = [zero; 2];
    for y in 0..disparity.height() {
        let limit_m = if y == 0 { CUT_M } else { TALL_M };
        let d: f32x16<S> = padded(simd, disparity.row(y), x, 0.0);
        // As [`Plane::disparity`] reckons.
        let ground = slope + plane.a * cell_centre(0, y).1 + plane.c;
        // The height is over the limit, multiplied by d.
        let above = ((d - ground) * plane.camera_height_m).simd_gt(d * limit_m);
        let step = d - mean;
        let near = step.abs().simd_le((mean * SAME_PART).max(SAME_PX));
        let same = lives.simd_gt(zero) & near;
        let hole = step.simd_lt(zero).select((lives - one).max(zero), zero);
        lives = (above | same).select(full, hole);
        mean = same.select(mean + step * RENEWAL, above.select(d, mean));
        store_inside(out.row_mut(y), x, lives.simd_gt(zero).select(one, zero));
    }
}

/// Means over [`REACH`] cells to either side.
#[inline(always)]
fn average(row: &[f32], out: &mut [f32]) {
    for (out, window) in out.iter_mut().zip(row.windows(2 * REACH + 1)) {
        *out = window.iter().sum::<f32>() / (2 * REACH + 1) as f32;
    }
}
