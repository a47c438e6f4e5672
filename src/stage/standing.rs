//! Things that stand on the ground: column segments joined in bird's-eye view.

pub mod climb;
pub mod column;
pub mod join;
mod sides;

use crate::camera::StereoRig;
use crate::image::{Image, Size};
use crate::simd::{Level, dispatch};
use crate::stage::ground::Plane;
use crate::stage::regions::components::agree;
use column::{Columns, Segment, Top};
use join::Join;
use sides::sides;

/// Pixels that a cell is wide: poles, legs and the gaps between things are narrow.
pub const WIDE: usize = 2;
/// Pixels that a cell is high: what stands is higher than wide.
pub const HIGH: usize = 4;
/// Share of its columns from which a thing that goes on upward is part of a
/// building, if it is wider than a trunk or a pole, metres.
const MOST_TALL: f32 = 0.45;
const TRUNK_M: f32 = 1.2;
/// A thing reaches at least this height, metres (of a road scene).
const LEAST_TOP_M: f32 = 0.35;
/// and this part of its length: a bank of earth or a kerb is lower.
const LEAST_RISE: f32 = 0.1;
/// Share of a thing's columns that must reach the ground.
const LEAST_CONTACT: f32 = 0.3;
/// Share of a thing's cells that its box leaves out on every side.
const TRIM: f32 = 0.04;
/// Cells across a pole, at most.
const MOST_WIDE: usize = 6;
/// Share of a thing's sides that must be free of anything nearer.
const LEAST_FREE: f32 = 0.3;

/// Width in metres from which what does not reach the ground may be a plate on a post
/// too thin to be seen: a traffic sign, which is as large on every road. It is no
/// wider than a trunk or a pole may be.
const PLATE_M: f32 = 0.3;
/// Share of its sides, of so many cells at least, behind which it is farther away.
const PLATE_FREE: f32 = 0.8;
const PLATE_SIDES: u32 = 6;

/// One thing on the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Thing {
    /// Number of cells.
    pub cells: u32,
    /// Cells above those, of surfaces that end below a lorry's height.
    above: u32,
    /// Left and right end in the camera's frame, metres.
    pub lateral_m: [f32; 2],
    /// Height of its highest cell above the ground, metres.
    pub top_m: f32,
    /// Nearest and farthest segment, metres.
    pub depth_m: [f32; 2],
    /// Columns of cells, how many of them stand on the ground, how many of them
    /// go on above a lorry's height, how many are covered there.
    columns: u32,
    contacts: u32,
    tall: u32,
    covered: u32,
    /// Cells at its sides with something farther and something nearer beyond.
    free: u32,
    hidden: u32,
    /// As narrow as a trunk or a pole.
    narrow: bool,
    /// Held up by a post that is not seen.
    plate: bool,
}

impl Thing {
    /// Left to right and near to far, metres.
    fn size_m(&self) -> [f32; 2] {
        [self.lateral_m, self.depth_m].map(|[from, to]| to - from)
    }

    fn part(&self, columns: u32) -> f32 {
        columns as f32 / self.columns as f32
    }

    fn is_large(&self, scale: f32, least_cells: u32) -> bool {
        let low = (LEAST_TOP_M * scale).max(LEAST_RISE * self.size_m()[0]);
        let above = if self.stands() { 0 } else { self.above };
        self.cells + above >= least_cells && self.top_m >= low
    }

    fn stands(&self) -> bool {
        self.part(self.contacts) >= LEAST_CONTACT
    }

    fn is_narrow(&self) -> bool {
        let [width, depth] = self.size_m();
        width.max(depth) <= TRUNK_M
    }

    fn goes_on(&self) -> bool {
        self.part(self.tall + self.covered) > MOST_TALL
    }

    fn is_building(&self) -> bool {
        !self.is_narrow() && self.goes_on()
    }

    fn is_plate(&self) -> bool {
        let sides = self.free + self.hidden;
        let apart = sides >= PLATE_SIDES && self.free as f32 >= PLATE_FREE * sides as f32;
        let wide = self.size_m()[0] >= PLATE_M;
        !self.stands() && self.is_narrow() && wide && !self.goes_on() && apart
    }

