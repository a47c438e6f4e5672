//! Where to cut an attention map.

use crate::image::Image;

/// Bins of the histogram over 0..=1.
const BINS: usize = 256;

/// The threshold that separates two classes best: the largest variance between
/// them (Otsu 1979), among the 255 inner edges of a histogram of 256 bins.
/// Infinite, so that nothing exceeds it, when all values fall into one bin.
pub fn otsu(map: &Image<f32>) -> f32 {
    // Neighbours fall into the same bin, which would wait for itself.
    let mut histograms = [[0_u64; BINS]; 4];
    for values in map.pixels().chunks(4) {
        for (histogram, value) in histograms.iter_mut().zip(values) {
            // The cast takes NaN and negative values to 0.
            histogram[((value * BINS as f32) as usize).min(BINS - 1)] += 1;
        }
    }
    let [mut histogram, others @ ..] = histograms;
    for other in others {
        for (count, other) in histogram.iter_mut().zip(other) {
            *count += other;
        }
    }
    let total: u64 = histogram.iter().sum();
    let total_moment: u64 = histogram.iter().zip(0..).map(|(&count, bin)| count * bin).sum();
    let (mut below, mut moment) = (0, 0);
    let (mut best, mut threshold) = (0.0, f32::INFINITY);
    for (bin, &count) in histogram.iter().enumerate().take(BINS - 1) {
        below += count;
        moment += count * bin as u64;
        let above = total - below;
        if below == 0 || above == 0 {
            continue;
        }
        let mean_below = moment as f64 / below as f64;
        let mean_above = (total_moment - moment) as f64 / above as f64;
        let variance = below as f64 * above as f64 * (mean_above - mean_below).powi(2);
        if variance > best {
            best = variance;
            threshold = (bin + 1) as f32 / BINS as f32;
        }
    }
    threshold
}
