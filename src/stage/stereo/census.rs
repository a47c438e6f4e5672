//! The census transform: which pixels of a window are brighter than its centre.

use crate::image::Image;
use crate::simd::prelude::*;
use crate::simd::{LANES, Simd, load, store, u8x32};

/// Columns of context on either side of a pixel.
pub const REACH_X: usize = 4;
/// Rows of context on either side of a pixel.
pub const REACH_Y: usize = 3;

/// Byte planes of a descriptor.
pub const PLANES: usize = 4;

/// Offsets (dx, dy) of the 9x7 window's pixels in reading order: bit k is set
/// where the pixel at offset k is brighter than the centre (Zabih and Woodfill
/// 1994). Of the window, seen as a chessboard, the 32 squares are taken whose
/// colour is not that of the centre: they fill four bytes.
pub const OFFSETS: [(isize, isize); 32] = {
    let mut offsets = [(0, 0); 32];
    let (mut k, mut i) = (0, 0);
    while k < 32 {
        let (dx, dy) = (i % 9 - 4, i / 9 - 3);
        if (dx + dy) % 2 != 0 {
            offsets[k] = (dx, dy);
            k += 1;
        }
        i += 1;
    }
    offsets
};

/// Gray rows and descriptors of a rectangle that may reach beyond the image,
/// whose pixels are then those of the border.
#[derive(Default)]
pub struct Census {
    gray: Vec<u8>,
    gray_stride: usize,
    planes: Vec<u8>,
    stride: usize,
    rows: usize,
}

impl Census {
    /// Computes columns `x0 .. x0 + width` (rounded up to whole vectors) of
    /// rows `y0 .. y0 + rows`.
    #[inline(always)]
    pub fn run<S: Simd>(
        &mut self,
        simd: S,
        image: &Image<u8>,
        x0: isize,
        width: usize,
        y0: usize,
        rows: usize,
    ) {
        self.stride = width.next_multiple_of(LANES);
        self.gray_stride = self.stride + 2 * LANES;
        self.rows = rows;
        self.gray.resize(self.gray_stride * (rows + 2 * REACH_Y), 0);
        self.planes.resize(self.stride * PLANES * rows, 0);
        for (i, row) in self.gray.chunks_exact_mut(self.gray_stride).enumerate() {
            let y = (y0 + i).saturating_sub(REACH_Y).min(image.height() - 1);
            copy_clamped(image.row(y), x0 - LANES as isize, row);
        }
        for (i, planes) in self.planes.chunks_exact_mut(self.stride * PLANES).enumerate() {
            let gray = &self.gray[i * self.gray_stride..(i + 2 * REACH_Y + 1) * self.gray_stride];
            for x in (0..self.stride).step_by(LANES) {
                let at = REACH_Y * self.gray_stride + LANES + x;
                let centre = load(simd, gray, at);
                for plane in 0..PLANES {
                    let mut byte = u8x32::splat(simd, 0);
                    for &(dx, dy) in OFFSETS.iter().skip(plane * 8).take(8).rev() {
                        let step = dy * self.gray_stride as isize + dx;
                        let pixel = load(simd, gray, (at as isize + step) as usize);
                        byte = byte + byte + pixel.saturating_sub(centre).min(1);
                    }
                    store(planes, plane * self.stride + x, byte);
                }
            }
        }
    }

    /// Distance of a descriptor's byte planes.
    pub const fn stride(&self) -> usize {
        self.stride
    }

    /// The four byte planes of row `row`, one after the other.
    #[inline(always)]
    pub fn planes(&self, row: usize) -> &[u8] {
        &self.planes[row * PLANES * self.stride..(row + 1) * PLANES * self.stride]
    }

    /// Gray values of row `row`; column `x0` stands at index [`LANES`].
    #[inline(always)]
    pub fn gray(&self, row: usize) -> &[u8] {
        let at = (row + REACH_Y) * self.gray_stride;
        &self.gray[at..at + self.gray_stride]
    }
}

/// Copies from column `x0` on; beyond the ends the border pixel is repeated.
fn copy_clamped(row: &[u8], x0: isize, out: &mut [u8]) {
    let width = row.len() as isize;
    let end = x0 + out.len() as isize;
    let (from, to) = (x0.clamp(0, width), end.clamp(0, width));
    let left = (from - x0).min(out.len() as isize) as usize;
    let middle = (to - from) as usize;
    out[..left].fill(row[0]);
    out[left..left + middle].copy_from_slice(&row[from as usize..to as usize]);
    out[left + middle..].fill(row[row.len() - 1]);
}
