//! From raw matches to disparity and confidence.

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::{Image, Size};
use crate::perception::RoiMask;
use crate::stage::stereo::Matches;

/// Left-right check, median, speckle filter, confidence.
pub struct Refine {
    size: Size,
}

impl Refine {
    /// The stage for images of `size`.
    pub fn new(_config: &Config, size: Size) -> Self {
        Self { size }
    }

    /// Disparity in pixels with `cx_l - cx_r` subtracted (NaN where there is
    /// none), and its confidence 0..=1.
    pub fn run(
        &mut self,
        _matches: &Matches,
        _roi: &RoiMask,
        _rig: &StereoRig,
        disparity: &mut Image<f32>,
        confidence: &mut Image<f32>,
    ) {
        disparity.resize(self.size);
        disparity.fill(f32::NAN);
        confidence.resize(self.size);
        confidence.fill(0.0);
    }
}
