//! Which segments are one thing.

use super::column::{Columns, Segment, Top};
use super::{HIGH, WIDE};
use crate::camera::StereoRig;
use crate::image::Image;
use crate::stage::regions::components::{TOLERANCE_PX, tolerance};
use crate::stage::regions::union_find::UnionFind;

/// Gap in metres across which segments beside each other are one thing, if
/// nothing is seen through it.
const GAP_M: f32 = 0.4;
/// The same where something nearer hides what is between, as wide as a person who
/// walks; then their depths may differ by this much, metres.
const HIDDEN_GAP_M: f32 = 1.2;
const HIDDEN_STEP_M: f32 = 0.15;
/// Share of a segment's height over which a gap beside it shows what is behind or before.
const SEE_THROUGH: f32 = 0.5;
/// Columns joined after which no further ones are asked: those have been.
const ENOUGH: usize = 2;
/// Their difference in depth: metres, in parts of the depth, and in standard
/// deviations of a segment's disparity, pixels.
const STEP_M: f32 = 0.5;
const STEP_PART: f32 = 0.04;
const STEP_PX: f32 = 0.2;
/// How far one surface recedes from a column to the next at most, metres: half of a
/// car's side seen from before it. Near the axis the formula knows no limit.
const LONGEST_M: f32 = 2.0;
/// Height of a segment that alone is evidence of a thing, metres.
const STRONG_M: f32 = 0.36;
/// Share of a part's columns that must stand on another part of the same thing.
const LEAST_LINK: f32 = 0.5;
/// How much lower than the top of the part in front an upper part may begin, metres.
const SINK_M: f32 = 0.15;
/// How far behind its lower part a thing's upper part may begin (a windscreen
/// behind a bonnet), metres.
const SETBACK_M: f32 = 1.5;
/// Cells without disparity between such parts.
const MAX_HOLES: u32 = 2;

/// The joining of segments, with its buffers.
#[derive(Debug, Default)]
pub struct Join {
    sets: UnionFind,
    places: Vec<Place>,
    strong: Vec<bool>,
    /// The strong ones by themselves, and the index of the first of each column.
    strong_places: Vec<Place>,
    first_strong: Vec<u32>,
    widths: Vec<u32>,
    links: Vec<u64>,
}

impl Join {
    /// Segments beside each other at one depth, and parts above each other.
    ///
    /// Where one surface hides another, cells hold a mixture of both. Such
    /// pieces are short: they take a thing, but never make one of two.
    pub fn run(&mut self, disparity: &Image<f32>, columns: &Columns, view: &View) {
        let Columns { segments, first, .. } = columns;
        self.places.clear();
        self.places.extend((0..).zip(segments).map(|(i, s)| view.place(i, s)));
        self.strong.clear();
        let least = STRONG_M * view.scale;
        self.strong.extend(self.places.iter().map(|place| {
            let rows = (place.lower - place.upper) as f32 * HIGH as f32;
            rows * place.distance >= least * view.focal
        }));
        self.strong_places.clear();
        self.first_strong.clear();
        for column in first.windows(2) {
            self.first_strong.push(self.strong_places.len() as u32);
            let column = column[0] as usize..column[1] as usize;
            let strong = self.places[column.clone()].iter().zip(&self.strong[column]);
            self.strong_places
                .extend(strong.filter(|(_, strong)| **strong).map(|(place, _)| place));
        }
        self.first_strong.push(self.strong_places.len() as u32);
        self.sets.reset(segments.len());
        self.beside(disparity, columns, view);
        self.above(columns, view);
        self.attach(columns, view);
    }

