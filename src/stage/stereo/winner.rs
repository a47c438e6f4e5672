//! The disparity of least cost, seen from the left and from the right image.

use std::ops::Range;

use crate::simd::prelude::*;
use crate::simd::{Block, LANES, Simd, load, load_block, store, u8x32};
use crate::stage::stereo::NO_MATCH;
use crate::stage::stereo::volume::RunShape;

/// Units of [`crate::perception::DISPARITY_STEP`] per pixel.
pub const STEPS: i32 = 32;

/// What one row of one tile yields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Winners {
    /// Disparity in units of [`crate::perception::DISPARITY_STEP`], or [`NO_MATCH`].
    pub disparity: [i16; LANES],
    /// Evidence, 0..=255.
    pub evidence: [u8; LANES],
}

/// The best left partner of every right pixel of a band.
#[derive(Default)]
pub struct RightWinner {
    cost: Vec<u8>,
    index: Vec<u8>,
    stride: usize,
    lo: usize,
    shift: u32,
    /// Columns that may have a partner.
    columns: Range<usize>,
    /// Sums of one row of a run: disparity, column, with a vector of padding on
    /// either side; 255 where a tile has not this disparity.
    sums: Vec<u8>,
    sums_stride: usize,
    /// First column of the run.
    x0: usize,
    /// Smallest disparity of the run.
    first: usize,
    spans: Vec<Span>,
}

/// Where 32 right pixels have left partners.
struct Span {
    /// Image column of the first one.
    x: usize,
    /// Disparities of the tiles that they may meet.
    disparities: Range<usize>,
}

impl RightWinner {
    /// Forgets everything; `rows` of `width` pixels and disparities `lo .. hi` come.
    pub fn reset(&mut self, width: usize, rows: usize, lo: usize, hi: usize) {
        self.lo = lo;
        self.shift = shift_for(hi - lo);
        self.columns = width..0;
        self.stride = width + 2 * LANES;
        self.cost.clear();
        self.cost.resize(self.stride * rows, 255);
        self.index.clear();
        self.index.resize(self.stride * rows, 0);
    }

    /// The rows of a run come, whose first column is `x0`.
    pub fn start(&mut self, x0: usize, shape: &RunShape<'_>) {
        let width = shape.width();
        self.x0 = x0;
        self.first = shape.lo;
        self.sums_stride = width + 2 * LANES;
        self.sums.clear();
        self.sums.resize(self.sums_stride * shape.range(), 255);
        self.spans.clear();
        let from = (x0 + 1).saturating_sub(shape.hi);
        for x in (from..x0 + width - shape.lo.min(x0 + width)).step_by(LANES) {
            let (mut least, mut most) = (usize::MAX, 0);
            for (k, tile) in shape.tiles.iter().enumerate() {
                // Disparities at which one of these pixels meets one of the tile's.
                let column = x0 + k * LANES;
                let lo = (column + 1).saturating_sub(x + LANES).max(tile.lo);
                let hi = (column + LANES).saturating_sub(x).min(tile.lo + tile.n);
                if lo < hi {
                    (least, most) = (least.min(lo), most.max(hi));
                }
            }
            if least < most {
                self.columns.start = self.columns.start.min(x);
                self.columns.end = self.columns.end.max(x + LANES);
                self.spans.push(Span { x, disparities: least..most });
            }
        }
    }

    /// Takes the sums of tile `k`, from disparity `lo` on. Lanes from `inside`
    /// on are no pixels.
    #[inline(always)]
    pub fn take<S: Simd>(&mut self, simd: S, k: usize, lo: usize, inside: usize, costs: &[Block]) {
        let mut outside = [255; LANES];
        outside[..inside].fill(0);
        let outside = load_block(simd, &outside);
        let at = (lo - self.first) * self.sums_stride + (k + 1) * LANES;
        let mut rows = self.sums[at..].chunks_mut(self.sums_stride);
        for cost in costs {
            // (Zipped, the two would be called for, not inlined.)
            if let Some(row) = rows.next() {
                store(row, 0, load_block(simd, cost) | outside);
            }
        }
    }

    /// The right pixels choose among the left ones of row `y`, once all tiles
    /// of the run have been taken.
    ///
    /// Every vector of right pixels looks at all its disparities in turn: its
    /// best stays in registers. (The other way round, left pixels voting, the
    /// same bytes would be stored and loaded again one place further on, which
    /// stalls the processor's store forwarding.)
    #[inline(always)]
    pub fn vote<S: Simd>(&mut self, simd: S, y: usize) {
        let row = y * self.stride;
        let (stride, first) = (self.sums_stride, self.first);
        for Span { x, disparities } in &self.spans {
            let at = row + x;
            let mut best = load(simd, &self.cost, at);
            let mut index = load(simd, &self.index, at);
            let start =
                (disparities.start - first) * stride + x + disparities.start + LANES - self.x0;
            let mut sums = self.sums[start..].chunks(stride + 1);
            for d in disparities.clone() {
                let Some(sums) = sums.next() else { break };
                let cost = load(simd, sums, 0);
                let mine = u8x32::splat(simd, ((d - self.lo) >> self.shift) as u8);
                index = cost.simd_lt(best).select(mine, index);
                best = best.min(cost);
            }
            store(&mut self.cost, at, best);
            store(&mut self.index, at, index);
        }
    }

