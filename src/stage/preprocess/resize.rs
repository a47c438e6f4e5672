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

/// One row of cells from four rows of gray pixels. Four pixels side by side are one word,
/// so that no sum runs across a vector.
#[inline(always)]
fn mean_of_four(band: &[u8], width: usize, out: &mut [u8]) {
    const EVEN: u32 = 0x00ff_00ff;
    let n = (width / 4).min(out.len());
    let (whole, cut) = out.split_at_mut(n);
    let words = |y: usize| &band[y * width..][..4 * n].as_chunks::<4>().0[..n];
    let rows = [words(0), words(1), words(2), words(3)];
    for (i, cell) in whole.iter_mut().enumerate() {
        let mut sums = 0;
        for row in rows {
            let word = u32::from_le_bytes(row[i]);
            sums += (word & EVEN) + (word >> 8 & EVEN);
        }
        *cell = (((sums & 0xffff) + (sums >> 16) + 8) / 16) as u8;
    }
    if let (Some(cell), count @ 1..) = (cut.first_mut(), 4 * (width - 4 * n) as u32) {
        let ends = band.chunks_exact(width).flat_map(|row| &row[4 * n..]);
        let sum: u32 = ends.map(|pixel| u32::from(*pixel)).sum();
        *cell = ((sum + count / 2) / count) as u8;
    }
}

/// One row of cells from up to `F` rows of pixels.
#[inline(always)]
fn mean_band<const C: usize, const F: usize>(band: &[u8], width: usize, out: &mut [u8]) {
    let height = band.len() / (width * C);
    if C == 1 && F == 4 && height == F {
        mean_of_four(band, width, out);
        return;
    }
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
