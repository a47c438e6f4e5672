//! From one value per cell to one per pixel.

use std::ops::Range;

use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, padded, prelude::*};
use crate::stage::coarse::CELL;

/// Cells that are taken at once.
const LANES: usize = 16;

/// Bilinear interpolation of a map over cells of [`CELL`] pixels at every
/// pixel of an image of `size`; outside the outermost cell centres the nearest
/// value. Cell `i` has its centre at pixel `4 i + 1.5`.
///
/// `cells` must have the size `size.divided_by(CELL)`. One thread: outputs ask for it
/// as well, which have no share in the workers.
pub fn upsample(level: Level, cells: &Image<f32>, size: Size, out: &mut Image<f32>) {
    out.resize(size);
    if size.is_empty() || cells.size() != size.divided_by(CELL) {
        return;
    }
    dispatch!(level, simd => {
        for (y, out) in out.pixels_mut().chunks_exact_mut(size.width).enumerate() {
            Rows::at(cells, y).spread(simd, 0..cells.width(), out);
        }
    });
}

/// The rows of cells above and below a row of pixels, and the share of the latter.
pub(in crate::stage) struct Rows<'a> {
    upper: &'a [f32],
    lower: &'a [f32],
    share: f32,
}

impl<'a> Rows<'a> {
    /// Those of row `y` of pixels.
    #[inline(always)]
    pub(in crate::stage) fn at(cells: &'a Image<f32>, y: usize) -> Self {
        let (upper, lower, share) = neighbours(y, cells.height());
        Self { upper: cells.row(upper), lower: cells.row(lower), share }
    }
}

impl Rows<'_> {
    /// Writes the pixels of `cells`, and of others, into their row `out`.
    #[inline(always)]
    pub(in crate::stage) fn spread<S: Simd>(&self, simd: S, cells: Range<usize>, out: &mut [f32]) {
        let last = self.upper.len() - 1;
        let end = cells.end.min(last);
        // Cells with neighbours on both sides; the last of them once more.
        if let Some(latest) = last.checked_sub(LANES).filter(|latest| *latest > 0) {
            let mut x = cells.start.clamp(1, latest);
            while x < end {
                let from = x.min(latest);
                self.spread_cells(simd, from, &mut out[from * CELL..(from + LANES) * CELL]);
                x += LANES;
            }
        } else {
            for x in cells.start.max(1)..end {
                self.spread_cell(x, &mut out[x * CELL..(x + 1) * CELL]);
            }
        }
        for x in [0, last] {
            if cells.contains(&x) {
                let end = out.len().min((x + 1) * CELL);
                self.spread_cell(x, &mut out[x * CELL..end]);
            }
        }
    }

    /// The value between the rows at cell `x`.
    #[inline(always)]
    fn value(&self, x: usize) -> f32 {
        self.upper[x] + self.share * (self.lower[x] - self.upper[x])
    }

    #[inline(always)]
    fn spread_cell(&self, x: usize, out: &mut [f32]) {
        let here = self.value(x);
        let before = self.value(x.saturating_sub(1)) - here;
        let after = self.value((x + 1).min(self.upper.len() - 1)) - here;
        let pixels = [(before, OUTER), (before, INNER), (after, INNER), (after, OUTER)];
        for (out, (step, share)) in out.iter_mut().zip(pixels) {
            *out = here + share * step;
        }
    }

    #[inline(always)]
    fn spread_cells<S: Simd>(&self, simd: S, x: usize, out: &mut [f32]) {
        let around = [self.lanes(simd, x - 1), self.lanes(simd, x), self.lanes(simd, x + 1)];
        let pixels = between(around);
        for (out, pixels) in out.as_chunks_mut::<LANES>().0.iter_mut().zip(pixels) {
            pixels.store_slice(out);
        }
    }

    /// One bit for each pixel of the cells from `x` on that is at least `threshold`.
    #[inline(always)]
    fn compare<S: Simd>(&self, simd: S, x: usize, threshold: f32) -> u64 {
        let last = self.upper.len() - 1;
        let before = f32x16::splat(simd, self.value(x.saturating_sub(1)));
        let after = f32x16::splat(simd, self.value((x + LANES).min(last)));
        let here = if x + LANES <= self.upper.len() {
            self.lanes(simd, x)
        } else {
            // The last value goes on beyond the end.
            let upper: f32x16<S> = padded(simd, self.upper, x, self.upper[last]);
            let lower: f32x16<S> = padded(simd, self.lower, x, self.lower[last]);
            upper + (lower - upper) * self.share
        };
        let around = [before.slide::<{ LANES - 1 }>(here), here, here.slide::<1>(after)];
        let mut bits = 0;
        for (i, pixels) in between(around).into_iter().enumerate() {
            bits |= pixels.simd_ge(threshold).to_bitmask() << (i * LANES);
        }
        bits
    }

    #[inline(always)]
    fn lanes<S: Simd>(&self, simd: S, x: usize) -> f32x16<S> {
        let upper = f32x16::from_slice(simd, &self.upper[x..x + LANES]);
        let lower = f32x16::from_slice(simd, &self.lower[x..x + LANES]);
        upper + (lower - upper) * self.share
    }
}

