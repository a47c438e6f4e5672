//! Segments of a column of cells that are one surface above the ground.

use super::kinds::{Bits, HIGH_M, Kinds};
use super::{HIGH, centre};
use crate::image::Image;
use crate::simd::Level;
use crate::stage::ground::Plane;
use crate::stage::regions::components::agree;
use crate::stage::roi::bits::{first_set, is_set, last_set};

/// A segment that begins no higher than this stands on the ground, metres.
const CONTACT_M: f32 = 0.6;
/// A surface that reaches higher than a lorry is part of a building, a tree or a pole.
pub const TALL_M: f32 = 4.2;
/// Cells without disparity that a segment may span.
const MAX_HOLES: usize = 2;
/// Cells of a segment, at least: what is shorter is a mixture of two surfaces at
/// an edge as a rule, or noise. Of streets half of all segments are.
const LEAST_CELLS: u32 = 3;
/// Metres from which so many cells are enough: what is far away is no higher than
/// that, and what two surfaces mix to at an edge is lower.
const FEW_CELLS: u32 = 2;
const FEW_M: f32 = 0.6;
/// Cells above a segment among which the next disparity is looked for.
const LOOK_UP: usize = 6;
/// Largest distance of a cell from its segment's mean disparity, in parts: the bonnet
/// of a car and what is parked a metre before it are two.
const SEGMENT_PART: f32 = 0.1;
/// Largest difference in disparity of a thing's foot from the thing, in parts.
const FOOT_PART: f32 = 0.08;

/// What is above the upper end of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Top {
    /// Something farther away, the sky, or nothing that was measured.
    Free,
    /// Something nearer, that hides how far up the surface goes.
    Covered,
    /// The surface goes on above [`TALL_M`].
    Tall,
}

/// Cells of one column that are one surface.
#[derive(Clone, Copy, Debug)]
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
    /// Disparity of the highest one.
    last: f32,
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
    kinds: Kinds,
    /// All segments.
    pub segments: Vec<Segment>,
    /// Index of the first segment of each column, and the number of all.
    pub first: Vec<u32>,
}

impl Columns {
    /// The finder with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self { level, kinds: Kinds::default(), segments: Vec::new(), first: Vec::new() }
    }

    /// Upward through every column: cells above the ground whose disparities agree.
    pub fn find(&mut self, disparity: &Image<f32>, plane: &Plane) {
        self.segments.clear();
        self.first.clear();
        self.kinds.find(self.level, disparity, plane);
        let contact_m = CONTACT_M * super::size_scale(plane);
        for x in 0..disparity.width() {
            self.first.push(self.segments.len() as u32);
            let column = Column::new(x, disparity, plane, &self.kinds);
            column.climb(contact_m, &mut self.segments);
        }
        self.first.push(self.segments.len() as u32);
        self.ground(disparity, plane);
    }

    /// Down from a segment to where the ground has its disparity: what is lower
    /// than [`super::kinds::LOW_M`] was no evidence of a thing, but belongs to one.
    fn ground(&mut self, disparity: &Image<f32>, plane: &Plane) {
        for s in self.segments.iter_mut().filter(|s| s.contact) {
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
    }
}

/// One column of cells.
struct Column<'a> {
    x: usize,
    disparity: &'a Image<f32>,
    heights: &'a Image<f32>,
    plane: &'a Plane,
    bits: Bits<'a>,
}

impl<'a> Column<'a> {
    fn new(x: usize, disparity: &'a Image<f32>, plane: &'a Plane, kinds: &'a Kinds) -> Self {
        Self { x, disparity, heights: &kinds.heights, plane, bits: kinds.column(x) }
    }

    fn climb(&self, contact_m: f32, out: &mut Vec<Segment>) {
        let height = self.disparity.height();
        let mut next = last_set(self.bits.evidence, height);
        while let Some(mut y) = next {
            // Directly above a cell of the ground, something stands on it.
            let below = first_set(self.bits.known, y + 1);
            let gap = below.unwrap_or(height) - y - 1;
            let ground = below.is_none_or(|below| is_set(self.bits.ground, below));
            let mut carried = gap <= MAX_HOLES && ground;
            next = loop {
                let mut s = self.start(y, contact_m, carried);
                let end = self.grow(&mut s);
                if self.is_long(&s) {
                    out.push(s);
                }
                let Some((above, gap)) = end else { break None };
                if !is_set(self.bits.evidence, above) {
                    break last_set(self.bits.evidence, above);
                }
                // What is farther away stands on this one or is hidden by it.
                carried = gap <= MAX_HOLES && self.disparity.get(self.x, above) < s.disparity();
                y = above;
            };
        }
    }

    /// Whether a segment is more than noise.
    fn is_long(&self, s: &Segment) -> bool {
        // A plate on a post may hang where only a part of it is low enough.
        let whole = s.cells + s.upper - s.reach;
        let row_m = self.plane.a * self.plane.camera_height_m / s.disparity();
        s.cells >= LEAST_CELLS
            || (s.top != Top::Tall && whole >= LEAST_CELLS)
            || (s.contact
                && s.cells >= FEW_CELLS
                && (FEW_CELLS as usize * HIGH) as f32 * row_m >= FEW_M)
    }

    /// A segment of one cell.
    fn start(&self, y: usize, contact_m: f32, carried: bool) -> Segment {
        let (d, height) = (self.disparity.get(self.x, y), self.heights.get(self.x, y));
        Segment {
            x: self.x as u32,
            upper: y as u32,
            lower: y as u32 + 1,
            reach: y as u32,
            cells: 1,
            sum: d,
            last: d,
            bottom_m: height,
            top_m: height,
            contact: carried || height <= contact_m,
            top: Top::Free,
        }
    }

    /// Upward from a segment's first cell as far as the surface goes. What is
    /// above: a cell with disparity, and the number of those without between.
    fn grow(&self, s: &mut Segment) -> Option<(usize, usize)> {
        let (mut y, mut mean) = (s.upper as usize, s.disparity());
        while let Some(above) = last_set(self.bits.known, y) {
            let gap = y - above - 1;
            let d = self.disparity.get(self.x, above);
            let near = (d - mean).abs() <= SEGMENT_PART * mean;
            if !(gap <= MAX_HOLES && near && agree(d, s.last)) {
                self.end(s, above, gap);
                return Some((above, gap));
            }
            let height = self.heights.get(self.x, above);
            s.last = d;
            s.reach = above as u32;
            if height <= HIGH_M {
                s.upper = above as u32;
                s.cells += 1;
                s.sum += d;
                s.top_m = s.top_m.max(height);
                mean = s.disparity();
            } else if height > TALL_M {
                s.top = Top::Tall;
            }
            y = above;
        }
        // At the edge of the image nobody knows how far up it goes.
        if s.top == Top::Free && y == 0 {
            s.top = Top::Tall;
        }
        None
    }

    /// What the cell `above`, which is of something else, tells about a segment's top.
    fn end(&self, s: &mut Segment, above: usize, gap: usize) {
        let d = self.disparity.get(self.x, above);
        if s.top != Top::Tall && gap <= LOOK_UP && !agree(d, s.last) {
            let (u, v) = centre(self.x, above);
            // Nothing ends at this height by chance: a step in a wall.
            if self.plane.height(u, v, s.last) > HIGH_M
                && s.reach == s.upper
                && s.upper == above as u32 + 1
            {
                s.top = Top::Tall;
            } else if d > s.last {
                s.top = Top::Covered;
            }
        }
    }
}
