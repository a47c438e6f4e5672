//! What a thing that stands is like, and whether it is one.

use super::WIDE;
use super::column::{Segment, Top};
use super::join::View;

/// Share of its columns from which a thing that goes on upward is part of a
/// building, if it is wider than a trunk or a pole, metres.
const MOST_TALL: f32 = 0.45;
const TRUNK_M: f32 = 1.7;
/// A thing reaches at least this height, metres (of a road scene).
const LEAST_TOP_M: f32 = 0.35;
/// and this part of its length: a bank of earth or a kerb is lower.
const LEAST_RISE: f32 = 0.1;
/// Share of a thing's columns that must reach the ground.
const LEAST_CONTACT: f32 = 0.2;
/// Share of a thing's sides that must be free of anything nearer.
const LEAST_FREE: f32 = 0.3;

/// A thing beside which nothing differs is none, where what is so many metres (of a
/// road scene) behind it would differ.
const BESIDE_M: f32 = 2.0;

/// Width in metres from which what does not reach the ground may be a plate on a post
/// too thin to be seen: a traffic sign, which is as large on every road. It is no
/// wider than a trunk or a pole may be.
const PLATE_M: f32 = 0.3;
/// Share of its sides, of so many cells at least, behind which it is farther away: of a
/// patch of wall, around which little was measured, fewer are known.
const PLATE_FREE: f32 = 0.8;
const PLATE_SIDES: u32 = 5;

/// One thing on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    pub(super) free: u32,
    pub(super) hidden: u32,
    /// As narrow as a trunk or a pole.
    pub(super) narrow: bool,
    /// Held up by a post that is not seen.
    pub(super) plate: bool,
}

impl Thing {
    /// One without segments.
    pub(super) const EMPTY: Self = Self {
        cells: 0,
        above: 0,
        lateral_m: [f32::INFINITY, f32::NEG_INFINITY],
        top_m: 0.0,
        depth_m: [f32::INFINITY, f32::NEG_INFINITY],
        columns: 0,
        contacts: 0,
        tall: 0,
        covered: 0,
        free: 0,
        hidden: 0,
        narrow: false,
        plate: false,
    };

    /// Takes a segment in.
    pub(super) fn add(&mut self, s: &Segment, view: &View) {
        let z = view.depth_scale / s.disparity();
        let left = (s.x as f32 * WIDE as f32 - 0.5 - view.cx) * z / view.focal;
        self.cells += s.cells;
        self.above += if s.top == Top::Tall { 0 } else { s.upper.saturating_sub(s.reach) };
        self.columns += 1;
        self.contacts += u32::from(s.contact);
        self.tall += u32::from(s.top == Top::Tall);
        self.covered += u32::from(s.top == Top::Covered);
        self.lateral_m[0] = self.lateral_m[0].min(left);
        self.lateral_m[1] = self.lateral_m[1].max(left + WIDE as f32 * z / view.focal);
        self.top_m = self.top_m.max(s.top_m);
        self.depth_m = [self.depth_m[0].min(z), self.depth_m[1].max(z)];
    }

    /// Left to right and near to far, metres.
    fn size_m(&self) -> [f32; 2] {
        [self.lateral_m, self.depth_m].map(|[from, to]| to - from)
    }

    fn share(&self, columns: u32) -> f32 {
        columns as f32 / self.columns as f32
    }

    pub(super) fn is_large(&self, scale: f32, least_cells: u32) -> bool {
        let low = (LEAST_TOP_M * scale).max(LEAST_RISE * self.size_m()[0]);
        let above = if self.stands() { 0 } else { self.above };
        self.cells + above >= least_cells && self.top_m >= low
    }

    pub(super) fn stands(&self) -> bool {
        self.share(self.contacts) >= LEAST_CONTACT
    }

    pub(super) fn is_narrow(&self) -> bool {
        let [width, depth] = self.size_m();
        width.max(depth) <= TRUNK_M
    }

    fn goes_on(&self) -> bool {
        self.share(self.tall + self.covered) > MOST_TALL
    }

    pub(super) fn is_building(&self) -> bool {
        !self.is_narrow() && self.goes_on()
    }

    pub(super) fn is_plate(&self) -> bool {
        let sides = self.free + self.hidden;
        let apart = sides >= PLATE_SIDES && self.free as f32 >= PLATE_FREE * sides as f32;
        let wide = self.size_m()[0] >= PLATE_M;
        !self.stands() && self.is_narrow() && wide && !self.goes_on() && apart
    }

    pub(super) fn is_behind(&self, view: &View) -> bool {
        let sides = self.free + self.hidden;
        if sides == 0 {
            // Far away what is beside a thing need not differ enough to tell.
            return self.goes_on() || self.depth_m[0] < view.distance_of_step(BESIDE_M);
        }
        (self.free as f32) < LEAST_FREE * sides as f32
    }
}