/// Sets the bits of the pixels of row `y` of cells that are at least `threshold`, pixel `i % 64`
/// of word `i / 64` of each of four rows of pixels, or of fewer at the lower edge; beyond
/// the last pixel of a row they mean nothing. Values are those of attention, 0..=1.
#[inline(always)]
pub(in crate::stage) fn compare<S: Simd>(
    simd: S,
    cells: &Image<f32>,
    y: usize,
    threshold: f32,
    words: &mut [u64],
) {
    let stride = cells.width().div_ceil(LANES);
    let near = Near {
        rows: [y.saturating_sub(1), y, (y + 1).min(cells.height() - 1)].map(|y| cells.row(y)),
        limits: [threshold - ROUNDING, threshold + ROUNDING],
    };
    // Of the cells before, at the edge none or all as those behind it.
    let mut before = [0, u64::MAX];
    let mut here = near.bits(simd, 0);
    for i in 0..stride {
        let after = if i + 1 < stride { near.bits(simd, (i + 1) * LANES) } else { [0, u64::MAX] };
        let beside = [0, 1].map(|k| (before[k] >> (LANES - 1) & 1, after[k] & 1));
        let some = here[0] != 0 || beside[0] != (0, 0);
        let all = here[1] == (1 << LANES) - 1 && beside[1] == (1, 1);
        for (row, words) in words.chunks_exact_mut(stride).enumerate() {
            words[i] = match (some, all) {
                (false, _) => 0,
                (_, true) => u64::MAX,
                _ => Rows::at(cells, y * CELL + row).compare(simd, i * LANES, threshold),
            };
        }
        (before, here) = (here, after);
    }
}

/// What is between values exceeds none of them by more.
const ROUNDING: f32 = 1e-3;

/// Rows of cells that the pixels of the middle one are between.
struct Near<'a> {
    rows: [&'a [f32]; 3],
    limits: [f32; 2],
}

impl Near<'_> {
    /// Of the cells from `x` on, which have one at least as large as the lower limit, and
    /// which have three as the upper one; the last cell goes on beyond the end.
    #[inline(always)]
    fn bits<S: Simd>(&self, simd: S, x: usize) -> [u64; 2] {
        let last = self.rows[1].len() - 1;
        let middle: f32x16<S> = padded(simd, self.rows[1], x, self.rows[1][last]);
        let [mut most, mut least] = [middle; 2];
        for row in [self.rows[0], self.rows[2]] {
            let row: f32x16<S> = padded(simd, row, x, row[last]);
            (most, least) = (most.max(row), least.min(row));
        }
        [most.simd_ge(self.limits[0]).to_bitmask(), least.simd_ge(self.limits[1]).to_bitmask()]
    }
}

/// The pixels of cells in their order, from the values of the cells before, of
/// themselves and of those after.
#[inline(always)]
fn between<S: Simd>([before, here, after]: [f32x16<S>; 3]) -> [f32x16<S>; CELL] {
    let (before, after) = (before - here, after - here);
    let (first, third) = (here + before * OUTER, here + after * INNER);
    let (second, fourth) = (here + before * INNER, here + after * OUTER);
    let (odd, even) = (first.interleave(third), second.interleave(fourth));
    let (low, high) = (odd.0.interleave(even.0), odd.1.interleave(even.1));
    [low.0, low.1, high.0, high.1]
}

/// Shares of the neighbour in a cell's outer and inner pixels.
const OUTER: f32 = 0.375;
const INNER: f32 = 0.125;

/// The cells on both sides of pixel `at`, and the share of the second.
fn neighbours(at: usize, cells: usize) -> (usize, usize, f32) {
    let cell = at / CELL;
    match at % CELL {
        0 => (cell, cell.saturating_sub(1), 0.375),
        1 => (cell, cell.saturating_sub(1), 0.125),
        2 => (cell, (cell + 1).min(cells - 1), 0.125),
        _ => (cell, (cell + 1).min(cells - 1), 0.375),
    }
}

// The four phases above are written out for this cell size.
const _: () = assert!(CELL == 4);
