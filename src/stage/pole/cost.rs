//! What it costs that a pixel of the left view is one of the right view, in bands.

use std::ops::Range;

use crate::camera::StereoRig;
use crate::image::Image;
use crate::simd::Simd;
use crate::stage::ground::Plane;

/// Most that the difference of two pixels may cost, of 255: one of them is of something else.
pub const MOST_COST: f32 = 30.0;

/// The two views in bands, and what is known of the scene.
#[derive(Clone)]
pub struct Views<'a> {
    /// Mean brightness per band of the left and of the right view.
    pub bands: [&'a Image<f32>; 2],
    /// What poles stand on.
    pub plane: &'a Plane,
    /// Calibration of the views.
    pub rig: &'a StereoRig,
    /// Disparities that are searched, `x_l - x_r` in pixels.
    pub search: Range<usize>,
}

/// Adds to the cost per disparity what pixel x of a band of the left view costs.
#[inline(always)]
pub fn add_costs<S: Simd>(_simd: S, views: &Views<'_>, band: usize, x: isize, costs: &mut [f32]) {
    let [left, right] = views.bands.map(|view| view.row(band));
    let Some((x, &own)) = usize::try_from(x).ok().and_then(|x| Some((x, left.get(x)?))) else {
        // It is the same to all.
        return;
    };
    let (near, beyond) = costs.split_at_mut(costs.len().min(x + 1));
    let partners = right[x + 1 - near.len()..=x].iter().rev();
    for (cost, other) in near.iter_mut().zip(partners) {
        *cost += (own - other).abs().min(MOST_COST);
    }
    for cost in beyond {
        *cost += MOST_COST;
    }
}

/// Adds `values` times `factor` to `sums`.
#[inline(always)]
pub fn add(sums: &mut [f32], values: &[f32], factor: f32) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// The first of the least values.
#[inline(always)]
pub fn least(values: &[f32]) -> Option<(usize, f32)> {
    // In lanes, so that it becomes vector code.
    let mut lanes = [f32::INFINITY; 8];
    let (groups, rest) = values.as_chunks::<8>();
    for group in groups {
        for (lane, value) in lanes.iter_mut().zip(group) {
            *lane = if *value < *lane { *value } else { *lane };
        }
    }
    let least = lanes.iter().chain(rest).fold(f32::INFINITY, |least, value| least.min(*value));
    Some((values.iter().position(|value| *value == least)?, least))
}

/// The value between the pixels of a row.
pub fn sample(row: &[f32], at: f32) -> f32 {
    let at = at.clamp(0.0, (row.len() - 1) as f32);
    let (i, part) = (at as usize, at.fract());
    row[i] + part * (row[(i + 1).min(row.len() - 1)] - row[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::image::Size;
    use crate::simd::{self, dispatch};

    #[test]
    fn a_disparity_costs_the_difference_up_to_a_limit() {
        let size = Size::new(60, 1);
        let camera = |tx| Camera::pinhole(size, 50.0, 30.0, 0.0, tx);
        let rig = StereoRig::new(camera(0.0), camera(-5.0), 0.0).unwrap();
        let plane = Plane::new(0.2, 0.0, -1.0, &rig).unwrap();
        let left = Image::from_fn(size, |x, _| (x * 7 % 40) as f32);
        let right = Image::from_fn(size, |x, _| (x * 11 % 50) as f32);
        let views = Views { bands: [&left, &right], plane: &plane, rig: &rig, search: 0..32 };
        for level in simd::available() {
            for x in [0_usize, 5, 31, 59] {
                let mut costs = [1.0; 32];
                dispatch!(level, simd => add_costs(simd, &views, 0, x as isize, &mut costs));
                for (d, cost) in costs.into_iter().enumerate() {
                    let other = x.checked_sub(d).map(|x| right.get(x, 0));
                    let difference = other.map_or(f32::INFINITY, |r| (left.get(x, 0) - r).abs());
                    assert_eq!(cost, 1.0 + difference.min(MOST_COST), "{x} {d}");
                }
            }
            // Beyond the image all are alike.
            let mut costs = [1.0; 32];
            dispatch!(level, simd => add_costs(simd, &views, 0, -1, &mut costs));
            dispatch!(level, simd => add_costs(simd, &views, 0, 60, &mut costs));
            assert_eq!(costs, [1.0; 32]);
        }
    }

    #[test]
    fn the_first_of_the_least_is_found_wherever_it_is() {
        for n in [1, 7, 8, 9, 30] {
            for at in 0..n {
                let values: Vec<f32> =
                    (0..n).map(|i| if i >= at && i % 5 == at % 5 { 1.0 } else { 2.0 }).collect();
                assert_eq!(least(&values), Some((at, 1.0)));
            }
        }
        assert_eq!(least(&[]), None);
    }

    #[test]
    fn between_pixels_lies_what_is_between_their_values() {
        let row = [10.0, 20.0, 40.0];
        for (at, expected) in [(0.0, 10.0), (0.5, 15.0), (1.25, 25.0), (2.0, 40.0), (9.0, 40.0)] {
            assert_eq!(sample(&row, at), expected);
        }
        assert_eq!(sample(&row, -3.0), 10.0);
    }
}
