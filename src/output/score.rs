//! Scores of a run against the truth that its source knows.

mod counts;
mod frame;

use std::convert::Infallible;

pub use counts::{DistanceScore, RoiScore, ScoreSummary, Scores};
use frame::Layout;
pub use frame::{FrameScore, shrink_to};

use super::Sink;
use crate::input::Observation;
use crate::metric::{Confusion, DisparityStats, Overlap, RegionCounts};
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
    scores: Scores,
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
        self.scores.frames += 1;
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
        self.scores.scored += u64::from(usable);
        self.scores.unscorable += u64::from(!usable);
        usable.then_some(frame)
    }

    fn score_objects(&mut self, perception: &Perception, frame: &mut FrameScore) {
        let layout = &self.layout;
        let mut pixels = Confusion::default();
        let labels = perception.labels.pixels().iter().zip(layout.objects.pixels());
        pixels.add(labels.map(|(label, object)| (*label != 0, *object != 0)));
        frame.pixels = pixels.total();
        self.scores.pixels.merge(&pixels);

        let (regions, objects) = (layout.regions.len(), layout.truths.len());
        let masks = Overlap::from_fn(regions, objects, |r, o| layout.mask_iou(r, o));
        let boxes = Overlap::from_fn(regions, objects, |r, o| {
            Overlap::of_boxes(layout.regions[r].bounds, layout.truths[o].bounds)
        });
        let asked = |o: usize| layout.truths[o].area >= u64::from(self.min_area);
        for (i, threshold) in IOU_THRESHOLDS.into_iter().enumerate() {
            self.scores.boxes[i].add(&boxes.matching(threshold), |_| true, asked);
            let matching = masks.matching(threshold);
            self.scores.masks[i].add(&matching, |_| true, asked);
            if i == MAIN_THRESHOLD {
                let mut alone = RegionCounts::default();
                alone.add(&matching, |_| true, asked);
                frame.regions = alone.total(threshold);
                for (r, shape) in layout.regions.iter().enumerate() {
                    let object = matching.pairs.iter().find(|(region, _)| *region == r);
                    let stated = perception.regions.get(shape.index).map(|r| r.confidence);
                    if let Some(stated) = stated
                        && object.is_none_or(|&(_, o)| asked(o))
                    {
                        self.scores.confidence.add(f64::from(stated), object.is_some());
                    }
                }
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
        self.scores.identities.add(tracks);

        let covered = layout.truths.iter().filter(|t| t.area >= u64::from(self.min_area));
        self.scores
            .roi
            .add(f64::from(perception.roi.fraction), covered.map(|t| (t.covered, t.area)));
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
        self.scores.roi_disparity.merge(&roi);
        if !with_objects || layout.objects.size() != layout.disparity.size() {
            return;
        }
        let objects = layout.objects.pixels();
        self.scores
            .object_disparity
            .add(pairs().zip(objects).filter(|(_, object)| **object != 0).map(|(pair, _)| pair));
        for &(region, object) in &frame.matched {
            let Some(region) = perception.regions.get(region) else { continue };
            if let Some(truth) = layout.true_distance(object, &perception.rig) {
                self.scores.distance.add(f64::from(region.median_depth), truth);
            }
        }
    }

    /// Everything so far; `None` when no observation had usable truth.
    pub fn summary(&self) -> Option<ScoreSummary> {
        self.scores.summary()
    }

    /// What was counted.
    pub const fn scores(&self) -> &Scores {
        &self.scores
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
