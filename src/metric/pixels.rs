//! Pixel-wise classification (eq. 7-9).

use serde::{Deserialize, Serialize};

use super::share;

/// Counts of pixels by what they are and what they were taken for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Confusion {
    /// Salient, and found.
    pub true_positives: u64,
    /// Not salient, but found.
    pub false_positives: u64,
    /// Salient, but missed.
    pub false_negatives: u64,
    /// Not salient, and left alone.
    pub true_negatives: u64,
}

impl Confusion {
    /// Adds the pixels of one frame as pairs (found, salient).
    pub fn add(&mut self, pixels: impl IntoIterator<Item = (bool, bool)>) {
        // Counted in an array: the four branches would mispredict on every edge.
        let mut counts = [0_u64; 4];
        for (found, salient) in pixels {
            counts[usize::from(found) * 2 + usize::from(salient)] += 1;
        }
        self.true_negatives += counts[0];
        self.false_negatives += counts[1];
        self.false_positives += counts[2];
        self.true_positives += counts[3];
    }

    /// Adds the counts of another accumulator.
    pub fn merge(&mut self, other: &Self) {
        self.true_positives += other.true_positives;
        self.false_positives += other.false_positives;
        self.false_negatives += other.false_negatives;
        self.true_negatives += other.true_negatives;
    }

    /// (TP + TN) / all, eq. 7. `None` without pixels.
    pub fn accuracy(&self) -> Option<f64> {
        let right = self.true_positives + self.true_negatives;
        share(right, right + self.false_positives + self.false_negatives)
    }

    /// TP / (TP + FP), eq. 8. `None` when nothing was found.
    pub fn precision(&self) -> Option<f64> {
        share(self.true_positives, self.true_positives + self.false_positives)
    }

    /// TP / (TP + FN), eq. 8. `None` when there was nothing to find.
    pub fn recall(&self) -> Option<f64> {
        share(self.true_positives, self.true_positives + self.false_negatives)
    }

    /// 2 TP / (2 TP + FP + FN), eq. 9. `None` when nothing was found and
    /// nothing was there.
    pub fn f1(&self) -> Option<f64> {
        let doubled = 2 * self.true_positives;
        share(doubled, doubled + self.false_positives + self.false_negatives)
    }

    /// Everything in one row. `None` without pixels.
    pub fn total(&self) -> Option<PixelScore> {
        Some(PixelScore {
            accuracy: self.accuracy()?,
            precision: self.precision(),
            recall: self.recall(),
            f1: self.f1(),
        })
    }
}

/// Eq. 7-9 over all pixels of all frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PixelScore {
    /// Eq. 7.
    pub accuracy: f64,
    /// Eq. 8; `None` when nothing was found.
    pub precision: Option<f64>,
    /// Eq. 8; `None` when nothing was there.
    pub recall: Option<f64>,
    /// Eq. 9; `None` when both are.
    pub f1: Option<f64>,
}
