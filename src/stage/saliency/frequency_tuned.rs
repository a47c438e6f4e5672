//! Frequency-tuned saliency as a mode of its own.

use crate::image::Image;
use crate::simd::Level;
use crate::stage::saliency::color::Color;
use crate::stage::saliency::normalize::normalize;
use crate::stage::saliency::{AttentionScene, Cue};

/// A map of less range than ΔE = 20 is not stretched to full range.
const LEAST: f32 = 0.2;

/// Frequency-tuned salient region detection (Achanta et al. 2009): the colour
/// contrast of [`Color`], stretched to 0..=1.
pub struct FrequencyTuned {
    color: Color,
}

impl FrequencyTuned {
    /// The mode at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { color: Color::new(level) }
    }

    /// Writes the attention map.
    pub fn run(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        self.color.conspicuity(scene, out);
        normalize(out, LEAST);
    }
}
