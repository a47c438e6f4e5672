//! How far a thing stands out in depth from what is beside it.

use crate::image::Image;
use crate::stage::coarse::CELL;

/// Distances looked at on both sides, in cells.
const OFFSETS: [usize; 8] = [4, 6, 9, 14, 20, 30, 45, 68];
/// How far to look in a road scene, metres.
const REACH_M: f32 = 2.5;
/// Relative drop of disparity that counts fully.
const FULL_DROP: f32 = 0.35;

/// Lateral depth contrast, with its buffers.
#[derive(Debug, Default)]
pub struct Lateral {
    left: Vec<f32>,
    right: Vec<f32>,
    reach: Vec<f32>,
}

impl Lateral {
    /// C = min(1, (min(l, r) + max(l, r) / 2) / (0.35 d)) where l and r are the
    /// largest drops of disparity towards the left and the right, over a few
    /// offsets up to 2.5 m x `scale`. A pole drops on both sides, the edge of a
    /// wall on one; what continues on both sides has none.
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
        for y in 0..disparity.height() {
            let d = disparity.row(y);
            self.left.fill(0.0);
            self.right.fill(0.0);
            for (reach, &d) in self.reach.iter_mut().zip(d) {
                // At least the smallest offset, wherever the thing is.
                *reach = (d * cells_per_disparity).max(OFFSETS[0] as f32);
            }
            for offset in OFFSETS.into_iter().filter(|&o| o < width) {
                let at = offset as f32;
                let n = width - offset;
                for (((left, &here), &there), &reach) in self.left[offset..]
                    .iter_mut()
                    .zip(&d[offset..])
                    .zip(d)
                    .zip(&self.reach[offset..])
                {
                    let drop = if at <= reach { here - there } else { 0.0 };
                    *left = left.max(drop);
                }
                for (((right, &here), &there), &reach) in
                    self.right[..n].iter_mut().zip(d).zip(&d[offset..]).zip(&self.reach)
                {
                    let drop = if at <= reach { here - there } else { 0.0 };
                    *right = right.max(drop);
                }
            }
            for (((out, &d), &l), &r) in
                out.row_mut(y).iter_mut().zip(d).zip(&self.left).zip(&self.right)
            {
                let drop = l.min(r) + 0.5 * l.max(r);
                *out = (drop / (FULL_DROP * d.max(0.5))).min(1.0);
            }
        }
    }
}
