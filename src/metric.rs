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
//! | error profile | the same over pixels by d*, 8 px a bin | |
//! | filled | the same after holes took the smaller d of their row neighbours | |
//! | sparsification, AUSE | mean error left when 0, 5, … 95 % of the pixels went, as a share of that of all: by confidence, less by error | Ilg et al. 2018 |
//! | continuity | share of 4-neighbours in a region with \|Δd\| < 1 px | |
//! | map precision, recall, area | of the pixels at or above threshold 0..=255, mean over images | |
//! | F | 1.3 P R / (0.3 P + R): largest and mean of the mean curve; adaptive at twice the map's mean | Achanta et al. 2009 |
//! | weighted F | F1 with errors weighted by where they are | Margolin et al. 2014 |
//! | S | ½ object-aware + ½ region-aware similarity | Fan et al. 2017 |
//! | E | mean of (1 + ξ)² / 4, ξ the alignment with the mask | Fan et al. 2018 |
//! | MAE | mean \|map − mask\| | Perazzi et al. 2012 |
//! | ROI@90, ROI@95 | smallest area that holds 90, 95 % of the salient pixels | |
//! | J, F, recall, decay | IoU; F of outlines within 0.8 % of the diagonal; share above ½; first less last quarter | DAVIS 2016 |
//! | warped IoU | IoU of a mask with the one before, moved along the flow | |
//! | region precision, recall, F1 | one-to-one matching at IoU ≥ τ | PASCAL VOC |
//! | calibration error | mean of \|stated probability − share that was right\| over ten bins | Naeini et al. 2015 |
//! | epipolar error | median vertical distance of a corner from its partner, px | |
//! | ID switches | a true object continues under another track | CLEAR MOT 2008 |
//!
//! Every accumulator takes frames one by one and answers `None` when nothing
//! was there to be scored: no NaN gets into a table.
//!
//! The measures of maps are those of `pysodmetrics`, on maps as they are and,
//! as it does, on maps stretched to 0..=1; `tests/interop` compares them.

mod calibration;
mod continuity;
mod disparity;
mod distance;
mod epipolar;
mod fill;
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

pub use calibration::{Calibration, CalibrationRow, CalibrationScore};
pub use continuity::continuity;
pub use disparity::{DisparityScore, DisparityStats};
pub use epipolar::{Epipolar, MISALIGNED_PX, epipolar};
pub use fill::fill;
pub use identity::IdSwitches;
pub use map::{MapScore, MapStats};
pub use mean::Mean;
pub use overlap::{Matching, Overlap, RegionCounts, RegionScore};
pub use pixels::{Confusion, PixelScore};
pub use profile::{ErrorProfile, PROFILE_BINS, PROFILE_STEP};
pub use sample::EvenSample;
pub use sparsification::{SPARSIFICATION_STEPS, SparsificationScore, SparsificationStats};
pub use times::{Percentiles, StageStats, StageSummary};
pub use video::{VideoScore, VideoStats, boundary_f};

/// `part / whole`, `None` when there is no whole.
fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}
