//! From cells to pixels: the things' own outlines.

use crate::simd::{Level, Simd, dispatch, f32x16, mask32x16, padded, prelude::*, u8x16, u32x16};
use crate::stage::ground::Plane;
use crate::stage::regions::RegionSource;
use crate::stage::regions::candidates::{Candidates, PixelBox};
use crate::stage::regions::components::tolerance;
use crate::stage::regions::runs::{Spans, edge_words, find_edges};
use crate::stage::regions::upright::fill::fill;
use crate::stage::roi::bits::{BitMask, bits_from, first_set, last_set};
use crate::stage::standing::{HIGH, Things, WIDE};

/// Largest difference of a pixel from its surface in parts of the disparity.
const SURFACE_PART: f32 = 0.1;
const SURFACE_PX: f32 = 0.7;
/// By how much a disparity of a thing exceeds the ground's: pixels, and parts of its
/// surface's. Around the foot of a thing the matcher carries its disparity on over the
/// bare ground.
const GROUND_PX: f32 = 0.3;
const GROUND_PART: f32 = 0.02;

/// Pixels of a row that are painted at once.
const LANES: usize = 16;

/// The bits of the left pixels of cells, and of the pixels of the first.
const LEFT: u64 = 0x5555;
const CELL_BITS: u64 = (1 << WIDE) - 1;

// A group is made of whole cells of two pixels.
const _: () = assert!(WIDE == 2 && LANES == 16);

/// What holes in a cell are, if what is beside them does not tell: none of the thing, of the
/// thing where nothing was matched. Or they are of the thing whatever is beside them.
const OUTSIDE: u8 = 0;
const OWN: u8 = 1;
const INSIDE: u8 = 2;

/// The painter with its buffers: one row of cells, and what each of its pixels
/// must agree with.
#[derive(Debug)]
pub struct Painter {
    level: Level,
    /// The row's own ids and surfaces, with an empty cell on either side.
    own: Vec<u32>,
    own_surface: Vec<f32>,
    /// What stands for the row below the last one.
    nothing: Vec<u32>,
    /// Whose pixels a cell may have, where the surface is and how far from it
    /// a pixel may be.
    ids: Vec<u32>,
    surface: Vec<f32>,
    tolerance: Vec<f32>,
    /// Where the row's ids change.
    edges: Vec<u64>,
    /// Per pixel of a row the same, what a hole is, and the ground's change along it.
    surfaces: Vec<f32>,
    tolerances: Vec<f32>,
    holes: Vec<u8>,
    slopes: Vec<f32>,
}

