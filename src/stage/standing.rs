//! Things that stand on the ground: column segments joined in bird's-eye view.

use crate::camera::StereoRig;
use crate::image::Image;
use crate::stage::coarse::CELL;
use crate::stage::ground::{Plane, cell_centre};
use crate::stage::regions::components::agree;
use crate::stage::regions::union_find::UnionFind;

/// Heights in metres (of a road scene) between which a segment lies.
const LOW_M: f32 = 0.2;
const HIGH_M: f32 = 2.6;
/// What goes on above [`HIGH_M`] up to this height is part of a building.
const TALL_M: f32 = 3.4;
/// Share of its columns from which a thing is such a part, if it is wider than
/// a trunk or a pole, metres.
const MOST_TALL: f32 = 0.4;
const TRUNK_M: f32 = 1.2;
/// Uncertainty of a cell's disparity in pixels; it lifts the lower limit far away.
const NOISE_PX: f32 = 0.4;
/// A segment that begins no higher than this stands on the ground, metres.
const CONTACT_M: f32 = 0.6;
/// A thing reaches at least this height, metres.
const LEAST_TOP_M: f32 = 0.35;
/// Gap in metres across which segments beside each other are one thing.
const GAP_M: f32 = 0.5;
/// Their difference in depth: metres, and in parts of the depth.
const STEP_M: f32 = 0.5;
const STEP_PART: f32 = 0.04;
/// The same of columns side by side, metres: a surface seen at a grazing angle.
const NEXT_STEP_M: f32 = 0.8;
/// How far behind its lower part a thing's upper part may begin (a windscreen
/// behind a bonnet), metres.
const SETBACK_M: f32 = 1.5;
/// Cells without disparity that a segment may span.
const MAX_HOLES: usize = 2;
/// Largest distance of a cell from its segment's mean disparity, in parts.
const SEGMENT_PART: f32 = 0.12;
/// Largest difference in disparity of a thing's foot from the thing, in parts.
const FOOT_PART: f32 = 0.08;
/// Share of a thing's columns that must reach the ground.
const LEAST_CONTACT: f32 = 0.2;
/// Share of a thing's cells that its box leaves out on every side.
const TRIM: f32 = 0.04;
/// Disparity in pixels below which heights are noise.
const LEAST_DISPARITY: f32 = 1.2;

/// One thing on the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thing {
    /// Number of cells.
    pub cells: u32,
    /// Left and right end in the camera's frame, metres.
    pub lateral_m: [f32; 2],
    /// Height of its highest cell above the ground, metres.
    pub top_m: f32,
    /// Nearest and farthest segment, metres.
    pub depth_m: [f32; 2],
    /// Columns of cells, and how many of them stand on the ground.
    columns: u32,
    contacts: u32,
    tall: u32,
}

/// Cells of one column that are one surface.
#[derive(Clone, Copy, Debug)]
struct Segment {
    x: u32,
    /// Rows, the upper one inclusive, the lower one exclusive.
    upper: u32,
    lower: u32,
    cells: u32,
    sum: f32,
    last: f32,
    top_m: f32,
    contact: bool,
    /// Goes on above what is looked at.
    tall: bool,
}

impl Segment {
    fn disparity(&self) -> f32 {
        self.sum / self.cells as f32
    }
}

/// The things of a frame and where they are.
#[derive(Debug, Default)]
pub struct Things {
    /// Per cell 0, else 1 + index into `list`.
    pub ids: Image<u32>,
    /// Per cell of a thing the disparity of its surface there (`cx_l - cx_r` subtracted).
    pub surface: Image<f32>,
    /// The things, from left to right by their first column.
    pub list: Vec<Thing>,
    /// Candidates that do not reach the ground.
    pub floating: u32,
}

/// The finder of things that stand, with its buffers.
#[derive(Debug, Default)]
pub struct Standing {
    segments: Vec<Segment>,
    /// Index of the first segment of each column, and the number of all.
    first: Vec<u32>,
    sets: UnionFind,
    thing: Vec<u32>,
    rows: Vec<u32>,
    seen: Vec<u32>,
    limits: Vec<[u32; 2]>,
}

impl Standing {
    /// Things in a map of disparity per cell (full-size pixels, `cx_l - cx_r`
    /// subtracted, NaN where there is none) on `plane`.
    pub fn run(
        &mut self,
        disparity: &Image<f32>,
        plane: &Plane,
        rig: &StereoRig,
        least_cells: u32,
        out: &mut Things,
    ) {
        self.find_segments(disparity, plane);
        self.ground(disparity, plane);
        self.join(plane.scale(), rig);
        self.collect(plane.scale(), rig, least_cells, out);
        self.paint(disparity, out);
    }

