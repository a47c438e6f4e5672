//! Intensity contrast.

use crate::image::Image;
use crate::stage::saliency::integral::{Integral, surrounds};
use crate::stage::saliency::{AttentionScene, Cue};

/// The contrast that counts as 1, in gray levels.
const FULL: f32 = 128.0;

/// `C_I(x, y) = |I - μ_I(N_r)|` (eq. 3), the mean over the three radii of
/// [`surrounds`], in units of 128 gray levels.
#[derive(Default)]
pub struct Intensity {
    integral: Integral,
    mean: Vec<f32>,
}

impl Cue for Intensity {
    fn conspicuity(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let gray = &scene.cells.gray;
        out.resize(gray.size());
        self.integral.take(gray);
        self.mean.resize(gray.width(), 0.0);
        let radii = surrounds(gray.size());
        let scale = 1.0 / (FULL * radii.len() as f32);
        for y in 0..gray.height() {
            let out = out.row_mut(y);
            out.fill(0.0);
            for r in radii {
                self.integral.means(y, r, &mut self.mean);
                for ((c, &i), &mean) in out.iter_mut().zip(gray.row(y)).zip(&self.mean) {
                    *c += (f32::from(i) - mean).abs();
                }
            }
            for c in out {
                *c = (*c * scale).min(1.0);
            }
        }
    }
}
