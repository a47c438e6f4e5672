//! The vertical and diagonal paths of a band, 32 columns in one vector.

use crate::simd::prelude::*;
use crate::simd::{Block, LANES, Simd, abs_diff, load, load_block, store, u8x32};
use crate::stage::stereo::census::Census;
use crate::stage::stereo::cost::{Penalties, PenaltyLanes, descriptors, hamming};
use crate::stage::stereo::engine::Finish;
use crate::stage::stereo::plan::Tile;
use crate::stage::stereo::volume::{RunShape, Seeds, Volume};

/// Path costs of one row, disparity by disparity, with padding of one vector on
/// either side and of one disparity at either end that always holds 255
/// ("nothing known": such a value is later cut to P2).
#[derive(Default)]
struct Path {
    state: Vec<u8>,
    floor: Vec<u8>,
}

impl Path {
    fn reset(&mut self, range: usize, stride: usize) {
        self.state.clear();
        self.state.resize((range + 2) * stride, 255);
        self.floor.clear();
        self.floor.resize(stride, 0);
    }
}

/// State of the paths that come down, or go up.
#[derive(Default)]
pub struct Vertical {
    straight: Path,
    /// Coming from the left, of the previous and of the current row.
    from_left: [Path; 2],
    /// Coming from the right likewise.
    from_right: [Path; 2],
    /// Sum of the paths of one row of one tile.
    sums: Vec<Block>,
    stride: usize,
}

/// What one row of one tile yields: the floors of its paths; their costs stand
/// in `Vertical::sums`.
type Floors<S> = u8x32<S>;

/// Rows of a sweep: the one at work and the one its paths come from.
struct Step {
    row: usize,
    from: usize,
}

impl Vertical {
    /// Adds the paths from above to `volume`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the inputs of one kernel")]
    pub fn down<S: Simd, const DIAGONALS: bool>(
        &mut self,
        simd: S,
        shape: &RunShape<'_>,
        penalties: Penalties,
        left: &Census,
        right: &Census,
        seeds: Option<&Seeds<'_>>,
        volume: &mut Volume,
    ) {
        self.reset::<DIAGONALS>(shape);
        if let Some(seeds) = seeds {
            self.seed::<DIAGONALS>(shape, penalties, seeds, seeds.y0 - shape.context_above);
        }
        for row in 0..shape.context_above + shape.rows {
            let step = Step { row, from: row.saturating_sub(1) };
            for (k, tile) in shape.tiles.iter().enumerate() {
                let floor =
                    self.tile::<S, DIAGONALS>(simd, shape, penalties, left, right, &step, k, tile);
                if row < shape.context_above {
                    continue;
                }
                let y = row - shape.context_above;
                for (out, sum) in volume.row_mut(k, y).iter_mut().zip(&self.sums) {
                    let sum = load_block(simd, sum).saturating_sub(floor);
                    load_block(simd, out).saturating_add(sum).store_array(out);
                }
                add_floors(volume.floor_mut(k, y), floor);
            }
            self.turn();
        }
    }

    /// Completes the sums of `volume` by the paths from below, row by row from
    /// the last one up, and hands every finished row of a tile to `finish`.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the inputs of one kernel")]
    pub fn up<S: Simd, const DIAGONALS: bool>(
        &mut self,
        simd: S,
        shape: &RunShape<'_>,
        penalties: Penalties,
        left: &Census,
        right: &Census,
        seeds: Option<&Seeds<'_>>,
        volume: &mut Volume,
        finish: &mut Finish<'_>,
    ) {
        self.reset::<DIAGONALS>(shape);
        let end = shape.context_above + shape.rows + shape.context_below;
        if let Some(seeds) = seeds {
            let last = seeds.y0 + shape.rows + shape.context_below - 1;
            self.seed::<DIAGONALS>(shape, penalties, seeds, last);
        }
        for row in (shape.context_above..end).rev() {
            let step = Step { row, from: (row + 1).min(end - 1) };
            for (k, tile) in shape.tiles.iter().enumerate() {
                let floor =
                    self.tile::<S, DIAGONALS>(simd, shape, penalties, left, right, &step, k, tile);
                let y = row - shape.context_above;
                if y >= shape.rows {
                    continue;
                }
                for (out, sum) in volume.row_mut(k, y).iter_mut().zip(&self.sums) {
                    let sum = load_block(simd, sum).saturating_sub(floor);
                    load_block(simd, out).saturating_add(sum).store_array(out);
                }
                add_floors(volume.floor_mut(k, y), floor);
                let floors = *volume.floor_mut(k, y);
                finish.row(simd, k, y, volume.row(k, y), &floors);
            }
            if row < shape.context_above + shape.rows {
                finish.vote(simd, row - shape.context_above, volume);
            }
            self.turn();
        }
    }

