//! The two horizontal paths of a band, all 32 rows in one vector.
//!
//! With rows in the lanes the recursion along x needs no minimum across a
//! vector, and its latency is shared by 32 rows.

use crate::simd::prelude::*;
use crate::simd::{Block, LANES, Simd, abs_diff, load_block, transpose, transpose_every, u8x32};
use crate::stage::stereo::census::{Census, PLANES};
use crate::stage::stereo::cost::{Descriptors, Penalties, PenaltyLanes, cost};
use crate::stage::stereo::volume::{RunShape, Seeds, Volume};

/// State of the horizontal paths.
#[derive(Default)]
pub struct Horizontal {
    /// Left descriptors: per column, per plane, 32 rows.
    left: Vec<Block>,
    /// Right descriptors likewise.
    right: Vec<Block>,
    /// Left gray values per column.
    gray: Vec<Block>,
    /// 255/w per column; empty when the weight is off.
    weight: Vec<Block>,
    /// Path cost per disparity, one slot of padding on either side.
    state: Vec<Block>,
    /// Both paths of one tile: column, disparity.
    both: Vec<Block>,
    /// Minimum over the disparities of the path from the left, per column.
    floor: Vec<Block>,
}

impl Horizontal {
    /// Sets the sums of `volume` to those of both paths, each less its minimum
    /// over the disparities, and its floors to the sum of these minima.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the inputs of one kernel")]
    pub fn run<S: Simd>(
        &mut self,
        simd: S,
        shape: &RunShape<'_>,
        penalties: Penalties,
        left: &Census,
        right: &Census,
        seeds: Option<&Seeds<'_>>,
        volume: &mut Volume,
    ) {
        self.prepare(simd, shape, left, right);
        self.forward(simd, shape, penalties, seeds, volume);
        self.backward(simd, shape, penalties, seeds, volume);
    }

    /// Turns rows into columns.
    #[inline(always)]
    fn prepare<S: Simd>(&mut self, simd: S, shape: &RunShape<'_>, left: &Census, right: &Census) {
        self.left.resize(shape.width() * PLANES, [0; LANES]);
        self.right.resize(right.stride() * PLANES, [0; LANES]);
        self.gray.resize(shape.width(), [0; LANES]);
        for (census, out) in [(left, &mut self.left), (right, &mut self.right)] {
            let columns = out.len() / PLANES;
            for x in (0..columns).step_by(LANES) {
                for plane in 0..PLANES {
                    let mut block = [[0; LANES]; LANES];
                    for (i, lanes) in block.iter_mut().enumerate() {
                        let at = plane * census.stride() + x;
                        lanes.copy_from_slice(&census.planes(shape.row(i))[at..at + LANES]);
                    }
                    let columns = transpose(simd, &block);
                    for (i, column) in columns.iter().enumerate() {
                        column.store_array(&mut out[(x + i) * PLANES + plane]);
                    }
                }
            }
        }
        for x in (0..shape.width()).step_by(LANES) {
            let mut block = [[0; LANES]; LANES];
            for (i, lanes) in block.iter_mut().enumerate() {
                lanes.copy_from_slice(&left.gray(shape.row(i))[LANES + x..2 * LANES + x]);
            }
            for (i, column) in transpose(simd, &block).iter().enumerate() {
                column.store_array(&mut self.gray[x + i]);
            }
        }
        self.weight.clear();
        if let Some(weight) = shape.weight {
            self.weight.resize(shape.width(), [0; LANES]);
            for (x, column) in self.weight.iter_mut().enumerate() {
                for (i, lane) in column.iter_mut().enumerate() {
                    *lane = weight.at(x, i.min(shape.rows - 1));
                }
            }
        }
        self.state.clear();
        self.state.resize(shape.range() + 2, [255; LANES]);
    }

    #[inline(always)]
    fn penalties<S: Simd>(&self, simd: S, penalties: Penalties, x: usize) -> PenaltyLanes<S> {
        PenaltyLanes::new(simd, penalties, self.weight.get(x))
    }

    #[inline(always)]
    fn left_at<S: Simd>(&self, simd: S, x: usize) -> Descriptors<S> {
        load_descriptors(simd, &self.left[x * PLANES..])
    }

    /// One column of one path: `state` moves on from the previous column.
    /// Returns the new minimum over the disparities.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the registers of one kernel")]
    fn column<S: Simd>(
        simd: S,
        left: &Descriptors<S>,
        right: &[Block],
        state: &mut [Block],
        floor: u8x32<S>,
        p1: u8x32<S>,
        p2: u8x32<S>,
    ) -> u8x32<S> {
        let n = state.len() - 2;
        let mut smaller = entering(simd, &state[0], floor, p2);
        let mut same = entering(simd, &state[1], floor, p2);
        let mut least = u8x32::splat(simd, 255);
        // Disparities grow to the left in the right image.
        let right = right[..n * PLANES].as_chunks::<PLANES>().0;
        for i in 0..n {
            let larger = entering(simd, &state[i + 2], floor, p2);
            let descriptor = &right[n - 1 - i];
            let right = load_descriptors(simd, descriptor);
            let cost = cost(left, &right) + same.min(smaller.min(larger) + p1);
            cost.store_array(&mut state[i + 1]);
            least = least.min(cost);
            smaller = same;
            same = larger;
        }
        least
    }

