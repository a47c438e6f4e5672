//! The normalisation N of eq. 4.

use crate::image::Image;

/// `N(x) = (x - min) / max(max - min, least)`: stretches a map to 0..=1, but
/// never one whose whole range is less than `least`, so that noise in an empty
/// scene stays near 0 and a constant map becomes 0.
pub fn normalize(map: &mut Image<f32>, least: f32) {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for &value in map.pixels() {
        low = low.min(value);
        high = high.max(value);
    }
    let scale = 1.0 / (high - low).max(least);
    for value in map.pixels_mut() {
        *value = ((*value - low) * scale).min(1.0);
    }
}
