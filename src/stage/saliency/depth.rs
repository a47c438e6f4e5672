//! Depth contrast.

use crate::image::Image;
use crate::stage::saliency::integral::{Integral, MAX_VALUE, surrounds};
use crate::stage::saliency::{AttentionScene, Cue};

/// Steps per pixel of disparity.
const STEPS: f32 = 16.0;

/// Disparity in pixels at which the contrast is halved: what the coarse
/// disparity does not resolve makes no contrast.
const NOISE: f32 = 4.0;

/// `C_D`: contrast of the disparity of the same frame, so that the first frame
/// has it too: `|d - μ_d(N_r)| / (max(d, μ_d) + 4 px)`, the mean over the three
/// radii of [`surrounds`].
///
/// Since Z = f B / d this is the difference of two depths in units of the
/// larger one (less what 4 px of noise make uncertain): 0 on a plane facing
/// the camera, 0.5 where the surround is twice as far.
#[derive(Default)]
pub struct Depth {
    steps: Image<u16>,
    integral: Integral,
    mean: Vec<f32>,
}

impl Cue for Depth {
    fn conspicuity(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let disparity = &scene.coarse.filled;
        let offset = scene.rig.disparity_offset() as f32;
        out.resize(disparity.size());
        self.steps.resize(disparity.size());
        for (steps, &d) in self.steps.pixels_mut().iter_mut().zip(disparity.pixels()) {
            // The cast takes NaN and negative values to 0.
            *steps = (((d - offset) * STEPS + 0.5) as u16).min(MAX_VALUE);
        }
        self.integral.take(&self.steps);
        self.mean.resize(disparity.width(), 0.0);
        let radii = surrounds(disparity.size());
        for y in 0..disparity.height() {
            let out = out.row_mut(y);
            out.fill(0.0);
            for r in radii {
                self.integral.means(y, r, &mut self.mean);
                for ((c, &d), &mean) in out.iter_mut().zip(self.steps.row(y)).zip(&self.mean) {
                    let d = f32::from(d);
                    *c += (d - mean).abs() / (d.max(mean) + NOISE * STEPS);
                }
            }
            for c in out {
                *c *= 1.0 / radii.len() as f32;
            }
        }
    }
}