    #[inline(always)]
    fn forward<S: Simd>(
        &mut self,
        simd: S,
        shape: &RunShape<'_>,
        penalties: Penalties,
        seeds: Option<&Seeds<'_>>,
        volume: &mut Volume,
    ) {
        self.floor.resize(shape.width(), [0; LANES]);
        if let Some(seeds) = seeds {
            seeds.fill_column(&shape.tiles[0], shape, seeds.left, penalties.p2, &mut self.state);
        }
        // Nothing is known without seeds: 255 less 255 is a path that begins with nothing.
        let mut floor = u8x32::splat(simd, if seeds.is_some() { 0 } else { 255 });
        for (k, tile) in shape.tiles.iter().enumerate() {
            let base = tile.lo - shape.lo;
            for (column, out) in volume.tile_mut(k).chunks_exact_mut(tile.n).enumerate() {
                let x = k * LANES + column;
                let lanes = self.penalties(simd, penalties, x);
                let gray = load_block(simd, &self.gray[x]);
                let before = load_block(simd, &self.gray[x.saturating_sub(1)]);
                let p2 = lanes.p2_across(abs_diff(gray, before));
                let left = self.left_at(simd, x);
                let right = &self.right[shape.right_from(x, tile) * PLANES..];
                let state = &mut self.state[base..base + tile.n + 2];
                floor = Self::column(simd, &left, right, state, floor, lanes.p1, p2);
                out.copy_from_slice(&state[1..=tile.n]);
                floor.store_array(&mut self.floor[x]);
                if column == 0 {
                    self.forget_outside(base, tile.n);
                }
            }
        }
    }

    /// Forgets what an adjacent tile left at disparities this one has not.
    #[inline(always)]
    fn forget_outside(&mut self, base: usize, n: usize) {
        self.state[..=base].fill([255; LANES]);
        self.state[base + 1 + n..].fill([255; LANES]);
    }

    #[inline(always)]
    fn backward<S: Simd>(
        &mut self,
        simd: S,
        shape: &RunShape<'_>,
        penalties: Penalties,
        seeds: Option<&Seeds<'_>>,
        volume: &mut Volume,
    ) {
        self.state.fill([255; LANES]);
        let last = shape.tiles.len() - 1;
        if let Some(seeds) = seeds {
            seeds.fill_column(
                &shape.tiles[last],
                shape,
                seeds.right,
                penalties.p2,
                &mut self.state,
            );
        }
        // Nothing is known without seeds: 255 less 255 is a path that begins with nothing.
        let mut floor = u8x32::splat(simd, if seeds.is_some() { 0 } else { 255 });
        for (k, tile) in shape.tiles.iter().enumerate().rev() {
            let base = tile.lo - shape.lo;
            let mut floors = [[0; LANES]; LANES];
            self.both.resize(tile.n * LANES, [0; LANES]);
            let sums = volume.tile_mut(k);
            for column in (0..LANES).rev() {
                let x = k * LANES + column;
                let lanes = self.penalties(simd, penalties, x);
                let gray = load_block(simd, &self.gray[x]);
                let before = load_block(simd, &self.gray[(x + 1).min(shape.width() - 1)]);
                let p2 = lanes.p2_across(abs_diff(gray, before));
                let left = self.left_at(simd, x);
                let right = &self.right[shape.right_from(x, tile) * PLANES..];
                let state = &mut self.state[base..base + tile.n + 2];
                floor = Self::column(simd, &left, right, state, floor, lanes.p1, p2);
                let forward_floor = load_block(simd, &self.floor[x]);
                (floor + forward_floor).store_array(&mut floors[column]);
                let from_left = &sums[column * tile.n..(column + 1) * tile.n];
                let both = &mut self.both[column * tile.n..(column + 1) * tile.n];
                for ((both, from_left), from_right) in
                    both.iter_mut().zip(from_left).zip(&state[1..])
                {
                    let from_left = load_block(simd, from_left).saturating_sub(forward_floor);
                    let from_right = load_block(simd, from_right).saturating_sub(floor);
                    from_left.saturating_add(from_right).store_array(both);
                }
                if column == LANES - 1 {
                    self.forget_outside(base, tile.n);
                }
            }
            // The path from the left has been read: its place is taken by the sums.
            for i in 0..tile.n {
                for (y, row) in transpose_every(simd, &self.both[i..], tile.n).iter().enumerate() {
                    row.store_array(&mut sums[y * tile.n + i]);
                }
            }
            for (y, row) in transpose(simd, &floors).iter().enumerate() {
                let floor = volume.floor_mut(k, y);
                for (out, value) in floor.iter_mut().zip(row.to_array()) {
                    *out = value as u16;
                }
            }
        }
    }
}

#[inline(always)]
fn load_descriptors<S: Simd>(simd: S, blocks: &[Block]) -> Descriptors<S> {
    let blocks = &blocks[..PLANES];
    [
        load_block(simd, &blocks[0]),
        load_block(simd, &blocks[1]),
        load_block(simd, &blocks[2]),
        load_block(simd, &blocks[3]),
    ]
}

/// What the previous column's path cost adds: less its floor, and at most P2.
#[inline(always)]
fn entering<S: Simd>(simd: S, block: &Block, floor: u8x32<S>, p2: u8x32<S>) -> u8x32<S> {
    load_block(simd, block).saturating_sub(floor).min(p2)
}