    /// Strong segments side by side with nothing seen through between them.
    fn beside(&mut self, disparity: &Image<f32>, columns: &Columns, view: &View) {
        for place in &self.strong_places {
            let column = place.x as usize;
            let s = &columns.segments[place.segment as usize];
            let [gap, hidden_gap] = [GAP_M, HIDDEN_GAP_M].map(|gap| view.columns(gap, place));
            let (mut looked, mut hidden) = (0, 0);
            for x in (column.saturating_sub(hidden_gap)..column).rev() {
                let near = column - x <= gap;
                let others = self.first_strong[x] as usize..self.first_strong[x + 1] as usize;
                let mut joined = false;
                for other in &self.strong_places[others] {
                    if (near || view.is_as_deep(place, other)) && view.beside(place, other) {
                        self.sets.union(other.segment, place.segment);
                        joined = true;
                    }
                }
                looked += usize::from(joined);
                if looked == ENOUGH {
                    break;
                }
                if joined {
                    continue;
                }
                let [farther, nearer] = beyond(disparity, x, s);
                hidden += usize::from(nearer);
                // What was not measured, or is hidden only in part, may be a small gap.
                if farther || !near && column - x - hidden > gap {
                    break;
                }
            }
        }
    }

    /// Sets of strong segments of which one stands on the other along most of its width.
    fn above(&mut self, columns: &Columns, view: &View) {
        let Columns { segments, first, .. } = columns;
        self.widths.clear();
        self.widths.resize(segments.len(), 0);
        self.links.clear();
        for x in 0..first.len() - 1 {
            let column = first[x] as usize..first[x + 1] as usize;
            let mut below: Option<usize> = None;
            for i in column.filter(|i| self.strong[*i]) {
                let set = self.sets.find(i as u32);
                self.widths[set as usize] += 1;
                if let Some(j) = below
                    && view.above((&segments[j], &self.places[j]), (&segments[i], &self.places[i]))
                {
                    let other = self.sets.find(j as u32);
                    if other != set {
                        self.links
                            .push((u64::from(other.min(set)) << 32) | u64::from(other.max(set)));
                    }
                }
                below = Some(i);
            }
        }
        self.links.sort_unstable();
        for same in self.links.chunk_by(|a, b| a == b) {
            let (a, b) = ((same[0] >> 32) as u32, same[0] as u32);
            let width = self.widths[a as usize].min(self.widths[b as usize]);
            if same.len() as f32 >= LEAST_LINK * width as f32 {
                self.sets.union(a, b);
            }
        }
    }

    /// The other segments: each to the neighbour nearest in depth.
    fn attach(&mut self, columns: &Columns, view: &View) {
        let Columns { segments, first, .. } = columns;
        for (i, s) in segments.iter().enumerate().filter(|(i, _)| !self.strong[*i]) {
            let column = s.x as usize;
            let mut best = (f32::INFINITY, None);
            let from = first[column.saturating_sub(1)] as usize;
            let to = first[(column + 2).min(first.len() - 1)] as usize;
            let place = &self.places[i];
            for (j, other) in (from..to).zip(&self.places[from..to]) {
                let step = (place.distance - other.distance).abs();
                if j == i || step >= best.0 || !(self.strong[j] || j < i) {
                    continue;
                }
                let t = &segments[j];
                let touches = if t.x == s.x {
                    view.above((s, place), (t, other)) || view.above((t, other), (s, place))
                } else {
                    view.beside(place, other)
                };
                if touches {
                    best = (step, Some(j));
                }
            }
            if let Some(j) = best.1 {
                self.sets.union(j as u32, i as u32);
            }
        }
    }

    /// The set that a segment belongs to, by the index of its first segment.
    pub fn set_of(&mut self, segment: u32) -> u32 {
        self.sets.find(segment)
    }
}

/// Whether column `x` shows over most of the height of a segment something farther,
/// and whether something nearer.
fn beyond(disparity: &Image<f32>, x: usize, s: &Segment) -> [bool; 2] {
    let d = s.disparity();
    let (least, most) = (d - tolerance(d), d + tolerance(d));
    let (mut farther, mut nearer) = (0, 0);
    for y in s.upper as usize..s.lower as usize {
        // NaN is neither.
        let other = disparity.get(x, y);
        farther += u32::from(other < least);
        nearer += u32::from(other > most);
    }
    [farther, nearer].map(|rows| rows as f32 > SEE_THROUGH * (s.lower - s.upper) as f32)
}

