//! Things that stand on the ground: column segments joined in bird's-eye view.

pub mod climb;
pub mod column;
pub mod join;
mod sides;
mod split;
mod thing;

use std::ops::Range;

use crate::camera::StereoRig;
use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, prelude::*, store_inside, u32x16};
use crate::stage::ground::Plane;
use crate::stage::regions::components::agree;
use column::{Columns, Segment, Top};
use join::{Join, View};
use sides::sides;
use split::Split;
pub use thing::Thing;

/// Pixels that a cell is wide: poles, legs and the gaps between things are narrow.
pub const WIDE: usize = 2;
/// Pixels that a cell is high: what stands is higher than wide.
pub const HIGH: usize = 4;
/// Share of a thing's cells that its box leaves out on every side.
const TRIM: f32 = 0.04;
/// Cells across a pole, at most.
const MOST_WIDE: usize = 6;

/// The things of a frame and where they are.
#[derive(Debug, Default)]
pub struct Things {
    /// Per cell 0, else 1 + index into `list`.
    pub ids: Image<u32>,
    /// Per cell of a thing the disparity of its surface there (`cx_l - cx_r` subtracted).
    pub surface: Image<f32>,
    /// The things, from left to right by their first column; parts of what was taken
    /// for one at the end.
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
    split: Split,
    /// The left and the right half of each thing.
    halves: Vec<[Thing; 2]>,
    thing: Vec<u32>,
    rows: Vec<u32>,
    seen: Vec<u32>,
    limits: Vec<[u32; 2]>,
    strip: Strip,
}

impl Standing {
    /// The finder with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            columns: Columns::new(level),
            join: Join::default(),
            split: Split::default(),
            halves: Vec::new(),
            thing: Vec::new(),
            rows: Vec::new(),
            seen: Vec::new(),
            limits: Vec::new(),
            strip: Strip::default(),
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
        let view = View::new(size_scale(plane), rig);
        self.join.run(disparity, &self.columns, &view);
        self.collect(disparity, &view, least_cells, out);
        self.divide(&view, least_cells, &mut out.list);
        self.paint(disparity, out);
    }

    fn collect(&mut self, disparity: &Image<f32>, view: &View, least_cells: u32, out: &mut Things) {
        let scale = view.scale;
        out.list.clear();
        out.floating = 0;
        out.background = 0;
        self.thing.clear();
        for (i, s) in self.columns.segments.iter().enumerate() {
            let root = self.join.set_of(i as u32) as usize;
            if root == i {
                out.list.push(Thing::EMPTY);
            }
            let thing = if root == i { out.list.len() as u32 } else { self.thing[root] };
            self.thing.push(thing);
            out.list[thing as usize - 1].add(s, view);
        }
        self.look_aside(disparity, scale, least_cells, &mut out.list);
        // Things that are none get the number 0, the others new ones.
        self.seen.clear();
        let mut kept = 0;
        for i in 0..out.list.len() {
            let thing = out.list[i];
            let plate = thing.is_plate();
            let (large, stands) = (thing.is_large(scale, least_cells), plate || thing.stands());
            let background = thing.is_building() || thing.is_behind(view);
            out.floating += u32::from(large && !stands);
            out.background += u32::from(large && stands && background);
            if large && stands && !background {
                out.list[kept] = thing;
                (out.list[kept].narrow, out.list[kept].plate) = (thing.is_narrow(), plate);
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

    /// Makes two of things that are rather two, if both would be things; the right one
    /// comes last.
    fn divide(&mut self, view: &View, least_cells: u32, list: &mut Vec<Thing>) {
        let Self { columns, thing: things, split, halves, .. } = self;
        let cuts = split.run(&columns.segments, things, list, view, least_cells);
        halves.clear();
        halves.resize(list.len(), [Thing::EMPTY; 2]);
        let segments = || columns.segments.iter();
        for (s, thing) in segments().zip(&*things).filter(|(_, thing)| **thing != 0) {
            let index = *thing as usize - 1;
            if let Some(cut) = cuts[index] {
                halves[index][usize::from(s.x >= cut)].add(s, view);
            }
        }
        // The numbers of the right ones.
        self.seen.clear();
        for (index, halves) in halves.iter_mut().enumerate() {
            let is_thing = |half: &Thing| {
                half.is_large(view.scale, least_cells) && half.stands() && !half.is_building()
            };
            let two = cuts[index].is_some() && halves.iter().all(is_thing);
            if two {
                for half in &mut *halves {
                    half.narrow = half.is_narrow();
                }
                list[index] = halves[0];
                list.push(halves[1]);
            }
            self.seen.push(if two { list.len() as u32 } else { 0 });
        }
        for (s, thing) in segments().zip(things).filter(|(_, thing)| **thing != 0) {
            let index = *thing as usize - 1;
            if self.seen[index] != 0 && cuts[index].is_some_and(|cut| s.x >= cut) {
                *thing = self.seen[index];
            }
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
                if seen[index] == 0 {
                    continue;
                }
                let thing = &mut things[index];
                // What is held up is asked along its whole height: of a far or high plate
                // only a row or two lie below the heights that are climbed.
                let held = thing.is_narrow() && !thing.stands() && s.top != Top::Tall;
                let upper = if held { s.reach } else { s.upper };
                let [free, hidden] = sides(simd, disparity, &Segment { upper, ..*s });
                thing.free += free;
                thing.hidden += hidden;
            }
        });
    }

    /// Writes the cells of each thing, less its outermost ones.
    fn paint(&mut self, disparity: &Image<f32>, out: &mut Things) {
        let size = disparity.size();
        out.ids.resize(size);
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
        self.write(disparity, out);
    }

    /// The same within the limits.
    fn write(&mut self, disparity: &Image<f32>, out: &mut Things) {
        let Size { width: columns, height } = disparity.size();
        self.seen.clear();
        self.seen.resize(out.list.len(), 0);
        self.strip.clear(height);
        // In order, which takes less time than to leave nothing of the last frame in each strip.
        out.ids.fill(0);
        let Self { level, columns: Columns { segments, .. }, thing, seen, limits, strip, .. } =
            self;
        let mut segments = segments.iter().zip(&*thing).filter(|(_, t)| **t != 0).peekable();
        for first in (0..columns).step_by(Strip::WIDTH) {
            let inside = |s: &Segment| (s.x as usize) < first + Strip::WIDTH;
            while let Some((s, &thing)) = segments.next_if(|(s, _)| inside(s)) {
                let index = thing as usize - 1;
                // Segments come column by column: what has passed is the share to the left.
                let total = out.list[index].cells as f32;
                let passed = seen[index];
                seen[index] += s.cells;
                if ((passed + s.cells) as f32) < TRIM * total
                    || passed as f32 > (1.0 - TRIM) * total
                {
                    continue;
                }
                let [top, bottom] = limits[index];
                let (x, d) = (s.x as usize - first, s.disparity());
                strip.paint(x, s.upper.max(top)..s.lower.min(bottom), thing, d);
                // A pole is seen up to its end, a trunk up to its crown, a plate wholly.
                let Thing { narrow, plate, .. } = out.list[index];
                if plate || narrow && s.top == Top::Tall {
                    let end = s.upper.min(bottom);
                    let same = |y: &u32| plate || width(disparity, s, *y) <= MOST_WIDE;
                    let n = (s.reach..end).rev().take_while(same).count() as u32;
                    strip.paint(x, end - n..end, thing, d);
                }
            }
            dispatch!(*level, simd => strip.give(simd, first, out));
        }
    }
}

