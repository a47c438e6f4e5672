//! From pixels to cells: the median disparity of each.

use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, mask32x16, padded, prelude::*};
use crate::stage::coarse::CELL;
use crate::stage::regions::RegionSource;
use crate::stage::roi::bits::{BitMask, bits_from, even_bits};
use crate::stage::standing::{HIGH, WIDE, cells};

/// Places in a cell whose disparities are asked; their median is the cell's.
const SAMPLES: [(usize, usize); 4] = [(0, 0), (1, 1), (0, 2), (1, 3)];
/// A sorting network of as many (Batcher 1968).
const EXCHANGES: [(usize, usize); 5] = [(0, 1), (2, 3), (0, 2), (1, 3), (1, 2)];
/// Samples with disparity that a cell needs.
const LEAST_SAMPLES: usize = 2;

/// Cells whose medians are taken at once, and their pixels in a row.
const LANES: usize = 16;
const PIXELS: usize = LANES * WIDE;
/// Coarse cells of as many pixels.
const COARSE: usize = PIXELS / CELL;

// A row of cells is a row of coarse cells, and a group's bits are a part of a word.
const _: () = assert!(HIGH == CELL && WIDE == 2 && 2 * WIDE == CELL && 64 % LANES == 0);

/// Fills `map` with the disparity of each cell, and sets the bit in `fine` of
/// those whose disparity is a fine one, because they lie in what was matched.
pub fn shrink(level: Level, source: &RegionSource<'_>, map: &mut Image<f32>, fine: &mut BitMask) {
    let size = source.disparity.size();
    map.resize(cells(size));
    fine.reset(cells(size));
    let offset = source.rig.disparity_offset() as f32;
    for cy in 0..map.height() {
        let rows: [usize; HIGH] = std::array::from_fn(|i| (cy * HIGH + i).min(size.height - 1));
        let row = Row {
            disparity: rows.map(|y| source.disparity.row(y)),
            matched: [rows[0], rows[HIGH - 1]].map(|y| source.roi.matched.row(y)),
            coarse: source.coarse.checked.row(cy),
            offset,
        };
        dispatch!(level, simd => row.shrink(simd, map.row_mut(cy), fine.row_mut(cy)));
    }
}

/// What one row of cells is made from.
struct Row<'a> {
    disparity: [&'a [f32]; HIGH],
    /// The first and the last row.
    matched: [&'a [u64]; 2],
    coarse: &'a [f32],
    offset: f32,
}

impl Row<'_> {
    #[inline(always)]
    fn shrink<S: Simd>(&self, simd: S, map: &mut [f32], fine: &mut [u64]) {
        let (groups, rest) = map.as_chunks_mut::<LANES>();
        let whole = groups.len();
        for (i, group) in groups.iter_mut().enumerate() {
            self.cells(simd, i, fine).store_array(group);
        }
        if !rest.is_empty() {
            rest.copy_from_slice(&self.cells(simd, whole, fine).as_slice()[..rest.len()]);
        }
    }

    /// The cells of group `i`, whose bits in `fine` are set.
    #[inline(always)]
    fn cells<S: Simd>(&self, simd: S, i: usize, fine: &mut [u64]) -> f32x16<S> {
        let x = i * PIXELS;
        // What was not matched finely is known coarsely.
        let coarse: f32x16<S> = padded(simd, self.coarse, i * COARSE, f32::NAN);
        let coarse = coarse - self.offset;
        let mut values = coarse.zip_low(coarse);
        let [upper, lower] = self.matched;
        let matched = cells_of(upper, lower, x);
        if matched != 0 {
            let medians = medians_of(simd, &self.disparity, x);
            let known = medians.simd_eq(medians).to_bitmask() & matched;
            values = mask32x16::from_bitmask(simd, known).select(medians, values);
            fine[i * LANES / 64] |= known << (i * LANES % 64);
        }
        values
    }
}

/// One bit for each of [`LANES`] cells from pixel `x` on of which a pixel of one of two
/// rows is set.
#[inline(always)]
fn cells_of(upper: &[u64], lower: &[u64], x: usize) -> u64 {
    let any = bits_from(upper, x) | bits_from(lower, x);
    even_bits(any | any >> 1) & ((1 << LANES) - 1)
}

/// Median disparity of some of the pixels of each of several cells, whose rows
/// are given, from column `from` on; NaN with too few.
#[inline(always)]
fn medians_of<S: Simd>(simd: S, rows: &[&[f32]; HIGH], from: usize) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let nowhere = f32x16::splat(simd, f32::INFINITY);
    let mut sorted = [zero; SAMPLES.len()];
    let mut n = zero;
    for (sample, (dx, dy)) in sorted.iter_mut().zip(SAMPLES) {
        // The last column goes on beyond the edge.
        let (row, last) = (rows[dy], rows[dy][rows[dy].len() - 1]);
        let left: f32x16<S> = padded(simd, row, from, last);
        let right: f32x16<S> = padded(simd, row, from + LANES, last);
        let d = if dx == 0 { left.unzip_low(right) } else { left.unzip_high(right) };
        // Holes go to the end.
        let known = d.simd_eq(d);
        n += known.select(one, zero);
        *sample = known.select(d, nowhere);
    }
    for (i, j) in EXCHANGES {
        (sorted[i], sorted[j]) = (sorted[i].min(sorted[j]), sorted[i].max(sorted[j]));
    }
    // The upper one of an even number.
    let mut medians = f32x16::splat(simd, f32::NAN);
    for count in LEAST_SAMPLES..=SAMPLES.len() {
        medians = n.simd_eq(count as f32).select(sorted[count / 2], medians);
    }
    medians
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd;

    #[test]
    fn the_median_is_that_of_the_samples_that_there_are() {
        // Every pattern of holes, in each cell another order of the values.
        for holes in 0_u32..16 {
            let mut values = [[0.0_f32; PIXELS]; HIGH];
            let mut kept = [(); LANES].map(|()| Vec::new());
            for (turn, kept) in kept.iter_mut().enumerate() {
                for (i, (x, y)) in SAMPLES.into_iter().enumerate() {
                    let hole = holes >> i & 1 == 1;
                    let value = ((i * 3 + turn) % 4) as f32;
                    values[y][turn * WIDE + x] = if hole { f32::NAN } else { value };
                    kept.extend((!hole).then_some(value));
                }
                kept.sort_by(f32::total_cmp);
            }
            let rows: [&[f32]; HIGH] = std::array::from_fn(|y| &values[y][..]);
            for level in simd::available() {
                let found: [f32; LANES] =
                    dispatch!(level, simd => medians_of(simd, &rows, 0).to_array());
                for (kept, found) in kept.iter().zip(found) {
                    if kept.len() < LEAST_SAMPLES {
                        assert!(found.is_nan());
                    } else {
                        assert_eq!(found.to_bits(), kept[kept.len() / 2].to_bits(), "{holes:b}");
                    }
                }
            }
        }
    }
}
