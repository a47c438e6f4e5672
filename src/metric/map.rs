//! Attention maps against true masks.

use serde::{Deserialize, Serialize};

use crate::image::Image;

/// Collects maps; every measure is averaged per image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapStats {
    images: u64,
}

impl MapStats {
    /// Adds one map, 0..=255, with its mask, non-zero where salient. Both have
    /// the same size. Masks without a salient pixel are left out.
    pub fn add(&mut self, map: &Image<u8>, mask: &Image<u8>) {
        let _ = (map, mask);
    }

    /// Adds the images of another one.
    pub fn merge(&mut self, other: &Self) {
        self.images += other.images;
    }

    /// Everything in one row; `None` without images.
    pub fn total(&self) -> Option<MapScore> {
        None
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
    /// Weighted F (Margolin et al. 2014).
    pub weighted_f: f64,
    /// Structure measure (Fan et al. 2017), α = 0.5.
    pub s_measure: f64,
    /// Largest enhanced-alignment measure (Fan et al. 2018) over all thresholds.
    pub max_e: f64,
    /// Its mean over all thresholds.
    pub mean_e: f64,
    /// The same at twice the map's mean.
    pub adaptive_e: f64,
    /// Mean absolute error.
    pub mae: f64,
    /// Precision at threshold 0..=255, mean over images.
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
