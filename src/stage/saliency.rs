//! The attention map.

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::{Image, Size};
use crate::perception::View;
use crate::simd::Level;
use crate::stage::coarse::{CELL, CoarseDisparity};
use crate::stamp::Stamp;

/// What the cues look at.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Time of the frame.
    pub stamp: Stamp,
    /// Left view, full size.
    pub left: &'a View,
    /// Quarter-size disparity of the same frame.
    pub coarse: &'a CoarseDisparity,
    /// Calibration of the full-size views.
    pub rig: &'a StereoRig,
}

/// The register of the previous frame.
#[derive(Debug, Default)]
pub struct Previous {
    stamp: Option<Stamp>,
}

impl Previous {
    /// Forgets the previous frame.
    pub fn clear(&mut self) {
        self.stamp = None;
    }
}

/// The attention stage.
pub struct Saliency {
    size: Size,
}

impl Saliency {
    /// The stage for views of `size`.
    pub fn new(_config: &Config, size: Size, _level: Level) -> Self {
        Self { size }
    }

    /// Writes S, 0..=1, per cell of [`CELL`] pixels into `attention` and for
    /// every pixel into `saliency`.
    pub fn run(
        &mut self,
        scene: &Scene<'_>,
        previous: &mut Previous,
        attention: &mut Image<f32>,
        saliency: &mut Image<f32>,
    ) {
        previous.stamp = Some(scene.stamp);
        attention.resize(self.size.divided_by(CELL));
        attention.fill(1.0);
        saliency.resize(self.size);
        saliency.fill(1.0);
    }
}
