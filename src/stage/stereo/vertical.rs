//! The vertical and diagonal paths of a band, 32 columns in one vector.

use crate::simd::prelude::*;
use crate::simd::{Block, LANES, Simd, abs_diff, load, load_block, store, u8x32};
use crate::stage::stereo::census::{Census, PLANES};
use crate::stage::stereo::cost::{Penalties, PenaltyLanes, cost, descriptors};
use crate::stage::stereo::engine::Finish;
use crate::stage::stereo::plan::Tile;
use crate::stage::stereo::volume::{RunShape, Seeds, Volume};

/// The paths of a sweep, as layers of its state.
const STRAIGHT: usize = 0;
/// Coming from the left: of one row, and of the next one.
const FROM_LEFT: usize = 1;
/// Coming from the right likewise.
const FROM_RIGHT: usize = 3;
const LAYERS: usize = 5;

/// State of the paths that come down, or go up.
#[derive(Default)]
pub struct Vertical {
    /// Path costs of one row: disparity, layer, column, with padding of one
    /// vector on either side of the columns and of one disparity at either end
    /// that always holds 255 ("nothing known": such a value is later cut to P2).
    costs: Vec<u8>,
    /// Their minimum over the disparities: layer, column; 255 where nothing is
    /// known, so that a path from there begins with nothing.
    floors: Vec<u8>,
    /// Which of its two layers holds a diagonal path's previous row: 0 or 1.
    turn: usize,
    /// Sum of the paths of one row of one tile.
    sums: Vec<Block>,
    /// Length of a layer.
    stride: usize,
}

/// What one row of one tile yields: the floors of its paths; their costs stand
/// in `Vertical::sums`.
type Floors<S> = u8x32<S>;

/// Which way a sweep goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the upper rows to the lower ones.
    Down,
    /// From the lower rows to the upper ones.
    Up,
}

/// Rows of a sweep: the one at work and the one its paths come from.
struct Step {
    row: usize,
    from: usize,
}

impl Vertical {
    /// Adds the paths of `direction` to `volume`, row by row. If they are the last
    /// ones, `finish` gets every finished row of a tile instead, and `volume` stays
    /// as it is.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the inputs of one kernel")]
    pub fn sweep<S: Simd, const DIAGONALS: bool>(
        &mut self,
        simd: S,
        direction: Direction,
        shape: &RunShape<'_>,
        penalties: Penalties,
        left: &Census,
        right: &Census,
        seeds: Option<&Seeds<'_>>,
        volume: &mut Volume,
        mut finish: Option<&mut Finish<'_>>,
    ) {
        self.reset::<DIAGONALS>(shape);
        let rows = shape.context_above..shape.context_above + shape.rows;
        let all = match direction {
            Direction::Down => 0..rows.end,
            Direction::Up => rows.start..rows.end + shape.context_below,
        };
        let row_at = |i: usize| match direction {
            Direction::Down => all.start + i,
            Direction::Up => all.end - 1 - i,
        };
        if let Some(seeds) = seeds {
            let y = seeds.y0 + row_at(0) - shape.context_above;
            self.seed::<DIAGONALS>(shape, penalties, seeds, y);
        }
        for i in 0..all.len() {
            let step = Step { row: row_at(i), from: row_at(i.saturating_sub(1)) };
            let row = rows.contains(&step.row).then(|| step.row - rows.start);
            for (k, tile) in shape.tiles.iter().enumerate() {
                let floor =
                    self.tile::<S, DIAGONALS>(simd, shape, penalties, left, right, &step, k, tile);
                let Some(y) = row else { continue };
                add_floors(volume.floor_mut(k, y), floor);
                match &mut finish {
                    None => {
                        for (out, sum) in volume.row_mut(k, y).iter_mut().zip(&self.sums) {
                            let sum = load_block(simd, sum).saturating_sub(floor);
                            load_block(simd, out).saturating_add(sum).store_array(out);
                        }
                    }
                    Some(finish) => {
                        for (sum, before) in self.sums.iter_mut().zip(volume.row(k, y)) {
                            let cost = load_block(simd, sum).saturating_sub(floor);
                            load_block(simd, before).saturating_add(cost).store_array(sum);
                        }
                        let floors = *volume.floor_mut(k, y);
                        finish.row(simd, k, y, &self.sums[..tile.n], &floors);
                    }
                }
            }
            if let (Some(y), Some(finish)) = (row, &mut finish) {
                finish.vote(simd, y);
            }
            self.turn();
        }
    }

