//! Costs summed over a block around each pixel: the classic local matchers.

use crate::simd::prelude::*;
use crate::simd::{LANES, Simd, abs_diff, load};
use crate::stage::stereo::census::Census;
use crate::stage::stereo::cost::{MAX_COST, cost, descriptors};
use crate::stage::stereo::volume::{RunShape, Volume};

/// What is summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Absolute differences of gray values, cut at [`MAX_COST`].
    Absolute,
    /// Distances of descriptors.
    Census,
}

/// Pixels from the centre of a block to its edge.
pub const RADIUS: usize = 4;

/// Columns of a tile with the blocks' overhang, in whole vectors.
const WIDE: usize = 3 * LANES;

/// Sum of a block to a byte: 8 times the mean cost.
const fn to_byte(sum: u16) -> u8 {
    const AREA: u32 = ((2 * RADIUS + 1) * (2 * RADIUS + 1)) as u32;
    const { assert!(8 * MAX_COST as u32 <= 255) };
    ((sum as u32 * 8 + AREA / 2) / AREA) as u8
}

/// Fills the rows of `volume` with the mean cost of the block around each
/// pixel. Blocks end where the run and its rows of context end: the row or
/// column there counts again.
#[inline(always)]
pub fn run<S: Simd>(
    simd: S,
    measure: Measure,
    shape: &RunShape<'_>,
    left: &Census,
    right: &Census,
    volume: &mut Volume,
) {
    let last_row = shape.context_above + shape.rows + shape.context_below - 1;
    for (k, tile) in shape.tiles.iter().enumerate() {
        for i in 0..tile.n {
            let row_of =
                |y: isize| (y + shape.context_above as isize).clamp(0, last_row as isize) as usize;
            let mut columns = [0_u16; WIDE];
            let mut costs = [0_u8; WIDE];
            let radius = RADIUS as isize;
            for y in -radius..shape.rows as isize + radius {
                row_costs(simd, measure, shape, left, right, row_of(y), k, i, &mut costs);
                for (sum, &cost) in columns.iter_mut().zip(&costs) {
                    *sum += cost as u16;
                }
                let Ok(centre) = usize::try_from(y - radius) else { continue };
                let sums = &mut volume.row_mut(k, centre)[i];
                for (x, out) in sums.iter_mut().enumerate() {
                    let from = LANES + x - RADIUS;
                    let sum: u16 = columns[from..=from + 2 * RADIUS].iter().sum();
                    *out = to_byte(sum);
                }
                let oldest = row_of(y - 2 * radius);
                row_costs(simd, measure, shape, left, right, oldest, k, i, &mut costs);
                for (sum, &cost) in columns.iter_mut().zip(&costs) {
                    *sum -= cost as u16;
                }
            }
        }
        for y in 0..shape.rows {
            volume.floor_mut(k, y).fill(0);
        }
    }
}

/// Costs of one row at one disparity: the tile's columns and a vector on
/// either side, of which the run's own border column fills what lies outside.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "the inputs of one kernel")]
fn row_costs<S: Simd>(
    simd: S,
    measure: Measure,
    shape: &RunShape<'_>,
    left: &Census,
    right: &Census,
    row: usize,
    k: usize,
    i: usize,
    out: &mut [u8; WIDE],
) {
    let tile = &shape.tiles[k];
    let most = shape.tiles.len() - 1;
    let (first, last) = (k.saturating_sub(1), (k + 1).min(most));
    for block in first..=last {
        let x = block * LANES;
        let partner = shape.right_from(x, tile) + tile.n - 1 - i;
        let cost = match measure {
            Measure::Census => {
                let l = descriptors(simd, left.planes(row), left.stride(), x);
                let r = descriptors(simd, right.planes(row), right.stride(), partner);
                cost(&l, &r)
            }
            Measure::Absolute => {
                let l = load(simd, left.gray(row), LANES + x);
                let r = load(simd, right.gray(row), LANES + partner);
                abs_diff(l, r).min(MAX_COST)
            }
        };
        let at = (block + 1 - k) * LANES;
        cost.store_slice(&mut out[at..at + LANES]);
    }
    if k == 0 {
        let border = out[LANES];
        out[..LANES].fill(border);
    }
    if k == most {
        let border = out[2 * LANES - 1];
        out[2 * LANES..].fill(border);
    }
}