    /// Upward through every column: cells above the ground whose disparities agree.
    fn find_segments(&mut self, disparity: &Image<f32>, plane: &Plane) {
        let scale = plane.scale();
        self.segments.clear();
        self.first.clear();
        for x in 0..disparity.width() {
            self.first.push(self.segments.len() as u32);
            let mut open: Option<Segment> = None;
            let mut holes = 0;
            // What the segment above stands on or is hidden by.
            let mut carried = true;
            for y in (0..disparity.height()).rev() {
                let d = disparity.get(x, y);
                if d.is_nan() || d <= LEAST_DISPARITY {
                    holes += 1;
                    if holes > MAX_HOLES {
                        self.segments.extend(open.take());
                        carried = false;
                    }
                    continue;
                }
                holes = 0;
                let (u, v) = cell_centre(x, y);
                let height = plane.height(u, v, d);
                let low = LOW_M * scale + NOISE_PX * plane.camera_height_m / d;
                if let Some(s) = &mut open
                    && height > HIGH_M
                    && agree(d, s.last)
                {
                    s.last = d;
                    s.tall = height > TALL_M;
                    if !s.tall {
                        continue;
                    }
                }
                if height < low || height > HIGH_M {
                    self.segments.extend(open.take());
                    // Directly above a cell of the ground, something stands on it.
                    carried = height < low;
                    continue;
                }
                match &mut open {
                    Some(s)
                        if agree(d, s.last)
                            && (d - s.disparity()).abs() <= SEGMENT_PART * s.disparity() =>
                    {
                        s.upper = y as u32;
                        s.cells += 1;
                        s.sum += d;
                        s.last = d;
                        s.top_m = s.top_m.max(height);
                    }
                    _ => {
                        let hidden = open.as_ref().is_some_and(|s| d < s.disparity());
                        self.segments.extend(open.take());
                        open = Some(Segment {
                            x: x as u32,
                            upper: y as u32,
                            lower: y as u32 + 1,
                            cells: 1,
                            sum: d,
                            last: d,
                            top_m: height,
                            contact: carried || hidden || height <= CONTACT_M * scale,
                            tall: false,
                        });
                        // It carries one segment only.
                        carried = false;
                    }
                }
            }
            self.segments.extend(open);
        }
        self.first.push(self.segments.len() as u32);
    }

    /// Down from a segment to where the ground has its disparity: what is lower
    /// than [`LOW_M`] was no evidence of a thing, but belongs to one.
    fn ground(&mut self, disparity: &Image<f32>, plane: &Plane) {
        for s in self.segments.iter_mut().filter(|s| s.contact) {
            let mean = s.disparity();
            for y in s.lower as usize..disparity.height() {
                let (u, v) = cell_centre(s.x as usize, y);
                let d = disparity.get(s.x as usize, y);
                // NaN is no contradiction.
                let other = (d - mean).abs() > FOOT_PART * mean;
                if plane.disparity(u, v) >= mean || other {
                    break;
                }
                s.lower = y as u32 + 1;
                s.sum += mean;
                s.cells += 1;
            }
        }
    }

    /// Segments beside each other at one depth, and parts above each other.
    fn join(&mut self, scale: f32, rig: &StereoRig) {
        let (depth_scale, focal) = (rig.depth_scale() as f32, rig.focal_px() as f32);
        self.sets.reset(self.segments.len());
        for i in 0..self.segments.len() {
            let s = self.segments[i];
            let z = depth_scale / s.disparity();
            let column = s.x as usize;
            // Above: the next segment of the same column.
            if i + 1 < self.first[column + 1] as usize {
                let t = self.segments[i + 1];
                let setback = depth_scale / t.disparity() - z;
                let near = s.upper.saturating_sub(t.lower) as usize <= MAX_HOLES;
                if near && (-0.3 * SETBACK_M * scale..SETBACK_M * scale).contains(&setback) {
                    self.sets.union(i as u32, i as u32 + 1);
                }
            }
            // Beside: columns to the left, up to the largest gap.
            let step = (STEP_M * scale).max(STEP_PART * z);
            let columns = (GAP_M * scale * focal / z / CELL as f32) as usize + 1;
            let from = self.first[column.saturating_sub(columns)] as usize;
            for j in from..self.first[column] as usize {
                let t = self.segments[j];
                let overlap = s.lower.min(t.lower) > s.upper.max(t.upper);
                let next = t.x + 1 == s.x;
                let step = if next { step.max(NEXT_STEP_M * scale) } else { step };
                if overlap && (depth_scale / t.disparity() - z).abs() <= step {
                    self.sets.union(j as u32, i as u32);
                }
            }
        }
    }

