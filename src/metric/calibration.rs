//! Whether stated probabilities come true.

use serde::{Deserialize, Serialize};

/// Bins of equal width over 0..=1.
const BINS: usize = 10;

/// Counts how often what was stated with a probability was right (reliability
/// diagram; expected calibration error of Naeini et al. 2015).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    bins: [Bin; BINS],
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Bin {
    count: u64,
    right: u64,
    sum: f64,
}

impl Calibration {
    /// Adds one statement; a probability outside 0..=1 is none and is left out.
    pub fn add(&mut self, probability: f64, right: bool) {
        if (0.0..=1.0).contains(&probability) {
            let bin = &mut self.bins[((probability * BINS as f64) as usize).min(BINS - 1)];
            bin.count += 1;
            bin.right += u64::from(right);
            bin.sum += probability;
        }
    }

    /// Adds the counts of another accumulator.
    pub fn merge(&mut self, other: &Self) {
        for (bin, more) in self.bins.iter_mut().zip(&other.bins) {
            bin.count += more.count;
            bin.right += more.right;
            bin.sum += more.sum;
        }
    }

    /// Everything so far; `None` when nothing was stated.
    pub fn total(&self) -> Option<CalibrationScore> {
        let total: u64 = self.bins.iter().map(|bin| bin.count).sum();
        if total == 0 {
            return None;
        }
        let rows = self.bins.iter().filter(|bin| bin.count > 0).map(|bin| CalibrationRow {
            stated: bin.sum / bin.count as f64,
            right: bin.right as f64 / bin.count as f64,
            count: bin.count,
        });
        let rows: Vec<_> = rows.collect();
        let weighted = rows.iter().map(|r| (r.stated - r.right).abs() * r.count as f64);
        Some(CalibrationScore { error: weighted.sum::<f64>() / total as f64, rows })
    }
}

/// How far stated probabilities are from what came true.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibrationScore {
    /// Mean over all statements of |stated − right| of their bin.
    pub error: f64,
    /// The reliability diagram: bins with statements, by probability.
    pub rows: Vec<CalibrationRow>,
}

/// One bin of a reliability diagram.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CalibrationRow {
    /// Mean stated probability.
    pub stated: f64,
    /// Share that was right.
    pub right: f64,
    /// Statements.
    pub count: u64,
}
