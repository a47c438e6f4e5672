//! Scores of a run against the truth that its source knows.

mod frame;

use std::convert::Infallible;

use serde::Serialize;

pub use frame::FrameScore;
use frame::Layout;

use super::Sink;
use crate::input::Observation;
use crate::metric::{
    Confusion, DisparityScore, DisparityStats, IdSwitches, Overlap, PixelScore, RegionCounts,
    RegionScore,
};
use crate::perception::Perception;

/// Least overlaps at which regions are matched with objects.
pub const IOU_THRESHOLDS: [f64; 3] = [0.3, 0.5, 0.75];

/// Index of the threshold for distances, identities and per-frame scores.
const MAIN_THRESHOLD: usize = 1;

/// Collects the metrics of all observations that come with truth; the others
/// are only counted.
#[derive(Debug, Default)]
pub struct ScoreSink {
    min_area: u32,
    frames: u64,
    scored: u64,
    unscorable: u64,
    pixels: Confusion,
    roi_disparity: DisparityStats,
    object_disparity: DisparityStats,
    masks: [RegionCounts; IOU_THRESHOLDS.len()],
    boxes: [RegionCounts; IOU_THRESHOLDS.len()],
    roi: RoiCoverage,
    identities: IdSwitches,
    distance: DistanceErrors,
    layout: Layout,
}

impl ScoreSink {
    /// A sink for which true objects of fewer than `min_area` visible pixels
    /// (`regions.min_area`) need not be found: missing them is no miss, and
    /// finding them is no false positive.
    pub fn new(min_area: u32) -> Self {
        Self { min_area, ..Self::default() }
    }

    /// Adds one frame and says how it fared; `None` without usable truth.
    pub fn score(
        &mut self,
        observation: &Observation,
        perception: &Perception,
    ) -> Option<FrameScore> {
        self.frames += 1;
        let truth = observation.truth.as_ref()?;
        if truth.disparity.is_none() && truth.objects.is_none() {
            return None;
        }
        let mut frame = FrameScore::default();
        let mut usable = false;
        if let Some(objects) = &truth.objects
            && self.layout.measure(objects, perception)
        {
            usable = true;
            self.score_objects(perception, &mut frame);
        }
        if let Some(disparity) = &truth.disparity
            && self.layout.fit_disparity(disparity, perception)
        {
            usable = true;
            self.score_disparity(perception, truth.objects.is_some(), &mut frame);
        }
        self.scored += u64::from(usable);
        self.unscorable += u64::from(!usable);
        usable.then_some(frame)
    }

    fn score_objects(&mut self, perception: &Perception, frame: &mut FrameScore) {
        let layout = &self.layout;
        let mut pixels = Confusion::default();
        let labels = perception.labels.pixels().iter().zip(layout.objects.pixels());
        pixels.add(labels.map(|(label, object)| (*label != 0, *object != 0)));
        frame.pixels = pixels.total();
        self.pixels.merge(&pixels);

        let (regions, objects) = (layout.regions.len(), layout.truths.len());
        let masks = Overlap::from_fn(regions, objects, |r, o| layout.mask_iou(r, o));
        let boxes = Overlap::from_fn(regions, objects, |r, o| {
            Overlap::of_boxes(layout.regions[r].bounds, layout.truths[o].bounds)
        });
        let asked = |o: usize| layout.truths[o].area >= u64::from(self.min_area);
        for (i, threshold) in IOU_THRESHOLDS.into_iter().enumerate() {
            self.boxes[i].add(&boxes.matching(threshold), |_| true, asked);
            let matching = masks.matching(threshold);
            self.masks[i].add(&matching, |_| true, asked);
            if i == MAIN_THRESHOLD {
                let mut alone = RegionCounts::default();
                alone.add(&matching, |_| true, asked);
                frame.regions = alone.total(threshold);
                frame.matched = matching
                    .pairs
                    .iter()
                    .map(|&(r, o)| (layout.regions[r].index, layout.truths[o].id))
                    .collect();
            }
        }
        let tracks = frame.matched.iter().filter_map(|&(region, object)| {
            Some((object, perception.regions.get(region)?.track_id))
        });
        self.identities.add(tracks);

        let covered = layout.truths.iter().filter(|t| t.area >= u64::from(self.min_area));
        self.roi.add(f64::from(perception.roi.fraction), covered.map(|t| (t.covered, t.area)));
    }

    fn score_disparity(
        &mut self,
        perception: &Perception,
        with_objects: bool,
        frame: &mut FrameScore,
    ) {
        let layout = &self.layout;
        let pairs = || {
            perception
                .disparity
                .pixels()
                .iter()
                .copied()
                .zip(layout.disparity.pixels().iter().copied())
        };
        let mut roi = DisparityStats::default();
        let matched = perception.roi.matched.pixels();
        roi.add(pairs().zip(matched).filter(|(_, inside)| **inside != 0).map(|(pair, _)| pair));
        frame.disparity = roi.total();
        self.roi_disparity.merge(&roi);
        if !with_objects || layout.objects.size() != layout.disparity.size() {
            return;
        }
        let objects = layout.objects.pixels();
        self.object_disparity
            .add(pairs().zip(objects).filter(|(_, object)| **object != 0).map(|(pair, _)| pair));
        for &(region, object) in &frame.matched {
            let Some(region) = perception.regions.get(region) else { continue };
            if let Some(truth) = layout.true_distance(object, &perception.rig) {
                self.distance.add(f64::from(region.median_depth), truth);
            }
        }
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
        })
    }
}

impl Sink for ScoreSink {
    type Error = Infallible;

    fn write(
        &mut self,
        observation: &Observation,
        perception: &Perception,
    ) -> Result<(), Infallible> {
        self.score(observation, perception);
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// How well the region of interest covers the true objects.
#[derive(Clone, Copy, Debug, Default)]
struct RoiCoverage {
    frames: u64,
    fraction_sum: f64,
    objects: u64,
    inside: u64,
    pixels: u64,
    at_90: u64,
    at_95: u64,
}

impl RoiCoverage {
    fn add(&mut self, fraction: f64, objects: impl Iterator<Item = (u64, u64)>) {
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
#[derive(Clone, Copy, Debug, Default)]
struct DistanceErrors {
    regions: u64,
    absolute: f64,
    relative: f64,
}

impl DistanceErrors {
    fn add(&mut self, distance: f64, truth: f64) {
        if distance.is_finite() && truth.is_finite() && truth > 0.0 {
            self.regions += 1;
            self.absolute += (distance - truth).abs();
            self.relative += (distance - truth).abs() / truth;
        }
    }

    fn total(&self) -> Option<DistanceScore> {
        let count = self.regions as f64;
        (self.regions > 0).then(|| DistanceScore {
            mean_error_m: self.absolute / count,
            mean_relative_error: self.relative / count,
            regions: self.regions,
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
    /// Regions measured.
    pub regions: u64,
}
