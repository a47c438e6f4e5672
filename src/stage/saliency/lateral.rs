//! How far a thing stands out in depth from what is beside it.

use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, prelude::*, store_inside};
use crate::stage::coarse::CELL;

/// Distances looked at on both sides, in cells.
const OFFSETS: [usize; 8] = [4, 6, 9, 14, 20, 30, 45, 68];
/// How far to look in a road scene, metres.
const REACH_M: f32 = 2.5;
/// Relative drop of disparity that counts fully.
const FULL_DROP: f32 = 0.35;
/// A drop up to this many pixels is noise.
pub const NOISE_PX: f32 = 0.15;

/// Cells that are looked at at once.
const LANES: usize = 16;
/// Cells beyond the ends of a row, for every offset and a cut group.
const BESIDE: usize = OFFSETS[OFFSETS.len() - 1] + LANES;

/// Lateral depth contrast, with its buffer.
#[derive(Debug)]
pub struct Lateral {
    level: Level,
    /// One row, with cells beyond its ends from which nothing drops.
    row: Vec<f32>,
}

impl Lateral {
    /// The cue at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, row: Vec::new() }
    }

    /// C = min(1, (min(l, r) + max(l, r) / 2) / (0.35 d)) where l and r are the
    /// largest drops of disparity towards the left and the right, less 0.15 px
    /// of noise, over a few offsets up to 2.5 m x `scale`. A pole drops on both
    /// sides, the edge of a wall on one; what continues on both sides has none.
    ///
    /// `disparity` has no NaN; `px_per_m` is the baseline's inverse: how many
    /// full-size pixels a metre spans per pixel of disparity.
    pub fn run(&mut self, disparity: &Image<f32>, px_per_m: f32, scale: f32, out: &mut Image<f32>) {
        let width = disparity.width();
        out.resize(disparity.size());
        self.row.clear();
        self.row.resize(width + 2 * BESIDE, f32::INFINITY);
        let cells_per_disparity = REACH_M * scale * px_per_m / CELL as f32;
        let Self { level, row } = self;
        dispatch!(*level, simd => {
            for y in 0..disparity.height() {
                row[BESIDE..BESIDE + width].copy_from_slice(disparity.row(y));
                for x in (0..width).step_by(LANES) {
                    let around = &row[x..x + 2 * BESIDE];
                    let contrast = contrast_of(simd, around, cells_per_disparity);
                    store_inside(out.row_mut(y), x, contrast);
                }
            }
        });
    }
}

/// The contrast of the cells in the middle of `around`.
#[inline(always)]
fn contrast_of<S: Simd>(simd: S, around: &[f32], cells_per_disparity: f32) -> f32x16<S> {
    let cells = |at: usize| f32x16::from_slice(simd, &around[at..at + LANES]);
    let d = cells(BESIDE);
    // At least the smallest offset, wherever the thing is.
    let reach = (d * cells_per_disparity).max(OFFSETS[0] as f32);
    let [mut left, mut right] = [f32x16::splat(simd, NOISE_PX); 2];
    for offset in OFFSETS {
        let within = reach.simd_ge(offset as f32);
        if !within.any_true() {
            break;
        }
        left = within.select(left.max(d - cells(BESIDE - offset)), left);
        right = within.select(right.max(d - cells(BESIDE + offset)), right);
    }
    contrast(left.min(right) + left.max(right) * 0.5 - 1.5 * NOISE_PX, d)
}

/// Drops of disparity from `disparity`, in pixels, as contrasts of at most 1.
#[inline(always)]
pub fn contrast<S: Simd>(drop: f32x16<S>, disparity: f32x16<S>) -> f32x16<S> {
    (drop / (disparity.max(0.5) * FULL_DROP)).min(1.0)
}
