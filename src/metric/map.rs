//! Attention maps against true masks.

mod alignment;
mod levels;
mod structure;
mod weighted;

use serde::{Deserialize, Serialize};

use super::Mean;
use crate::image::Image;
use levels::{Counts, Curve, LEVELS, Levels, Operation};

/// β² of F: precision counts more than recall (Achanta et al. 2009).
const BETA_SQUARED: f64 = 0.3;

/// Collects maps; every measure is averaged per image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapStats {
    images: u64,
    f: Curve,
    e: Curve,
    precision: Curve,
    recall: Curve,
    area: Curve,
    adaptive_f: Mean,
    adaptive_e: Mean,
    weighted_f: Mean,
    s_measure: Mean,
    mae: Mean,
    roi_90: Mean,
    roi_95: Mean,
}

impl MapStats {
    /// Adds one map as it is, 0..=255 for 0..=1, with its mask, non-zero where
    /// salient. Images whose mask has no salient pixel, or another size than
    /// the map, are left out; the answer is whether the image counts.
    pub fn add(&mut self, map: &Image<u8>, mask: &Image<u8>) -> bool {
        self.add_levels(map, mask, &Levels::as_is())
    }

    /// [`MapStats::add`] after the map's values were stretched so that they
    /// reach from 0 to 1, as referees do before they score.
    pub fn add_stretched(&mut self, map: &Image<u8>, mask: &Image<u8>) -> bool {
        self.add_levels(map, mask, &Levels::stretched(map))
    }

    fn add_levels(&mut self, map: &Image<u8>, mask: &Image<u8>, levels: &Levels) -> bool {
        if map.size() != mask.size() {
            return false;
        }
        let counts = Counts::of(map, mask);
        if counts.positives() == 0 {
            return false;
        }
        self.images += 1;
        let at = counts.operations(levels);
        self.f.add(|i| at[i].f());
        self.e.add(|i| alignment::e_measure(at[i]));
        self.precision.add(|i| at[i].precision());
        self.recall.add(|i| at[i].recall());
        self.area.add(|i| at[i].area());
        let threshold = counts.threshold(levels);
        let adaptive = counts.operation(|level| levels.value[level] >= threshold);
        self.adaptive_f.add(adaptive.f());
        self.adaptive_e.add(alignment::e_measure(adaptive));
        self.weighted_f.add(weighted::weighted_f(map, mask, levels));
        self.s_measure.add(structure::s_measure(map, mask, levels, &counts));
        self.mae.add(counts.mean_error(levels));
        // Threshold 0 takes the whole image and with it everything salient.
        let holding = |share| at.iter().rev().find(|at| at.recall() >= share).map(Operation::area);
        self.roi_90.add(holding(0.9).unwrap_or(1.0));
        self.roi_95.add(holding(0.95).unwrap_or(1.0));
        true
    }

    /// Adds the images of another one.
    pub fn merge(&mut self, other: &Self) {
        self.images += other.images;
        self.f.merge(&other.f);
        self.e.merge(&other.e);
        self.precision.merge(&other.precision);
        self.recall.merge(&other.recall);
        self.area.merge(&other.area);
        self.adaptive_f.merge(&other.adaptive_f);
        self.adaptive_e.merge(&other.adaptive_e);
        self.weighted_f.merge(&other.weighted_f);
        self.s_measure.merge(&other.s_measure);
        self.mae.merge(&other.mae);
        self.roi_90.merge(&other.roi_90);
        self.roi_95.merge(&other.roi_95);
    }

    /// Everything in one row; `None` without images.
    pub fn total(&self) -> Option<MapScore> {
        if self.images == 0 {
            return None;
        }
        let curve = |curve: &Curve| curve.over(self.images);
        let (f, e) = (curve(&self.f), curve(&self.e));
        let largest = |curve: &[f64]| curve.iter().copied().fold(0.0, f64::max);
        let mean = |curve: &[f64]| curve.iter().sum::<f64>() / LEVELS as f64;
        Some(MapScore {
            images: self.images,
            max_f: largest(&f),
            mean_f: mean(&f),
            adaptive_f: self.adaptive_f.value()?,
            weighted_f: self.weighted_f.value()?,
            s_measure: self.s_measure.value()?,
            max_e: largest(&e),
            mean_e: mean(&e),
            adaptive_e: self.adaptive_e.value()?,
            mae: self.mae.value()?,
            precision: curve(&self.precision),
            recall: curve(&self.recall),
            area: curve(&self.area),
            roi_90: self.roi_90.value()?,
            roi_95: self.roi_95.value()?,
        })
    }
}

/// Attention maps against true masks, means over images.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MapScore {
    /// Number of images.
    pub images: u64,
    /// Largest F (β² = 0.3) over all thresholds, of the mean curve.
    pub max_f: f64,
    /// Mean F over all thresholds.
    pub mean_f: f64,
    /// F at twice the map's mean.
    pub adaptive_f: f64,
    /// Weighted F (Margolin et al. 2014), β² = 1.
    pub weighted_f: f64,
    /// Structure measure (Fan et al. 2017), α = 0.5.
    pub s_measure: f64,
    /// Largest enhanced-alignment measure (Fan et al. 2018) over all
    /// thresholds, of the mean curve.
    pub max_e: f64,
    /// Its mean over all thresholds.
    pub mean_e: f64,
    /// The same at twice the map's mean.
    pub adaptive_e: f64,
    /// Mean absolute error.
    pub mae: f64,
    /// Precision at threshold 0..=255, mean over images; 0 where nothing is
    /// that salient.
    pub precision: Vec<f64>,
    /// Recall at threshold 0..=255, mean over images.
    pub recall: Vec<f64>,
    /// Share of the image at or above threshold 0..=255, mean over images.
    pub area: Vec<f64>,
    /// Mean over images of the smallest area that holds 90 % of the salient pixels.
    pub roi_90: f64,
    /// The same for 95 %.
    pub roi_95: f64,
}
