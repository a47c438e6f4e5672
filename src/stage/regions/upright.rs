//! Regions of things that stand on the ground, from the fine disparity.

use super::RegionSource;
use super::components::{Candidates, tolerance};
use super::trim::{NARROW_M, Trim};
use crate::image::Image;
use crate::perception::Rejections;
use crate::simd::{Level, Simd, dispatch, f32x4, prelude::*};
use crate::stage::coarse::CELL;
use crate::stage::ground::Plane;
use crate::stage::standing::{HIGH, Standing, Things, WIDE, cells, size_scale};

/// Places in a cell whose disparities are asked; their median is the cell's.
const SAMPLES: [(usize, usize); 4] = [(0, 0), (1, 1), (0, 2), (1, 3)];
/// A sorting network of as many (Batcher 1968).
const EXCHANGES: [(usize, usize); 5] = [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)];
/// Samples with disparity that a cell needs.
const LEAST_SAMPLES: usize = 2;
/// Share of a thing's cells that must be salient.
const LEAST_SALIENT: f32 = 0.3;
/// Largest difference of a pixel from its surface in parts of the disparity.
const SURFACE_PART: f32 = 0.1;
const SURFACE_PX: f32 = 0.7;
const GROUND_PX: f32 = 0.3;

/// Cells whose medians are taken at once.
const LANES: usize = 8;

/// The former of such regions, with its buffers.
#[derive(Debug)]
pub struct Upright {
    level: Level,
    standing: Standing,
    things: Things,
    cells: Image<f32>,
    /// 1 for cells whose disparity is a fine one.
    fine: Image<u8>,
    /// Per cell of a row: holes in it are inside of the thing.
    inside: Vec<bool>,
    salient: Vec<u32>,
    number: Vec<u32>,
}

