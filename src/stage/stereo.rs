//! Stereo correspondence inside the region of interest.

pub mod block;
pub mod census;
pub mod cost;
pub mod engine;
pub mod horizontal;
pub mod plan;
pub mod vertical;
pub mod volume;
pub mod winner;

use crate::config::{Algorithm, Config};
use crate::image::{Image, Size};
use crate::perception::{RoiMask, View};
use crate::simd::Level;
use crate::stage::coarse::CoarseDisparity;
use crate::stage::saliency::upsample;
use crate::stage::stereo::block::Measure;
use crate::stage::stereo::cost::Penalties;
use crate::stage::stereo::engine::{Engine, Method, Settings, Views};
use crate::stage::stereo::plan::Plan;

/// Value of a pixel without a match.
pub const NO_MATCH: i16 = i16::MIN;

/// What the matcher found, before any check.
#[derive(Clone, Debug, Default)]
pub struct Matches {
    /// Disparity `x_l - x_r` of left pixels in units of
    /// [`crate::perception::DISPARITY_STEP`]; [`NO_MATCH`] outside the region of interest.
    pub left: Image<i16>,
    /// The same seen from the right image, for the left-right check.
    pub right: Image<i16>,
    /// Evidence for the left disparity from the shape of its cost curve
    /// (uniqueness, peak ratio): 0 none, 255 unmistakable.
    pub evidence: Image<u8>,
}

/// The matcher.
pub struct Stereo {
    size: Size,
    engine: Engine,
    plan: Plan,
    lambda: f32,
    level: Level,
    /// S per pixel, where it is asked for.
    saliency: Image<f32>,
    weight: Image<u8>,
}

impl Stereo {
    /// The matcher for views of `size`.
    pub fn new(config: &Config, size: Size, level: Level) -> Self {
        let stereo = &config.stereo;
        let lo = stereo.min_disparity.max(0) as usize;
        let settings = Settings {
            penalties: Penalties::of(stereo),
            method: match stereo.algorithm {
                Algorithm::SemiGlobal => match stereo.paths {
                    4 => Method::FourPaths,
                    5 => Method::FivePaths,
                    _ => Method::EightPaths,
                },
                Algorithm::Block => Method::Block(Measure::Absolute),
                Algorithm::CensusBlock => Method::Block(Measure::Census),
            },
            context: 8,
            search: lo..lo + stereo.disparity_range.max(1) as usize,
        };
        Self {
            size,
            engine: Engine::new(settings, level),
            plan: Plan::default(),
            lambda: stereo.saliency_weight as f32,
            level,
            saliency: Image::default(),
            weight: Image::default(),
        }
    }

    /// Matches `left` with `right` where `roi.matched` is set. `attention` is one value
    /// per cell.
    pub fn run(
        &mut self,
        left: &View,
        right: &View,
        roi: &RoiMask,
        attention: &Image<f32>,
        coarse: &CoarseDisparity,
        out: &mut Matches,
    ) {
        debug_assert_eq!(left.gray.size(), self.size);
        let search = self.engine.settings().search.clone();
        self.plan.of_mask(&roi.matched, roi.fraction, Some(&coarse.checked), &search);
        let weighted = self.lambda > 0.0;
        if weighted {
            upsample(self.level, attention, self.size, &mut self.saliency);
            self.weight.resize(self.size);
            let saliency = self.saliency.pixels();
            for (out, &s) in self.weight.pixels_mut().iter_mut().zip(saliency) {
                *out = (255.0 / (1.0 + self.lambda * s.clamp(0.0, 1.0))) as u8;
            }
        }
        let views = Views {
            left: &left.gray,
            right: &right.gray,
            mask: Some(&roi.matched),
            coarse: Some(&coarse.checked),
            weight: weighted.then_some(&self.weight),
        };
        self.engine.run(&views, &self.plan, out);
    }
}
