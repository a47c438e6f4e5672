//! Stereo correspondence inside the region of interest.

use crate::config::Config;
use crate::image::{Image, Size};
use crate::perception::{RoiMask, View};
use crate::simd::Level;
use crate::stage::coarse::CoarseDisparity;

/// Value of a pixel without a match.
pub const NO_MATCH: i16 = i16::MIN;

/// What the matcher found, before any check.
#[derive(Clone, Debug, Default)]
pub struct Matches {
    /// Disparity `x_l - x_r` of left pixels in units of
    /// [`crate::perception::DISPARITY_STEP`]; [`NO_MATCH`] outside the region of interest.
    pub left: Image<i16>,
    /// The same seen from the right image, for the left-right check.
    pub right: Image<i16>,
    /// Evidence for the left disparity from the shape of its cost curve
    /// (uniqueness, peak ratio): 0 none, 255 unmistakable.
    pub evidence: Image<u8>,
}

/// The matcher.
pub struct Stereo {
    size: Size,
}

impl Stereo {
    /// The matcher for views of `size`.
    pub fn new(_config: &Config, size: Size, _level: Level) -> Self {
        Self { size }
    }

    /// Matches `left` with `right` where `roi.matched` is set.
    pub fn run(
        &mut self,
        _left: &View,
        _right: &View,
        _roi: &RoiMask,
        _saliency: &Image<f32>,
        _coarse: &CoarseDisparity,
        out: &mut Matches,
    ) {
        out.left.resize(self.size);
        out.left.fill(NO_MATCH);
        out.right.resize(self.size);
        out.right.fill(NO_MATCH);
        out.evidence.resize(self.size);
        out.evidence.fill(0);
    }
}