impl Upright {
    /// The former with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            standing: Standing::default(),
            things: Things::default(),
            cells: Image::default(),
            fine: Image::default(),
            inside: Vec::new(),
            salient: Vec::new(),
            number: Vec::new(),
        }
    }

    /// Candidates for regions on `plane`, of things of at least `min_area`
    /// pixels; those that are refused here are counted.
    pub fn run(
        &mut self,
        plane: &Plane,
        source: &RegionSource<'_>,
        min_area: usize,
        out: &mut Candidates,
        rejections: &mut Rejections,
    ) {
        self.shrink(source);
        let least_cells = (min_area / (WIDE * HIGH)).max(1) as u32;
        self.standing.run(&self.cells, plane, source.rig, least_cells, &mut self.things);
        let count = self.choose(&source.roi.salient);
        self.paint(plane, source, count, out);
        self.trim(plane, source, out);
        rejections.floating = self.things.floating;
        rejections.background = self.things.background;
        rejections.not_salient = (self.things.list.len() - count) as u32;
    }

    /// The median disparity of each cell inside the region of interest.
    fn shrink(&mut self, source: &RegionSource<'_>) {
        let size = source.disparity.size();
        self.cells.resize(cells(size));
        self.fine.resize(cells(size));
        let offset = source.rig.disparity_offset() as f32;
        for cy in 0..self.cells.height() {
            // Rows of the cell inside the image, and whether any is matched.
            let rows: [usize; HIGH] = std::array::from_fn(|i| (cy * HIGH + i).min(size.height - 1));
            let matched = [rows[0], rows[HIGH - 1]].map(|y| source.roi.matched.row(y));
            let disparity = rows.map(|y| source.disparity.row(y));
            let coarse = source.coarse.checked.row(cy);
            let cells = self.cells.row_mut(cy).chunks_mut(LANES);
            let kinds = self.fine.row_mut(cy).chunks_mut(LANES);
            for ((cells, kinds), first) in cells.zip(kinds).zip((0..).step_by(LANES)) {
                let any = |cell: usize| {
                    let from = (first + cell) * WIDE;
                    let last = (from + WIDE - 1).min(size.width - 1);
                    matched.iter().any(|row| row[from] != 0 || row[last] != 0)
                };
                let fine: [bool; LANES] =
                    std::array::from_fn(|cell| cell < cells.len() && any(cell));
                let mut medians = [f32::NAN; LANES];
                if fine.contains(&true) {
                    dispatch!(self.level, _simd => {
                        medians_of(&disparity, first * WIDE, &mut medians);
                    });
                }
                let found = cells.iter_mut().zip(kinds).zip(medians).zip(fine).zip(first..);
                for ((((out, kind), median), fine), x) in found {
                    // What was not matched finely is known coarsely.
                    let measured = fine && !median.is_nan();
                    *kind = u8::from(measured);
                    *out = if measured { median } else { coarse[x * WIDE / CELL] - offset };
                }
            }
        }
    }

    /// Numbers the things that are salient; returns how many.
    fn choose(&mut self, salient: &Image<u8>) -> usize {
        self.salient.clear();
        self.salient.resize(self.things.list.len(), 0);
        self.number.clear();
        self.number.resize(self.things.list.len(), 0);
        for cy in 0..self.things.ids.height() {
            let pixels = salient.row((cy * HIGH + HIGH / 2).min(salient.height() - 1));
            for (cx, &id) in self.things.ids.row(cy).iter().enumerate() {
                if id != 0 {
                    let at = (cx * WIDE + WIDE / 2).min(pixels.len() - 1);
                    self.number[id as usize - 1] += 1;
                    self.salient[id as usize - 1] += u32::from(pixels[at] != 0);
                }
            }
        }
        let mut count = 0;
        for (number, &salient) in self.number.iter_mut().zip(&self.salient) {
            let chosen = salient as f32 >= LEAST_SALIENT * *number as f32 && salient > 0;
            count += u32::from(chosen);
            *number = if chosen { count } else { 0 };
        }
        for id in self.things.ids.pixels_mut().iter_mut().filter(|id| **id != 0) {
            *id = self.number[*id as usize - 1];
        }
        count as usize
    }

    /// From cells to pixels: those of a thing's cells that do not contradict
    /// its surface, and those of the cells beside and above that agree with it.
    fn paint(
        &mut self,
        plane: &Plane,
        source: &RegionSource<'_>,
        count: usize,
        out: &mut Candidates,
    ) {
        let size = source.disparity.size();
        out.clear(size, count);
        let (ids, surface) = (&self.things.ids, &self.things.surface);
        for cy in 0..ids.height() {
            let (row, surfaces) = (ids.row(cy), surface.row(cy));
            let below = if cy + 1 < ids.height() { ids.row(cy + 1) } else { &[] };
            if row.iter().chain(below).all(|id| *id == 0) {
                continue;
            }
            enclose(row, self.fine.row(cy), &mut self.inside);
            let inside = &self.inside;
            let cell = |cx: usize| {
                let left = if cx > 0 { row[cx - 1] } else { 0 };
                let right = row.get(cx + 1).copied().unwrap_or(0);
                let low = below.get(cx).copied().unwrap_or(0);
                let (id, surface) = match (row.get(cx).copied().unwrap_or(0), left, right, low) {
                    (0, 0, 0, 0) => return Cell::NONE,
                    (0, 0, 0, id) => (id, surface.get(cx, cy + 1)),
                    (0, 0, id, _) => (id, surfaces[cx + 1]),
                    (0, id, ..) if cx < row.len() => (id, surfaces[cx - 1]),
                    (0, ..) => return Cell::NONE,
                    (own, ..) => (own, surfaces[cx]),
                };
                let own = row[cx] != 0;
                let interior = own && inside[cx];
                let tolerance =
                    if own { (SURFACE_PART * surface).max(SURFACE_PX) } else { tolerance(surface) };
                Cell { id, own, interior, surface, tolerance }
            };
            for cx in (0..row.len()).step_by(2) {
                let pair = [cell(cx), cell(cx + 1)];
                if pair.iter().any(|cell| cell.id != 0) {
                    let at = [cx * WIDE, cy * HIGH];
                    dispatch!(self.level, simd => paint(simd, &pair, at, plane, source, out));
                }
            }
        }
    }

    /// Cuts narrow things at the edges that the image shows.
    fn trim(&self, plane: &Plane, source: &RegionSource<'_>, out: &mut Candidates) {
        let narrow = NARROW_M * size_scale(plane);
        for (thing, &id) in self.things.list.iter().zip(&self.number).filter(|(_, id)| **id != 0) {
            let bounds = &out.boxes[id as usize - 1];
            let depth = thing.depth_m[0].midpoint(thing.depth_m[1]);
            let focal = source.rig.focal_px() as f32;
            if bounds.area == 0 || bounds.width() as f32 * depth > narrow * focal {
                continue;
            }
            let surface = source.rig.depth_scale() as f32 / depth;
            Trim { rgb: source.rgb, disparity: source.disparity, surface }.run(id, out);
        }
    }
}

