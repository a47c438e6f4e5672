//! Salient regions with their measures.

pub mod adjoin;
pub mod candidates;
pub mod components;
pub mod contour;
pub mod measure;
pub mod part;
pub mod raised;
pub mod runs;
pub mod simplify;
pub mod trim;
pub mod union_find;
pub mod upright;

use std::ops::Range;

use rayon::prelude::*;

use crate::camera::StereoRig;
use crate::config::{Config, SaliencyMode};
use crate::image::{Image, Size};
use crate::perception::{Region, RegionList, Rejections, View};
use crate::simd::{Level, Simd, dispatch, mask16x16, prelude::*, u8x16, u16x16};
use crate::stage::coarse::CoarseDisparity;
use crate::stage::depth::Depth;
use crate::stage::ground::Plane;
use crate::stage::pole::Pole;
use crate::stage::roi::Masks;
use candidates::Candidates;
use components::Components;
use contour::Contour;
use measure::{Evidence, Measure};
use raised::Raised;
use upright::Upright;

/// Least share of a region's pixels that must have a disparity.
const MIN_VALID_FRACTION: f32 = 0.1;
/// Least mean confidence of a region's disparities.
const MIN_MEAN_CONFIDENCE: f32 = 0.1;
/// Largest robust spread (one standard deviation) of disparity in one object:
/// in pixels, and in parts of the median. A car that reaches from 4 m to 8 m
/// has 0.3; a strip of road 0.55; wrong matches all over the range 0.65.
const MAX_SPREAD_PX: f32 = 1.0;
const MAX_SPREAD_PART: f32 = 0.4;
/// Without a plane, the sum of saliency from which a candidate counts, in parts
/// of the largest one: patterns and edges fall into many small ones.
const LEAST_WEIGHT: f32 = 0.05;
/// Least confidence of a region on a plane, for which it is calibrated: what is seen
/// by one camera only beside a thing is small and has few disparities, and rather
/// none than a thing.
const LEAST_CONFIDENCE: f32 = 0.45;
/// Weights of the confidence. Logistic regression on 3600 regions of five rendered
/// streets and a rendered table finds hardly more than area to tell (constant .8, area .9,
/// share with disparity .7); these keep what few disparities say of the smallest, at a
/// calibration error of .02 on all together and .02 to .05 on each (the street that is
/// shipped: .05, the table: .05).
const CERTAINTY: f32 = -2.5;
const PER_AREA: f32 = 0.9;
const PER_VALID: f32 = 4.2;
/// Distance at which nearness is one half, in metres.
const NEAR_M: f32 = 10.0;

/// What regions are made from; all images but the attention map have the same size.
#[derive(Clone, Copy)]
pub struct RegionSource<'a> {
    /// The left view.
    pub left: &'a View,
    /// Attention per cell; that of a pixel is what [`upsample`](super::saliency::upsample())
    /// makes of it.
    pub attention: &'a Image<f32>,
    /// Region of interest.
    pub roi: &'a Masks,
    /// Disparity in pixels, NaN where there is none.
    pub disparity: &'a Image<f32>,
    /// Disparity of the whole frame, coarser.
    pub coarse: &'a CoarseDisparity,
    /// Confidence of the disparity.
    pub confidence: &'a Image<f32>,
    /// Calibration of these images.
    pub rig: &'a StereoRig,
    /// The ground, where one is known: what stands on it becomes a region.
    /// Without it, connected pixels of one depth do.
    pub plane: Option<&'a Plane>,
    /// Poles on the ground.
    pub poles: &'a [Pole],
    /// A plane that is looked down upon: what stands off it becomes a region.
    pub table: Option<&'a Plane>,
}

/// The region former.
pub struct Regions {
    level: Level,
    size: Size,
    min_area: usize,
    max_count: usize,
    /// In mode `scene`, where attention tells what matters without a plane.
    weighs: bool,
    contour_tolerance: f32,
    depth: Depth,
    components: Components,
    /// The salient pixels, where their components are asked for.
    salient: Image<u8>,
    upright: Upright,
    raised: Raised,
    candidates: Candidates,
    /// The candidates that are large enough, counted from 1, and what speaks for each.
    ids: Vec<u32>,
    evidence: Vec<Evidence>,
    /// One for each thread. Which of them gets which regions does not depend on
    /// who is faster, so that their buffers stop growing.
    workers: Vec<Worker>,
}

/// Measures and outlines one region after the other.
#[derive(Debug)]
struct Worker {
    measure: Measure,
    contour: Contour,
}

