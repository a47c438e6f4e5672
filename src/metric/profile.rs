//! Errors by true disparity.

use serde::{Deserialize, Serialize};

use super::DisparityStats;

/// Width of a bin in pixels of disparity.
pub const PROFILE_STEP: f32 = 8.0;

/// Most bins.
pub const PROFILE_BINS: usize = 128;

/// Collects disparity errors by true disparity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ErrorProfile {
    /// Bin i holds true disparities from 8 i to 8 (i + 1) pixels; the last one
    /// of [`PROFILE_BINS`] also all larger ones.
    pub bins: Vec<DisparityStats>,
}

impl ErrorProfile {
    /// Adds pixels as pairs (estimate, truth) in pixels; what is not finite is
    /// unknown.
    pub fn add(&mut self, pixels: impl IntoIterator<Item = (f32, f32)>) {
        for (estimate, truth) in pixels {
            if !truth.is_finite() {
                continue;
            }
            let bin = ((truth / PROFILE_STEP) as usize).min(PROFILE_BINS - 1);
            if bin >= self.bins.len() {
                self.bins.resize(bin + 1, DisparityStats::default());
            }
            self.bins[bin].add([(estimate, truth)]);
        }
    }

    /// Adds the bins of another one.
    pub fn merge(&mut self, other: &Self) {
        let bins = self.bins.len().max(other.bins.len());
        self.bins.resize(bins, DisparityStats::default());
        for (bin, more) in self.bins.iter_mut().zip(&other.bins) {
            bin.merge(more);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_go_to_the_bin_of_their_truth() {
        let mut profile = ErrorProfile::default();
        profile.add([(1.0, 0.5), (9.0, 7.99), (9.0, 8.0), (f32::NAN, 20.0), (3.0, f32::NAN)]);
        let mut more = ErrorProfile::default();
        more.add([(1e9, 1e9), (7.0, 9.0)]);
        profile.merge(&more);
        assert_eq!(profile.bins.len(), PROFILE_BINS);
        let pixels = |bin: usize| profile.bins[bin].total().map(|score| score.pixels);
        assert_eq!((pixels(0), pixels(1), pixels(2)), (Some(2), Some(2), None));
        assert_eq!(profile.bins[1].epe(), Some(1.5));
        assert_eq!(pixels(PROFILE_BINS - 1), Some(1));
    }
}