/// Where a segment is.
#[derive(Clone, Copy, Debug)]
struct Place {
    segment: u32,
    x: u32,
    upper: u32,
    lower: u32,
    /// Along the optical axis, metres.
    distance: f32,
}

/// What is needed to reckon with segments in space.
pub struct View {
    /// Size of things against a road's.
    pub scale: f32,
    /// f B, pixels x metres.
    pub depth_scale: f32,
    /// Focal length, pixels.
    pub focal: f32,
    /// Column of the principal point, pixels.
    pub cx: f32,
}

impl View {
    /// For things of `scale`, seen by `rig`.
    pub fn new(scale: f32, rig: &StereoRig) -> Self {
        Self {
            scale,
            depth_scale: rig.depth_scale() as f32,
            focal: rig.focal_px() as f32,
            cx: rig.principal_point().0 as f32,
        }
    }

    fn place(&self, segment: u32, s: &Segment) -> Place {
        let distance = self.depth_scale / s.disparity();
        Place { segment, x: s.x, upper: s.upper, lower: s.lower, distance }
    }

    /// Columns of cells across `length_m` metres of a road scene at a segment, and four pixels.
    fn columns(&self, length_m: f32, s: &Place) -> usize {
        (length_m * self.scale * self.focal / s.distance / WIDE as f32) as usize + 2
    }

    /// Whether segments of different columns are one surface.
    fn beside(&self, s: &Place, t: &Place) -> bool {
        if s.lower.min(t.lower) <= s.upper.max(t.upper) {
            return false;
        }
        let (zs, zt) = (s.distance, t.distance);
        let (near, far) = (zs.min(zt), zs.max(zt));
        let step = far - near;
        let most = (STEP_M * self.scale).max(STEP_PART * far);
        if step <= most {
            return true;
        }
        // d Z = Z² / (f B) d d
        let most = most.max(STEP_PX * far * far / self.depth_scale);
        if step <= most || s.x.abs_diff(t.x) != 1 {
            return step <= most;
        }
        // A surface parallel to the axis recedes by as much as its
        // columns approach the centre; nothing that is visible recedes faster.
        let (us, ut) = (self.offset(s), self.offset(t));
        let recedes = us * ut > 0.0 && (us.abs() < ut.abs()) == (zs > zt);
        recedes
            && step <= most + (near * ((us / ut).max(ut / us) - 1.0)).min(LONGEST_M * self.scale)
    }

    /// Whether segments with something nearer between them may be one surface.
    fn is_as_deep(&self, s: &Place, t: &Place) -> bool {
        (s.distance - t.distance).abs() <= HIDDEN_STEP_M * self.scale
    }

    /// Distance from which a step of `step_m` metres (of a road scene) is within the noise
    /// of the disparity, metres: d Z = Z² / (f B) d d.
    pub fn distance_of_step(&self, step_m: f32) -> f32 {
        (step_m * self.scale * self.depth_scale / TOLERANCE_PX).sqrt()
    }

    /// Columns from the principal point, pixels.
    fn offset(&self, s: &Place) -> f32 {
        (s.x as usize * WIDE) as f32 + 0.5 - self.cx
    }

    /// Whether `upper` is a part of what `lower` is of, in the same column.
    fn above(&self, lower: (&Segment, &Place), upper: (&Segment, &Place)) -> bool {
        let setback = upper.1.distance - lower.1.distance;
        let (lower, upper) = (lower.0, upper.0);
        let near = lower.upper.abs_diff(upper.lower) <= MAX_HOLES;
        // A surface that only leans back rises on the way; what begins lower
        // than the edge in front of it is something else behind it.
        let rises = upper.bottom_m >= lower.top_m - SINK_M * self.scale;
        let back = SETBACK_M * self.scale;
        near && rises && upper.top != Top::Tall && (-0.3 * back..back).contains(&setback)
    }
}