impl Regions {
    /// The stage for images of `size`.
    pub fn new(config: &Config, size: Size, level: Level) -> Self {
        Self {
            level,
            size,
            min_area: usize::try_from(config.regions.min_area).unwrap_or(1),
            max_count: usize::try_from(config.regions.max_count).unwrap_or(1),
            weighs: config.saliency.mode == SaliencyMode::Scene,
            contour_tolerance: config.regions.contour_tolerance as f32,
            depth: Depth::new(config),
            components: Components::default(),
            salient: Image::default(),
            upright: Upright::new(level),
            raised: Raised::new(level),
            candidates: Candidates::default(),
            ids: Vec::new(),
            evidence: Vec::new(),
            workers: Vec::new(),
        }
    }

    /// Fills labels, regions (by decreasing [`priority`]) and the counts of refused candidates.
    pub fn run(
        &mut self,
        source: &RegionSource<'_>,
        labels: &mut Image<u16>,
        regions: &mut RegionList,
        rejections: &mut Rejections,
    ) {
        regions.clear();
        *rejections = Rejections::default();
        let mut joined = 0;
        if let Some(plane) = source.plane {
            let area = self.min_area;
            self.upright.run(plane, source, area, &mut self.candidates, rejections);
        } else if let Some(plane) = source.table {
            joined = self.raised.run(plane, source, &mut self.components, &mut self.candidates);
        } else {
            source.roi.salient.write(self.level, &mut self.salient);
            self.components.run(&self.salient, source.disparity, &mut self.candidates);
        }
        self.ids.clear();
        for (id, bounds) in (1..).zip(&self.candidates.boxes) {
            if bounds.area < self.min_area {
                rejections.small_area += 1;
            } else {
                self.ids.push(id);
                regions.push_empty();
            }
        }
        // They left an empty box.
        rejections.small_area -= joined;
        self.measure(source, regions);
        let mut evidence = self.evidence.iter();
        let on_plane = source.plane.or(source.table).is_some();
        let least = if on_plane { LEAST_CONFIDENCE } else { 0.0 };
        regions.retain(|region| {
            let count = evidence.next().and_then(|e| refusal(e, region, least, rejections));
            count.map(|count| *count += 1).is_none()
        });
        if self.weighs && source.plane.is_none() && source.table.is_none() {
            retain_weighty(regions, rejections);
        }
        regions.sort_unstable_by(|a, b| {
            priority(b).total_cmp(&priority(a)).then((a.y, a.x).cmp(&(b.y, b.x)))
        });
        rejections.over_count = regions.len().saturating_sub(self.max_count) as u32;
        regions.truncate(self.max_count);
        self.label(labels, regions);
    }

    /// Fills one region for each of `self.ids`, and what speaks for it.
    fn measure(&mut self, source: &RegionSource<'_>, regions: &mut [Region]) {
        while self.workers.len() < rayon::current_num_threads() {
            self.workers.push(Worker {
                measure: Measure::new(self.level, self.depth),
                contour: Contour::new(self.level),
            });
        }
        self.evidence.resize(regions.len(), Evidence::default());
        let Self { candidates, ids, evidence, workers, .. } = self;
        let share = share(regions.len(), workers);
        let work = regions.par_chunks_mut(share).zip(evidence.par_chunks_mut(share));
        work.zip(ids.par_chunks(share)).zip(workers).for_each(
            |(((regions, evidence), ids), worker)| {
                for ((region, evidence), &id) in regions.iter_mut().zip(evidence).zip(ids) {
                    let bounds = &candidates.boxes[id as usize - 1];
                    let id = candidates.first + id - 1;
                    *evidence = worker.measure.run(id, bounds, candidates, source, region);
                    let followed = candidates.followed_of(id);
                    region.confidence = confidence(region, followed);
                }
            },
        );
    }

    /// Numbers the regions in their order, in the label image too, and draws their contours.
    fn label(&mut self, labels: &mut Image<u16>, regions: &mut RegionList) {
        labels.resize(self.size);
        for (label, region) in (1..).zip(regions.iter_mut()) {
            region.label = label;
        }
        // Rows that were just cleared are still at hand.
        for upper in (0..self.size.height).step_by(BAND) {
            let band = upper..(upper + BAND).min(self.size.height);
            let width = self.size.width;
            let rows = &mut labels.pixels_mut()[band.start * width..band.end * width];
            for part in rows.chunks_mut(CLEARED) {
                part.fill(0);
            }
            for region in regions.iter() {
                dispatch!(self.level, simd => mark(simd, region, band.clone(), labels));
            }
        }
        let Self { workers, contour_tolerance, .. } = self;
        let share = share(regions.len(), workers);
        regions.par_chunks_mut(share).zip(workers).for_each(|(regions, worker)| {
            for region in regions {
                let (width, origin) = (region.width as usize, [region.x, region.y]);
                let (mask, tolerance) = (&region.mask, *contour_tolerance);
                worker.contour.run(mask, width, origin, tolerance, &mut region.contour);
            }
        });
    }
}

