//! Regions of things that stand on the ground, from the fine disparity.

use super::RegionSource;
use super::components::{Candidates, agree};
use crate::image::Image;
use crate::stage::coarse::CELL;
use crate::stage::ground::Plane;
use crate::stage::standing::{Standing, Things};

/// Places in a cell whose disparities are asked; their median is the cell's.
const SAMPLES: [(usize, usize); 8] =
    [(0, 0), (2, 0), (1, 1), (3, 1), (0, 2), (2, 2), (1, 3), (3, 3)];
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
    /// Candidates for regions on `plane`; returns how many things of at least
    /// `min_area` pixels do not reach the ground.
    pub fn run(
        &mut self,
        plane: &Plane,
        source: &RegionSource<'_>,
        min_area: usize,
        out: &mut Candidates,
    ) -> u32 {
        self.shrink(source);
        let least_cells = (min_area / (CELL * CELL)).max(1) as u32;
        self.standing.run(&self.cells, plane, source.rig, least_cells, &mut self.things);
        let count = self.choose(&source.roi.salient);
        self.paint(plane, source, out);
        out.measure_boxes(count);
        self.things.floating
    }

    /// The median disparity of each cell inside the region of interest.
    fn shrink(&mut self, source: &RegionSource<'_>) {
        let size = source.disparity.size();
        self.cells.resize(size.divided_by(CELL));
        let offset = source.rig.disparity_offset() as f32;
        for cy in 0..self.cells.height() {
            for cx in 0..self.cells.width() {
                let (x0, y0) = (cx * CELL, cy * CELL);
                let mut sorted = [f32::INFINITY; SAMPLES.len()];
                let mut n = 0;
                for (dx, dy) in SAMPLES {
                    let (x, y) = (x0 + dx, y0 + dy);
                    if x >= size.width || y >= size.height {
                        continue;
                    }
                    let d = source.disparity.get(x, y);
                    if d.is_nan() {
                        continue;
                    }
                    let mut at = n;
                    while at > 0 && sorted[at - 1] > d {
                        sorted[at] = sorted[at - 1];
                        at -= 1;
                    }
                    sorted[at] = d;
                    n += 1;
                }
                // What was not matched finely is known coarsely.
                let coarse = || source.coarse.checked.get(cx, cy) - offset;
                let median = if n < LEAST_SAMPLES { coarse() } else { sorted[n / 2] };
                self.cells.set(cx, cy, median);
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
        count as usize
    }

    /// From cells to pixels: those of a thing's cells that do not contradict
    /// its surface, and those of the cells beside and above that agree with it.
    fn paint(&mut self, plane: &Plane, source: &RegionSource<'_>, out: &mut Candidates) {
        let disparity = source.disparity;
        let size = disparity.size();
        out.ids.resize(size);
        out.ids.fill(0);
        let (ids, surface) = (&self.things.ids, &self.things.surface);
        let number = |cx: usize, cy: usize| match ids.get(cx, cy) {
            0 => 0,
            id => self.number[id as usize - 1],
        };
        for cy in 0..ids.height() {
            for cx in 0..ids.width() {
                let own = number(cx, cy);
                let interior = (cx == 0 || number(cx - 1, cy) == own)
                    && (cx + 1 == ids.width() || number(cx + 1, cy) == own);
                let (id, surface) = if own != 0 {
                    (own, surface.get(cx, cy))
                } else {
                    let left = if cx > 0 { number(cx - 1, cy) } else { 0 };
                    let right = if cx + 1 < ids.width() { number(cx + 1, cy) } else { 0 };
                    let below = if cy + 1 < ids.height() { number(cx, cy + 1) } else { 0 };
                    match (left, right, below) {
                        (0, 0, 0) => continue,
                        (0, 0, id) => (id, surface.get(cx, cy + 1)),
                        (0, id, _) => (id, surface.get(cx + 1, cy)),
                        (id, _, _) => (id, surface.get(cx - 1, cy)),
                    }
                };
                for y in cy * CELL..(cy * CELL + CELL).min(size.height) {
                    let columns = cx * CELL..(cx * CELL + CELL).min(size.width);
                    // What does not rise above the ground is none of the thing.
                    let ground = plane.disparity((cx * CELL) as f32 + 1.5, y as f32) + GROUND_PX;
                    let d = &disparity.row(y)[columns.clone()];
                    let unmatched = source.roi.matched.row(y)[columns.start] == 0;
                    for (out, &d) in out.ids.row_mut(y)[columns].iter_mut().zip(d) {
                        let inside = if own == 0 {
                            agree(d, surface) && d > ground
                        } else {
                            // NaN does not contradict.
                            d.is_nan() && (interior || unmatched)
                                || ((d - surface).abs() <= (SURFACE_PART * surface).max(SURFACE_PX)
                                    && d > ground)
                        };
                        if inside {
                            *out = id;
                        }
                    }
                }
            }
        }
    }
}
