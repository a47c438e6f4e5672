//! Regions of things that stand on the ground, from the fine disparity.

use super::RegionSource;
use super::components::{Candidates, tolerance};
use crate::image::Image;
use crate::perception::Rejections;
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

/// The former of such regions, with its buffers.
#[derive(Debug, Default)]
pub struct Upright {
    standing: Standing,
    things: Things,
    cells: Image<f32>,
    salient: Vec<u32>,
    number: Vec<u32>,
}

impl Upright {
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
            // Rows and columns of the cell inside the image, and whether any is matched.
            let rows: [usize; CELL] = std::array::from_fn(|i| (cy * CELL + i).min(size.height - 1));
            let matched = [rows[0], rows[CELL - 1]].map(|y| source.roi.matched.row(y));
            let disparity = rows.map(|y| source.disparity.row(y));
            let coarse = source.coarse.checked.row(cy);
            for (cx, out) in self.cells.row_mut(cy).iter_mut().enumerate() {
                let from = cx * CELL;
                let last = (from + CELL - 1).min(size.width - 1);
                let any = matched.iter().any(|row| row[from] != 0 || row[last] != 0);
                // What was not matched finely is known coarsely.
                *out = if any { median(&disparity, from, last) } else { f32::NAN };
                if out.is_nan() {
                    *out = coarse[cx] - offset;
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
                let columns = cx * CELL..(cx * CELL + CELL).min(size.width);
                for y in cy * CELL..(cy * CELL + CELL).min(size.height) {
                    // What does not rise above the ground is none of the thing.
                    let ground = plane.disparity(columns.start as f32 + 1.5, y as f32) + GROUND_PX;
                    let unmatched = own && source.roi.matched.row(y)[columns.start] == 0;
                    let fill = interior || unmatched;
                    let d = &source.disparity.row(y)[columns.clone()];
                    let inside = |d: f32| {
                        (d.is_nan() && fill) || ((d - surface).abs() <= tolerance && d > ground)
                    };
                    out.mark(id, columns.start, y, d.iter().map(|&d| inside(d)));
                }
            }
        }
    }
}

/// Median disparity of some of the pixels of a cell, whose rows are given, from
/// column `from` to column `last`; NaN with too few.
fn median(rows: &[&[f32]; CELL], from: usize, last: usize) -> f32 {
    // Holes go to the end. Exchanges without branches: which way they go is as
    // random as the noise.
    let mut n = 0;
    let mut sorted = SAMPLES.map(|(dx, dy)| {
        let d = rows[dy][(from + dx).min(last)];
        n += usize::from(!d.is_nan());
        if d.is_nan() { f32::INFINITY } else { d }
    });
    for (i, j) in EXCHANGES {
        let (low, high) = (sorted[i].min(sorted[j]), sorted[i].max(sorted[j]));
        (sorted[i], sorted[j]) = (low, high);
    }
    if n < LEAST_SAMPLES { f32::NAN } else { sorted[n / 2] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_that_of_the_samples_that_there_are() {
        // Every pattern of holes, in several orders of the values.
        for holes in 0_u32..256 {
            for turn in 0..8 {
                let mut values = [[0.0_f32; CELL]; CELL];
                let mut kept = Vec::new();
                for (i, (x, y)) in SAMPLES.into_iter().enumerate() {
                    let hole = holes >> i & 1 == 1;
                    let value = ((i * 5 + turn * 3) % 8) as f32;
                    values[y][x] = if hole { f32::NAN } else { value };
                    kept.extend((!hole).then_some(value));
                }
                kept.sort_by(f32::total_cmp);
                let rows: [&[f32]; CELL] = std::array::from_fn(|y| &values[y][..]);
                let found = median(&rows, 0, CELL - 1);
                if kept.len() < LEAST_SAMPLES {
                    assert!(found.is_nan());
                } else {
                    assert_eq!(found.to_bits(), kept[kept.len() / 2].to_bits(), "{holes:b} {turn}");
                }
            }
        }
    }
}
