//! Illumination normalisation of gray views.

use rayon::prelude::*;

use crate::image::Image;

/// Tiles along each axis of contrast-limited equalisation.
const TILES: usize = 8;
/// A histogram bin holds at most this many times its fair share.
const CLIP: usize = 2;
/// Interpolation weights are in 1/256.
const ONE: usize = 256;

/// Contrast-limited adaptive histogram equalisation (Zuiderveld 1994): the
/// image in at most 8x8 tiles, each with the equalising curve of its histogram
/// clipped at twice the fair share of a bin, curves interpolated bilinearly
/// between tile centres.
#[derive(Default)]
pub struct Clahe {
    curves: Vec<[u8; 256]>,
}

impl Clahe {
    /// Equalises `gray` in place.
    pub fn run(&mut self, gray: &mut Image<u8>) {
        if gray.size().is_empty() {
            return;
        }
        let (width, height) = (gray.width(), gray.height());
        let tile = (width.div_ceil(TILES), height.div_ceil(TILES));
        let tiles = (width.div_ceil(tile.0), height.div_ceil(tile.1));
        self.curves.resize(tiles.0 * tiles.1, [0; 256]);
        for (i, curve) in self.curves.iter_mut().enumerate() {
            let (x, y) = (i % tiles.0 * tile.0, i / tiles.0 * tile.1);
            let (x_end, y_end) = ((x + tile.0).min(width), (y + tile.1).min(height));
            let mut histogram = [0_usize; 256];
            for y in y..y_end {
                for &value in &gray.row(y)[x..x_end] {
                    histogram[usize::from(value)] += 1;
                }
            }
            *curve = equalising_curve(&mut histogram, (x_end - x) * (y_end - y));
        }
        let curves = &self.curves;
        gray.pixels_mut().par_chunks_exact_mut(width).with_min_len(8).enumerate().for_each(
            |(y, row)| {
                let (upper, lower, fy) = between(y, tile.1, tiles.1);
                let (upper, lower) = (&curves[upper * tiles.0..], &curves[lower * tiles.0..]);
                for (x, value) in row.iter_mut().enumerate() {
                    let (left, right, fx) = between(x, tile.0, tiles.0);
                    let v = usize::from(*value);
                    let curve = |curves: &[[u8; 256]], i: usize| usize::from(curves[i][v]);
                    let above = curve(upper, left) * (ONE - fx) + curve(upper, right) * fx;
                    let below = curve(lower, left) * (ONE - fx) + curve(lower, right) * fx;
                    let sum = above * (ONE - fy) + below * fy;
                    *value = ((sum + ONE * ONE / 2) / (ONE * ONE)) as u8;
                }
            },
        );
    }
}

/// The tiles whose centres lie on both sides of `at`, and the share of the second.
fn between(at: usize, tile: usize, tiles: usize) -> (usize, usize, usize) {
    // Twice the distance from the first centre, so that half pixels stay whole.
    let Some(twice) = (2 * at + 1).checked_sub(tile) else { return (0, 0, 0) };
    let first = twice / (2 * tile);
    if first + 1 >= tiles {
        return (tiles - 1, tiles - 1, 0);
    }
    (first, first + 1, (twice - first * 2 * tile) * ONE / (2 * tile))
}

fn equalising_curve(histogram: &mut [usize; 256], area: usize) -> [u8; 256] {
    let limit = (CLIP * area / 256).max(1);
    let mut excess = 0;
    for bin in histogram.iter_mut() {
        excess += bin.saturating_sub(limit);
        *bin = (*bin).min(limit);
    }
    let (each, rest) = (excess / 256, excess % 256);
    for (i, bin) in histogram.iter_mut().enumerate() {
        // The rest is spread evenly: bin i gets one where i * rest / 256 steps up.
        *bin += each + usize::from((i + 1) * rest / 256 > i * rest / 256);
    }
    let mut curve = [0; 256];
    let mut sum = 0;
    for (value, count) in curve.iter_mut().zip(histogram) {
        sum += *count;
        *value = ((sum * 255 + area / 2) / area) as u8;
    }
    curve
}

/// Gives `right` the mean and the contrast (standard deviation) of `left`; the
/// contrast changes at most by a factor of two.
pub fn match_contrast(left: &Image<u8>, right: &mut Image<u8>) {
    let (mean_left, deviation_left) = moments(left);
    let (mean_right, deviation_right) = moments(right);
    let gain = if deviation_right > 0.0 {
        (deviation_left / deviation_right).clamp(0.5, 2.0)
    } else {
        1.0
    };
    let mut curve = [0_u8; 256];
    for (value, mapped) in curve.iter_mut().enumerate() {
        // The cast saturates at 0 and 255.
        *mapped = ((value as f64 - mean_right) * gain + mean_left).round() as u8;
    }
    for value in right.pixels_mut() {
        *value = curve[usize::from(*value)];
    }
}

/// Mean and standard deviation; whole-number sums, so that their order is free.
fn moments(gray: &Image<u8>) -> (f64, f64) {
    let count = gray.pixels().len().max(1) as f64;
    let (sum, squares) = gray.pixels().iter().fold((0_u64, 0_u64), |(sum, squares), &value| {
        let value = u64::from(value);
        (sum + value, squares + value * value)
    });
    let mean = sum as f64 / count;
    (mean, (squares as f64 / count - mean * mean).max(0.0).sqrt())
}
