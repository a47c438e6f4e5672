//! Epipolar alignment: how far apart the two images of a point lie vertically,
//! which is 0 for a rectified pair. Stereo searches along rows, so matches get
//! lost from about half a pixel on.
//!
//! One corner per cell of a grid over the left image is looked for in the right
//! one, in both directions, by the census of its surroundings (Zabih and
//! Woodfill 1994), to which brightness does not matter. Few points, no state:
//! some ten milliseconds for a measurement now and then.

use std::ops::RangeInclusive;

use crate::image::Image;

/// Cells of the grid, across and down.
const GRID: [usize; 2] = [12, 7];

/// Half the side of the window in which a corner is a corner.
const WINDOW: usize = 3;

/// Smaller eigenvalue of the gradients' mean outer product that makes a corner:
/// both directions vary by some 8 gray levels per 2 pixels.
const LEAST_CORNER: f32 = 64.0;

/// Census words are compared at this many steps of two pixels to each side.
const STEPS: usize = 3;
const REACH: usize = 2 * STEPS;

/// Pixels around a word that it looks at.
const CENSUS: usize = 2;

/// Bits of one word, and of one comparison.
const WORD_BITS: u32 = 24;
const BITS: u32 = (2 * STEPS as u32 + 1) * (2 * STEPS as u32 + 1) * WORD_BITS;

/// Fewer points say nothing.
const FEWEST_POINTS: usize = 12;

/// Rows that are farther apart than this, in pixels, cost matches.
pub const MISALIGNED_PX: f64 = 1.0;

/// The vertical misalignment of one pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Epipolar {
    /// Median of (row in the right image - row in the left image), pixels.
    pub offset_px: f64,
    /// Median of its magnitude, pixels: also large when one camera is turned,
    /// where the offsets of both halves of the image cancel out.
    pub error_px: f64,
    /// Median of (column in the left image - column in the right image), pixels:
    /// negative when the two images are swapped.
    pub disparity_px: f64,
    /// Number of matched points.
    pub points: usize,
}

/// Measures a pair of gray views of one size: partners are looked for
/// `disparities` pixels to the left and up to `reach` pixels up and down.
///
/// `None` when too few points are found again without doubt.
pub fn epipolar(
    left: &Image<u8>,
    right: &Image<u8>,
    disparities: RangeInclusive<i32>,
    reach: usize,
) -> Option<Epipolar> {
    if left.size() != right.size() {
        return None;
    }
    let mut words = Vec::new();
    let found: Vec<[f64; 2]> = corners(left)
        .filter_map(|[x, y]| partner(left, right, [x, y], &disparities, reach, &mut words))
        .collect();
    if found.len() < FEWEST_POINTS {
        return None;
    }
    Some(Epipolar {
        offset_px: median(found.iter().map(|f| f[1])),
        error_px: median(found.iter().map(|f| f[1].abs())),
        disparity_px: median(found.iter().map(|f| f[0])),
        points: found.len(),
    })
}

/// The best corner of each cell that has one.
fn corners(image: &Image<u8>) -> impl Iterator<Item = [usize; 2]> + '_ {
    const MARGIN: usize = REACH + CENSUS + 1;
    let size = image.size();
    let cell = |i: usize, of: usize, extent: usize| {
        let inner = extent.saturating_sub(2 * MARGIN);
        MARGIN + i * inner / of..MARGIN + (i + 1) * inner / of
    };
    (0..GRID[0] * GRID[1]).filter_map(move |i| {
        let columns = cell(i % GRID[0], GRID[0], size.width);
        let rows = cell(i / GRID[0], GRID[1], size.height);
        // Every third pixel: a corner is wider than that.
        let places = rows.step_by(3).flat_map(|y| columns.clone().step_by(3).map(move |x| [x, y]));
        let (score, place) = places
            .map(|[x, y]| (cornerness(image, x, y), [x, y]))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        (score >= LEAST_CORNER).then_some(place)
    })
}