    #[inline(always)]
    fn reset<const DIAGONALS: bool>(&mut self, shape: &RunShape<'_>) {
        self.stride = shape.width() + 2 * LANES;
        self.turn = 0;
        self.costs.clear();
        self.costs.resize((shape.range() + 2) * self.slot::<DIAGONALS>(), 255);
        self.floors.clear();
        self.floors.resize(self.slot::<DIAGONALS>(), 255);
        let most = shape.tiles.iter().map(|t| t.n).max().unwrap_or(0);
        self.sums.resize(most, [0; LANES]);
    }

    /// Length of what is held of one disparity.
    #[inline(always)]
    fn slot<const DIAGONALS: bool>(&self) -> usize {
        if DIAGONALS { LAYERS * self.stride } else { self.stride }
    }

    /// Paths enter the first row from the coarse disparities at image row `y`.
    #[inline(always)]
    fn seed<const DIAGONALS: bool>(
        &mut self,
        shape: &RunShape<'_>,
        penalties: Penalties,
        seeds: &Seeds<'_>,
        y: usize,
    ) {
        let slot = self.slot::<DIAGONALS>();
        let used: &[usize] =
            if DIAGONALS { &[STRAIGHT, FROM_LEFT, FROM_RIGHT] } else { &[STRAIGHT] };
        for (k, tile) in shape.tiles.iter().enumerate() {
            for layer in used {
                let at = layer * self.stride + (k + 1) * LANES;
                self.floors[at..at + LANES].fill(0);
            }
            let coarse = std::array::from_fn(|i| seeds.at(k * LANES + i, y));
            for d in tile.lo..tile.lo + tile.n {
                let lanes = Seeds::costs(&coarse, d, penalties.p2);
                for layer in used {
                    let at = (d - shape.lo + 1) * slot + layer * self.stride + (k + 1) * LANES;
                    self.costs[at..at + LANES].copy_from_slice(&lanes);
                }
            }
        }
    }

    /// The current row becomes the previous one.
    #[inline(always)]
    fn turn(&mut self) {
        self.turn = 1 - self.turn;
    }