/// Pixels that are cleared by one call: longer runs take more time for each.
const CLEARED: usize = 512;

/// Rows that are labelled together.
const BAND: usize = 8;

/// Writes the label of a region into rows `band`, sixteen pixels at a time and
/// the last sixteen of a row once more: rows are short.
#[inline(always)]
fn mark<S: Simd>(simd: S, region: &Region, band: Range<usize>, labels: &mut Image<u16>) {
    let label = u16x16::splat(simd, region.label);
    let (x, y) = (region.x as usize, region.y as usize);
    let (width, height) = (region.width as usize, region.height as usize);
    for y_of in band.start.max(y)..band.end.min(y + height) {
        let mask = &region.mask[(y_of - y) * width..][..width];
        let row = &mut labels.row_mut(y_of)[x..x + width];
        for (mask, row) in mask.as_chunks().0.iter().zip(row.as_chunks_mut().0) {
            mark_lanes(simd, label, mask, row);
        }
        if let (Some(mask), Some(row)) = (mask.last_chunk(), row.last_chunk_mut()) {
            mark_lanes(simd, label, mask, row);
        } else {
            for (_, pixel) in mask.iter().zip(row).filter(|(mask, _)| **mask != 0) {
                *pixel = region.label;
            }
        }
    }
}

#[inline(always)]
fn mark_lanes<S: Simd>(simd: S, label: u16x16<S>, mask: &[u8; 16], row: &mut [u16; 16]) {
    let old = u16x16::load_array_ref(simd, row);
    let outside = u8x16::load_array_ref(simd, mask).simd_eq(0).to_bitmask();
    mask16x16::from_bitmask(simd, outside).select(old, label).store_slice(row);
}

/// How many of `regions` each of the workers gets, at most.
fn share(regions: usize, workers: &[Worker]) -> usize {
    regions.div_ceil(workers.len().max(1)).max(1)
}

/// Probability that a region is a thing of this outline (mask IoU of at least
/// one half): logistic in the logarithm of its area and in the share of its
/// pixels with disparity, less those that were `followed` where nothing was matched.
fn confidence(region: &Region, followed: usize) -> f32 {
    let area = region.area as f32;
    let valid = region.valid_fraction * area / (area - followed as f32).max(1.0);
    let score = CERTAINTY + PER_AREA * (area / 1000.0).ln() + PER_VALID * valid.min(1.0);
    1.0 / (1.0 + (-score).exp())
}

/// What comes first: mean saliency x confidence x nearness, where nearness is
/// 10 m / (10 m + median depth), and 0.1 for an unknown depth.
pub fn priority(region: &Region) -> f32 {
    let near = NEAR_M / (NEAR_M + region.median_depth);
    region.mean_saliency * region.confidence * if near.is_nan() { 0.1 } else { near }
}

/// Drops what weighs little beside the weightiest one, area x mean saliency.
fn retain_weighty(regions: &mut RegionList, rejections: &mut Rejections) {
    let weight = |region: &Region| region.mean_saliency * region.area as f32;
    let most = regions.iter().map(weight).fold(0.0, f32::max);
    let before = regions.len();
    regions.retain(|region| weight(region) >= LEAST_WEIGHT * most);
    rejections.not_salient += (before - regions.len()) as u32;
}

/// The counter of the reason why a candidate is no region.
fn refusal<'a>(
    evidence: &Evidence,
    region: &Region,
    least_confidence: f32,
    rejections: &'a mut Rejections,
) -> Option<&'a mut u32> {
    if region.valid_fraction < MIN_VALID_FRACTION
        || evidence.mean_confidence < MIN_MEAN_CONFIDENCE
        || region.confidence < least_confidence
    {
        return Some(&mut rejections.low_confidence);
    }
    let limit = MAX_SPREAD_PX.max(MAX_SPREAD_PART * evidence.median_disparity);
    (evidence.spread > limit).then_some(&mut rejections.inconsistent_depth)
}
