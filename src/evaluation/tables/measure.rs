//! The columns: what is shown, in which unit, and where it comes from.

use crate::evaluation::figures::Figures;
use crate::evaluation::peer::Peer;
use crate::table::{Best, Cell, Column};
use Best::{Highest, Lowest};

/// One measure.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Its name in the code.
    pub key: &'static str,
    /// Its name in heads, with the unit.
    pub name: &'static str,
    /// What it means.
    pub help: &'static str,
    /// Which value is the better one of two that can be compared.
    pub best: Option<Best>,
    /// Whether the best value of a column is marked: not where the rows are
    /// over different pixels.
    marked: bool,
    unit: Unit,
    of: fn(&Figures) -> Option<f64>,
    peer: Option<fn(&Peer) -> f64>,
}

/// How a value is written.
#[derive(Clone, Copy, Debug)]
enum Unit {
    /// A share as a number up to 1.
    Share,
    /// A share in percent with so many decimals.
    Percent(usize),
    /// As it is, with so many decimals.
    Plain(usize),
}

impl Measure {
    /// The value of a method.
    pub fn of(&self, figures: &Figures) -> Option<f64> {
        (self.of)(figures).filter(|value| value.is_finite())
    }

    /// The value of a peer; `None` for what is not asked of peers.
    pub fn of_peer(&self, peer: &Peer) -> Option<f64> {
        self.peer.map(|of| of(peer)).filter(|value| value.is_finite())
    }

    /// A value as a cell.
    pub fn cell(&self, value: Option<f64>) -> Cell {
        match self.unit {
            Unit::Share => Cell::number(value, 3),
            Unit::Percent(decimals) => Cell::number(value.map(|v| 100.0 * v), decimals),
            Unit::Plain(decimals) => Cell::number(value, decimals),
        }
    }

    /// The head of its column.
    pub fn column(&self) -> Column {
        Column {
            name: self.name.into(),
            help: self.help.into(),
            best: self.best.filter(|_| self.marked),
        }
    }
}

/// The measure of this key.
pub fn find(key: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.key == key)
}

const fn measure(
    key: &'static str,
    name: &'static str,
    help: &'static str,
    best: Option<Best>,
    unit: Unit,
    of: fn(&Figures) -> Option<f64>,
) -> Measure {
    Measure { key, name, help, best, marked: true, unit, of, peer: None }
}

impl Measure {
    const fn unmarked(mut self) -> Self {
        self.marked = false;
        self
    }

    const fn with_peer(mut self, of: fn(&Peer) -> f64) -> Self {
        self.peer = Some(of);
        self
    }
}

const HIGH: Option<Best> = Some(Highest);
const LOW: Option<Best> = Some(Lowest);

