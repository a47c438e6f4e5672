//! What the alignment thread does: measures, off the frame loop and once a
//! second, how far apart the rows of the two images are.

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::config::Config;
use crate::drive::Engine;
use crate::image::Image;
use crate::mailbox::{Mailbox, Taken};
use crate::metric::{Epipolar, epipolar};
use crate::ros::diagnostics::NodeStatus;

/// Time between two measurements.
const PERIOD: Duration = Duration::from_secs(1);

/// Rows searched up and down: what is farther apart is not a worn calibration,
/// and the doctor's to find.
const REACH: usize = 8;

/// The gray views of one frame, as the matcher sees them.
pub(super) struct GrayPair {
    left: Image<u8>,
    right: Image<u8>,
    disparities: RangeInclusive<i32>,
    /// Camera pixels per pixel of the views.
    scale: f64,
}

/// Takes a pair out of the frame loop now and then.
pub(super) struct Sampler {
    pairs: Arc<Mailbox<GrayPair>>,
    due: Instant,
}

impl Sampler {
    /// A sampler that is due at once.
    pub fn new(pairs: Arc<Mailbox<GrayPair>>) -> Self {
        Self { pairs, due: Instant::now() }
    }

    /// Copies the views of the frame that `engine` has just processed, once a
    /// second.
    pub fn take(&mut self, engine: &Engine, config: &Config) {
        if Instant::now() < self.due {
            return;
        }
        let Some([left, right]) = engine.gray_views() else { return };
        self.due = Instant::now() + PERIOD;
        let first = config.stereo.min_disparity as i32;
        let last = first + config.stereo.disparity_range as i32 - 1;
        // A pair that nobody has looked at yet is as good as this one.
        drop(self.pairs.put(GrayPair {
            left: left.clone(),
            right: right.clone(),
            disparities: first..=last,
            scale: config.preprocess.scale as f64,
        }));
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        self.pairs.close();
    }
}

/// The alignment thread, until no pair will come any more.
pub(super) fn run(pairs: &Mailbox<GrayPair>, status: &NodeStatus) {
    loop {
        match pairs.take(PERIOD) {
            Taken::Item(GrayPair { left, right, disparities, scale }) => {
                if let Some(found) = epipolar(&left, &right, disparities, REACH) {
                    status.note_alignment(Epipolar {
                        offset_px: found.offset_px * scale,
                        error_px: found.error_px * scale,
                        disparity_px: found.disparity_px * scale,
                        points: found.points,
                    });
                }
            }
            Taken::Nothing => {}
            Taken::Closed => break,
        }
    }
}
