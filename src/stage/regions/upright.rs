//! Regions of things that stand on the ground, from the fine disparity.

use super::RegionSource;
use super::components::{Candidates, tolerance};
use crate::image::Image;
use crate::perception::Rejections;
use crate::simd::{Level, Simd, dispatch, f32x4, prelude::*};
use crate::stage::coarse::CELL;
use crate::stage::ground::Plane;
use crate::stage::standing::{Standing, Things};

/// Places in a cell whose disparities are asked; their median is the cell's.
const SAMPLES: [(usize, usize); 8] =
    [(0, 0), (2, 0), (1, 1), (3, 1), (0, 2), (2, 2), (1, 3), (3, 3)];
/// Batcher's odd-even merge sort of as many (Batcher 1968).
const EXCHANGES: [(usize, usize); 19] = [
    (0, 1),
    (2, 3),
    (4, 5),
    (6, 7),
    (0, 2),
    (1, 3),
    (4, 6),
    (5, 7),
    (1, 2),
    (5, 6),
    (0, 4),
    (1, 5),
    (2, 6),
    (3, 7),
    (2, 4),
    (3, 5),
    (1, 2),
    (3, 4),
    (5, 6),
];
/// Samples with disparity that a cell needs.
const LEAST_SAMPLES: usize = 3;
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
        let least_cells = (min_area / (CELL * CELL)).max(1) as u32;
        self.standing.run(&self.cells, plane, source.rig, least_cells, &mut self.things);
        let count = self.choose(&source.roi.salient);
        self.paint(plane, source, count, out);
        rejections.floating = self.things.floating;
        rejections.background = self.things.background;
        rejections.not_salient = (self.things.list.len() - count) as u32;
    }

    /// The median disparity of each cell inside the region of interest.
    fn shrink(&mut self, source: &RegionSource<'_>) {
        let size = source.disparity.size();
        self.cells.resize(size.divided_by(CELL));
        let offset = source.rig.disparity_offset() as f32;
        for cy in 0..self.cells.height() {
            // Rows of the cell inside the image, and whether any is matched.
            let rows: [usize; CELL] = std::array::from_fn(|i| (cy * CELL + i).min(size.height - 1));
            let matched = [rows[0], rows[CELL - 1]].map(|y| source.roi.matched.row(y));
            let disparity = rows.map(|y| source.disparity.row(y));
            let coarse = source.coarse.checked.row(cy);
            let cells = self.cells.row_mut(cy).chunks_mut(LANES);
            for ((cells, coarse), first) in
                cells.zip(coarse.chunks(LANES)).zip((0..).step_by(LANES))
            {
                let any = |cell: usize| {
                    let from = (first + cell) * CELL;
                    let last = (from + CELL - 1).min(size.width - 1);
                    matched.iter().any(|row| row[from] != 0 || row[last] != 0)
                };
                let fine: [bool; LANES] =
                    std::array::from_fn(|cell| cell < cells.len() && any(cell));
                let mut medians = [f32::NAN; LANES];
                if fine.contains(&true) {
                    dispatch!(self.level, _simd => {
                        medians_of(&disparity, first * CELL, &mut medians);
                    });
                }
                for (((out, coarse), median), fine) in
                    cells.iter_mut().zip(coarse).zip(medians).zip(fine)
                {
                    // What was not matched finely is known coarsely.
                    *out = if fine && !median.is_nan() { median } else { coarse - offset };
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
            let pixels = salient.row((cy * CELL + CELL / 2).min(salient.height() - 1));
            for (cx, &id) in self.things.ids.row(cy).iter().enumerate() {
                if id != 0 {
                    let at = (cx * CELL + CELL / 2).min(pixels.len() - 1);
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
            for cx in 0..row.len() {
                let left = if cx > 0 { row[cx - 1] } else { 0 };
                let right = row.get(cx + 1).copied().unwrap_or(0);
                let low = below.get(cx).copied().unwrap_or(0);
                let (id, surface) = match (row[cx], left, right, low) {
                    (0, 0, 0, 0) => continue,
                    (0, 0, 0, id) => (id, surface.get(cx, cy + 1)),
                    (0, 0, id, _) => (id, surfaces[cx + 1]),
                    (0, id, _, _) => (id, surfaces[cx - 1]),
                    (own, ..) => (own, surfaces[cx]),
                };
                let own = row[cx] != 0;
                // What only one camera sees at the sides of a thing belongs to
                // what is behind it.
                let interior =
                    own && (cx == 0 || left == id) && (cx + 1 == row.len() || right == id);
                let tolerance =
                    if own { (SURFACE_PART * surface).max(SURFACE_PX) } else { tolerance(surface) };
                let cell =
                    Cell { x: cx * CELL, y: cy * CELL, id, own, interior, surface, tolerance };
                dispatch!(self.level, simd => cell.paint(simd, plane, source, out));
            }
        }
    }
}

/// A cell that may have pixels of a thing.
struct Cell {
    /// Its left upper pixel.
    x: usize,
    y: usize,
    /// The thing's number.
    id: u32,
    /// It is one of the thing's own; else it lies beside or above one.
    own: bool,
    /// So are its neighbours to the left and to the right.
    interior: bool,
    /// Disparity of the thing there, and how far from it a pixel's may be.
    surface: f32,
    tolerance: f32,
}

impl Cell {
    /// Gives those pixels to the thing that are on its surface, and the holes in it.
    #[inline(always)]
    fn paint<S: Simd>(
        &self,
        simd: S,
        plane: &Plane,
        source: &RegionSource<'_>,
        out: &mut Candidates,
    ) {
        let size = source.disparity.size();
        let columns = (size.width - self.x).min(CELL);
        for y in self.y..(self.y + CELL).min(size.height) {
            // What does not rise above the ground is none of the thing.
            let ground = plane.disparity(self.x as f32 + 1.5, y as f32) + GROUND_PX;
            let unmatched = self.own && source.roi.matched.row(y)[self.x] == 0;
            let row = &source.disparity.row(y)[self.x..];
            let pixels: [f32; CELL] = if let Some(pixels) = row.first_chunk() {
                *pixels
            } else {
                let mut pixels = [f32::NAN; CELL];
                pixels[..columns].copy_from_slice(row);
                pixels
            };
            let d = f32x4::from_slice(simd, &pixels);
            let on = (d - self.surface).abs().simd_le(self.tolerance) & d.simd_gt(ground);
            let holes = if self.interior || unmatched { !d.simd_eq(d).to_bitmask() } else { 0 };
            out.mark(self.id, self.x, y, columns, (on.to_bitmask() | holes) as u32);
        }
    }
}

/// Median disparity of some of the pixels of each of several cells, whose rows
/// are given, from column `from` on; NaN with too few.
#[inline(always)]
fn medians_of(rows: &[&[f32]; CELL], from: usize, medians: &mut [f32; LANES]) {
    // Holes go to the end. Exchanges without branches: which way they go is as
    // random as the noise.
    let last = rows[0].len() - 1;
    let mut sorted = [[0.0_f32; LANES]; SAMPLES.len()];
    for (sample, (dx, dy)) in sorted.iter_mut().zip(SAMPLES) {
        for (cell, d) in sample.iter_mut().enumerate() {
            *d = rows[dy][(from + cell * CELL + dx).min(last)];
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
    fn the_median_is_that_of_the_samples_that_there_are() {
        // Every pattern of holes, in each cell another order of the values.
        for holes in 0_u32..256 {
            let mut values = [[0.0_f32; LANES * CELL]; CELL];
            let mut kept = [(); LANES].map(|()| Vec::new());
            for (turn, kept) in kept.iter_mut().enumerate() {
                for (i, (x, y)) in SAMPLES.into_iter().enumerate() {
                    let hole = holes >> i & 1 == 1;
                    let value = ((i * 5 + turn * 3) % 8) as f32;
                    values[y][turn * CELL + x] = if hole { f32::NAN } else { value };
                    kept.extend((!hole).then_some(value));
                }
                kept.sort_by(f32::total_cmp);
            }
            let rows: [&[f32]; CELL] = std::array::from_fn(|y| &values[y][..]);
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