/// Smaller eigenvalue of the mean outer product of the gradients around a pixel
/// (Shi and Tomasi 1994).
fn cornerness(image: &Image<u8>, x: usize, y: usize) -> f32 {
    let (mut xx, mut xy, mut yy) = (0, 0, 0);
    for v in y - WINDOW..=y + WINDOW {
        let (above, row, below) = (image.row(v - 1), image.row(v), image.row(v + 1));
        for u in x - WINDOW..=x + WINDOW {
            let gx = i32::from(row[u + 1]) - i32::from(row[u - 1]);
            let gy = i32::from(below[u]) - i32::from(above[u]);
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
        }
    }
    let count = ((2 * WINDOW + 1) * (2 * WINDOW + 1)) as f32;
    let [xx, xy, yy] = [xx, xy, yy].map(|sum| sum as f32 / count);
    let half_difference = (xx - yy) / 2.0;
    f32::midpoint(xx, yy) - half_difference.hypot(xy)
}

/// Horizontal and vertical shift to the partner of a pixel; `None` when it has
/// none, or two that are about equally good.
fn partner(
    left: &Image<u8>,
    right: &Image<u8>,
    [x, y]: [usize; 2],
    disparities: &RangeInclusive<i32>,
    reach: usize,
    words: &mut Vec<u32>,
) -> Option<[f64; 2]> {
    const MARGIN: usize = REACH + CENSUS;
    let size = left.size();
    // Where the partner may be: its whole surroundings inside the image.
    let inside =
        |v: i64, extent: usize| v.clamp(MARGIN as i64, (extent - 1 - MARGIN) as i64) as usize;
    let first_x = inside(x as i64 - i64::from(*disparities.end()), size.width);
    let last_x = inside(x as i64 - i64::from(*disparities.start()), size.width);
    let first_y = inside(y as i64 - reach as i64, size.height);
    let last_y = inside(y as i64 + reach as i64, size.height);

    let mut wanted = [[0; 2 * STEPS + 1]; 2 * STEPS + 1];
    for (j, row) in wanted.iter_mut().enumerate() {
        for (i, word) in row.iter_mut().enumerate() {
            *word = census(left, x + 2 * i - REACH, y + 2 * j - REACH);
        }
    }
    let columns = last_x - first_x + 1 + 2 * REACH;
    words.clear();
    for v in first_y - REACH..=last_y + REACH {
        words.extend((0..columns).map(|i| census(right, first_x - REACH + i, v)));
    }
    let width = last_x - first_x + 1;
    let cost = |u: usize, v: usize| {
        let mut sum = 0;
        for (j, row) in wanted.iter().enumerate() {
            let from = (v - first_y + 2 * j) * columns + (u - first_x);
            let there = words[from..=from + 2 * REACH].iter().step_by(2);
            sum += row.iter().zip(there).map(|(a, b)| (a ^ b).count_ones()).sum::<u32>();
        }
        sum
    };
    let costs: Vec<u32> = (first_y..=last_y)
        .flat_map(|v| (first_x..=last_x).map(move |u| (u, v)))
        .map(|(u, v)| cost(u, v))
        .collect();
    let (best_at, &best) = costs.iter().enumerate().min_by_key(|(_, cost)| **cost)?;
    let (u, v) = (best_at % width, best_at / width);
    let second = costs
        .iter()
        .enumerate()
        .filter(|(i, _)| (i % width).abs_diff(u) > 2 || (i / width).abs_diff(v) > 2)
        .map(|(_, cost)| *cost)
        .min()?;
    // A partner at the rim of the searched rows may well lie beyond it.
    let rows = last_y - first_y + 1;
    if best > BITS / 4 || best * 5 > second * 4 || v == 0 || v + 1 == rows {
        return None;
    }
    let [above, here, below] = [v - 1, v, v + 1].map(|v| f64::from(costs[v * width + u]));
    let curvature = above - 2.0 * here + below;
    let fraction = if curvature > 0.0 { (above - below) / (2.0 * curvature) } else { 0.0 };
    Some([x as f64 - (first_x + u) as f64, (first_y + v) as f64 + fraction - y as f64])
}