    /// Writes the disparities of the right pixels of row `y` that have a
    /// partner, in units of [`crate::perception::DISPARITY_STEP`].
    #[inline(always)]
    pub fn finish(&self, y: usize, out: &mut [i16]) {
        let columns = self.columns.start..self.columns.end.min(out.len());
        if columns.is_empty() {
            return;
        }
        let row = y * self.stride;
        let costs = &self.cost[row + columns.start..row + columns.end];
        let indices = &self.index[row + columns.start..row + columns.end];
        for ((out, &cost), &index) in out[columns].iter_mut().zip(costs).zip(indices) {
            let d = (self.lo as i32 + ((index as i32) << self.shift)) * STEPS;
            *out = if cost == 255 { NO_MATCH } else { d as i16 };
        }
    }
}

/// By how much an index must be shifted to fit into a byte: a range is 512 at most.
const fn shift_for(range: usize) -> u32 {
    (range > 256) as u32
}

/// Winners of 32 pixels from their summed costs, a block per disparity from
/// `lo` on. `floors` is what was subtracted from all costs of a pixel.
#[inline(always)]
pub fn winners<S: Simd>(simd: S, costs: &[Block], lo: usize, floors: &[u16; LANES]) -> Winners {
    let n = costs.len();
    let shift = shift_for(n);
    // The costs beside the best one are kept along with it. At an end of the
    // range nothing is known beyond it: the best stands in for both there.
    let mut before = load_block(simd, &costs[0]);
    let (mut best, mut smaller, mut larger) = (before, before, before);
    let mut index = u8x32::splat(simd, 0);
    // The second best that is no neighbour of the best: of those two and more
    // below it when it was found, and of those two and more above it since.
    let none = u8x32::splat(simd, 255);
    let (mut second, mut below) = (none, none);
    let mut fresh = none.simd_eq(none);
    for i in 1..n {
        let cost = load_block(simd, &costs[i]);
        let after = load_block(simd, &costs[(i + 1).min(n - 1)]);
        let better = cost.simd_lt(best);
        best = best.min(cost);
        index = better.select(u8x32::splat(simd, (i >> shift) as u8), index);
        // At the end of the range, `after` is the best itself.
        let inner = i + 1 < n;
        smaller = better.select(if inner { before } else { cost }, smaller);
        larger = better.select(after, larger);
        second = better.select(below, fresh.select(second, second.min(cost)));
        below = below.min(before);
        fresh = better;
        before = cost;
    }
    // So few disparities that all are neighbours are no evidence.
    let alone = if n < 4 { second.simd_eq(none) } else { none.simd_lt(none) };
    let second = alone.select(best, second);
    let (best, second, index) = (best.to_array(), second.to_array(), index.to_array());
    let (smaller, larger) = (smaller.to_array(), larger.to_array());
    // What follows is arithmetic of single pixels; each loop is over lanes and
    // without branches, so that it becomes vector code as well.
    let mut place = [0_usize; LANES];
    for lane in 0..LANES {
        place[lane] = (index[lane] as usize) << shift;
    }
    if shift > 0 {
        for (lane, place) in place.iter_mut().enumerate() {
            while best[lane] < 255 && costs[*place][lane] != best[lane] {
                *place += 1;
            }
        }
    }
    let mut out = Winners { disparity: [NO_MATCH; LANES], evidence: [0; LANES] };
    for lane in 0..LANES {
        let steps = sub_steps(smaller[lane], best[lane], larger[lane]);
        let disparity = (lo + place[lane]) as i32 * STEPS + steps;
        out.disparity[lane] = if best[lane] == 255 { NO_MATCH } else { disparity as i16 };
    }
    for lane in 0..LANES {
        let first = (best[lane] as u16 + floors[lane]) as f32;
        let other = (second[lane] as u16 + floors[lane]) as f32;
        // Exact where it matters: both are whole numbers below 2000, so that a
        // quotient that is no whole number is no neighbour of one either.
        let evidence = (255.0 * (other - first) / other.max(1.0)).clamp(1.0, 255.0) as u8;
        out.evidence[lane] = if best[lane] == 255 { 0 } else { evidence };
    }
    out
}

/// Offset of the minimum from its sample, in 1/32 px, under two lines of equal
/// and opposite slope through the three costs (equiangular fit).
#[inline(always)]
fn sub_steps(smaller: u8, least: u8, larger: u8) -> i32 {
    let rise = (smaller.max(larger) - least) as f32;
    let exact = (STEPS / 2) as f32 * (smaller as f32 - larger as f32) / rise.max(1.0);
    // Rounded to the nearest step, away from zero at halves; the cast cuts.
    (exact + 0.5_f32.copysign(exact)) as i32
}
