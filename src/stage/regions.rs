//! Salient regions with their measures.

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::{Image, Size};
use crate::perception::{RegionList, Rejections, RoiMask};

/// What regions are made from; all images have the same size.
#[derive(Clone, Copy)]
pub struct RegionSource<'a> {
    /// Attention map.
    pub saliency: &'a Image<f32>,
    /// Region of interest.
    pub roi: &'a RoiMask,
    /// Disparity in pixels, NaN where there is none.
    pub disparity: &'a Image<f32>,
    /// Confidence of the disparity.
    pub confidence: &'a Image<f32>,
    /// Depth in metres, NaN, +Inf, -Inf as in `Perception::depth`.
    pub depth: &'a Image<f32>,
    /// Calibration of these images.
    pub rig: &'a StereoRig,
}

/// The region former.
pub struct Regions {
    size: Size,
}

impl Regions {
    /// The stage for images of `size`.
    pub fn new(_config: &Config, size: Size) -> Self {
        Self { size }
    }

    /// Fills labels, regions (by decreasing priority) and the counts of refused candidates.
    pub fn run(
        &mut self,
        _source: &RegionSource<'_>,
        labels: &mut Image<u16>,
        regions: &mut RegionList,
        rejections: &mut Rejections,
    ) {
        labels.resize(self.size);
        labels.fill(0);
        regions.clear();
        *rejections = Rejections::default();
    }
}
