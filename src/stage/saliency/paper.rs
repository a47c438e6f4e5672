//! The linear fusion of five cues (eq. 4).

use crate::config;
use crate::image::Image;
use crate::simd::Level;
use crate::stage::saliency::color::Color;
use crate::stage::saliency::depth::Depth;
use crate::stage::saliency::intensity::Intensity;
use crate::stage::saliency::motion::Motion;
use crate::stage::saliency::normalize::normalize;
use crate::stage::saliency::orientation::Orientation;
use crate::stage::saliency::{AttentionScene, Cue};

/// A fused map of less range is not stretched to full range.
pub const LEAST: f32 = 0.1;

/// `S = N[α C_I + β C_C + γ C_O + δ C_D + ε C_M]` with the weights of
/// `saliency.paper.*`, divided by their sum; N is [`normalize`] with [`LEAST`].
pub struct Paper {
    intensity: Intensity,
    color: Color,
    orientation: Orientation,
    depth: Depth,
    motion: Motion,
    weights: [f32; 5],
    cue: Image<f32>,
}

impl Paper {
    /// The fusion with these weights.
    pub fn new(weights: &config::Paper, level: Level) -> Self {
        let w =
            [weights.intensity, weights.color, weights.orientation, weights.depth, weights.motion];
        let sum: f64 = w.iter().sum();
        let weights = w.map(|w| if sum > 0.0 { (w / sum) as f32 } else { 0.0 });
        Self {
            intensity: Intensity::default(),
            color: Color::new(level),
            orientation: Orientation::default(),
            depth: Depth::default(),
            motion: Motion,
            weights,
            cue: Image::default(),
        }
    }

    /// Writes the attention map.
    pub fn run(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        out.resize(scene.cells.gray.size());
        out.fill(0.0);
        let cues: [&mut dyn Cue; 5] = [
            &mut self.intensity,
            &mut self.color,
            &mut self.orientation,
            &mut self.depth,
            &mut self.motion,
        ];
        for (cue, weight) in cues.into_iter().zip(self.weights) {
            if weight > 0.0 {
                cue.conspicuity(scene, &mut self.cue);
                for (sum, &c) in out.pixels_mut().iter_mut().zip(self.cue.pixels()) {
                    *sum += weight * c;
                }
            }
        }
        normalize(out, LEAST);
    }
}
