//! How well the outline of a mask is met.

use crate::image::{Image, Size};
use crate::metric::distance::nearest;

/// Distance at which outlines still meet, as a share of the image's diagonal.
const TOLERANCE: f64 = 0.008;

/// F of the outlines of two masks, non-zero inside (DAVIS, Perazzi et al.
/// 2016): of both outlines the share that has the other one within 0.8 % of
/// the diagonal, rounded up to pixels; their harmonic mean. 1 when both are
/// empty, 0 when one is, or when the sizes differ.
pub fn boundary_f(mask: &Image<u8>, truth: &Image<u8>) -> f64 {
    if mask.size() != truth.size() {
        return 0.0;
    }
    let (ours, theirs) = (outline(mask), outline(truth));
    if ours.is_empty() || theirs.is_empty() {
        return f64::from(u8::from(ours.is_empty() && theirs.is_empty()));
    }
    let diagonal = (mask.width() as f64).hypot(mask.height() as f64);
    let reach = ((TOLERANCE * diagonal).ceil() as u64).pow(2);
    let precision = share_within(&ours, &theirs, reach);
    let recall = share_within(&theirs, &ours, reach);
    let sum = precision + recall;
    if sum > 0.0 { 2.0 * precision * recall / sum } else { 0.0 }
}

/// The pixels (x, y) that differ from their right, lower or lower right
/// neighbour, in row order. Beyond the border the last row and column go on.
fn outline(mask: &Image<u8>) -> Vec<(usize, usize)> {
    let (width, height) = (mask.width(), mask.height());
    let mut pixels = Vec::new();
    for (y, row) in mask.rows().enumerate() {
        let below = mask.row((y + 1).min(height - 1));
        for x in 0..width {
            let right = (x + 1).min(width - 1);
            let here = row[x] != 0;
            let others = [row[right], below[x], below[right]];
            if others.iter().any(|other| (*other != 0) != here) {
                pixels.push((x, y));
            }
        }
    }
    pixels
}

/// Share of `pixels` within the squared distance `reach` of one of `others`;
/// neither is empty.
fn share_within(pixels: &[(usize, usize)], others: &[(usize, usize)], reach: u64) -> f64 {
    // Distances are wanted at `pixels` alone: the box around both is enough.
    let all = || pixels.iter().chain(others);
    let left = all().map(|p| p.0).min().unwrap_or(0);
    let top = all().map(|p| p.1).min().unwrap_or(0);
    let right = all().map(|p| p.0).max().unwrap_or(0);
    let bottom = all().map(|p| p.1).max().unwrap_or(0);
    let mut sites = Image::new(Size::new(right - left + 1, bottom - top + 1));
    for (x, y) in others {
        sites.set(x - left, y - top, true);
    }
    let Some(nearest) = nearest(sites.size(), |x, y| sites.get(x, y)) else { return 0.0 };
    let within = |&&(x, y): &&(usize, usize)| nearest.get(x - left, y - top).squared <= reach;
    pixels.iter().filter(within).count() as f64 / pixels.len() as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The benchmark's definition, word by word: outlines grown by a disk.
    fn slow(mask: &Image<u8>, truth: &Image<u8>) -> f64 {
        let size = mask.size();
        let (width, height) = (size.width as isize, size.height as isize);
        let outline = |image: &Image<u8>| {
            Image::from_fn(size, |x, y| {
                let at = |x: usize, y: usize| image.get(x, y) != 0;
                let (last_x, last_y) = (x + 1 == size.width, y + 1 == size.height);
                match (last_x, last_y) {
                    (true, true) => false,
                    (true, false) => at(x, y) != at(x, y + 1),
                    (false, true) => at(x, y) != at(x + 1, y),
                    (false, false) => {
                        at(x, y) != at(x + 1, y)
                            || at(x, y) != at(x, y + 1)
                            || at(x, y) != at(x + 1, y + 1)
                    }
                }
            })
        };
        let radius = (0.008 * ((width * width + height * height) as f64).sqrt()).ceil() as isize;
        let grown = |outline: &Image<bool>| {
            Image::from_fn(size, |x, y| {
                let (x, y) = (x as isize, y as isize);
                (-radius..=radius).any(|dy| {
                    (-radius..=radius).any(|dx| {
                        let (a, b) = (x + dx, y + dy);
                        dx * dx + dy * dy <= radius * radius
                            && (0..width).contains(&a)
                            && (0..height).contains(&b)
                            && outline.get(a as usize, b as usize)
                    })
                })
            })
        };
        let (ours, theirs) = (outline(mask), outline(truth));
        let count = |image: &Image<bool>| image.pixels().iter().filter(|p| **p).count();
        let met = |a: &Image<bool>, b: &Image<bool>| {
            let both = a.pixels().iter().zip(b.pixels()).filter(|(a, b)| **a && **b);
            both.count() as f64 / count(a) as f64
        };
        let (precision, recall) = match (count(&ours), count(&theirs)) {
            (0, 0) => (1.0, 1.0),
            (0, _) => (1.0, 0.0),
            (_, 0) => (0.0, 1.0),
            _ => (met(&ours, &grown(&theirs)), met(&theirs, &grown(&ours))),
        };
        if precision + recall == 0.0 {
            0.0
        } else {
            2.0 * precision * recall / (precision + recall)
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]
        #[test]
        fn outlines_meet_where_a_disk_reaches(
            width in 1_usize..40,
            height in 1_usize..200,
            boxes in prop::collection::vec((0_usize..40, 0_usize..200, 0_usize..30, 0_usize..60), 4),
        ) {
            let size = Size::new(width, height);
            let image = |boxes: &[(usize, usize, usize, usize)]| Image::from_fn(size, |x, y| {
                let inside = boxes.iter().any(|&(a, b, w, h)| {
                    (a..a + w).contains(&x) && (b..b + h).contains(&y)
                });
                255 * u8::from(inside)
            });
            let (mask, truth) = (image(&boxes[..2]), image(&boxes[2..]));
            let (fast, slow) = (boundary_f(&mask, &truth), slow(&mask, &truth));
            prop_assert!((fast - slow).abs() < 1e-12, "{} {}", fast, slow);
        }
    }
}
