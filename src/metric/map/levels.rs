//! The 256 levels of a map: what they mean, and how many pixels have them.

use serde::{Deserialize, Serialize};

use super::BETA_SQUARED;
use crate::image::Image;

/// Values of a byte.
pub(super) const LEVELS: usize = 256;

/// What each level of a map stands for.
pub(super) struct Levels {
    /// Saliency, 0..=1.
    pub value: [f64; LEVELS],
    /// The highest threshold 0..=255 that the level reaches.
    pub step: [u8; LEVELS],
}

impl Levels {
    /// Level v is v / 255.
    pub fn as_is() -> Self {
        Self::new(byte)
    }

    /// Level v of this map is (v - smallest) / (largest - smallest). A flat
    /// map stays as it is.
    pub fn stretched(map: &Image<u8>) -> Self {
        let extremes = map.pixels().iter().min().zip(map.pixels().iter().max());
        match extremes {
            Some((&low, &high)) if low < high => {
                let (low, high) = (byte(usize::from(low)), byte(usize::from(high)));
                Self::new(|level| (byte(level) - low) / (high - low))
            }
            _ => Self::as_is(),
        }
    }

    fn new(value: impl Fn(usize) -> f64) -> Self {
        let value = std::array::from_fn(value);
        // Rounded down in double precision: so the referees make bytes again.
        Self { value, step: value.map(|value: f64| (value * 255.0) as u8) }
    }
}

fn byte(level: usize) -> f64 {
    level as f64 / 255.0
}

/// Number of pixels per level.
pub(super) type Histogram = [u64; LEVELS];

/// Pixels per level, salient ones apart.
#[derive(Clone, Copy)]
pub(super) struct Counts {
    pub salient: Histogram,
    pub other: Histogram,
}

impl Counts {
    /// Of nothing.
    pub const EMPTY: Self = Self { salient: [0; LEVELS], other: [0; LEVELS] };

    /// Of a map and its mask, equally large.
    pub fn of(map: &Image<u8>, mask: &Image<u8>) -> Self {
        let mut counts = Self::EMPTY;
        counts.add(map.pixels(), mask.pixels());
        counts
    }

    /// Adds pixels of the map and of its mask.
    pub fn add(&mut self, map: &[u8], mask: &[u8]) {
        for (level, mask) in map.iter().zip(mask) {
            let histogram = if *mask == 0 { &mut self.other } else { &mut self.salient };
            histogram[usize::from(*level)] += 1;
        }
    }

    /// Salient pixels.
    pub fn positives(&self) -> u64 {
        self.salient.iter().sum()
    }

    /// All pixels.
    pub fn pixels(&self) -> u64 {
        self.positives() + self.other.iter().sum::<u64>()
    }

    /// What comes of taking the levels for which `takes` holds.
    pub fn operation(&self, takes: impl Fn(usize) -> bool) -> Operation {
        let sum = |histogram: &Histogram| {
            histogram.iter().enumerate().filter(|(level, _)| takes(*level)).map(|(_, n)| n).sum()
        };
        Operation {
            hits: sum(&self.salient),
            false_alarms: sum(&self.other),
            positives: self.positives(),
            pixels: self.pixels(),
        }
    }

    /// What comes of each threshold 0..=255.
    pub fn operations(&self, levels: &Levels) -> [Operation; LEVELS] {
        let (positives, pixels) = (self.positives(), self.pixels());
        let mut at = [Operation { hits: 0, false_alarms: 0, positives, pixels }; LEVELS];
        for (level, step) in levels.step.iter().enumerate() {
            at[usize::from(*step)].hits += self.salient[level];
            at[usize::from(*step)].false_alarms += self.other[level];
        }
        for i in (0..LEVELS - 1).rev() {
            at[i].hits += at[i + 1].hits;
            at[i].false_alarms += at[i + 1].false_alarms;
        }
        at
    }

    /// Twice the mean of the map, at most 1 (Achanta et al. 2009).
    pub fn threshold(&self, levels: &Levels) -> f64 {
        let sum = moment(&self.salient, &levels.value) + moment(&self.other, &levels.value);
        (2.0 * (sum / self.pixels() as f64)).min(1.0)
    }

    /// Mean absolute difference between map and mask.
    pub fn mean_error(&self, levels: &Levels) -> f64 {
        let missed = moment(&self.salient, &levels.value.map(|value| 1.0 - value));
        (missed + moment(&self.other, &levels.value)) / self.pixels() as f64
    }
}

/// Sum of `value` over the pixels of a histogram.
pub(super) fn moment(histogram: &Histogram, value: &[f64; LEVELS]) -> f64 {
    let present = histogram.iter().zip(value).filter(|(count, _)| **count > 0);
    present.map(|(count, value)| *count as f64 * value).sum()
}

/// A map cut at some threshold, against its mask.
#[derive(Clone, Copy)]
pub(super) struct Operation {
    /// Salient pixels that were taken.
    pub hits: u64,
    /// Other pixels that were taken.
    pub false_alarms: u64,
    /// Salient pixels.
    pub positives: u64,
    /// All pixels.
    pub pixels: u64,
}

impl Operation {
    /// Pixels that were taken.
    pub const fn taken(&self) -> u64 {
        self.hits + self.false_alarms
    }

    /// 0 where nothing was taken.
    pub fn precision(&self) -> f64 {
        self.hits as f64 / self.taken().max(1) as f64
    }

    pub fn recall(&self) -> f64 {
        self.hits as f64 / self.positives.max(1) as f64
    }

    /// Share of the image that was taken.
    pub fn area(&self) -> f64 {
        self.taken() as f64 / self.pixels.max(1) as f64
    }

    /// (1 + β²) P R / (β² P + R), 0 where nothing salient was taken.
    pub fn f(&self) -> f64 {
        let (precision, recall) = (self.precision(), self.recall());
        if self.hits == 0 {
            return 0.0;
        }
        (1.0 + BETA_SQUARED) * precision * recall / (BETA_SQUARED * precision + recall)
    }
}

/// Sum over images of a curve over the thresholds 0..=255.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Curve(Vec<f64>);

impl Curve {
    pub fn add(&mut self, value: impl Fn(usize) -> f64) {
        self.0.resize(LEVELS, 0.0);
        for (i, sum) in self.0.iter_mut().enumerate() {
            *sum += value(i);
        }
    }

    pub fn merge(&mut self, other: &Self) {
        self.add(|i| other.0.get(i).copied().unwrap_or(0.0));
    }

    /// The mean over so many images.
    pub fn over(&self, images: u64) -> Vec<f64> {
        let mut mean = self.0.clone();
        mean.resize(LEVELS, 0.0);
        for value in &mut mean {
            *value /= images as f64;
        }
        mean
    }
}
