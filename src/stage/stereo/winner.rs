//! The disparity of least cost, seen from the left and from the right image.

use crate::simd::prelude::*;
use crate::simd::{Block, LANES, Simd, load, load_block, store, u8x32};
use crate::stage::stereo::NO_MATCH;

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

    /// The 32 left pixels from column `x` of row `y` cost `costs[i]` at
    /// disparity `lo + i`. `outside` is 255 for lanes beyond the image.
    #[inline(always)]
    pub fn vote<S: Simd>(
        &mut self,
        simd: S,
        (x, y): (usize, usize),
        lo: usize,
        costs: &[Block],
        outside: u8x32<S>,
    ) {
        let row = y * self.stride;
        let cost_row = &mut self.cost[row..row + self.stride];
        let index_row = &mut self.index[row..row + self.stride];
        for (i, cost) in costs.iter().enumerate() {
            let cost = load_block(simd, cost) | outside;
            let at = x + self.pad - (lo + i);
            let best = load(simd, cost_row, at);
            let index = load(simd, index_row, at);
            let mine = u8x32::splat(simd, ((lo + i - self.lo) >> self.shift) as u8);
            let better = cost.simd_lt(best);
            store(cost_row, at, cost.min(best));
            store(index_row, at, better.select(mine, index));
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
    let mut out = Winners { disparity: [NO_MATCH; LANES], evidence: [0; LANES] };
    for lane in 0..LANES {
        let c0 = best[lane];
        if c0 == 255 {
            continue;
        }
        let mut i = (index[lane] as usize) << shift;
        while costs[i][lane] != c0 {
            i += 1;
        }
        let (first, other) =
            (c0 as u32 + floors[lane] as u32, second[lane] as u32 + floors[lane] as u32);
        if other * 100 < first * (100 + uniqueness_ratio) {
            out.evidence[lane] = 0;
        } else {
            out.evidence[lane] = (255 * (other - first) / other.max(1)).clamp(1, 255) as u8;
        }
        let c0 = c0 as i32;
        let smaller = if i > 0 { costs[i - 1][lane] as i32 } else { c0 };
        let larger = if i + 1 < n { costs[i + 1][lane] as i32 } else { c0 };
        out.disparity[lane] = ((lo + i) as i32 * STEPS + sub_step(smaller, c0, larger)) as i16;
    }
    out
}

/// Offset of the minimum from its sample, in 1/32 px, under two lines of equal
/// and opposite slope through the three costs (equiangular fit).
#[inline(always)]
fn sub_step(smaller: i32, least: i32, larger: i32) -> i32 {
    let rise = smaller.max(larger) - least;
    if rise <= 0 || smaller < least || larger < least {
        return 0;
    }
    let twice = (smaller - larger) * STEPS;
    // Rounded to the nearest step, away from zero at halves.
    (twice + rise * twice.signum()) / (2 * rise)
}
