//! How far a thing stands out in depth from what is beside it.

use crate::image::Image;
use crate::simd::{Level, dispatch};
use crate::stage::coarse::CELL;

/// Distances looked at on both sides, in cells.
const OFFSETS: [usize; 8] = [4, 6, 9, 14, 20, 30, 45, 68];
/// How far to look in a road scene, metres.
const REACH_M: f32 = 2.5;
/// Relative drop of disparity that counts fully.
const FULL_DROP: f32 = 0.35;
/// A drop up to this many pixels is noise.
pub const NOISE_PX: f32 = 0.15;

/// Lateral depth contrast, with its buffers.
#[derive(Debug)]
pub struct Lateral {
    level: Level,
    left: Vec<f32>,
    right: Vec<f32>,
    reach: Vec<f32>,
}

impl Lateral {
    /// The cue at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, left: Vec::new(), right: Vec::new(), reach: Vec::new() }
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
        for buffer in [&mut self.left, &mut self.right, &mut self.reach] {
            buffer.clear();
            buffer.resize(width, 0.0);
        }
        let cells_per_disparity = REACH_M * scale * px_per_m / CELL as f32;
        let Self { level, left, right, reach } = self;
        dispatch!(*level, _simd => {
            for y in 0..disparity.height() {
                let d = disparity.row(y);
                left.fill(NOISE_PX);
                right.fill(NOISE_PX);
                for (reach, &d) in reach.iter_mut().zip(d) {
                    // At least the smallest offset, wherever the thing is.
                    *reach = (d * cells_per_disparity).max(OFFSETS[0] as f32);
                }
                for offset in OFFSETS.into_iter().filter(|&o| o < width) {
                    let (at, n) = (offset as f32, width - offset);
                    drops(at, &d[offset..], &d[..n], &reach[offset..], &mut left[offset..]);
                    drops(at, &d[..n], &d[offset..], &reach[..n], &mut right[..n]);
                }
                for (((out, &d), &l), &r) in
                    out.row_mut(y).iter_mut().zip(d).zip(left.iter()).zip(right.iter())
                {
                    let drop = l.min(r) + 0.5 * l.max(r) - 1.5 * NOISE_PX;
                    *out = contrast(drop, d);
                }
            }
        });
    }
}

/// A drop of disparity from `disparity`, in pixels, as a contrast of at most 1.
#[inline(always)]
pub fn contrast(drop: f32, disparity: f32) -> f32 {
    (drop / (FULL_DROP * disparity.max(0.5))).min(1.0)
}

/// The larger of `most` and the drop from here to there, where `at` is within reach.
#[inline(always)]
fn drops(at: f32, here: &[f32], there: &[f32], reach: &[f32], most: &mut [f32]) {
    for (((most, &here), &there), &reach) in most.iter_mut().zip(here).zip(there).zip(reach) {
        let drop = if at <= reach { here - there } else { 0.0 };
        *most = most.max(drop);
    }
}