    fn collect(&mut self, scale: f32, rig: &StereoRig, least_cells: u32, out: &mut Things) {
        let (depth_scale, focal) = (rig.depth_scale() as f32, rig.focal_px() as f32);
        let cx = rig.principal_point().0 as f32;
        out.list.clear();
        out.floating = 0;
        self.thing.clear();
        for i in 0..self.segments.len() {
            let root = self.sets.find(i as u32) as usize;
            if root == i {
                out.list.push(Thing {
                    lateral_m: [f32::INFINITY, f32::NEG_INFINITY],
                    depth_m: [f32::INFINITY, f32::NEG_INFINITY],
                    ..Thing::default()
                });
            }
            let thing = if root == i { out.list.len() as u32 } else { self.thing[root] };
            self.thing.push(thing);
            let s = &self.segments[i];
            let t = &mut out.list[thing as usize - 1];
            let z = depth_scale / s.disparity();
            let left = (s.x as f32 * CELL as f32 - 0.5 - cx) * z / focal;
            t.cells += s.cells;
            t.columns += 1;
            t.contacts += u32::from(s.contact);
            t.tall += u32::from(s.tall);
            t.lateral_m[0] = t.lateral_m[0].min(left);
            t.lateral_m[1] = t.lateral_m[1].max(left + CELL as f32 * z / focal);
            t.top_m = t.top_m.max(s.top_m);
            t.depth_m = [t.depth_m[0].min(z), t.depth_m[1].max(z)];
        }
        // Things that are none get the number 0, the others new ones.
        self.seen.clear();
        let mut kept = 0;
        for i in 0..out.list.len() {
            let thing = out.list[i];
            let stands = thing.contacts as f32 >= LEAST_CONTACT * thing.columns as f32;
            let large = thing.cells >= least_cells && thing.top_m >= LEAST_TOP_M * scale;
            let building = thing.tall as f32 > MOST_TALL * thing.columns as f32
                && thing.lateral_m[1] - thing.lateral_m[0] > TRUNK_M;
            out.floating += u32::from(large && !stands);
            if large && stands && !building {
                out.list[kept] = thing;
                kept += 1;
                self.seen.push(kept as u32);
            } else {
                self.seen.push(0);
            }
        }
        out.list.truncate(kept);
        for thing in &mut self.thing {
            *thing = self.seen[*thing as usize - 1];
        }
    }

    /// Writes the cells of each thing, less its outermost ones.
    fn paint(&mut self, disparity: &Image<f32>, out: &mut Things) {
        let size = disparity.size();
        out.ids.resize(size);
        out.ids.fill(0);
        out.surface.resize(size);
        out.surface.fill(f32::NAN);
        self.rows.clear();
        self.rows.resize(size.height * out.list.len(), 0);
        for (s, &thing) in self.segments.iter().zip(&self.thing).filter(|(_, t)| **t != 0) {
            let at = (thing as usize - 1) * size.height;
            for y in s.upper..s.lower {
                self.rows[at + y as usize] += 1;
            }
        }
        self.limits.clear();
        for rows in self.rows.chunks_exact(size.height.max(1)) {
            let total: u32 = rows.iter().sum();
            let trim = (total as f32 * TRIM) as u32;
            let end = |rows: &mut dyn Iterator<Item = &u32>| {
                let mut passed = 0;
                rows.take_while(|n| {
                    passed += **n;
                    passed <= trim
                })
                .count() as u32
            };
            let (top, bottom) = (end(&mut rows.iter()), end(&mut rows.iter().rev()));
            self.limits.push([top, size.height as u32 - bottom]);
        }
        self.seen.clear();
        self.seen.resize(out.list.len(), 0);
        for (s, &thing) in self.segments.iter().zip(&self.thing).filter(|(_, t)| **t != 0) {
            let index = thing as usize - 1;
            // Segments come column by column: what has passed is the share to the left.
            let total = out.list[index].cells as f32;
            let passed = self.seen[index];
            self.seen[index] += s.cells;
            if ((passed + s.cells) as f32) < TRIM * total || passed as f32 > (1.0 - TRIM) * total {
                continue;
            }
            let [top, bottom] = self.limits[index];
            for y in s.upper.max(top)..s.lower.min(bottom) {
                out.ids.set(s.x as usize, y as usize, thing);
                out.surface.set(s.x as usize, y as usize, s.disparity());
            }
        }
    }
}
