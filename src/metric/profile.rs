//! Errors by true disparity.

use serde::{Deserialize, Serialize};

use super::DisparityStats;

/// Width of a bin in pixels of disparity.
pub const PROFILE_STEP: f32 = 8.0;

/// Collects disparity errors by true disparity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorProfile {
    /// Bin i holds true disparities from 8 i to 8 (i + 1) pixels.
    pub bins: Vec<DisparityStats>,
}

impl ErrorProfile {
    /// Adds the bins of another one.
    pub fn merge(&mut self, other: &Self) {
        let bins = self.bins.len().max(other.bins.len());
        self.bins.resize(bins, DisparityStats::default());
        for (bin, more) in self.bins.iter_mut().zip(&other.bins) {
            bin.merge(more);
        }
    }
}
