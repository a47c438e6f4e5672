//! What the field measures, by its definitions: one accumulator per metric.
//!
//! | metric | definition | source |
//! |---|---|---|
//! | accuracy | A = (TP + TN) / (TP + TN + FP + FN) | eq. 7 |
//! | precision, recall | P = TP / (TP + FP), R = TP / (TP + FN) | eq. 8 |
//! | F1 | 2 P R / (P + R) = 2 TP / (2 TP + FP + FN) | eq. 9 |
//! | end-point error | EPE = mean of \|d − d*\| where both are known | eq. 10 |
//! | D1 | share with \|d − d*\| > 3 px and > 5 % of d* | KITTI 2015 |
//! | bad-τ | share with \|d − d*\| > τ px | Middlebury |
//! | density | share of pixels with known d* that have a d | |
//! | region precision, recall, F1 | one-to-one matching at IoU ≥ τ | PASCAL VOC |
//! | ID switches | a true object continues under another track | CLEAR MOT 2008 |
//!
//! Every accumulator takes frames one by one and answers `None` when nothing
//! was there to be scored: no NaN gets into a table.

mod disparity;
mod identity;
mod map;
mod mean;
mod overlap;
mod pixels;
mod profile;
mod sample;
mod sparsification;
mod times;
mod video;

pub use disparity::{DisparityScore, DisparityStats};
pub use identity::IdSwitches;
pub use map::{MapScore, MapStats};
pub use mean::Mean;
pub use overlap::{Matching, Overlap, RegionCounts, RegionScore};
pub use pixels::{Confusion, PixelScore};
pub use profile::{ErrorProfile, PROFILE_STEP};
pub use sample::EvenSample;
pub use sparsification::{SPARSIFICATION_STEPS, SparsificationScore, SparsificationStats};
pub use times::{Percentiles, StageStats, StageSummary};
pub use video::{VideoScore, VideoStats};

/// `part / whole`, `None` when there is no whole.
fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}
