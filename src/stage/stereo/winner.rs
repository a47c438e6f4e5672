//! The disparity of least cost, seen from the left and from the right image.

use crate::simd::prelude::*;
use crate::simd::{Block, LANES, Simd, load, load_block, store, u8x32};
use crate::stage::stereo::NO_MATCH;
use crate::stage::stereo::plan::Tile;
use crate::stage::stereo::volume::Volume;

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
    pad: usize,
    lo: usize,
    shift: u32,
}

impl RightWinner {
    /// Forgets everything; `rows` of `width` pixels and disparities `lo .. hi` come.
    pub fn reset(&mut self, width: usize, rows: usize, lo: usize, hi: usize) {
        self.pad = hi;
        self.lo = lo;
        self.shift = shift_for(hi - lo);
        self.stride = width + hi + 2 * LANES;
        self.cost.clear();
        self.cost.resize(self.stride * rows, 255);
        self.index.clear();
        self.index.resize(self.stride * rows, 0);
    }

    /// The left pixels of row `y` from column `x0` on vote, all tiles of a run.
    /// Lanes from column `width` on are no pixels.
    ///
    /// The loop over disparities is the outer one: with it inside, every vector
    /// would be loaded again one byte beside where it has just been stored,
    /// which stalls the processor's store forwarding.
    #[inline(always)]
    pub fn vote<S: Simd>(
        &mut self,
        simd: S,
        (x0, y): (usize, usize),
        width: usize,
        tiles: &[Tile],
        volume: &Volume,
    ) {
        let row = y * self.stride;
        let cost_row = &mut self.cost[row..row + self.stride];
        let index_row = &mut self.index[row..row + self.stride];
        let (pad, lo, shift) = (self.pad, self.lo, self.shift);
        let from = tiles.iter().map(|t| t.lo).min().unwrap_or(0);
        let to = tiles.iter().map(|t| t.lo + t.n).max().unwrap_or(0);
        for d in from..to {
            let mine = u8x32::splat(simd, ((d - lo) >> shift) as u8);
            for (k, tile) in tiles.iter().enumerate() {
                if d < tile.lo || d >= tile.lo + tile.n {
                    continue;
                }
                let mut cost = load_block(simd, &volume.row(k, y)[d - tile.lo]);
                let x = x0 + k * LANES;
                if x + LANES > width {
                    let mut outside = [255; LANES];
                    outside[..width - x].fill(0);
                    cost |= load_block(simd, &outside);
                }
                let at = x + pad - d;
                let best = load(simd, cost_row, at);
                let index = load(simd, index_row, at);
                let better = cost.simd_lt(best);
                store(cost_row, at, cost.min(best));
                store(index_row, at, better.select(mine, index));
            }
        }
    }

    /// Disparities of the right pixels of row `y`, in units of
    /// [`crate::perception::DISPARITY_STEP`].
    #[inline(always)]
    pub fn finish(&self, y: usize, out: &mut [i16]) {
        let at = y * self.stride + self.pad;
        let width = out.len();
        let costs = &self.cost[at..at + width];
        let indices = &self.index[at..at + width];
        for ((out, &cost), &index) in out.iter_mut().zip(costs).zip(indices) {
            let d = (self.lo + ((index as usize) << self.shift)) as i32 * STEPS;
            *out = if cost == 255 { NO_MATCH } else { d as i16 };
        }
    }
}

/// By how much an index must be shifted to fit into a byte.
const fn shift_for(range: usize) -> u32 {
    if range > 512 {
        2
    } else if range > 256 {
        1
    } else {
        0
    }
}

/// Winners of 32 pixels from their summed costs, a block per disparity from
/// `lo` on. `floors` is what was subtracted from all costs of a pixel.
#[inline(always)]
pub fn winners<S: Simd>(
    simd: S,
    costs: &[Block],
    lo: usize,
    floors: &[u16; LANES],
    uniqueness_ratio: u32,
) -> Winners {
    let n = costs.len();
    let shift = shift_for(n);
    let mut best = u8x32::splat(simd, 255);
    let mut index = u8x32::splat(simd, 0);
    for (i, cost) in costs.iter().enumerate() {
        let cost = load_block(simd, cost);
        let better = cost.simd_lt(best);
        best = best.min(cost);
        index = better.select(u8x32::splat(simd, (i >> shift) as u8), index);
    }
    // The second best that is no neighbour of the best.
    let mut second = u8x32::splat(simd, 255);
    let one = u8x32::splat(simd, 1);
    for (i, cost) in costs.iter().enumerate() {
        let i = u8x32::splat(simd, (i >> shift) as u8);
        let distance = i.saturating_sub(index) | index.saturating_sub(i);
        let cost = load_block(simd, cost);
        second = second.min(distance.simd_le(one).select(u8x32::splat(simd, 255), cost));
    }
    let (best, second, index) = (best.to_array(), second.to_array(), index.to_array());
    // What follows is arithmetic of single pixels; each loop is over lanes and
    // without branches, so that it becomes vector code as well.
    let mut place = [0_usize; LANES];
    let (mut smaller, mut larger) = ([0_u8; LANES], [0_u8; LANES]);
    for lane in 0..LANES {
        let mut i = (index[lane] as usize) << shift;
        while shift > 0 && best[lane] < 255 && costs[i][lane] != best[lane] {
            i += 1;
        }
        place[lane] = i;
        // At an end of the range nothing is known beyond it: no offset then.
        let both = i > 0 && i + 1 < n;
        smaller[lane] = if both { costs[i - 1][lane] } else { best[lane] };
        larger[lane] = if both { costs[i + 1][lane] } else { best[lane] };
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
        let unique = other * 100.0 >= first * (100 + uniqueness_ratio) as f32;
        out.evidence[lane] = if unique && best[lane] != 255 { evidence } else { 0 };
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
