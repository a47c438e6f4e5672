//! Depth from disparity (eq. 2).

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::Image;

/// ε of eq. 2 in pixels. It keeps the division defined and is far below the
/// finest disparity step (1/32 px): at d = 1 px it moves Z by one millionth.
pub const EPSILON_PX: f32 = 1e-6;

/// Z = f B / (d + ε), clipped as REP 117 wants it.
pub struct Depth {
    min_m: f32,
    max_m: f32,
}

impl Depth {
    /// The stage with `depth.min` and `depth.max`.
    pub fn new(config: &Config) -> Self {
        Self { min_m: config.depth.min as f32, max_m: config.depth.max as f32 }
    }

    /// Depth in metres; NaN, +Inf, -Inf as in [`crate::perception::Perception::depth`].
    ///
    /// A disparity of zero or less belongs to a point at infinity (or to the
    /// noise around it): +Inf.
    pub fn run(&mut self, disparity: &Image<f32>, rig: &StereoRig, depth: &mut Image<f32>) {
        let scale = rig.depth_scale() as f32;
        let (min_m, max_m) = (self.min_m, self.max_m);
        depth.resize(disparity.size());
        for (z, &d) in depth.pixels_mut().iter_mut().zip(disparity.pixels()) {
            *z = depth_from_disparity(d, scale, min_m, max_m);
        }
    }
}

/// One pixel of eq. 2; `scale_px_m` is f B in pixel metres.
#[inline]
pub fn depth_from_disparity(d: f32, scale_px_m: f32, min_m: f32, max_m: f32) -> f32 {
    // Written as selections, not branches, so that whole rows become vectors.
    let z = scale_px_m / (d + EPSILON_PX);
    let z = if z < min_m { f32::NEG_INFINITY } else { z };
    let z = if z > max_m { f32::INFINITY } else { z };
    let z = if d <= 0.0 { f32::INFINITY } else { z };
    if d.is_nan() { f32::NAN } else { z }
}
