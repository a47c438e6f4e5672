//! The enhanced-alignment measure (Fan et al. 2018).

use super::levels::Operation;

/// E of a binary map: 1 where all pixels agree.
///
/// Map and mask lose their means, and each pixel scores (1 + ξ)² / 4 with
/// ξ = 2 a b / (a² + b²) of what is left. Only four pairs (a, b) occur, so
/// four products of counts are the whole sum. It is divided by one less than
/// the number of pixels, as in the authors' program; a single pixel by one.
pub(super) fn e_measure(at: Operation) -> f64 {
    let (taken, pixels) = (at.taken() as f64, at.pixels as f64);
    let sum = if at.positives == at.pixels {
        taken
    } else {
        let (hits, false_alarms) = (at.hits as f64, at.false_alarms as f64);
        let (map_mean, mask_mean) = (taken / pixels, at.positives as f64 / pixels);
        let misses = at.positives as f64 - hits;
        hits * enhanced(1.0 - map_mean, 1.0 - mask_mean)
            + false_alarms * enhanced(1.0 - map_mean, -mask_mean)
            + misses * enhanced(-map_mean, 1.0 - mask_mean)
            + (pixels - taken - misses) * enhanced(-map_mean, -mask_mean)
    };
    sum / (pixels - 1.0).max(1.0)
}

fn enhanced(a: f64, b: f64) -> f64 {
    // The mask has both kinds of pixels here: b is never zero.
    let aligned = 2.0 * a * b / (a * a + b * b + f64::EPSILON);
    (1.0 + aligned).powi(2) / 4.0
}
