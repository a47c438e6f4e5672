//! The weighted F (Margolin et al. 2014).

use super::levels::Levels;
use crate::image::{Image, Size};
use crate::metric::distance::nearest;

/// Errors spread over 7x7 pixels with a Gaussian of this deviation.
const SIGMA: f64 = 5.0;
const RADIUS: usize = 3;

/// Distance in pixels over which the weight of a false alarm comes half as
/// near to 2, which it has far from the object.
const HALVING: f64 = 5.0;

/// Weighted F, β² = 1; 0 without a salient pixel.
///
/// A miss beside pixels that were found weighs less, a false alarm more the
/// farther it is from the object.
pub(super) fn weighted_f(map: &Image<u8>, mask: &Image<u8>, levels: &Levels) -> f64 {
    let Some(object) = nearest(mask.size(), |x, y| mask.get(x, y) != 0) else {
        return 0.0;
    };
    let miss = levels.value.map(|value| (value - 1.0).abs());
    let level = |index: usize| usize::from(map.pixels()[index]);
    // Around the object the error of its nearest pixel goes on.
    let continued = object.pixels().iter().map(|object| miss[level(object.index)]);
    let spread = spread(mask.size(), continued);

    let (mut positives, mut missed, mut false_alarms) = (0.0, 0.0, 0.0);
    let decay = -std::f64::consts::LN_2 / HALVING;
    for (index, mask) in mask.pixels().iter().enumerate() {
        if *mask == 0 {
            let distance = (object.pixels()[index].squared as f64).sqrt();
            false_alarms += levels.value[level(index)] * (2.0 - (decay * distance).exp());
        } else {
            positives += 1.0;
            missed += miss[level(index)].min(spread.pixels()[index]);
        }
    }
    let hits = positives - missed;
    let recall = 1.0 - missed / positives;
    let precision = hits / (hits + false_alarms + f64::EPSILON);
    2.0 * recall * precision / (recall + precision + f64::EPSILON)
}

/// Convolution with the Gaussian, nothing beyond the border.
fn spread(size: Size, values: impl Iterator<Item = f64>) -> Image<f64> {
    let weights = gaussian();
    let padded = Size::new(size.width, size.height + 2 * RADIUS);
    let mut across = Image::new(padded);
    let mut row = vec![0.0; size.width + 2 * RADIUS];
    let mut values = values;
    for y in 0..size.height {
        for (slot, value) in row[RADIUS..].iter_mut().zip(values.by_ref().take(size.width)) {
            *slot = value;
        }
        let out: &mut [f64] = across.row_mut(y + RADIUS);
        for (shift, weight) in weights.iter().enumerate() {
            add_weighted(out, &row[shift..], *weight);
        }
    }
    let mut out = Image::new(size);
    for y in 0..size.height {
        for (shift, weight) in weights.iter().enumerate() {
            add_weighted(out.row_mut(y), across.row(y + shift), *weight);
        }
    }
    out
}

fn add_weighted(sums: &mut [f64], values: &[f64], weight: f64) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

/// One axis of the separable kernel; its sum is 1.
fn gaussian() -> [f64; 2 * RADIUS + 1] {
    let weights: [f64; 2 * RADIUS + 1] = std::array::from_fn(|i| {
        let distance = i.abs_diff(RADIUS) as f64;
        (-distance * distance / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Every step as the paper writes it, pixel by pixel.
    fn slow(map: &Image<u8>, mask: &Image<u8>) -> f64 {
        let (width, height) = (map.width() as isize, map.height() as isize);
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let truth = |x: isize, y: isize| f64::from(u8::from(mask.get(x as usize, y as usize) != 0));
        let error = |x: isize, y: isize| {
            (f64::from(map.get(x as usize, y as usize)) / 255.0 - truth(x, y)).abs()
        };
        let object = |x: isize, y: isize| {
            let squared = |a: isize, b: isize| (x - a).pow(2) + (y - b).pow(2);
            let salient = pixels().filter(|&(a, b)| truth(a, b) == 1.0);
            salient.map(|(a, b)| (squared(a, b), a, b)).min().unwrap()
        };
        let kernel = |dx: isize, dy: isize| (-((dx * dx + dy * dy) as f64) / 50.0).exp();
        let taps = || (-3..=3).flat_map(|dy| (-3..=3).map(move |dx| (dx, dy)));
        let norm: f64 = taps().map(|(dx, dy)| kernel(dx, dy)).sum();
        let (mut positives, mut missed, mut false_alarms) = (0.0, 0.0, 0.0);
        for (x, y) in pixels() {
            if truth(x, y) == 1.0 {
                let mut spread = 0.0;
                for (dx, dy) in taps() {
                    let (a, b) = (x + dx, y + dy);
                    if (0..width).contains(&a) && (0..height).contains(&b) {
                        let (_, a, b) = object(a, b);
                        spread += kernel(dx, dy) / norm * error(a, b);
                    }
                }
                positives += 1.0;
                missed += error(x, y).min(spread);
            } else {
                let distance = (object(x, y).0 as f64).sqrt();
                false_alarms += error(x, y) * (2.0 - 0.5_f64.powf(distance / 5.0));
            }
        }
        let precision = (positives - missed) / (positives - missed + false_alarms + f64::EPSILON);
        let recall = 1.0 - missed / positives;
        2.0 * precision * recall / (precision + recall + f64::EPSILON)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(100) })]
        #[test]
        fn the_weighted_f_is_that_of_the_paper(
            width in 1_usize..11,
            height in 1_usize..11,
            rarity in 1_u8..10,
            noise in prop::collection::vec(any::<u8>(), 100),
            levels in prop::collection::vec(any::<u8>(), 100),
        ) {
            let size = Size::new(width, height);
            let map = Image::from_fn(size, |x, y| levels[y * width + x]);
            let mut mask = Image::from_fn(size, |x, y| u8::from(noise[y * width + x] % rarity == 0));
            mask.set(width / 2, height / 2, 1);
            let fast = weighted_f(&map, &mask, &Levels::as_is());
            prop_assert!((fast - slow(&map, &mask)).abs() < 1e-9, "{} {}", fast, slow(&map, &mask));
        }
    }
}
