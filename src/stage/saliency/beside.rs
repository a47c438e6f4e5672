//! Agreement with what is beside at the same depth.

use crate::image::Image;
use crate::simd::{Level, dispatch};

/// Cells on either side.
const REACH: usize = 3;
/// Largest difference in disparity: pixels, and in parts.
const SAME_PX: f32 = 0.6;
const SAME_PART: f32 = 0.08;

/// Mean over a row's neighbours of the same depth, with its buffers.
#[derive(Debug)]
pub struct Beside {
    level: Level,
    sum: Vec<f32>,
    count: Vec<f32>,
}

impl Beside {
    /// The filter at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, sum: Vec::new(), count: Vec::new() }
    }

    /// Replaces each value of `map` by its mean over the cells of its row up to
    /// three columns away whose `disparity` (pixels, no NaN) differs by at most
    /// max(0.6 px, 8 %): a thing is one, and what is behind it is not of it.
    pub fn run(&mut self, disparity: &Image<f32>, map: &mut Image<f32>) {
        let width = map.width();
        self.sum.resize(width, 0.0);
        self.count.resize(width, 0.0);
        let Self { level, sum, count } = self;
        dispatch!(*level, _simd => {
            for y in 0..map.height() {
                average(disparity.row(y), map.row_mut(y), &mut sum[..width], &mut count[..width]);
            }
        });
    }
}

#[inline(always)]
fn average(disparity: &[f32], row: &mut [f32], sum: &mut [f32], count: &mut [f32]) {
    let width = row.len();
    sum.copy_from_slice(row);
    count.fill(1.0);
    for step in 1..=REACH.min(width.saturating_sub(1)) {
        let n = width - step;
        add(&disparity[..n], &disparity[step..], &row[step..], &mut sum[..n], &mut count[..n]);
        add(&disparity[step..], &disparity[..n], &row[..n], &mut sum[step..], &mut count[step..]);
    }
    for ((value, sum), count) in row.iter_mut().zip(sum).zip(count) {
        *value = *sum / *count;
    }
}

/// Adds the neighbours that are as deep.
#[inline(always)]
fn add(here: &[f32], there: &[f32], values: &[f32], sum: &mut [f32], count: &mut [f32]) {
    let cells = here.iter().zip(there).zip(values).zip(sum).zip(count);
    for ((((&here, &there), &value), sum), count) in cells {
        let same = (there - here).abs() <= (SAME_PART * here).max(SAME_PX);
        *sum += if same { value } else { 0.0 };
        *count += if same { 1.0 } else { 0.0 };
    }
}