impl Painter {
    /// The painter with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            own: Vec::new(),
            own_surface: Vec::new(),
            nothing: Vec::new(),
            ids: Vec::new(),
            surface: Vec::new(),
            tolerance: Vec::new(),
            edges: Vec::new(),
            surfaces: Vec::new(),
            tolerances: Vec::new(),
            holes: Vec::new(),
            slopes: Vec::new(),
        }
    }

    /// Fills `out` with `count` candidates from as many `things`: those pixels
    /// of a thing's cells that do not contradict its surface, and those of the
    /// cells beside and above that agree with it, small holes filled ([`fill`]). Bits of
    /// `fine` are cells whose disparity was measured finely.
    pub fn run(
        &mut self,
        plane: &Plane,
        source: &RegionSource<'_>,
        (things, fine): (&Things, &BitMask),
        count: usize,
        out: &mut Candidates,
    ) {
        out.clear(source.disparity.size(), count);
        self.fit(things.ids.width(), plane);
        let mut used = false;
        for cy in 0..things.ids.height() {
            let row = things.ids.row(cy);
            let next = cy + 1;
            let below = if next < things.ids.height() { things.ids.row(next) } else { &[] };
            let own = std::mem::replace(&mut used, below.iter().fold(0, |any, id| any | id) != 0);
            // The first row has not been looked at.
            if cy > 0 && !own && !used {
                continue;
            }
            self.own[1..=row.len()].copy_from_slice(row);
            self.own_surface[1..=row.len()].copy_from_slice(things.surface.row(cy));
            self.holes.fill(OUTSIDE);
            let surfaces = things.surface.row(if below.is_empty() { cy } else { next });
            dispatch!(self.level, simd => {
                find_edges(simd, row, &mut self.edges);
                enclose(row, Spans::new(&self.edges), fine.row(cy), &mut self.holes);
                self.prepare(below, surfaces);
                find_edges(simd, &self.ids, &mut self.edges);
                self.paint(simd, plane, source, cy, out);
            });
        }
    }

    /// Buffers for rows of `width` cells.
    fn fit(&mut self, width: usize, plane: &Plane) {
        for buffer in [&mut self.own, &mut self.nothing] {
            buffer.clear();
            buffer.resize(width + 2, 0);
        }
        self.own_surface.resize(width + 2, 0.0);
        self.ids.resize(width, 0);
        self.edges.resize(edge_words(width), 0);
        self.surface.resize(width, 0.0);
        self.tolerance.resize(width, 0.0);
        // Whole groups from any pixel on.
        let pixels = width * WIDE + LANES;
        self.holes.resize(pixels, OUTSIDE);
        for buffer in [&mut self.surfaces, &mut self.tolerances, &mut self.slopes] {
            buffer.resize(pixels, 0.0);
        }
        for (x, slopes) in self.slopes.chunks_exact_mut(WIDE).enumerate() {
            slopes.fill(plane.b * ((x * WIDE) as f32 + 0.5));
        }
    }

    /// Whose each cell of the row is: its own thing's, else that of the cell to
    /// the left, to the right or below.
    #[inline(always)]
    fn prepare(&mut self, below: &[u32], below_surface: &[f32]) {
        let width = self.ids.len();
        let low = if below.is_empty() { &self.nothing[..width] } else { &below[..width] };
        let (own, left, right) = (&self.own[1..=width], &self.own[..width], &self.own[2..]);
        let surfaces = &self.own_surface;
        let (own_at, left_at, right_at) =
            (&surfaces[1..=width], &surfaces[..width], &surfaces[2..]);
        let (right, right_at, low_at) =
            (&right[..width], &right_at[..width], &below_surface[..width]);
        let ids = &mut self.ids[..width];
        let (surface, limit) = (&mut self.surface[..width], &mut self.tolerance[..width]);
        for x in 0..width {
            let (o, l, r) = (own[x], left[x], right[x]);
            let (at, at_left, at_right) = (own_at[x], left_at[x], right_at[x]);
            let (id, d) = (low[x], low_at[x]);
            let (id, d) = if r == 0 { (id, d) } else { (r, at_right) };
            let (id, d) = if l == 0 { (id, d) } else { (l, at_left) };
            let (id, d) = if o == 0 { (id, d) } else { (o, at) };
            ids[x] = id;
            surface[x] = d;
            limit[x] = if o == 0 { tolerance(d) } else { (SURFACE_PART * d).max(SURFACE_PX) };
        }
        let spread = [(&self.surface, &mut self.surfaces), (&self.tolerance, &mut self.tolerances)];
        for (cells, pixels) in spread {
            let pixels = pixels.as_chunks_mut::<WIDE>().0;
            for (pixels, cell) in pixels.iter_mut().zip(&cells[..width]) {
                *pixels = [*cell; WIDE];
            }
        }
    }

    /// Gives those pixels of a row of cells to their things that are on their
    /// surfaces, and the holes in them.
    #[inline(always)]
    fn paint<S: Simd>(
        &self,
        simd: S,
        plane: &Plane,
        source: &RegionSource<'_>,
        cy: usize,
        out: &mut Candidates,
    ) {
        let size = source.disparity.size();
        let rows = cy * HIGH..((cy + 1) * HIGH).min(size.height);
        // The lowest row once more where there are fewer.
        let lines: [&[f32]; HIGH] =
            std::array::from_fn(|i| source.disparity.row((rows.start + i).min(rows.end - 1)));
        for cells in Spans::new(&self.edges) {
            let id = self.ids[cells.start];
            if id == 0 {
                continue;
            }
            let columns = cells.start * WIDE..(cells.end * WIDE).min(size.width);
            let mut painted = PixelBox::NONE;
            for x in columns.clone().step_by(LANES) {
                let surface = f32x16::from_slice(simd, &self.surfaces[x..x + LANES]);
                let slope = f32x16::from_slice(simd, &self.slopes[x..x + LANES]);
                let near = Near {
                    surface,
                    tolerance: f32x16::from_slice(simd, &self.tolerances[x..x + LANES]),
                    slope,
                    // What the ground's disparity is raised by, with its constant part.
                    rise: surface * GROUND_PART + (plane.c + GROUND_PX),
                };
                let holes = u8x16::from_slice(simd, &self.holes[x..x + LANES]);
                let own = holes.simd_ge(u8x16::splat(simd, OWN)).to_bitmask();
                let inside = holes.simd_eq(u8x16::splat(simd, INSIDE)).to_bitmask();
                let all = u64::MAX >> (64 - LANES.min(columns.end - x));
                // All rows at once: nobody foresees the holes, on which more depends.
                let [mut on, mut holes] = [[0; HIGH]; 2];
                for i in 0..HIGH {
                    let d: f32x16<S> = padded(simd, lines[i], x, f32::NAN);
                    on[i] = near.of(d, plane.a * (rows.start + i) as f32) & all;
                    holes[i] = !d.simd_eq(d).to_bitmask() & all;
                }
                let (mut seen, mut seen_rows, mut area) = (0, 0_u64, 0);
                for (i, y) in rows.clone().enumerate() {
                    let (mut bits, mut holes) = (on[i], holes[i]);
                    // Those inside of a thing are its own anyway.
                    let open = holes & !inside;
                    if open != 0 {
                        let filled = fill(simd, source.disparity, &source.left.gray, (x, y));
                        bits |= near.of(filled, plane.a * y as f32) & open;
                        holes &= !(filled.simd_eq(filled).to_bitmask() & open);
                    }
                    holes &= own;
                    if holes != 0 {
                        let none = !bits_from(source.roi.matched.row(y), x);
                        // The left pixel of a cell tells.
                        bits |= holes & (inside | ((none & LEFT) * CELL_BITS));
                    }
                    write(simd, &mut out.ids.row_mut(y)[x..], out.first + id - 1, bits);
                    seen |= bits;
                    seen_rows |= u64::from(bits != 0) << i;
                    area += bits.count_ones() as usize;
                }
                if seen != 0 {
                    let ends = |at: usize, bits: u64| {
                        (
                            at + bits.trailing_zeros() as usize,
                            at + 64 - bits.leading_zeros() as usize,
                        )
                    };
                    let ((x0, x1), (y0, y1)) = (ends(x, seen), ends(rows.start, seen_rows));
                    painted.join(&PixelBox { x0, y0, x1, y1, area });
                }
            }
            out.boxes[id as usize - 1].join(&painted);
        }
    }
}

