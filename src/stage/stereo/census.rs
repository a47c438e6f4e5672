//! What a pixel is recognised by: the census of its surroundings and its gradient.

use crate::image::Image;
use crate::simd::prelude::*;
use crate::simd::{LANES, Simd, load, store, u8x32};

/// Columns of context on either side of a pixel.
pub const REACH_X: usize = 3;
/// Rows of context on either side of a pixel.
pub const REACH_Y: usize = 3;

/// Byte planes of a descriptor: three of census bits, and the horizontal Sobel
/// gradient, cut to -63..=63 and quantised to 0..=31.
pub const PLANES: usize = 4;

/// Offsets (dx, dy) of the 7x7 window's pixels in reading order: bit k is set
/// where the pixel at offset k is brighter than the centre (Zabih and Woodfill
/// 1994). Of the window, seen as a chessboard, the 24 squares are taken whose
/// colour is not that of the centre: they fill three bytes.
pub const OFFSETS: [(isize, isize); 24] = {
    let mut offsets = [(0, 0); 24];
    let (mut k, mut i) = (0, 0);
    while k < 24 {
        let (dx, dy) = (i % 7 - 3, i / 7 - 3);
        if (dx + dy) % 2 != 0 {
            offsets[k] = (dx, dy);
            k += 1;
        }
        i += 1;
    }
    offsets
};

/// Bits of 32 descriptors, the uppermost first. (A loop would not be unrolled,
/// and offsets that are known only at run time cost two checks each.)
macro_rules! plane {
    ($simd:expr, $window:expr, $($bit:literal)+) => {{
        let mut byte = u8x32::splat($simd, 0);
        $(byte = byte + byte + brighter::<S, $bit>($simd, $window);)+
        byte
    }};
}

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
            let (first, rest) = planes.split_at_mut(self.stride);
            let (second, rest) = rest.split_at_mut(self.stride);
            let (third, gradients) = rest.split_at_mut(self.stride);
            for x in (0..self.stride).step_by(LANES) {
                let window = window(gray, self.gray_stride, LANES + x - REACH_X);
                store(first, x, plane!(simd, &window, 7 6 5 4 3 2 1 0));
                store(second, x, plane!(simd, &window, 15 14 13 12 11 10 9 8));
                store(third, x, plane!(simd, &window, 23 22 21 20 19 18 17 16));
            }
            let rows = [REACH_Y - 1, REACH_Y, REACH_Y + 1]
                .map(|row| &gray[row * self.gray_stride + LANES - 1..][..self.stride + 2]);
            gradient_row(rows, gradients);
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

/// Columns that the descriptors of one vector look at.
const SPAN: usize = LANES + 2 * REACH_X;

/// What the descriptors of one vector look at. (Of known size, so that no
/// access needs a check.)
type Window<'a> = [&'a [u8; SPAN]; 2 * REACH_Y + 1];

#[inline(always)]
fn window(gray: &[u8], stride: usize, at: usize) -> Window<'_> {
    let mut window = [&[0; SPAN]; 2 * REACH_Y + 1];
    for (i, row) in window.iter_mut().enumerate() {
        if let Some(span) = gray[i * stride + at..].first_chunk() {
            *row = span;
        }
    }
    window
}

/// 1 where bit `BIT` of a descriptor is set.
#[inline(always)]
fn brighter<S: Simd, const BIT: usize>(simd: S, window: &Window<'_>) -> u8x32<S> {
    let (dx, dy) = const { OFFSETS[BIT] };
    let (x, y) = ((REACH_X as isize + dx) as usize, (REACH_Y as isize + dy) as usize);
    let pixel = load(simd, window[y], x);
    pixel.saturating_sub(load(simd, window[REACH_Y], REACH_X)).min(1)
}

/// Gradients of the middle one of three rows, which begin one column earlier.
#[inline(always)]
fn gradient_row([above, here, below]: [&[u8]; 3], out: &mut [u8]) {
    let windows = above.windows(3).zip(here.windows(3)).zip(below.windows(3));
    for (out, ((a, b), c)) in out.iter_mut().zip(windows) {
        let rise = |w: &[u8]| w[2] as i16 - w[0] as i16;
        let sobel = rise(a) + 2 * rise(b) + rise(c);
        *out = ((sobel.clamp(-63, 63) + 63) / 4) as u8;
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