/// Which of the 24 neighbours in a 5x5 window are darker than the pixel.
fn census(image: &Image<u8>, x: usize, y: usize) -> u32 {
    let centre = image.get(x, y);
    let mut word = 0;
    for v in y - CENSUS..=y + CENSUS {
        for &pixel in &image.row(v)[x - CENSUS..=x + CENSUS] {
            word = word << 1 | u32::from(pixel < centre);
        }
    }
    word
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;
    use crate::input::synthetic::noise::noise2;

    fn view(size: Size, place: impl Fn(f64, f64) -> [f64; 2], gain: f64) -> Image<u8> {
        Image::from_fn(size, |x, y| {
            let [u, v] = place(x as f64, y as f64);
            (gain * (130.0 + 100.0 * noise2(1, u / 5.0, v / 5.0))) as u8
        })
    }

    const SIZE: Size = Size::new(320, 160);

    #[test]
    fn a_rectified_pair_is_aligned() {
        let left = view(SIZE, |x, y| [x, y], 1.0);
        let right = view(SIZE, |x, y| [x + 17.0, y], 0.8);
        let found = epipolar(&left, &right, 0..=63, 6).unwrap();
        assert!(found.error_px < 0.2 && found.offset_px.abs() < 0.2, "{found:?}");
        assert!((found.disparity_px - 17.0).abs() < 0.5, "{found:?}");
        assert!(found.points > 30, "{found:?}");
    }

    #[test]
    fn a_vertical_offset_is_measured_with_its_sign_and_fraction() {
        let left = view(SIZE, |x, y| [x, y], 1.0);
        for offset in [-3.0, -1.5, 0.5, 2.0, 4.25] {
            let right = view(SIZE, |x, y| [x + 9.0, y - offset], 1.0);
            let found = epipolar(&left, &right, 0..=63, 6).unwrap();
            assert!((found.offset_px - offset).abs() < 0.2, "{offset}: {found:?}");
            assert!((found.error_px - offset.abs()).abs() < 0.2, "{offset}: {found:?}");
        }
    }

    #[test]
    fn a_turned_camera_shows_in_the_error() {
        let left = view(SIZE, |x, y| [x, y], 1.0);
        // 1.5 degrees around the centre: 4 px at the left and right rim.
        let right = view(SIZE, |x, y| [x + 9.0 + 0.026 * (y - 80.0), y - 0.026 * (x - 160.0)], 1.0);
        let found = epipolar(&left, &right, 0..=63, 6).unwrap();
        assert!(found.offset_px.abs() < 0.7 && found.error_px > 1.2, "{found:?}");
    }

    #[test]
    fn swapped_images_have_negative_disparities() {
        let left = view(SIZE, |x, y| [x, y], 1.0);
        let right = view(SIZE, |x, y| [x + 17.0, y], 1.0);
        let found = epipolar(&right, &left, -63..=63, 6).unwrap();
        assert!((found.disparity_px + 17.0).abs() < 0.5, "{found:?}");
    }

    #[test]
    fn what_cannot_be_matched_is_not_measured() {
        let flat = Image::filled(SIZE, 90);
        let left = view(SIZE, |x, y| [x, y], 1.0);
        assert_eq!(epipolar(&flat, &flat, 0..=63, 6), None);
        assert_eq!(epipolar(&left, &flat, 0..=63, 6), None);
        for size in [Size::new(0, 0), Size::new(9, 5), Size::new(18, 18), Size::new(40, 20)] {
            let tiny = view(size, |x, y| [x, y], 1.0);
            let _ = epipolar(&tiny, &tiny, -20..=20, 6);
        }
        assert_eq!(epipolar(&left, &Image::new(Size::new(8, 8)), 0..=63, 6), None);
    }
}
