//! Regions against true objects: overlaps, one-to-one matching, counts.

use serde::{Deserialize, Serialize};

use super::share;

/// Overlaps of every found region with every true object of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlap {
    regions: usize,
    objects: usize,
    /// IoU, region by region.
    iou: Vec<f64>,
}

impl Overlap {
    /// Overlaps computed pair by pair from (region index, object index).
    pub fn from_fn(regions: usize, objects: usize, iou: impl Fn(usize, usize) -> f64) -> Self {
        let pairs = (0..regions).flat_map(|r| (0..objects).map(move |o| (r, o)));
        Self { regions, objects, iou: pairs.map(|(r, o)| iou(r, o)).collect() }
    }

    /// IoU of two boxes `[x, y, width, height]` in pixels.
    pub fn of_boxes(a: [u32; 4], b: [u32; 4]) -> f64 {
        let [ax, ay, aw, ah] = a.map(u64::from);
        let [bx, by, bw, bh] = b.map(u64::from);
        let width = (ax + aw).min(bx + bw).saturating_sub(ax.max(bx));
        let height = (ay + ah).min(by + bh).saturating_sub(ay.max(by));
        let both = width * height;
        share(both, aw * ah + bw * bh - both).unwrap_or(0.0)
    }

    /// The largest one-to-one matching of pairs with IoU ≥ `threshold`.
    ///
    /// Among pairs the larger overlap is tried first, equal ones in the order
    /// of their indices, and the matching is then enlarged along augmenting
    /// paths (Kuhn 1955): no other matching has more pairs, and the same
    /// overlaps always give the same one.
    pub fn matching(&self, threshold: f64) -> Matching {
        let mut edges: Vec<(usize, usize)> = (0..self.regions)
            .flat_map(|r| (0..self.objects).map(move |o| (r, o)))
            .filter(|&(r, o)| self.get(r, o) >= threshold && self.get(r, o) > 0.0)
            .collect();
        // A stable sort: equal overlaps stay in index order.
        edges.sort_by(|a, b| self.get(b.0, b.1).total_cmp(&self.get(a.0, a.1)));
        let mut neighbours = vec![Vec::new(); self.regions];
        for &(r, o) in &edges {
            neighbours[r].push(o);
        }
        let mut region_of = vec![None; self.objects];
        let mut matched = vec![false; self.regions];
        for &(r, o) in &edges {
            if !matched[r] && region_of[o].is_none() {
                region_of[o] = Some(r);
                matched[r] = true;
            }
        }
        for r in (0..self.regions).filter(|r| !matched[*r]) {
            augment(r, &neighbours, &mut vec![false; self.objects], &mut region_of);
        }
        let pairs = region_of.iter().enumerate().filter_map(|(o, r)| Some(((*r)?, o))).collect();
        Matching { regions: self.regions, objects: self.objects, pairs }
    }

    fn get(&self, region: usize, object: usize) -> f64 {
        self.iou[region * self.objects + object]
    }
}

/// Finds `region` an object, moving other regions to their next one if need be.
fn augment(
    region: usize,
    neighbours: &[Vec<usize>],
    visited: &mut [bool],
    region_of: &mut [Option<usize>],
) -> bool {
    for &object in &neighbours[region] {
        if std::mem::replace(&mut visited[object], true) {
            continue;
        }
        let free = match region_of[object] {
            None => true,
            Some(other) => augment(other, neighbours, visited, region_of),
        };
        if free {
            region_of[object] = Some(region);
            return true;
        }
    }
    false
}

/// Which region is which object in one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Matching {
    regions: usize,
    objects: usize,
    /// Pairs (region index, object index), by object.
    pub pairs: Vec<(usize, usize)>,
}

/// Collects matchings over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RegionCounts {
    frames: u64,
    true_positives: u64,
    false_positives: u64,
    false_negatives: u64,
}

impl RegionCounts {
    /// Adds one frame. A region for which `region_counts` is false is no false
    /// positive, an object for which `object_counts` is false is no miss, and a
    /// pair with either is not counted: so objects too small to be asked for
    /// are neither reward nor punishment.
    pub fn add(
        &mut self,
        matching: &Matching,
        region_counts: impl Fn(usize) -> bool,
        object_counts: impl Fn(usize) -> bool,
    ) {
        self.frames += 1;
        let mut regions = (0..matching.regions).map(&region_counts).collect::<Vec<_>>();
        let mut objects = (0..matching.objects).map(&object_counts).collect::<Vec<_>>();
        for &(region, object) in &matching.pairs {
            self.true_positives += u64::from(regions[region] && objects[object]);
            (regions[region], objects[object]) = (false, false);
        }
        self.false_positives += regions.iter().filter(|counts| **counts).count() as u64;
        self.false_negatives += objects.iter().filter(|counts| **counts).count() as u64;
    }

    /// Adds the counts of another accumulator.
    pub fn merge(&mut self, other: &Self) {
        self.frames += other.frames;
        self.true_positives += other.true_positives;
        self.false_positives += other.false_positives;
        self.false_negatives += other.false_negatives;
    }

    /// Everything in one row, for matchings at `iou`. `None` when there was
    /// neither a region nor an object in any frame.
    pub fn total(&self, iou: f64) -> Option<RegionScore> {
        let doubled = 2 * self.true_positives;
        let f1 = share(doubled, doubled + self.false_positives + self.false_negatives)?;
        Some(RegionScore {
            iou,
            precision: share(self.true_positives, self.true_positives + self.false_positives),
            recall: share(self.true_positives, self.true_positives + self.false_negatives),
            f1,
            false_positives_per_frame: share(self.false_positives, self.frames)?,
            true_positives: self.true_positives,
            false_positives: self.false_positives,
            false_negatives: self.false_negatives,
        })
    }
}

/// Regions against objects over all frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RegionScore {
    /// Least overlap of a match.
    pub iou: f64,
    /// Matched regions among all; `None` when there was no region.
    pub precision: Option<f64>,
    /// Matched objects among all; `None` when there was no object.
    pub recall: Option<f64>,
    /// 2 TP / (2 TP + FP + FN).
    pub f1: f64,
    /// Unmatched regions per frame.
    pub false_positives_per_frame: f64,
    /// Matched pairs.
    pub true_positives: u64,
    /// Unmatched regions.
    pub false_positives: u64,
    /// Unmatched objects.
    pub false_negatives: u64,
}
