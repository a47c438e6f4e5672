//! What is beside a segment.

use super::column::Segment;
use crate::image::Image;
use crate::simd::{Simd, f32x16, prelude::*};
use crate::stage::regions::components::{TOLERANCE_PART, TOLERANCE_PX, tolerance};

/// Cells beside a thing in which its background is looked for.
const LOOK_ASIDE: usize = 6;
/// Cells that are read for that, and those before the segment's own.
const LANES: usize = 16;
const BEFORE: usize = LANES / 2;
/// Bits of the cells to the left and to the right.
const LEFT: u64 = ((1 << LOOK_ASIDE) - 1) << (BEFORE - LOOK_ASIDE);
const RIGHT: u64 = ((1 << LOOK_ASIDE) - 1) << (BEFORE + 1);

// All of them are read.
const _: () = assert!(BEFORE >= LOOK_ASIDE && BEFORE + LOOK_ASIDE < LANES);

/// How many cells to the left and to the right of a segment are farther than
/// it, and how many are nearer: in each row the nearest ones with a disparity.
#[inline(always)]
pub fn sides<S: Simd>(simd: S, disparity: &Image<f32>, s: &Segment) -> [u32; 2] {
    let (x, d) = (s.x as usize, s.disparity());
    let own = f32x16::splat(simd, d);
    let (mut farther, mut nearer) = (0, 0);
    for y in s.upper as usize..s.lower as usize {
        let cells = f32x16::load_array(simd, around(disparity.row(y), x));
        let known = cells.simd_eq(cells).to_bitmask();
        let (left, right) = (known & LEFT, known & RIGHT);
        let nearest = left.checked_ilog2().map_or(0, |i| 1 << i) | (right & right.wrapping_neg());
        // As `agree` says.
        let lead = (cells * TOLERANCE_PART).max(TOLERANCE_PX);
        farther += ((own - cells).simd_gt(tolerance(d)).to_bitmask() & nearest).count_ones();
        nearer += ((cells - own).simd_gt(lead).to_bitmask() & nearest).count_ones();
    }
    [farther, nearer]
}

/// The cells of a row around column `x`; NaN beyond its ends.
#[inline(always)]
fn around(row: &[f32], x: usize) -> [f32; LANES] {
    if let Some(cells) = row.get(x.wrapping_sub(BEFORE)..).and_then(<[f32]>::first_chunk) {
        return *cells;
    }
    let mut cells = [f32::NAN; LANES];
    for (i, cell) in cells.iter_mut().enumerate() {
        let x = (x + i).checked_sub(BEFORE);
        *cell = x.and_then(|x| row.get(x)).copied().unwrap_or(f32::NAN);
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;
    use crate::simd::{self, dispatch};
    use crate::stage::regions::components::agree;
    use crate::stage::standing::column::Top;

    #[test]
    fn the_nearest_cells_with_disparity_count() {
        let size = Size::new(41, 24);
        let map = Image::from_fn(size, |x, y| match (x * 5 + y * 11 + x * y % 7) % 13 {
            0..8 => f32::NAN,
            n => 8.0 + 0.4 * n as f32,
        });
        let plain = |s: &Segment| {
            let mut counts = [0, 0];
            for y in s.upper..s.lower {
                let cell = |x: Option<u32>| {
                    let x = x? as usize;
                    (x < size.width).then(|| map.get(x, y as usize)).filter(|d| !d.is_nan())
                };
                let left = (1..=6).find_map(|k| cell(s.x.checked_sub(k)));
                let right = (1..=6).find_map(|k| cell(s.x.checked_add(k)));
                for near in [left, right].into_iter().flatten() {
                    if !agree(near, s.disparity()) {
                        counts[usize::from(near > s.disparity())] += 1;
                    }
                }
            }
            counts
        };
        let mut all = [0, 0];
        for x in 0..size.width as u32 {
            let segment = Segment {
                x,
                upper: 2 + x % 5,
                lower: 24 - x % 3,
                reach: 0,
                cells: 2,
                sum: 24.0 + (x % 4) as f32 * 0.05,
                bottom_m: 0.0,
                top_m: 1.0,
                contact: true,
                top: Top::Free,
            };
            let expected = plain(&segment);
            all = [all[0] + expected[0], all[1] + expected[1]];
            for level in simd::available() {
                let found = dispatch!(level, simd => sides(simd, &map, &segment));
                assert_eq!(found, expected, "column {x}, {level:?}");
            }
        }
        assert!(all.iter().all(|count| *count > 100), "{all:?}");
    }
}
