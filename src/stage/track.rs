//! Identity of regions over frames.

use crate::camera::StereoRig;
use crate::config::Config;
use crate::perception::{RegionList, Rejections};
use crate::stamp::Stamp;

/// The tracker.
pub struct Track {
    last: Option<Stamp>,
}

impl Track {
    /// The stage with the parameters `tracking.*`.
    pub fn new(_config: &Config) -> Self {
        Self { last: None }
    }

    /// Forgets all tracks.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// Gives ids, states, ages and velocities to `regions`, removes those
    /// without temporal support and counts them.
    pub fn run(
        &mut self,
        stamp: Stamp,
        _rig: &StereoRig,
        _regions: &mut RegionList,
        _rejections: &mut Rejections,
    ) {
        self.last = Some(stamp);
    }
}
