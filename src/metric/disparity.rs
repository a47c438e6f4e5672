//! Errors of disparity against truth (eq. 10 and the benchmarks' measures).

use serde::{Deserialize, Serialize};

use super::share;

/// Collects disparity errors pixel by pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DisparityStats {
    /// Pixels with known truth.
    known: u64,
    /// Of those, pixels with an estimate.
    both: u64,
    error_sum: f64,
    d1: u64,
    bad: [u64; 4],
}

/// τ of bad-τ in pixels, in the order of [`DisparityStats::bad`].
const BAD: [f32; 4] = [1.0, 2.0, 3.0, 4.0];

impl DisparityStats {
    /// Adds pixels as pairs (estimate, truth) in pixels; what is not finite is
    /// unknown.
    pub fn add(&mut self, pixels: impl IntoIterator<Item = (f32, f32)>) {
        for (estimate, truth) in pixels {
            if !truth.is_finite() {
                continue;
            }
            self.known += 1;
            if !estimate.is_finite() {
                continue;
            }
            self.both += 1;
            let error = (estimate - truth).abs();
            self.error_sum += f64::from(error);
            self.d1 += u64::from(error > 3.0 && error > 0.05 * truth.abs());
            for (count, tau) in self.bad.iter_mut().zip(BAD) {
                *count += u64::from(error > tau);
            }
        }
    }

    /// Adds the counts of another accumulator.
    pub fn merge(&mut self, other: &Self) {
        self.known += other.known;
        self.both += other.both;
        self.error_sum += other.error_sum;
        self.d1 += other.d1;
        for (count, more) in self.bad.iter_mut().zip(other.bad) {
            *count += more;
        }
    }

    /// Mean |d − d*| in pixels, eq. 10. `None` when no pixel has both.
    pub fn epe(&self) -> Option<f64> {
        (self.both > 0).then(|| self.error_sum / self.both as f64)
    }

    /// Everything in one row. `None` when no pixel has both.
    pub fn total(&self) -> Option<DisparityScore> {
        let of_both = |count| share(count, self.both);
        Some(DisparityScore {
            epe_px: self.epe()?,
            d1: of_both(self.d1)?,
            bad_1: of_both(self.bad[0])?,
            bad_2: of_both(self.bad[1])?,
            bad_3: of_both(self.bad[2])?,
            bad_4: of_both(self.bad[3])?,
            density: share(self.both, self.known)?,
            pixels: self.both,
        })
    }
}

/// Disparity against truth. The shares are of the pixels that have both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DisparityScore {
    /// Eq. 10, pixels.
    pub epe_px: f64,
    /// Share with an error above 3 px and above 5 % of the truth.
    pub d1: f64,
    /// Share with an error above 1 px.
    pub bad_1: f64,
    /// Share with an error above 2 px.
    pub bad_2: f64,
    /// Share with an error above 3 px.
    pub bad_3: f64,
    /// Share with an error above 4 px.
    pub bad_4: f64,
    /// Pixels that have both, as a share of those with known truth.
    pub density: f64,
    /// Number of pixels that have both.
    pub pixels: u64,
}
