//! Doors in: where stereo frames come from.

pub mod bag;
pub mod dataset;
pub mod live;
pub mod synthetic;

use std::collections::BTreeMap;

use crate::image::Image;
use crate::perception::StereoFrame;

/// What is known to be true about a frame, where a source knows it.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// True disparity `x_l - x_r - (cx_l - cx_r)` of the left view in pixels,
    /// where the source can tell only of pixels that both cameras see; NaN unknown.
    pub disparity: Option<Image<f32>>,
    /// The same with the pixels that only the left camera sees, from sources
    /// that know both.
    pub disparity_with_occluded: Option<Image<f32>>,
    /// Ids of the salient objects in the left view; 0 is background.
    pub objects: Option<Image<u16>>,
    /// Motion of every left pixel to the next frame `[dx, dy]` in pixels; NaN unknown.
    pub flow: Option<Image<[f32; 2]>>,
}

/// One frame and, from some sources, its truth.
#[derive(Clone, Debug)]
pub struct Observation {
    /// The stereo pair.
    pub frame: StereoFrame,
    /// What should come out of it.
    pub truth: Option<Truth>,
}

/// What a source has met so far. Nothing is lost without being counted here.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Pairs delivered.
    pub pairs: u64,
    /// Left images that found no partner.
    pub unpaired_left: u64,
    /// Right images that found no partner.
    pub unpaired_right: u64,
    /// Images and pairs that could not be used, by reason.
    pub skipped: BTreeMap<String, u64>,
}

impl Tally {
    /// Counts one more thing that could not be used.
    pub fn skip(&mut self, reason: impl Into<String>) {
        *self.skipped.entry(reason.into()).or_default() += 1;
    }

    /// True when something was lost or skipped (exit code 3).
    pub fn has_losses(&self) -> bool {
        self.unpaired_left + self.unpaired_right > 0 || !self.skipped.is_empty()
    }
}

/// A source of stereo frames, in the order of their stamps.
pub trait FrameSource {
    /// What can stop this source.
    type Error: std::error::Error + Send + Sync + 'static;

    /// The next usable pair, `None` at the end. What could not be used on the
    /// way is counted in [`FrameSource::tally`].
    ///
    /// # Errors
    /// When the source itself fails and nothing more can come.
    fn next_observation(&mut self) -> Result<Option<Observation>, Self::Error>;

    /// What was met so far.
    fn tally(&self) -> &Tally;

    /// Share of the source that has been read, 0..=1, where it is known.
    fn progress(&self) -> Option<f64>;
}