#[rustfmt::skip]
static MEASURES: [Measure; 61] = [
    // The salient mask.
    measure("accuracy", "accuracy", "share of pixels that are classified rightly, eq. 7", HIGH, Unit::Share, |f| Some(f.salient?.accuracy)),
    measure("precision", "precision", "share of the salient mask that is a true object, eq. 8", HIGH, Unit::Share, |f| f.salient?.precision),
    measure("recall", "recall", "share of the true objects that is in the salient mask, eq. 8", HIGH, Unit::Share, |f| f.salient?.recall),
    measure("f1", "F1", "harmonic mean of precision and recall, eq. 9", HIGH, Unit::Share, |f| f.salient?.f1),
    // The attention map.
    measure("max_f", "max-F", "largest F (β² = 0.3) over all thresholds", HIGH, Unit::Share, |f| Some(f.map.as_ref()?.max_f)),
    measure("mean_f", "mean F", "mean F over all thresholds", HIGH, Unit::Share, |f| Some(f.map.as_ref()?.mean_f)),
    measure("weighted_f", "weighted F", "weighted F of Margolin et al. 2014", HIGH, Unit::Share, |f| Some(f.map.as_ref()?.weighted_f)),
    measure("s", "S", "structure measure of Fan et al. 2017", HIGH, Unit::Share, |f| Some(f.map.as_ref()?.s_measure)),
    measure("max_e", "max E", "largest enhanced-alignment measure of Fan et al. 2018", HIGH, Unit::Share, |f| Some(f.map.as_ref()?.max_e)),
    measure("mae", "MAE", "mean absolute difference of map and mask", LOW, Unit::Share, |f| Some(f.map.as_ref()?.mae)),
    measure("roi_90", "area at 90 % recall, %", "smallest share of the image that holds 90 % of the true pixels", LOW, Unit::Percent(1), |f| Some(f.map.as_ref()?.roi_90)),
    measure("matched", "ROI area, %", "share of the image that is matched", None, Unit::Percent(1), |f| f.matched),
    // The same after stretching.
    measure("stretched_max_f", "max-F", "largest F (β² = 0.3) over all thresholds", HIGH, Unit::Share, |f| Some(f.stretched_map.as_ref()?.max_f)),
    measure("stretched_mean_f", "mean F", "mean F over all thresholds", HIGH, Unit::Share, |f| Some(f.stretched_map.as_ref()?.mean_f)),
    measure("stretched_adaptive_f", "adaptive F", "F at twice the map's mean", HIGH, Unit::Share, |f| Some(f.stretched_map.as_ref()?.adaptive_f)),
    measure("stretched_weighted_f", "weighted F", "weighted F of Margolin et al. 2014", HIGH, Unit::Share, |f| Some(f.stretched_map.as_ref()?.weighted_f)),
    measure("stretched_s", "S", "structure measure of Fan et al. 2017", HIGH, Unit::Share, |f| Some(f.stretched_map.as_ref()?.s_measure)),
    measure("stretched_max_e", "max E", "largest enhanced-alignment measure of Fan et al. 2018", HIGH, Unit::Share, |f| Some(f.stretched_map.as_ref()?.max_e)),
    measure("stretched_mean_e", "mean E", "mean enhanced-alignment measure over all thresholds", HIGH, Unit::Share, |f| Some(f.stretched_map.as_ref()?.mean_e)),
    measure("stretched_adaptive_e", "adaptive E", "enhanced-alignment measure at twice the map's mean", HIGH, Unit::Share, |f| Some(f.stretched_map.as_ref()?.adaptive_e)),
    measure("stretched_mae", "MAE", "mean absolute difference of map and mask", LOW, Unit::Share, |f| Some(f.stretched_map.as_ref()?.mae)),
    // Disparity inside the region of interest.
    measure("epe", "EPE in ROI, px", "mean error of disparity where matched, eq. 10", LOW, Unit::Plain(2), |f| Some(f.in_roi()?.epe_px)),
    measure("d1", "D1 in ROI, %", "errors above 3 px and 5 % where matched", LOW, Unit::Percent(2), |f| Some(f.in_roi()?.d1)),
    measure("bad_2", "bad-2 in ROI, %", "errors above 2 px where matched", LOW, Unit::Percent(2), |f| Some(f.in_roi()?.bad_2)),
    measure("density", "density in ROI, %", "share of the true pixels inside the ROI that have a disparity", HIGH, Unit::Percent(1), |f| Some(f.in_roi()?.density)),
    measure("filled_d1", "filled D1 in ROI, %", "D1 over all true pixels inside the ROI, occluded ones too, after filling every hole", LOW, Unit::Percent(2), |f| Some(f.filled_roi?.d1)),
    // Disparity over the whole frame.
    measure("frame_epe", "EPE, px", "mean error of disparity, whole frame, not occluded", LOW, Unit::Plain(2), |f| Some(f.frame?.epe_px)).with_peer(|p| p.epe_px).unmarked(),
    measure("frame_d1", "D1, %", "errors above 3 px and 5 %, whole frame, not occluded", LOW, Unit::Percent(2), |f| Some(f.frame?.d1)).with_peer(|p| p.d1).unmarked(),
    measure("frame_bad_2", "bad-2, %", "errors above 2 px, whole frame, not occluded", LOW, Unit::Percent(2), |f| Some(f.frame?.bad_2)).with_peer(|p| p.bad_2).unmarked(),
    measure("frame_density", "density, %", "share of all true pixels that have a disparity", HIGH, Unit::Percent(1), |f| Some(f.frame?.density)).with_peer(|p| p.density),
    measure("frame_filled_d1", "filled D1, %", "D1 over all true pixels, occluded ones too, after filling every hole", LOW, Unit::Percent(2), |f| Some(f.filled_frame?.d1)).with_peer(|p| p.filled_d1),
    measure("ause", "AUSE", "area between the sparsification curves of confidence and of the true error: 0 is perfect", LOW, Unit::Share, |f| Some(f.sparsification.as_ref()?.ause)),
    // Regions.
    measure("region_f1_30", "region F1 @ .3", "regions matched one to one with true objects at IoU ≥ 0.3", HIGH, Unit::Share, |f| f.region_f1(0.3)),
    measure("region_f1_50", "region F1 @ .5", "regions matched one to one with true objects at IoU ≥ 0.5", HIGH, Unit::Share, |f| f.region_f1(0.5)),
    measure("region_f1_75", "region F1 @ .75", "regions matched one to one with true objects at IoU ≥ 0.75", HIGH, Unit::Share, |f| f.region_f1(0.75)),
    measure("distance", "distance error, %", "median relative error of the distance of matched regions", LOW, Unit::Percent(1), |f| Some(f.scores.as_ref()?.distance?.median_relative_error)),
    measure("switches", "ID switches", "times that a true object continues under another track; who finds little has few", None, Unit::Plain(0), |f| f.scores.as_ref()?.id_switches.map(|n| n as f64)),
    // Time.
    measure("preprocess_ms", "preprocess", "median ms per frame", None, Unit::Plain(2), |f| Some(f.times?.groups[0])),
    measure("saliency_ms", "saliency", "median ms per frame", None, Unit::Plain(2), |f| Some(f.times?.groups[1])),
    measure("roi_ms", "ROI", "median ms per frame", None, Unit::Plain(2), |f| Some(f.times?.groups[2])),
    measure("stereo_ms", "coarse + stereo", "median ms per frame", None, Unit::Plain(2), |f| Some(f.times?.groups[3])),
    measure("refine_ms", "refine", "median ms per frame", None, Unit::Plain(2), |f| Some(f.times?.groups[4])),
    measure("regions_ms", "depth + regions + track", "median ms per frame", None, Unit::Plain(2), |f| Some(f.times?.groups[5])),
    measure("p50_ms", "ms per frame", "median ms per frame, all stages", LOW, Unit::Plain(1), |f| Some(f.times?.total.p50)),
    measure("p95_ms", "p95", "95th percentile of ms per frame, all stages", LOW, Unit::Plain(1), |f| Some(f.times?.total.p95)),
    measure("p99_ms", "p99", "99th percentile of ms per frame, all stages", LOW, Unit::Plain(1), |f| Some(f.times?.total.p99)),
    measure("hz", "Hz", "frames per second at the median", HIGH, Unit::Plain(1), |f| Some(1000.0 / f.times?.total.p50)),
    measure("matching_ms", "matching, ms", "median ms of coarse + stereo + refine", LOW, Unit::Plain(1), |f| Some(f.times?.matching).filter(|ms| *ms > 0.0)).with_peer(|p| p.matching_ms),
    measure("saved_total", "saved in total, %", "how much less time a frame takes than with the full-frame baseline", HIGH, Unit::Percent(1), |f| f.saved_total),
    measure("saved_matching", "saved in matching, %", "how much less time coarse + stereo + refine take than with the full-frame baseline", HIGH, Unit::Percent(1), |f| f.saved_matching),
    // The fourth check.
    measure("continuity", "depth continuity, %", "neighbours inside a region whose disparities differ by less than a pixel", HIGH, Unit::Percent(1), |f| f.continuity),
    measure("true_continuity", "truth's own, %", "depth continuity of the truth inside the same regions", None, Unit::Percent(1), |f| f.true_continuity),
    measure("boundary", "boundary F", "boundary F of the regions against the true objects", HIGH, Unit::Share, |f| f.boundary),
    measure("warped", "warped IoU", "IoU of each salient mask with the one before, moved along the flow", HIGH, Unit::Share, |f| f.video.as_ref()?.warped_iou),
    measure("true_warped", "truth's own", "warped IoU of the true masks", None, Unit::Share, |f| f.video.as_ref()?.true_warped_iou),
    measure("j_mean", "J mean", "mean IoU of salient mask and truth over a video", HIGH, Unit::Share, |f| Some(f.video.as_ref()?.j_mean)),
    measure("j_recall", "J recall", "share of the frames with J above 0.5", HIGH, Unit::Share, |f| Some(f.video.as_ref()?.j_recall)),
    measure("j_decay", "J decay", "J of the first quarter of a video less that of the last", LOW, Unit::Share, |f| Some(f.video.as_ref()?.j_decay)),
    measure("f_mean", "F mean", "mean boundary accuracy over a video", HIGH, Unit::Share, |f| Some(f.video.as_ref()?.f_mean)),
    measure("f_recall", "F recall", "share of the frames with F above 0.5", HIGH, Unit::Share, |f| Some(f.video.as_ref()?.f_recall)),
    measure("f_decay", "F decay", "F of the first quarter of a video less that of the last", LOW, Unit::Share, |f| Some(f.video.as_ref()?.f_decay)),
];
