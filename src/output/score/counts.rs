//! Everything that is counted of a run, and the figures made of it.

use serde::{Deserialize, Serialize};

use super::{IOU_THRESHOLDS, MAIN_THRESHOLD};
use crate::metric::{
    Calibration, CalibrationScore, Confusion, DisparityScore, DisparityStats, IdSwitches,
    PixelScore, RegionCounts, RegionScore,
};

/// Everything counted so far. Counts of other scenes can be added.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    pub(super) frames: u64,
    pub(super) scored: u64,
    pub(super) unscorable: u64,
    pub(super) pixels: Confusion,
    pub(super) roi_disparity: DisparityStats,
    pub(super) object_disparity: DisparityStats,
    pub(super) masks: [RegionCounts; IOU_THRESHOLDS.len()],
    pub(super) boxes: [RegionCounts; IOU_THRESHOLDS.len()],
    pub(super) roi: RoiCoverage,
    pub(super) identities: IdSwitches,
    pub(super) distance: DistanceErrors,
    #[serde(default)]
    pub(super) confidence: Calibration,
}

impl Scores {
    /// Adds the counts of another scene.
    pub fn merge(&mut self, other: &Self) {
        self.frames += other.frames;
        self.scored += other.scored;
        self.unscorable += other.unscorable;
        self.pixels.merge(&other.pixels);
        self.roi_disparity.merge(&other.roi_disparity);
        self.object_disparity.merge(&other.object_disparity);
        for (counts, more) in self.masks.iter_mut().zip(&other.masks) {
            counts.merge(more);
        }
        for (counts, more) in self.boxes.iter_mut().zip(&other.boxes) {
            counts.merge(more);
        }
        self.roi.merge(&other.roi);
        self.identities.merge(&other.identities);
        self.distance.merge(&other.distance);
        self.confidence.merge(&other.confidence);
    }

    /// Everything so far; `None` when no observation had usable truth.
    pub fn summary(&self) -> Option<ScoreSummary> {
        if self.scored == 0 {
            return None;
        }
        let rows = |counts: &[RegionCounts]| {
            let pairs = counts.iter().zip(IOU_THRESHOLDS);
            pairs.filter_map(|(counts, iou)| counts.total(iou)).collect()
        };
        Some(ScoreSummary {
            frames: self.frames,
            scored_frames: self.scored,
            unscorable_frames: self.unscorable,
            pixels: self.pixels.total(),
            disparity_in_roi: self.roi_disparity.total(),
            disparity_on_objects: self.object_disparity.total(),
            regions_by_mask: rows(&self.masks),
            regions_by_box: rows(&self.boxes),
            roi: self.roi.total(),
            id_switches: self.identities.total(),
            distance: self.distance.total(),
            region_confidence: self.confidence.total(),
        })
    }
}

/// How well the region of interest covers the true objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct RoiCoverage {
    frames: u64,
    fraction_sum: f64,
    objects: u64,
    inside: u64,
    pixels: u64,
    at_90: u64,
    at_95: u64,
}

impl RoiCoverage {
    pub(super) fn add(&mut self, fraction: f64, objects: impl Iterator<Item = (u64, u64)>) {
        self.frames += 1;
        self.fraction_sum += fraction;
        for (inside, area) in objects {
            self.objects += 1;
            self.inside += inside;
            self.pixels += area;
            self.at_90 += u64::from(inside * 100 >= area * 90);
            self.at_95 += u64::from(inside * 100 >= area * 95);
        }
    }

    fn merge(&mut self, other: &Self) {
        self.frames += other.frames;
        self.fraction_sum += other.fraction_sum;
        self.objects += other.objects;
        self.inside += other.inside;
        self.pixels += other.pixels;
        self.at_90 += other.at_90;
        self.at_95 += other.at_95;
    }

    fn total(&self) -> Option<RoiScore> {
        let share = |part: u64, whole: u64| (whole > 0).then(|| part as f64 / whole as f64);
        (self.frames > 0).then(|| RoiScore {
            mean_fraction: self.fraction_sum / self.frames as f64,
            pixel_recall: share(self.inside, self.pixels),
            objects_90: share(self.at_90, self.objects),
            objects_95: share(self.at_95, self.objects),
        })
    }
}

/// Errors of the distances of matched regions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct DistanceErrors {
    absolute: f64,
    /// |Z − Z*| / Z* of every region.
    relative: Vec<f32>,
}

impl DistanceErrors {
    pub(super) fn add(&mut self, distance: f64, truth: f64) {
        if distance.is_finite() && truth.is_finite() && truth > 0.0 {
            self.absolute += (distance - truth).abs();
            self.relative.push(((distance - truth).abs() / truth) as f32);
        }
    }

    fn merge(&mut self, other: &Self) {
        self.absolute += other.absolute;
        self.relative.extend_from_slice(&other.relative);
    }

    fn total(&self) -> Option<DistanceScore> {
        let count = self.relative.len() as f64;
        let mut sorted = self.relative.clone();
        sorted.sort_unstable_by(f32::total_cmp);
        Some(DistanceScore {
            mean_error_m: self.absolute / count,
            mean_relative_error: sorted.iter().copied().map(f64::from).sum::<f64>() / count,
            median_relative_error: f64::from(*sorted.get(sorted.len() / 2)?),
            regions: sorted.len() as u64,
        })
    }
}

/// All metrics of a run. Absent (`null` in JSON) is what could not be scored.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScoreSummary {
    /// Frames seen.
    pub frames: u64,
    /// Frames with usable truth.
    pub scored_frames: u64,
    /// Frames whose truth does not fit the size of the views.
    pub unscorable_frames: u64,
    /// Region pixels against object pixels, eq. 7-9.
    pub pixels: Option<PixelScore>,
    /// Disparity where it was asked for, eq. 10.
    pub disparity_in_roi: Option<DisparityScore>,
    /// Disparity on the true objects, found or not.
    pub disparity_on_objects: Option<DisparityScore>,
    /// Regions matched by mask, one row per threshold.
    pub regions_by_mask: Vec<RegionScore>,
    /// Regions matched by box, one row per threshold.
    pub regions_by_box: Vec<RegionScore>,
    /// How well the region of interest covers the objects.
    pub roi: Option<RoiScore>,
    /// Identity switches of matched objects.
    pub id_switches: Option<u64>,
    /// Distances of matched regions.
    pub distance: Option<DistanceScore>,
    /// Confidence of the regions against how many of them are objects (mask IoU ≥ 0.5).
    pub region_confidence: Option<CalibrationScore>,
}

impl ScoreSummary {
    /// The regions matched by mask at IoU ≥ 0.5.
    pub fn main_regions(&self) -> Option<&RegionScore> {
        self.regions_by_mask.iter().find(|row| row.iou == IOU_THRESHOLDS[MAIN_THRESHOLD])
    }
}

/// The region of interest against the true objects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RoiScore {
    /// Mean share of the image that is matched.
    pub mean_fraction: f64,
    /// Share of all object pixels inside.
    pub pixel_recall: Option<f64>,
    /// Share of the objects of which at least 90 % is inside.
    pub objects_90: Option<f64>,
    /// Share of the objects of which at least 95 % is inside.
    pub objects_95: Option<f64>,
}

/// Median depth of matched regions against the objects' true median depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DistanceScore {
    /// Mean |Z − Z*| in metres.
    pub mean_error_m: f64,
    /// Mean |Z − Z*| / Z*.
    pub mean_relative_error: f64,
    /// Median |Z − Z*| / Z*.
    pub median_relative_error: f64,
    /// Regions measured.
    pub regions: u64,
}
