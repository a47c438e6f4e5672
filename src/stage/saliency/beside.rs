//! Agreement with what is beside at the same depth.

use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, prelude::*, store_inside};

/// Cells on either side.
const REACH: usize = 3;
/// Largest difference in disparity: pixels, and in parts.
const SAME_PX: f32 = 0.6;
const SAME_PART: f32 = 0.08;

/// Cells that are averaged at once.
const LANES: usize = 16;

/// Mean over a row's neighbours of the same depth, with its buffers.
#[derive(Debug)]
pub struct Beside {
    level: Level,
    /// One row of disparities and of values, with room for neighbours beyond its ends and
    /// for a whole group: nothing is as deep as that.
    disparity: Vec<f32>,
    values: Vec<f32>,
}

impl Beside {
    /// The filter at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, disparity: Vec::new(), values: Vec::new() }
    }

    /// Replaces each value of `map` by its mean over the cells of its row up to
    /// three columns away whose `disparity` (pixels, no NaN) differs by at most
    /// max(0.6 px, 8 %): a thing is one, and what is behind it is not of it.
    pub fn run(&mut self, disparity: &Image<f32>, map: &mut Image<f32>) {
        let width = map.width();
        let Self { level, disparity: depths, values } = self;
        for buffer in [&mut *depths, &mut *values] {
            buffer.clear();
            buffer.resize(width + 2 * REACH + LANES, f32::NAN);
        }
        dispatch!(*level, simd => {
            for y in 0..map.height() {
                depths[REACH..REACH + width].copy_from_slice(disparity.row(y));
                values[REACH..REACH + width].copy_from_slice(map.row(y));
                for x in (0..width).step_by(LANES) {
                    store_inside(map.row_mut(y), x, average(simd, &depths[x..], &values[x..]));
                }
            }
        });
    }
}

/// The means of cells, which begin [`REACH`] places from the start.
#[inline(always)]
fn average<S: Simd>(simd: S, disparity: &[f32], values: &[f32]) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let here = f32x16::from_slice(simd, &disparity[REACH..REACH + LANES]);
    let most = (here * SAME_PART).max(SAME_PX);
    let mut sum = f32x16::from_slice(simd, &values[REACH..REACH + LANES]);
    let mut count = one;
    for step in 1..=REACH {
        for at in [REACH + step, REACH - step] {
            let there = f32x16::from_slice(simd, &disparity[at..at + LANES]);
            let same = (there - here).abs().simd_le(most);
            let values = f32x16::from_slice(simd, &values[at..at + LANES]);
            sum += same.select(values, zero);
            count += same.select(one, zero);
        }
    }
    sum / count
}