/// Which cells of a row have fine cells of their own thing on both sides (or
/// the edge of the image) before those of anything else. What only one camera
/// sees at the sides of a thing belongs to what is behind it.
fn enclose(ids: &[u32], fine: &[u8], inside: &mut Vec<bool>) {
    inside.clear();
    inside.resize(ids.len(), true);
    pass(ids.iter().zip(fine).zip(inside.iter_mut()));
    pass(ids.iter().zip(fine).zip(inside.iter_mut()).rev());
}

/// The same for the side that the cells come from.
fn pass<'a>(cells: impl Iterator<Item = ((&'a u32, &'a u8), &'a mut bool)>) {
    let mut last = None;
    for ((id, fine), inside) in cells {
        *inside &= last.is_none_or(|last| last == id);
        if *fine != 0 {
            last = Some(id);
        }
    }
}

/// A cell that may have pixels of a thing.
#[derive(Clone, Copy)]
struct Cell {
    /// The thing's number, 0 for none.
    id: u32,
    /// It is one of the thing's own; else it lies beside or above one.
    own: bool,
    /// Holes in it are inside of the thing.
    interior: bool,
    /// Disparity of the thing there, and how far from it a pixel's may be.
    surface: f32,
    tolerance: f32,
}

impl Cell {
    const NONE: Self =
        Self { id: 0, own: false, interior: false, surface: f32::NAN, tolerance: 0.0 };
}

/// Gives those pixels of two cells side by side, the left upper one of which is
/// `at`, to their things that are on their surfaces, and the holes in them.
#[inline(always)]
fn paint<S: Simd>(
    simd: S,
    pair: &[Cell; 2],
    [x, y]: [usize; 2],
    plane: &Plane,
    source: &RegionSource<'_>,
    out: &mut Candidates,
) {
    let size = source.disparity.size();
    let columns = (size.width - x).min(2 * WIDE);
    let four = |of: [f32; 2]| f32x4::from_slice(simd, &[of[0], of[0], of[1], of[1]]);
    let surface = four(pair.map(|cell| cell.surface));
    let tolerance = four(pair.map(|cell| cell.tolerance));
    for y in y..(y + HIGH).min(size.height) {
        // What does not rise above the ground is none of the thing.
        let ground = four([0, WIDE].map(|dx| plane.disparity((x + dx) as f32 + 0.5, y as f32)));
        let row = &source.disparity.row(y)[x..];
        let pixels: [f32; 2 * WIDE] = if let Some(pixels) = row.first_chunk() {
            *pixels
        } else {
            let mut pixels = [f32::NAN; 2 * WIDE];
            pixels[..columns].copy_from_slice(row);
            pixels
        };
        let d = f32x4::from_slice(simd, &pixels);
        let on = (d - surface).abs().simd_le(tolerance) & d.simd_gt(ground + GROUND_PX);
        let matched = source.roi.matched.row(y);
        let mut filled = 0;
        for (i, cell) in pair.iter().enumerate() {
            let unmatched = cell.own && matched[(x + i * WIDE).min(size.width - 1)] == 0;
            filled |= if cell.interior || unmatched { 0b11 << (i * WIDE) } else { 0 };
        }
        let bits = (on.to_bitmask() | (!d.simd_eq(d).to_bitmask() & filled)) as u32;
        let [left, right] = pair.map(|cell| cell.id);
        if left == right {
            out.mark(left, x, y, columns, bits);
        } else {
            if left != 0 {
                out.mark(left, x, y, columns.min(WIDE), bits);
            }
            if right != 0 {
                out.mark(right, x + WIDE, y, columns - WIDE, bits >> WIDE);
            }
        }
    }
}

