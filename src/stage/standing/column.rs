//! Segments of a column of cells that are one surface above the ground.

use super::centre;
use super::climb::{LANES, climb};
use crate::image::Image;
use crate::simd::{Level, dispatch};
use crate::stage::ground::Plane;

/// Cells without disparity that a segment may span.
pub const MAX_HOLES: f32 = 2.0;
/// Largest difference in disparity of a thing's foot from the thing, in parts.
const FOOT_PART: f32 = 0.08;

/// What is above the upper end of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Top {
    /// Something farther away, the sky, or nothing that was measured.
    Free,
    /// Something nearer, that hides how far up the surface goes.
    Covered,
    /// The surface goes on above [`TALL_M`](super::climb::TALL_M).
    Tall,
}

/// Cells of one column that are one surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Column.
    pub x: u32,
    /// Upper row, inclusive.
    pub upper: u32,
    /// Lower row, exclusive.
    pub lower: u32,
    /// Row up to which the same surface goes on, inclusive.
    pub reach: u32,
    /// Cells with disparity.
    pub cells: u32,
    /// Sum of their disparities.
    pub sum: f32,
    /// Height of the lowest one above the ground, metres.
    pub bottom_m: f32,
    /// Height of the highest one, metres.
    pub top_m: f32,
    /// Stands on the ground, or is hidden below by what does.
    pub contact: bool,
    /// What is above.
    pub top: Top,
}

impl Segment {
    /// Mean disparity, pixels.
    pub fn disparity(&self) -> f32 {
        self.sum / self.cells as f32
    }
}

/// The segments of every column, from left to right, in a column upward.
#[derive(Debug)]
pub struct Columns {
    level: Level,
    /// Those of some columns, from the lowest upward.
    found: Vec<Segment>,
    /// All segments.
    pub segments: Vec<Segment>,
    /// Index of the first segment of each column, and the number of all.
    pub first: Vec<u32>,
}

impl Columns {
    /// The finder with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self { level, found: Vec::new(), segments: Vec::new(), first: Vec::new() }
    }

    /// Upward through every column: cells above the ground whose disparities agree.
    pub fn find(&mut self, disparity: &Image<f32>, plane: &Plane) {
        self.segments.clear();
        self.first.clear();
        for x in (0..disparity.width()).step_by(LANES) {
            self.found.clear();
            dispatch!(self.level, simd => climb(simd, x, disparity, plane, &mut self.found));
            for s in self.found.iter_mut().filter(|s| s.contact) {
                ground(s, disparity, plane);
            }
            self.sort(x, LANES.min(disparity.width() - x));
        }
        self.first.push(self.segments.len() as u32);
    }

    /// Takes those that were found in `columns` from `x` on, column by column.
    fn sort(&mut self, x: usize, columns: usize) {
        let mut next = [0; LANES];
        for s in &self.found {
            next[s.x as usize - x] += 1;
        }
        let mut so_far = self.segments.len();
        for next in &mut next[..columns] {
            self.first.push(so_far as u32);
            so_far += std::mem::replace(next, so_far);
        }
        self.segments.extend_from_slice(&self.found);
        for s in &self.found {
            let next = &mut next[s.x as usize - x];
            self.segments[*next] = *s;
            *next += 1;
        }
    }
}

/// Down from a segment to where the ground has its disparity: what is lower
/// than [`LOW_M`](super::climb::LOW_M) was no evidence of a thing, but belongs to one.
fn ground(s: &mut Segment, disparity: &Image<f32>, plane: &Plane) {
    let mean = s.disparity();
    for y in s.lower as usize..disparity.height() {
        let (u, v) = centre(s.x as usize, y);
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
