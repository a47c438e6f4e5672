//! Where a plane is looked down upon: what stands off it, or has another colour.

use crate::image::Image;
use crate::stage::ground::{Plane, cell_centre};
use crate::stage::saliency::AttentionScene;
use crate::stage::table::RELIEF_PX;

/// Cells on either side over which relief is pooled.
const REACH: usize = 2;
/// Mean relief there from which it is evidence, and is full.
const LEAST_POOLED: f32 = 0.4;
const FULL_POOLED: f32 = 0.7;
/// What a relief of the table's own colour is worth.
const RELIEF: f32 = 0.6;
/// Sum of the barriers of Y, Cb and Cr that counts fully.
const FULL_BARRIER: f32 = 90.0;
/// What falls off towards the edge, in squares of the relative distance from
/// the centre, of what has a colour but no relief.
const SPREAD: f32 = 1.0;
/// What a thing that moves by itself gains.
const MOTION: f32 = 0.5;

/// Attention over a plane that is looked down upon, with its buffers.
#[derive(Debug, Default)]
pub struct OnTable {
    relief: Image<f32>,
    across: Image<f32>,
    sums: Vec<f32>,
}

impl OnTable {
    /// S = max(R (.6 + .4 `C_MB`), `C_MB` exp(−r²)) · (1 + .5 `C_M`) per cell, limited to
    /// 1: R is the pooled relief, r the relative distance from the centre,
    /// `barrier` the sum of the barriers of Y, Cb and Cr, `C_M` the motion where
    /// it is known.
    ///
    /// The relief of a cell is (d − d of `plane`) / 1.6 px − 1 within 0..=1: two
    /// standard deviations of the coarse disparity are no evidence yet. R is the
    /// mean over 5x5 cells, in which those without disparity count 0, from .4 to
    /// .7: the vote of a median, so that edges stay and chance matches vanish.
    pub fn run(
        &mut self,
        plane: &Plane,
        scene: &AttentionScene<'_>,
        barrier: &Image<f32>,
        motion: Option<&Image<f32>>,
        out: &mut Image<f32>,
    ) {
        self.measure(plane, scene);
        let (width, height) = (out.width(), out.height());
        let sums = &mut self.sums;
        sums.resize(width, 0.0);
        for y in 0..height {
            let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(height);
            let share = 1.0 / rows.len() as f32;
            sums.fill(0.0);
            for row in rows {
                for (sum, value) in sums.iter_mut().zip(self.across.row(row)) {
                    *sum += value;
                }
            }
            let v = (y as f32 + 0.5) / height as f32 - 0.5;
            let row = out.row_mut(y).iter_mut().zip(sums.iter()).zip(barrier.row(y));
            for (x, ((out, &sum), &barrier)) in row.enumerate() {
                let u = (x as f32 + 0.5) / width as f32 - 0.5;
                let pooled = (sum * share - LEAST_POOLED) / (FULL_POOLED - LEAST_POOLED);
                let color = (barrier / FULL_BARRIER).min(1.0);
                let raised = pooled.clamp(0.0, 1.0) * (RELIEF + (1.0 - RELIEF) * color);
                *out = raised.max(color * (-SPREAD * (u * u + v * v)).exp());
            }
        }
        if let Some(motion) = motion {
            for (s, &motion) in out.pixels_mut().iter_mut().zip(motion.pixels()) {
                *s = (*s * (1.0 + MOTION * motion)).min(1.0);
            }
        }
    }

    /// The relief of each cell, and its mean over the row's neighbours.
    fn measure(&mut self, plane: &Plane, scene: &AttentionScene<'_>) {
        let checked = &scene.coarse.checked;
        let offset = scene.rig.disparity_offset() as f32;
        let width = checked.width();
        self.relief.resize(checked.size());
        self.across.resize(checked.size());
        for y in 0..checked.height() {
            let row = self.relief.row_mut(y).iter_mut().zip(checked.row(y));
            for (x, (out, &d)) in row.enumerate() {
                let (u, v) = cell_centre(x, y);
                let relief = (d - offset - plane.disparity(u, v)) / RELIEF_PX - 1.0;
                *out = if d.is_nan() { 0.0 } else { relief.clamp(0.0, 1.0) };
            }
            let relief = self.relief.row(y);
            for (x, out) in self.across.row_mut(y).iter_mut().enumerate() {
                let near = &relief[x.saturating_sub(REACH)..(x + REACH + 1).min(width)];
                *out = near.iter().sum::<f32>() / near.len() as f32;
            }
        }
    }
}
