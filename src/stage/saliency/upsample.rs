//! From one value per cell to one per pixel.

use rayon::prelude::*;

use crate::image::{Image, Size};
use crate::stage::coarse::CELL;

/// Bilinear interpolation of a map over cells of [`CELL`] pixels at every
/// pixel of an image of `size`; outside the outermost cell centres the nearest
/// value. Cell `i` has its centre at pixel `4 i + 1.5`.
///
/// `cells` must have the size `size.divided_by(CELL)`.
pub fn upsample(cells: &Image<f32>, size: Size, out: &mut Image<f32>) {
    out.resize(size);
    if size.is_empty() || cells.size() != size.divided_by(CELL) {
        return;
    }
    out.pixels_mut().par_chunks_exact_mut(size.width).with_min_len(32).enumerate().for_each(
        |(y, out)| {
            let (upper, lower, share) = neighbours(y, cells.height());
            let (upper, lower) = (cells.row(upper), cells.row(lower));
            let vertical = |x: usize| upper[x] + share * (lower[x] - upper[x]);
            let mut left = vertical(0);
            let mut here = left;
            // Whole cells first: their length is known and they vectorise.
            let (whole, cut) = out.as_chunks_mut::<CELL>();
            let after = |x: usize| vertical((x + 1).min(cells.width() - 1));
            for (x, pixels) in whole.iter_mut().enumerate() {
                let right = after(x);
                *pixels = across(left, here, right);
                (left, here) = (here, right);
            }
            let pixels = across(left, here, after(cells.width() - 1));
            cut.copy_from_slice(&pixels[..cut.len()]);
        },
    );
}

/// The four pixels of a cell from its value and those of its neighbours.
fn across(left: f32, here: f32, right: f32) -> [f32; CELL] {
    let (before, after) = (left - here, right - here);
    [here + 0.375 * before, here + 0.125 * before, here + 0.125 * after, here + 0.375 * after]
}

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
