//! What confidence says about errors.

use serde::{Deserialize, Serialize};

use super::Mean;

/// Number of points of a curve: 0, 5, … 95 % of the pixels removed.
pub const SPARSIFICATION_STEPS: usize = 20;

/// Pixels of a frame from which its curves say something.
const LEAST_PIXELS: usize = 100;

/// Collects sparsification curves (Ilg et al. 2018), each as a share of the
/// frame's own mean error; averaged per frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SparsificationStats {
    by_confidence: [Mean; SPARSIFICATION_STEPS],
    by_error: [Mean; SPARSIFICATION_STEPS],
}

impl SparsificationStats {
    /// Adds one frame by its pixels as (confidence, error), in row order: of
    /// equally confident pixels the first go first. What is not finite is
    /// dropped; the order is lost. A frame of fewer than 100 pixels, or
    /// without any error, has no curve and is left out.
    pub fn add(&mut self, pixels: &mut Vec<(f32, f32)>) {
        pixels.retain(|(confidence, error)| confidence.is_finite() && error.is_finite());
        let total: f64 = pixels.iter().map(|(_, error)| f64::from(*error)).sum();
        if pixels.len() < LEAST_PIXELS || total <= 0.0 {
            return;
        }
        pixels.sort_by(|a, b| a.0.total_cmp(&b.0));
        add_curve(&mut self.by_confidence, pixels, total);
        pixels.sort_unstable_by(|a, b| b.1.total_cmp(&a.1));
        add_curve(&mut self.by_error, pixels, total);
    }

    /// Adds the frames of another one.
    pub fn merge(&mut self, other: &Self) {
        for (mean, more) in self.by_confidence.iter_mut().zip(&other.by_confidence) {
            mean.merge(more);
        }
        for (mean, more) in self.by_error.iter_mut().zip(&other.by_error) {
            mean.merge(more);
        }
    }

    /// Both curves and the area between them; `None` without frames.
    pub fn total(&self) -> Option<SparsificationScore> {
        let curve = |means: &[Mean]| means.iter().map(Mean::value).collect::<Option<Vec<f64>>>();
        let (by_confidence, by_error) = (curve(&self.by_confidence)?, curve(&self.by_error)?);
        let between = by_confidence.iter().zip(&by_error).map(|(ours, best)| ours - best);
        let ause = between.sum::<f64>() / SPARSIFICATION_STEPS as f64;
        Some(SparsificationScore { by_confidence, by_error, ause })
    }
}

/// Mean error of what is left of `pixels` after each step from the front,
/// relative to that of all, whose errors sum up to `total`.
fn add_curve(curve: &mut [Mean; SPARSIFICATION_STEPS], pixels: &[(f32, f32)], total: f64) {
    let mean = total / pixels.len() as f64;
    let mut end = pixels.len();
    let mut sum = 0.0;
    for (step, point) in curve.iter_mut().enumerate().rev() {
        let start = pixels.len() * step / SPARSIFICATION_STEPS;
        sum += pixels[start..end].iter().map(|(_, error)| f64::from(*error)).sum::<f64>();
        end = start;
        point.add(sum / (pixels.len() - start) as f64 / mean);
    }
}

/// Mean error that remains when pixels are removed, relative to that of all.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SparsificationScore {
    /// The least confident pixels removed first; point i: i/20 removed.
    pub by_confidence: Vec<f64>,
    /// The worst pixels removed first: the best that confidence could do.
    pub by_error: Vec<f64>,
    /// Area between both curves (AUSE): 0 when confidence knows the errors.
    pub ause: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pixels: impl IntoIterator<Item = (f32, f32)>) -> Option<SparsificationScore> {
        let mut stats = SparsificationStats::default();
        stats.add(&mut pixels.into_iter().collect());
        stats.total()
    }

    #[test]
    fn confidence_that_knows_the_errors_is_as_good_as_the_errors() {
        // Errors 1..=100, mean 50.5; of the last 5 of 100: mean 3.
        let perfect = of((1..=100_u8).map(|i| (-f32::from(i), f32::from(i)))).unwrap();
        assert_eq!(perfect.ause, 0.0);
        assert!((perfect.by_error[19] - 3.0 / 50.5).abs() < 1e-12);
        assert_eq!(perfect.by_error[0], 1.0);

        let wrong = of((1..=100_u8).map(|i| (f32::from(i), f32::from(i)))).unwrap();
        assert!((wrong.by_confidence[19] - 98.0 / 50.5).abs() < 1e-12);
        // After i steps 5 i + 1 ..= 100 are left: mean (101 + 5 i) / 2, beside
        // (101 - 5 i) / 2: the difference is 5 i, its mean 47.5.
        assert!((wrong.ause - 47.5 / 50.5).abs() < 1e-12);
    }

    #[test]
    fn frames_count_alike_and_empty_ones_not_at_all() {
        assert_eq!(of([]), None);
        assert_eq!(of((0..99).map(|_| (1.0, 1.0))), None, "too few pixels");
        assert_eq!(of((0..200).map(|_| (1.0, 0.0))), None, "no error");
        assert_eq!(of((0..200).map(|i| (if i < 150 { f32::NAN } else { 0.5 }, 1.0))), None);
        let mut one = SparsificationStats::default();
        one.add(&mut (1..=100_u8).map(|i| (f32::from(i), f32::from(i))).collect());
        let mut other = SparsificationStats::default();
        other.add(&mut (0..5000_u16).map(|i| (f32::from(i), 1e6)).collect());
        one.merge(&other);
        assert!((one.total().unwrap().ause - 0.5 * 47.5 / 50.5).abs() < 1e-12);
    }
}
