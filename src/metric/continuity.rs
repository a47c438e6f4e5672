//! Whether disparity is smooth inside regions.

use super::Mean;
use crate::image::Image;

/// Difference in pixels of disparity from which neighbours lie apart.
const STEP: f32 = 1.0;

/// Of the pairs of 4-neighbours with one label that is not 0 and with finite
/// disparities, how many differ by less than a pixel: the sum counts those,
/// the count all pairs. Images of different sizes have no pairs.
pub fn continuity(disparity: &Image<f32>, labels: &Image<u16>) -> Mean {
    let mut pairs = Mean::default();
    if disparity.size() != labels.size() {
        return pairs;
    }
    let mut above: Option<(&[f32], &[u16])> = None;
    for (disparity, labels) in disparity.rows().zip(labels.rows()) {
        let rest = |from: usize| (&disparity[from..], &labels[from..]);
        if !labels.is_empty() {
            add(&mut pairs, rest(0), rest(1));
        }
        if let Some(above) = above.replace(rest(0)) {
            add(&mut pairs, above, rest(0));
        }
    }
    pairs
}

fn add(pairs: &mut Mean, a: (&[f32], &[u16]), b: (&[f32], &[u16])) {
    let labels = a.1.iter().zip(b.1);
    for ((a, b), (label, other)) in a.0.iter().zip(b.0).zip(labels) {
        let difference = (a - b).abs();
        // Finite together: the difference with NaN or an infinity is not.
        if *label != 0 && label == other && difference.is_finite() {
            pairs.add(f64::from(u8::from(difference < STEP)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;

    #[test]
    fn pairs_by_hand() {
        let size = Size::new(3, 2);
        let image = |pixels: Vec<f32>| Image::from_vec(size, pixels).unwrap();
        let disparity = image(vec![5.0, 5.5, 9.0, 5.0, f32::NAN, 9.25]);
        let one = Image::filled(size, 1_u16);
        // Across: 5|5.5 yes, 5.5|9 no, two with NaN; down: 5|5 yes, NaN, 9|9.25 yes.
        assert_eq!(continuity(&disparity, &one), Mean { sum: 3.0, count: 4 });
        let two = Image::from_vec(size, vec![1, 1, 2, 1, 1, 2]).unwrap();
        assert_eq!(continuity(&disparity, &two), Mean { sum: 3.0, count: 3 });
        let none = Image::filled(size, 0);
        assert_eq!(continuity(&disparity, &none).value(), None);
        // A step of a whole pixel is one.
        let step = image(vec![5.0, 6.0, 7.0, 5.0, 6.0, 7.0]);
        assert_eq!(continuity(&step, &one), Mean { sum: 3.0, count: 7 });
        assert_eq!(continuity(&step, &Image::default()).value(), None);
    }
}
