//! Segments of a column of cells that are one surface above the ground.

use crate::image::Image;
use crate::stage::ground::Plane;
use crate::stage::regions::components::agree;
use crate::stage::standing::centre;

/// Height in metres (of a road scene) from which a cell is above the ground.
const LOW_M: f32 = 0.2;
/// Uncertainty of a cell's disparity in pixels; it lifts the lower limit far away.
const NOISE_PX: f32 = 0.4;
/// A segment that begins no higher than this stands on the ground, metres.
const CONTACT_M: f32 = 0.6;
/// Height up to which surfaces are joined: the crowns of trees begin there, metres.
const HIGH_M: f32 = 2.6;
/// A surface that reaches higher than a lorry is part of a building, a tree or a pole.
const TALL_M: f32 = 4.2;
/// Cells without disparity that a segment may span.
const MAX_HOLES: usize = 2;
/// Cells above a segment among which the next disparity is looked for.
const LOOK_UP: usize = 6;
/// Largest distance of a cell from its segment's mean disparity, in parts.
const SEGMENT_PART: f32 = 0.12;
/// Largest difference in disparity of a thing's foot from the thing, in parts.
const FOOT_PART: f32 = 0.08;
/// Disparity in pixels below which heights are noise.
const LEAST_DISPARITY: f32 = 1.2;

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
#[derive(Debug, Default)]
pub struct Columns {
    /// All segments.
    pub segments: Vec<Segment>,
    /// Index of the first segment of each column, and the number of all.
    pub first: Vec<u32>,
}

impl Columns {
    /// Upward through every column: cells above the ground whose disparities agree.
    pub fn find(&mut self, disparity: &Image<f32>, plane: &Plane) {
        self.segments.clear();
        self.first.clear();
        for x in 0..disparity.width() {
            self.first.push(self.segments.len() as u32);
            self.climb(x, disparity, plane);
        }
        self.first.push(self.segments.len() as u32);
        self.ground(disparity, plane);
    }

    fn climb(&mut self, x: usize, disparity: &Image<f32>, plane: &Plane) {
        let scale = super::size_scale(plane);
        let mut open: Option<Segment> = None;
        // Cells without disparity since the last one with.
        let mut holes = 0;
        // What the segment above stands on or is hidden by.
        let mut carried = true;
        for y in (0..disparity.height()).rev() {
            let d = disparity.get(x, y);
            if d.is_nan() || d <= LEAST_DISPARITY {
                holes += 1;
                continue;
            }
            let gap = holes;
            holes = 0;
            let (u, v) = centre(x, y);
            let height = plane.height(u, v, d);
            if let Some(s) = &mut open {
                let near = (d - s.disparity()).abs() <= SEGMENT_PART * s.disparity();
                if gap <= MAX_HOLES && near && agree(d, s.last) {
                    s.last = d;
                    s.reach = y as u32;
                    if height <= HIGH_M {
                        s.upper = y as u32;
                        s.cells += 1;
                        s.sum += d;
                        s.top_m = s.top_m.max(height);
                    } else if height > TALL_M {
                        s.top = Top::Tall;
                    }
                    continue;
                }
                let mut s = *s;
                if s.top != Top::Tall && gap <= LOOK_UP && !agree(d, s.last) {
                    // Nothing ends at this height by chance: a step in a wall.
                    if plane.height(u, v, s.last) > HIGH_M
                        && s.reach == s.upper
                        && s.upper == y as u32 + 1
                    {
                        s.top = Top::Tall;
                    } else if d > s.last {
                        s.top = Top::Covered;
                    }
                }
                carried = gap <= MAX_HOLES && d < s.disparity();
                self.segments.push(s);
                open = None;
            } else if gap > MAX_HOLES {
                carried = false;
            }
            let low = LOW_M * scale + NOISE_PX * plane.camera_height_m / d;
            if height < low || height > HIGH_M {
                // Directly above a cell of the ground, something stands on it.
                carried = height < low;
                continue;
            }
            open = Some(Segment {
                x: x as u32,
                upper: y as u32,
                lower: y as u32 + 1,
                reach: y as u32,
                cells: 1,
                sum: d,
                last: d,
                bottom_m: height,
                top_m: height,
                contact: carried || height <= CONTACT_M * scale,
                top: Top::Free,
            });
            // It carries one segment only.
            carried = false;
        }
        if let Some(mut s) = open {
            // At the edge of the image nobody knows how far up it goes.
            if s.top == Top::Free && holes == 0 {
                s.top = Top::Tall;
            }
            self.segments.push(s);
        }
    }

    /// Down from a segment to where the ground has its disparity: what is lower
    /// than [`LOW_M`] was no evidence of a thing, but belongs to one.
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