    fn is_behind(&self) -> bool {
        let sides = self.free + self.hidden;
        // Far away nothing beside a thing differs enough to tell.
        if sides == 0 { self.goes_on() } else { (self.free as f32) < LEAST_FREE * sides as f32 }
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
    /// Candidates that go on above a lorry's height, or have only nearer things
    /// at their sides.
    pub background: u32,
}

/// The finder of things that stand, with its buffers.
#[derive(Debug)]
pub struct Standing {
    level: Level,
    columns: Columns,
    join: Join,
    thing: Vec<u32>,
    rows: Vec<u32>,
    seen: Vec<u32>,
    limits: Vec<[u32; 2]>,
}

impl Standing {
    /// The finder with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            columns: Columns::new(level),
            join: Join::default(),
            thing: Vec::new(),
            rows: Vec::new(),
            seen: Vec::new(),
            limits: Vec::new(),
        }
    }

    /// Things in a map of disparity per cell of [`WIDE`] x [`HIGH`] pixels (full-size pixels, `cx_l - cx_r`
    /// subtracted, NaN where there is none) on `plane`.
    pub fn run(
        &mut self,
        disparity: &Image<f32>,
        plane: &Plane,
        rig: &StereoRig,
        least_cells: u32,
        out: &mut Things,
    ) {
        self.columns.find(disparity, plane);
        let scale = size_scale(plane);
        self.join.run(disparity, &self.columns, scale, rig);
        self.collect(disparity, scale, rig, least_cells, out);
        self.paint(disparity, out);
    }

    fn collect(
        &mut self,
        disparity: &Image<f32>,
        scale: f32,
        rig: &StereoRig,
        least_cells: u32,
        out: &mut Things,
    ) {
        let (depth_scale, focal) = (rig.depth_scale() as f32, rig.focal_px() as f32);
        let cx = rig.principal_point().0 as f32;
        out.list.clear();
        out.floating = 0;
        out.background = 0;
        self.thing.clear();
        for (i, s) in self.columns.segments.iter().enumerate() {
            let root = self.join.set_of(i as u32) as usize;
            if root == i {
                out.list.push(Thing {
                    lateral_m: [f32::INFINITY, f32::NEG_INFINITY],
                    depth_m: [f32::INFINITY, f32::NEG_INFINITY],
                    ..Thing::default()
                });
            }
            let thing = if root == i { out.list.len() as u32 } else { self.thing[root] };
            self.thing.push(thing);
            let t = &mut out.list[thing as usize - 1];
            let z = depth_scale / s.disparity();
            let left = (s.x as f32 * WIDE as f32 - 0.5 - cx) * z / focal;
            t.cells += s.cells;
            t.above += if s.top == Top::Tall { 0 } else { s.upper.saturating_sub(s.reach) };
            t.columns += 1;
            t.contacts += u32::from(s.contact);
            t.tall += u32::from(s.top == Top::Tall);
            t.covered += u32::from(s.top == Top::Covered);
            t.lateral_m[0] = t.lateral_m[0].min(left);
            t.lateral_m[1] = t.lateral_m[1].max(left + WIDE as f32 * z / focal);
            t.top_m = t.top_m.max(s.top_m);
            t.depth_m = [t.depth_m[0].min(z), t.depth_m[1].max(z)];
        }
        self.look_aside(disparity, scale, least_cells, &mut out.list);
        // Things that are none get the number 0, the others new ones.
        self.seen.clear();
        let mut kept = 0;
        for i in 0..out.list.len() {
            let thing = out.list[i];
            let plate = thing.is_plate();
            let (large, stands) = (thing.is_large(scale, least_cells), plate || thing.stands());
            let background = thing.is_building() || thing.is_behind();
            out.floating += u32::from(large && !stands);
            out.background += u32::from(large && stands && background);
            if large && stands && !background {
                out.list[kept] = Thing { narrow: thing.is_narrow(), plate, ..thing };
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

    /// Counts what is at the sides of things that may be background for that alone.
    fn look_aside(
        &mut self,
        disparity: &Image<f32>,
        scale: f32,
        least_cells: u32,
        things: &mut [Thing],
    ) {
        self.seen.clear();
        self.seen.extend(things.iter().map(|thing| {
            let stands = thing.stands() || thing.is_narrow();
            let asked = thing.is_large(scale, least_cells) && stands;
            u32::from(asked && !thing.is_building())
        }));
        let Self { level, columns, thing, seen, .. } = self;
        dispatch!(*level, simd => {
            for (s, &thing) in columns.segments.iter().zip(&*thing) {
                let index = thing as usize - 1;
                if seen[index] != 0 {
                    let [free, hidden] = sides(simd, disparity, s);
                    things[index].free += free;
                    things[index].hidden += hidden;
                }
            }
        });
    }

    /// Writes the cells of each thing, less its outermost ones.
    fn paint(&mut self, disparity: &Image<f32>, out: &mut Things) {
        let size = disparity.size();
        out.ids.resize(size);
        out.ids.fill(0);
        out.surface.resize(size);
        self.rows.clear();
        // One place more for the lower end of what reaches the lowest row.
        let height = size.height + 1;
        self.rows.resize(height * out.list.len(), 0);
        for (s, &thing) in self.columns.segments.iter().zip(&self.thing).filter(|(_, t)| **t != 0) {
            // More from the upper row on, less from the lower one.
            let rows = &mut self.rows[(thing as usize - 1) * height..][..height];
            rows[s.upper as usize] = rows[s.upper as usize].wrapping_add(1);
            rows[s.lower as usize] = rows[s.lower as usize].wrapping_sub(1);
        }
        self.limits.clear();
        for rows in self.rows.chunks_exact_mut(height) {
            let mut cells = 0_u32;
            for n in &mut *rows {
                cells = cells.wrapping_add(*n);
                *n = cells;
            }
            let rows = &rows[..size.height];
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
        for (s, &thing) in self.columns.segments.iter().zip(&self.thing).filter(|(_, t)| **t != 0) {
            let index = thing as usize - 1;
            // Segments come column by column: what has passed is the share to the left.
            let total = out.list[index].cells as f32;
            let passed = self.seen[index];
            self.seen[index] += s.cells;
            if ((passed + s.cells) as f32) < TRIM * total || passed as f32 > (1.0 - TRIM) * total {
                continue;
            }
            let [top, bottom] = self.limits[index];
            let (upper, lower) = (s.upper.max(top) as usize, s.lower.min(bottom) as usize);
            let (at, n) = (upper * size.width + s.x as usize, lower.saturating_sub(upper));
            let d = s.disparity();
            for id in out.ids.pixels_mut().iter_mut().skip(at).step_by(size.width).take(n) {
                *id = thing;
            }
            for at in out.surface.pixels_mut().iter_mut().skip(at).step_by(size.width).take(n) {
                *at = d;
            }
            // A pole is seen up to its end, a trunk up to its crown, a plate wholly.
            let Thing { narrow, plate, .. } = out.list[index];
            if plate || narrow && s.top == Top::Tall {
                for y in (s.reach..s.upper.min(bottom)).rev() {
                    if !plate && width(disparity, s, y) > MOST_WIDE {
                        break;
                    }
                    out.ids.set(s.x as usize, y as usize, thing);
                    out.surface.set(s.x as usize, y as usize, d);
                }
            }
        }
    }
}

/// Size of things against a road's, 0.03..=1, from how far away the plane is
/// seen: a street from 5 m, a table from less than 1 m.
pub(crate) fn size_scale(plane: &Plane) -> f32 {
    (plane.distance_m / 5.0).powf(1.4).clamp(0.03, 1.0)
}

/// Size of the map of cells of an image of `size`.
pub fn cells(size: Size) -> Size {
    Size::new(size.width.div_ceil(WIDE), size.height.div_ceil(HIGH))
}

/// Centre of a cell in full-size pixels.
#[inline]
pub fn centre(x: usize, y: usize) -> (f32, f32) {
    ((x * WIDE) as f32 + (WIDE as f32 - 1.0) / 2.0, (y * HIGH) as f32 + (HIGH as f32 - 1.0) / 2.0)
}

/// Columns of cells around a segment that have its disparity in row `y`, no
/// more than one beyond the limit.
fn width(disparity: &Image<f32>, s: &Segment, y: u32) -> usize {
    let (row, x, d) = (disparity.row(y as usize), s.x as usize, s.disparity());
    let same = |d2: &&f32| agree(**d2, d);
    let left = row[..x].iter().rev().take(MOST_WIDE).take_while(same).count();
    let right = row[x + 1..].iter().take(MOST_WIDE).take_while(same).count();
    left + 1 + right
}