/// Some columns of cells by themselves: those of an image are far apart.
#[derive(Debug, Default)]
struct Strip {
    ids: Vec<[u32; Self::WIDTH]>,
    surface: Vec<[f32; Self::WIDTH]>,
    /// The rows that were written.
    rows: Range<usize>,
}

impl Strip {
    const WIDTH: usize = 16;

    /// No cell of any of `height` rows belongs to a thing.
    fn clear(&mut self, height: usize) {
        self.ids.clear();
        self.ids.resize(height, [0; Self::WIDTH]);
        self.surface.resize(height, [0.0; Self::WIDTH]);
        self.rows = height..0;
    }

    /// Gives some rows of a column to a thing.
    fn paint(&mut self, x: usize, rows: Range<u32>, id: u32, surface: f32) {
        if rows.is_empty() {
            return;
        }
        let rows = rows.start as usize..rows.end as usize;
        for (ids, surfaces) in
            self.ids[rows.clone()].iter_mut().zip(&mut self.surface[rows.clone()])
        {
            ids[x % Self::WIDTH] = id;
            surfaces[x % Self::WIDTH] = surface;
        }
        self.rows = self.rows.start.min(rows.start)..self.rows.end.max(rows.end);
    }

    /// Writes the columns from `first` on, as many as there are, and forgets them.
    #[inline(always)]
    fn give<S: Simd>(&mut self, simd: S, first: usize, out: &mut Things) {
        for y in self.rows.clone() {
            let ids = u32x16::load_array_ref(simd, &self.ids[y]);
            store_inside(out.ids.row_mut(y), first, ids);
            let surface = f32x16::load_array_ref(simd, &self.surface[y]);
            store_inside(out.surface.row_mut(y), first, surface);
            self.ids[y] = [0; Self::WIDTH];
        }
        self.rows = self.ids.len()..0;
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
