//! The structure measure (Fan et al. 2017).

use super::levels::{Counts, Histogram, LEVELS, Levels, moment};
use crate::image::Image;

/// Share of the object-aware part.
const ALPHA: f64 = 0.5;

/// S of a map whose mask has at least one salient pixel.
pub(super) fn s_measure(
    map: &Image<u8>,
    mask: &Image<u8>,
    levels: &Levels,
    counts: &Counts,
) -> f64 {
    if counts.positives() == counts.pixels() {
        return moment(&counts.salient, &levels.value) / counts.pixels() as f64;
    }
    let objects = object(levels, counts);
    let regions = region(map, mask, levels, counts.positives());
    (ALPHA * objects + (1.0 - ALPHA) * regions).max(0.0)
}

/// How uniform and how right the map is inside and outside the object.
fn object(levels: &Levels, counts: &Counts) -> f64 {
    let share = counts.positives() as f64 / counts.pixels() as f64;
    let inside = uniformity(&counts.salient, &levels.value);
    let outside = uniformity(&counts.other, &levels.value.map(|value| 1.0 - value));
    share * inside + (1.0 - share) * outside
}

/// 2 x̄ / (x̄² + 1 + σ).
fn uniformity(histogram: &Histogram, value: &[f64; LEVELS]) -> f64 {
    let (count, mean, scatter) = moments(histogram, value);
    let deviation = (scatter / (count - 1.0).max(1.0)).sqrt();
    2.0 * mean / (mean * mean + 1.0 + deviation + f64::EPSILON)
}

/// Number of pixels, their mean, and the sum of their squared deviations.
fn moments(histogram: &Histogram, value: &[f64; LEVELS]) -> (f64, f64, f64) {
    let count = histogram.iter().sum::<u64>() as f64;
    if count == 0.0 {
        return (0.0, 0.0, 0.0);
    }
    let mut present = histogram.iter().zip(value).filter(|(count, _)| **count > 0);
    if let (Some((_, only)), None) = (present.next(), present.next()) {
        // Exactly: whether there is any scatter decides on how a flat quarter
        // is scored.
        return (count, *only, 0.0);
    }
    let mean = moment(histogram, value) / count;
    (count, mean, moment(histogram, &value.map(|value| (value - mean) * (value - mean))))
}

/// Structural similarity of the four quarters around the object's centre,
/// weighted by area.
fn region(map: &Image<u8>, mask: &Image<u8>, levels: &Levels, positives: u64) -> f64 {
    let (width, height) = (map.width(), map.height());
    let (mut sum_x, mut sum_y) = (0, 0);
    for (y, row) in mask.rows().enumerate() {
        for (x, _) in row.iter().enumerate().filter(|(_, mask)| **mask != 0) {
            sum_x += x as u64;
            sum_y += y as u64;
        }
    }
    // The row and the column of the centre belong to the upper left.
    let after = |sum: u64| (sum as f64 / positives as f64).round_ties_even() as usize + 1;
    let (cx, cy) = (after(sum_x).min(width), after(sum_y).min(height));
    let mut quarters = [[Counts::EMPTY; 2]; 2];
    for (y, (map, mask)) in map.rows().zip(mask.rows()).enumerate() {
        let [left, right] = &mut quarters[usize::from(y >= cy)];
        left.add(&map[..cx], &mask[..cx]);
        right.add(&map[cx..], &mask[cx..]);
    }
    let area = (width * height) as f64;
    let weighted = quarters.iter().flatten().map(|quarter| {
        let weight = quarter.pixels() as f64 / area;
        if weight > 0.0 { weight * similarity(quarter, levels) } else { 0.0 }
    });
    weighted.sum()
}

/// SSIM of map and mask without its constants: 4 x̄ ȳ σxy / ((x̄² + ȳ²) (σx² + σy²)).
fn similarity(quarter: &Counts, levels: &Levels) -> f64 {
    let all = std::array::from_fn(|level| quarter.salient[level] + quarter.other[level]);
    let (count, mean, scatter) = moments(&all, &levels.value);
    let (inside, inside_mean, _) = moments(&quarter.salient, &levels.value);
    let (outside, outside_mean, _) = moments(&quarter.other, &levels.value);
    // The sums around the means, written so that a flat mask gives exact zeros.
    let between = inside * outside / count;
    let freedom = count - 1.0 + f64::EPSILON;
    let variances = scatter / freedom + between / freedom;
    let covariance = between * (inside_mean - outside_mean) / freedom;
    let mask_mean = inside / count;
    let numerator = 4.0 * mean * mask_mean * covariance;
    let denominator = (mean * mean + mask_mean * mask_mean) * variances;
    if numerator != 0.0 {
        numerator / (denominator + f64::EPSILON)
    } else if denominator == 0.0 {
        1.0
    } else {
        0.0
    }
}