/// Median disparity of some of the pixels of each of several cells, whose rows
/// are given, from column `from` on; NaN with too few.
#[inline(always)]
fn medians_of(rows: &[&[f32]; HIGH], from: usize, medians: &mut [f32; LANES]) {
    // Holes go to the end. Exchanges without branches: which way they go is as
    // random as the noise.
    let last = rows[0].len() - 1;
    let mut sorted = [[0.0_f32; LANES]; SAMPLES.len()];
    for (sample, (dx, dy)) in sorted.iter_mut().zip(SAMPLES) {
        for (cell, d) in sample.iter_mut().enumerate() {
            *d = rows[dy][(from + cell * WIDE + dx).min(last)];
        }
    }
    let mut n = [0_u32; LANES];
    for sample in &mut sorted {
        for (d, n) in sample.iter_mut().zip(&mut n) {
            *n += u32::from(!d.is_nan());
            *d = if d.is_nan() { f32::INFINITY } else { *d };
        }
    }
    for (i, j) in EXCHANGES {
        let (low, high) = sorted.split_at_mut(j);
        for (low, high) in low[i].iter_mut().zip(&mut high[0]) {
            (*low, *high) = (low.min(*high), low.max(*high));
        }
    }
    for (cell, median) in medians.iter_mut().enumerate() {
        let n = n[cell] as usize;
        *median = if n < LEAST_SAMPLES { f32::NAN } else { sorted[n / 2][cell] };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_belongs_to_a_thing_that_is_measured_on_both_sides() {
        // Edge, hole, thing 1, hole, thing 1, hole, thing 2, hole, what is none.
        let ids = [1, 1, 1, 1, 1, 1, 2, 2, 0];
        let fine = [0, 0, 1, 0, 1, 0, 1, 0, 1];
        let mut inside = Vec::new();
        enclose(&ids, &fine, &mut inside);
        assert_eq!(inside, [true, true, true, true, false, false, false, false, false]);
    }

    #[test]
    fn the_median_is_that_of_the_samples_that_there_are() {
        // Every pattern of holes, in each cell another order of the values.
        for holes in 0_u32..16 {
            let mut values = [[0.0_f32; LANES * WIDE]; HIGH];
            let mut kept = [(); LANES].map(|()| Vec::new());
            for (turn, kept) in kept.iter_mut().enumerate() {
                for (i, (x, y)) in SAMPLES.into_iter().enumerate() {
                    let hole = holes >> i & 1 == 1;
                    let value = ((i * 3 + turn) % 4) as f32;
                    values[y][turn * WIDE + x] = if hole { f32::NAN } else { value };
                    kept.extend((!hole).then_some(value));
                }
                kept.sort_by(f32::total_cmp);
            }
            let rows: [&[f32]; HIGH] = std::array::from_fn(|y| &values[y][..]);
            let mut found = [0.0; LANES];
            medians_of(&rows, 0, &mut found);
            for (kept, found) in kept.iter().zip(found) {
                if kept.len() < LEAST_SAMPLES {
                    assert!(found.is_nan());
                } else {
                    assert_eq!(found.to_bits(), kept[kept.len() / 2].to_bits(), "{holes:b}");
                }
            }
        }
    }
}