/// What pixels of a thing are near to.
struct Near<S: Simd> {
    surface: f32x16<S>,
    tolerance: f32x16<S>,
    /// The ground's change along the row, and what it is raised by.
    slope: f32x16<S>,
    rise: f32x16<S>,
}

impl<S: Simd> Near<S> {
    /// One bit for each disparity on the surface, of a row in which the ground's disparity is
    /// `ground`, less what is known here. What does not rise above it is none of the thing.
    #[inline(always)]
    fn of(&self, d: f32x16<S>, ground: f32) -> u64 {
        let on = (d - self.surface).abs().simd_le(self.tolerance);
        (on & d.simd_gt(self.slope + ground + self.rise)).to_bitmask()
    }
}

/// Writes `id` where bits are set and 0 elsewhere: what is to the right comes later.
#[inline(always)]
fn write<S: Simd>(simd: S, row: &mut [u32], id: u32, bits: u64) {
    if let Some(row) = row.first_chunk_mut::<LANES>() {
        let (id, none) = (u32x16::splat(simd, id), u32x16::splat(simd, 0));
        mask32x16::from_bitmask(simd, bits).select(id, none).store_slice(row);
    } else {
        for (i, pixel) in row.iter_mut().enumerate() {
            *pixel = if bits >> i & 1 == 1 { id } else { 0 };
        }
    }
}

/// Fills `holes`, per pixel, for the cells of things in a row, whose ids change between
/// `spans`. A hole is inside of a thing where there are fine cells of the thing on both
/// sides (or the edge of the image) before those of anything else: what only one camera
/// sees at the sides of a thing belongs to what is behind it.
#[inline(always)]
fn enclose(ids: &[u32], spans: Spans<'_>, fine: &[u64], holes: &mut [u8]) {
    for cells in spans {
        let id = ids[cells.start];
        if id == 0 {
            continue;
        }
        let own = |cell: usize| ids[cell] == id;
        let left = last_set(fine, cells.start).is_none_or(own);
        let right = first_set(fine, cells.end).is_none_or(own);
        let first = first_set(fine, cells.start).map_or(cells.end, |first| first + 1);
        let last = last_set(fine, cells.end).unwrap_or(cells.start);
        holes[cells.start * WIDE..cells.end * WIDE].fill(OWN);
        let from = if left { cells.start } else { first.min(cells.end) };
        let to = if right { cells.end } else { last.max(cells.start) };
        if from < to {
            holes[from * WIDE..to * WIDE].fill(INSIDE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd;

    #[test]
    fn a_hole_belongs_to_a_thing_that_is_measured_on_both_sides() {
        // Edge, hole, thing 1, hole, thing 1, hole, thing 2, hole, what is none.
        let ids = [1, 1, 1, 1, 1, 1, 2, 2, 0];
        let fine = [0b1_0101_0100];
        let mut holes = [OUTSIDE; 9 * WIDE];
        let mut edges = vec![0; edge_words(ids.len())];
        dispatch!(simd::detect(), simd => find_edges(simd, &ids, &mut edges));
        enclose(&ids, Spans::new(&edges), &fine, &mut holes);
        let expected = [INSIDE, INSIDE, INSIDE, INSIDE, OWN, OWN, OWN, OWN, OUTSIDE];
        assert_eq!(holes.as_chunks::<WIDE>().0, expected.map(|hole| [hole; WIDE]));
    }
}