    #[inline(always)]
    fn reset<const DIAGONALS: bool>(&mut self, shape: &RunShape<'_>) {
        self.stride = shape.width() + 2 * LANES;
        self.straight.reset(shape.range(), self.stride);
        if DIAGONALS {
            for path in self.from_left.iter_mut().chain(&mut self.from_right) {
                path.reset(shape.range(), self.stride);
            }
        }
        let most = shape.tiles.iter().map(|t| t.n).max().unwrap_or(0);
        self.sums.resize(most, [0; LANES]);
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
        for (k, tile) in shape.tiles.iter().enumerate() {
            let mut coarse = [f32::NAN; LANES];
            for (i, coarse) in coarse.iter_mut().enumerate() {
                *coarse = seeds.at(k * LANES + i, y);
            }
            for d in tile.lo..tile.lo + tile.n {
                let at = self.index(shape, k, d);
                let lanes = Seeds::costs(&coarse, d, penalties.p2);
                self.straight.state[at..at + LANES].copy_from_slice(&lanes);
                if DIAGONALS {
                    self.from_left[0].state[at..at + LANES].copy_from_slice(&lanes);
                    self.from_right[0].state[at..at + LANES].copy_from_slice(&lanes);
                }
            }
        }
    }

    #[inline(always)]
    fn index(&self, shape: &RunShape<'_>, tile: usize, d: usize) -> usize {
        (d - shape.lo + 1) * self.stride + (tile + 1) * LANES
    }

    /// The current row becomes the previous one.
    #[inline(always)]
    fn turn(&mut self) {
        self.from_left.swap(0, 1);
        self.from_right.swap(0, 1);
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
        let right_row = right.planes(step.row);
        let right_first = shape.right_from(x, tile) + tile.n - 1;
        let base = self.index(shape, k, tile.lo);
        let sums = &mut self.sums[..tile.n];

        let s_state = &mut self.straight.state[..];
        let s_floor = load(simd, &self.straight.floor, centre);
        let s_p2 = lanes.p2_across(abs_diff(gray, load(simd, from, LANES + x)));
        let mut s_smaller = entering(simd, s_state, base - stride, s_floor, s_p2);
        let mut s_same = entering(simd, s_state, base, s_floor, s_p2);
        let mut s_least = u8x32::splat(simd, 255);

        if !DIAGONALS {
            for (i, sum) in sums.iter_mut().enumerate() {
                let at = base + i * stride;
                let r = descriptors(simd, right_row, right.stride(), right_first - i);
                let cost = hamming(&l, &r);
                let s_larger = entering(simd, s_state, at + stride, s_floor, s_p2);
                let s = cost + s_same.min(s_smaller.min(s_larger) + p1);
                store(s_state, at, s);
                s_least = s_least.min(s);
                s_smaller = s_same;
                s_same = s_larger;
                s.store_array(sum);
            }
            store(&mut self.straight.floor, centre, s_least);
            return s_least;
        }

        let [l_prev, l_next] = &mut self.from_left;
        let (l_prev_state, l_next_state) = (&l_prev.state[..], &mut l_next.state[..]);
        let l_floor = load(simd, &l_prev.floor, centre - 1);
        let l_p2 = lanes.p2_across(abs_diff(gray, load(simd, from, LANES + x - 1)));
        let mut l_smaller = entering(simd, l_prev_state, base - stride - 1, l_floor, l_p2);
        let mut l_same = entering(simd, l_prev_state, base - 1, l_floor, l_p2);
        let mut l_least = u8x32::splat(simd, 255);

        let [r_prev, r_next] = &mut self.from_right;
        let (r_prev_state, r_next_state) = (&r_prev.state[..], &mut r_next.state[..]);
        let r_floor = load(simd, &r_prev.floor, centre + 1);
        let r_p2 = lanes.p2_across(abs_diff(gray, load(simd, from, LANES + x + 1)));
        let mut r_smaller = entering(simd, r_prev_state, base - stride + 1, r_floor, r_p2);
        let mut r_same = entering(simd, r_prev_state, base + 1, r_floor, r_p2);
        let mut r_least = u8x32::splat(simd, 255);

        for (i, sum) in sums.iter_mut().enumerate() {
            let at = base + i * stride;
            let r = descriptors(simd, right_row, right.stride(), right_first - i);
            let cost = hamming(&l, &r);

            let s_larger = entering(simd, s_state, at + stride, s_floor, s_p2);
            let s = cost + s_same.min(s_smaller.min(s_larger) + p1);
            store(s_state, at, s);
            s_least = s_least.min(s);
            s_smaller = s_same;
            s_same = s_larger;

            let l_larger = entering(simd, l_prev_state, at + stride - 1, l_floor, l_p2);
            let from_left = cost + l_same.min(l_smaller.min(l_larger) + p1);
            store(l_next_state, at, from_left);
            l_least = l_least.min(from_left);
            l_smaller = l_same;
            l_same = l_larger;

            let r_larger = entering(simd, r_prev_state, at + stride + 1, r_floor, r_p2);
            let from_right = cost + r_same.min(r_smaller.min(r_larger) + p1);
            store(r_next_state, at, from_right);
            r_least = r_least.min(from_right);
            r_smaller = r_same;
            r_same = r_larger;

            s.saturating_add(from_left).saturating_add(from_right).store_array(sum);
        }
        store(&mut self.straight.floor, centre, s_least);
        store(&mut l_next.floor, centre, l_least);
        store(&mut r_next.floor, centre, r_least);
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
