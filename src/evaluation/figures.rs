//! The figures that are made of what was counted.

use serde::Serialize;
use serde_json::{Value, json};

use super::Part;
use crate::metric::{
    DisparityScore, ErrorProfile, MapScore, PROFILE_STEP, Percentiles, PixelScore,
    SparsificationScore, VideoScore,
};
use crate::output::score::ScoreSummary;
use crate::perception::Stage;

/// Everything that the tables and plots show of one method on one data set.
/// Shares are 0..=1.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// The salient mask, eq. 7-9.
    pub salient: Option<PixelScore>,
    /// The attention map as it is.
    pub map: Option<MapScore>,
    /// The attention map after stretching.
    pub stretched_map: Option<MapScore>,
    /// Share of the image that was matched.
    pub matched: Option<f64>,
    /// Regions, identities, distances, disparity in the region of interest.
    pub scores: Option<ScoreSummary>,
    /// Disparity over the whole frame.
    pub frame: Option<DisparityScore>,
    /// Filled disparity in the region of interest.
    pub filled_roi: Option<DisparityScore>,
    /// Filled disparity over the whole frame.
    pub filled_frame: Option<DisparityScore>,
    /// Errors by true disparity.
    pub errors: Vec<Bin>,
    /// Confidence against errors.
    pub sparsification: Option<SparsificationScore>,
    /// The salient mask over time.
    pub video: Option<VideoScore>,
    /// Share of neighbours in a region that differ by less than a pixel.
    pub continuity: Option<f64>,
    /// The same of the truth.
    pub true_continuity: Option<f64>,
    /// Boundary F of the regions.
    pub boundary: Option<f64>,
    /// Where the time goes.
    pub times: Option<Times>,
    /// By what share a frame takes less time than that of the full-frame baseline.
    pub saved_total: Option<f64>,
    /// The same of coarse + stereo + refine.
    pub saved_matching: Option<f64>,
}

impl Figures {
    /// The figures of a part. Nothing is saved yet: that takes a baseline.
    pub fn of(part: &Part) -> Self {
        Self {
            salient: part.salient.total(),
            map: part.map.total(),
            stretched_map: part.stretched_map.total(),
            matched: part.matched.value(),
            scores: part.scores.summary(),
            frame: part.frame.total(),
            filled_roi: part.filled_roi.total(),
            filled_frame: part.filled_frame.total(),
            errors: bins(&part.errors),
            sparsification: part.sparsification.total(),
            video: part.video.total(),
            continuity: part.continuity.value(),
            true_continuity: part.true_continuity.value(),
            boundary: part.boundary.value(),
            times: Times::of(&part.times),
            saved_total: None,
            saved_matching: None,
        }
    }

    /// Says what is saved compared to `baseline`.
    pub fn compare_times(&mut self, baseline: &Times) {
        let saved = |own: f64, base: f64| (base > 0.0).then(|| 1.0 - own / base);
        if let Some(times) = &self.times {
            self.saved_total = saved(times.total.p50, baseline.total.p50);
            self.saved_matching = saved(times.matching, baseline.matching);
        }
    }

    /// F1 of the regions matched by mask at IoU ≥ `iou`.
    pub fn region_f1(&self, iou: f64) -> Option<f64> {
        let rows = &self.scores.as_ref()?.regions_by_mask;
        rows.iter().find(|row| row.iou == iou).map(|row| row.f1)
    }

    /// Disparity inside the region of interest.
    pub fn in_roi(&self) -> Option<DisparityScore> {
        self.scores.as_ref()?.disparity_in_roi
    }

    /// All figures and curves.
    pub fn json(&self) -> Value {
        serde_json::to_value(self).unwrap_or_else(|error| json!({ "error": error.to_string() }))
    }
}

/// Errors where the true disparity lies in a range.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Bin {
    /// Least true disparity in pixels.
    pub from_px: f64,
    /// The errors.
    #[serde(flatten)]
    pub score: DisparityScore,
}

fn bins(profile: &ErrorProfile) -> Vec<Bin> {
    let step = f64::from(PROFILE_STEP);
    let bins = profile.bins.iter().enumerate();
    bins.filter_map(|(i, bin)| Some(Bin { from_px: i as f64 * step, score: bin.total()? }))
        .collect()
}

/// The groups of stages in which times are shown, in the order of the pipeline
/// but for the coarse pass, which is a part of matching.
pub const STAGE_GROUPS: [(&str, &[Stage]); 6] = [
    ("preprocess", &[Stage::Preprocess]),
    ("saliency", &[Stage::Saliency]),
    ("ROI", &[Stage::Roi]),
    ("coarse + stereo", &[Stage::Coarse, Stage::Stereo]),
    ("refine", &[Stage::Refine]),
    ("depth + regions + track", &[Stage::Depth, Stage::Regions, Stage::Track]),
];

/// Where the time goes, in milliseconds per frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Times {
    /// Frames that were measured.
    pub frames: usize,
    /// Median of every group of [`STAGE_GROUPS`].
    pub groups: [f64; STAGE_GROUPS.len()],
    /// Median of coarse + stereo + refine.
    pub matching: f64,
    /// All stages.
    pub total: Percentiles,
}

impl Times {
    /// `None` when nothing was measured, or by a clock that stands still.
    fn of(times: &[[f64; Stage::ALL.len()]]) -> Option<Self> {
        let percentiles = |wanted: &dyn Fn(Stage) -> bool| {
            let sum = |frame: &[f64; Stage::ALL.len()]| -> f64 {
                let stages = Stage::ALL.into_iter().zip(frame);
                stages.filter(|(stage, _)| wanted(*stage)).map(|(_, ms)| ms).sum()
            };
            Percentiles::of(&mut times.iter().map(sum).collect::<Vec<_>>())
        };
        let mut groups = [0.0; STAGE_GROUPS.len()];
        for (median, (_, stages)) in groups.iter_mut().zip(STAGE_GROUPS) {
            *median = percentiles(&|stage| stages.contains(&stage))?.p50;
        }
        let total = percentiles(&|_| true)?;
        let matching = percentiles(&|stage| stage.is_matching())?.p50;
        let frames = times.len();
        (total.p50 > 0.0).then_some(Self { frames, groups, matching, total })
    }
}