    /// One row of one tile:
    /// `L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + P1, min_k L(q, k) + P2) - min_k L(q, k)`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the registers of one kernel")]
    fn tile<S: Simd, const DIAGONALS: bool>(
        &mut self,
        simd: S,
        shape: &RunShape<'_>,
        penalties: Penalties,
        left: &Census,
        right: &Census,
        step: &Step,
        k: usize,
        tile: &Tile,
    ) -> Floors<S> {
        let x = k * LANES;
        let stride = self.stride;
        let centre = x + LANES;
        let reciprocals = shape.weight.map(|weight| -> Block {
            let y = step.row.saturating_sub(shape.context_above).min(shape.rows - 1);
            std::array::from_fn(|i| weight.at(x + i, y))
        });
        let lanes = PenaltyLanes::new(simd, penalties, reciprocals.as_ref());
        let p1 = lanes.p1;
        let gray = load(simd, left.gray(step.row), LANES + x);
        let from = left.gray(step.from);

        let l = descriptors(simd, left.planes(step.row), left.stride(), x);
        // Disparities grow to the left in the right image.
        let right_from = shape.right_from(x, tile);
        let span = (PLANES - 1) * right.stride() + LANES;
        let partners =
            right.planes(step.row)[right_from..right_from + tile.n - 1 + span].windows(span).rev();
        let slot = self.slot::<DIAGONALS>();
        let sums = &mut self.sums[..tile.n];
        let first = (tile.lo - shape.lo) * slot;
        let mut slots = self.costs[first..first + (tile.n + 2) * slot].chunks_exact_mut(slot);
        let (Some(smallest), Some(mut here)) = (slots.next(), slots.next()) else {
            return u8x32::splat(simd, 0);
        };

        let s_at = STRAIGHT * stride + centre;
        let s_floor = load(simd, &self.floors, s_at);
        let s_p2 = lanes.p2_across(abs_diff(gray, load(simd, from, centre)));
        let mut s_smaller = entering(simd, smallest, s_at, s_floor, s_p2);
        let mut s_same = entering(simd, here, s_at, s_floor, s_p2);
        let mut s_least = u8x32::splat(simd, 255);

        if !DIAGONALS {
            for ((sum, partner), next) in sums.iter_mut().zip(partners).zip(slots) {
                let cost = cost(&l, &descriptors(simd, partner, right.stride(), 0));
                let s_larger = entering(simd, next, s_at, s_floor, s_p2);
                let s = cost + s_same.min(s_smaller.min(s_larger) + p1);
                store(here, s_at, s);
                s_least = s_least.min(s);
                s_smaller = s_same;
                s_same = s_larger;
                s.store_array(sum);
                here = next;
            }
            store(&mut self.floors, s_at, s_least);
            return s_least;
        }

        let (before, after) = (self.turn * stride, (1 - self.turn) * stride);
        let l_at = FROM_LEFT * stride + before + centre - 1;
        let l_to = FROM_LEFT * stride + after + centre;
        let l_floor = load(simd, &self.floors, l_at);
        let l_p2 = lanes.p2_across(abs_diff(gray, load(simd, from, centre - 1)));
        let mut l_smaller = entering(simd, smallest, l_at, l_floor, l_p2);
        let mut l_same = entering(simd, here, l_at, l_floor, l_p2);
        let mut l_least = u8x32::splat(simd, 255);

        let r_at = FROM_RIGHT * stride + before + centre + 1;
        let r_to = FROM_RIGHT * stride + after + centre;
        let r_floor = load(simd, &self.floors, r_at);
        let r_p2 = lanes.p2_across(abs_diff(gray, load(simd, from, centre + 1)));
        let mut r_smaller = entering(simd, smallest, r_at, r_floor, r_p2);
        let mut r_same = entering(simd, here, r_at, r_floor, r_p2);
        let mut r_least = u8x32::splat(simd, 255);

        for ((sum, partner), next) in sums.iter_mut().zip(partners).zip(slots) {
            let cost = cost(&l, &descriptors(simd, partner, right.stride(), 0));

            let s_larger = entering(simd, next, s_at, s_floor, s_p2);
            let s = cost + s_same.min(s_smaller.min(s_larger) + p1);
            store(here, s_at, s);
            s_least = s_least.min(s);
            s_smaller = s_same;
            s_same = s_larger;

            let l_larger = entering(simd, next, l_at, l_floor, l_p2);
            let from_left = cost + l_same.min(l_smaller.min(l_larger) + p1);
            store(here, l_to, from_left);
            l_least = l_least.min(from_left);
            l_smaller = l_same;
            l_same = l_larger;

            let r_larger = entering(simd, next, r_at, r_floor, r_p2);
            let from_right = cost + r_same.min(r_smaller.min(r_larger) + p1);
            store(here, r_to, from_right);
            r_least = r_least.min(from_right);
            r_smaller = r_same;
            r_same = r_larger;

            s.saturating_add(from_left).saturating_add(from_right).store_array(sum);
            here = next;
        }
        store(&mut self.floors, s_at, s_least);
        store(&mut self.floors, l_to, l_least);
        store(&mut self.floors, r_to, r_least);
        s_least.saturating_add(l_least).saturating_add(r_least)
    }
}

#[inline(always)]
fn add_floors<S: Simd>(floors: &mut [u16; LANES], floor: u8x32<S>) {
    for (out, value) in floors.iter_mut().zip(floor.to_array()) {
        *out += value as u16;
    }
}

/// What the previous row's path cost adds: less its floor, and at most P2.
#[inline(always)]
fn entering<S: Simd>(simd: S, state: &[u8], at: usize, floor: u8x32<S>, p2: u8x32<S>) -> u8x32<S> {
    load(simd, state, at).saturating_sub(floor).min(p2)
}
