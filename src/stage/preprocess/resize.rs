//! Area resize by a whole factor.

use rayon::prelude::*;

use crate::simd::{Level, dispatch};

/// Pixels summed at once along a row: bounds the stack buffer of column sums.
const STRIP: usize = 256;

/// Means over `F` x `F` pixels of `C` interleaved channels, rounded to nearest.
///
/// `pixels` has rows of `width` pixels, `out` rows of `out_width`; a cell that
/// the image's edge cuts averages the pixels it has, and pixels beyond the last
/// cell of `out` are left out.
pub fn box_mean<const C: usize, const F: usize>(
    level: Level,
    pixels: &[u8],
    width: usize,
    out: &mut [u8],
    out_width: usize,
) {
    // Cells are summed in 16 bits, and a strip ends at a whole cell.
    const { assert!(C <= 3 && F * F * 255 <= u16::MAX as usize && STRIP.is_multiple_of(F)) };
    if pixels.is_empty() || out.is_empty() {
        return;
    }
    let bands = pixels.par_chunks(width * C * F);
    bands.zip(out.par_chunks_exact_mut(out_width * C)).with_min_len(16).for_each(|(band, out)| {
        dispatch!(level, _simd => mean_band::<C, F>(band, width, out));
    });
}

/// One row of cells from up to `F` rows of pixels.
#[inline(always)]
fn mean_band<const C: usize, const F: usize>(band: &[u8], width: usize, out: &mut [u8]) {
    let height = band.len() / (width * C);
    // Column sums first: they run along whole rows and vectorise.
    let mut sums = [0_u16; STRIP * 3];
    for x in (0..width).step_by(STRIP) {
        let columns = STRIP.min(width - x);
        let sums = &mut sums[..columns * C];
        sums.fill(0);
        for row in band.chunks_exact(width * C) {
            for (sum, &value) in sums.iter_mut().zip(&row[x * C..]) {
                *sum += u16::from(value);
            }
        }
        let Some(out) = out.get_mut(x / F * C..) else { continue };
        let mut cells = out.chunks_exact_mut(C);
        // Whole cells have a known number of pixels: no division.
        let whole = if height == F { sums.len() / (F * C) } else { 0 };
        for (cell, sums) in cells.by_ref().zip(sums.chunks_exact(F * C)).take(whole) {
            for c in 0..C {
                let sum: u16 = (0..F).map(|i| sums[i * C + c]).sum();
                cell[c] = ((sum as usize + F * F / 2) / (F * F)) as u8;
            }
        }
        for (cell, sums) in cells.zip(sums[whole * F * C..].chunks(F * C)) {
            let count = (height * sums.len() / C) as u32;
            for (c, value) in cell.iter_mut().enumerate() {
                let sum: u32 = sums[c..].iter().step_by(C).map(|&s| u32::from(s)).sum();
                *value = ((sum + count / 2) / count) as u8;
            }
        }
    }
}
