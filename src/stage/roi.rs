//! The region of interest (eq. 5).

pub mod bits;
pub mod budget;
pub mod cells;
pub mod latency;
pub mod morphology;
pub mod threshold;

use crate::camera::StereoRig;
use crate::config::{Config, SaliencyMode, ThresholdMode};
use crate::image::{Image, Size};
use crate::perception::RoiMask;
use crate::simd::Level;
use crate::stage::coarse::CoarseDisparity;
use crate::stage::pole::Pole;

use bits::BitMask;
use budget::Budget;
use cells::{Components, retain_cells};
use morphology::Morphology;
use threshold::otsu;

/// Radius in pixels of the opening: filaments of one and two pixels are cut.
const OPENING: usize = 1;
/// Radius in pixels of the closing: gaps of up to one cell are filled.
const CLOSING: usize = 2;
/// How far the coarse disparity is trusted, in pixels. Depth is judged again
/// by the fine one; here nothing may be lost that it would accept.
const SLACK: f32 = 1.0;

/// The region of interest, one bit for each pixel.
#[derive(Debug, Default)]
pub struct Masks {
    /// See [`RoiMask::salient`].
    pub salient: BitMask,
    /// See [`RoiMask::matched`].
    pub matched: BitMask,
}

/// Threshold, morphology, components, area budget, dilation.
pub struct Roi {
    level: Level,
    size: Size,
    full_frame: bool,
    rectangle: Option<f32>,
    threshold: Option<f32>,
    depth_m: (f64, f64),
    min_area: u32,
    dilation: usize,
    max_fraction: f64,
    allowance: f64,
    masks: Masks,
    morphology: Morphology,
    /// Pixels of `matched`.
    area: usize,
    components: Components,
    budget: Budget,
}

impl Roi {
    /// The stage for views of `size`.
    pub fn new(config: &Config, size: Size, level: Level) -> Self {
        Self {
            level,
            size,
            full_frame: config.saliency.mode == SaliencyMode::FullFrame,
            rectangle: None,
            threshold: match config.saliency.threshold_mode {
                ThresholdMode::Fixed => Some(config.saliency.threshold as f32),
                ThresholdMode::Otsu => None,
            },
            depth_m: (config.depth.min, config.depth.max),
            min_area: u32::try_from(config.regions.min_area).unwrap_or(0),
            dilation: usize::try_from(config.roi.dilation).unwrap_or(0),
            max_fraction: config.roi.max_fraction,
            allowance: 1.0,
            masks: Masks::default(),
            morphology: Morphology::new(level),
            area: 0,
            components: Components::default(),
            budget: Budget::default(),
        }
    }

    /// From now on a centred rectangle of this share of the image, with its border.
    pub fn set_centred_rectangle(&mut self, fraction: f32) {
        self.rectangle = Some(fraction.clamp(0.0, 1.0));
    }

    /// From now on at most this share of the image is matched, even where
    /// `roi.max_fraction` allows more.
    pub fn set_allowance(&mut self, fraction: f64) {
        self.allowance = fraction;
    }

    /// Whether the mask is made from attention, not given.
    pub const fn follows_attention(&self) -> bool {
        self.rectangle.is_none() && !self.full_frame
    }

    /// Adds `poles` to both masks of the last run, which are matched as whole lines, as long
    /// as `roi.max_fraction` and the allowance have room for them; returns how many had.
    pub fn include(&mut self, poles: &[Pole], out: &mut RoiMask) -> usize {
        let limit = self.limit();
        let width = self.size.width;
        let mut count = 0;
        for pole in poles {
            let spans = || pole.rows.clone().map(|y| (y, pole.columns(y, width)));
            let new: usize = spans()
                .map(|(y, columns)| columns.filter(|x| out.matched.get(*x, y) == 0).count())
                .sum();
            if self.area + new > limit {
                break;
            }
            self.area += new;
            count += 1;
            for (y, columns) in spans() {
                for (mask, image) in [
                    (&mut self.masks.salient, &mut out.salient),
                    (&mut self.masks.matched, &mut out.matched),
                ] {
                    mask.set_rectangle((columns.start, columns.end), (y, y + 1));
                    image.row_mut(y)[columns.clone()].fill(255);
                }
            }
        }
        out.fraction = self.area as f32 / self.size.area().max(1) as f32;
        count
    }

    /// Pixels that may be matched.
    fn limit(&self) -> usize {
        (self.max_fraction.min(self.allowance) * self.size.area() as f64) as usize
    }

    /// The masks of the last run.
    pub const fn masks(&self) -> &Masks {
        &self.masks
    }

    /// The mask from `attention` per cell; S at a pixel is what
    /// [`upsample`](super::saliency::upsample()) makes of it.
    ///
    /// `salient` is S >= τ where `depth.min` <= Z <= `depth.max` by the coarse disparity
    /// (cells without one pass), opened and closed, less components smaller
    /// than `regions.min_area`. `matched` is `salient` dilated by a square of
    /// `roi.dilation` pixels to each side. When it exceeds `roi.max_fraction`
    /// or the allowance, both are cut to the most salient tiles.
    pub fn run(
        &mut self,
        attention: &Image<f32>,
        coarse: &CoarseDisparity,
        rig: &StereoRig,
        out: &mut RoiMask,
    ) {
        if let Some(fraction) = self.rectangle {
            self.mark_rectangle(f64::from(fraction));
        } else if self.full_frame {
            self.masks.salient.reset(self.size);
            self.masks.salient.fill();
            self.masks.matched.copy_from(&self.masks.salient);
            self.area = self.masks.matched.count(self.level);
        } else {
            let threshold = self.threshold.unwrap_or_else(|| otsu(attention));
            self.masks.salient.set_from_cells(self.level, attention, self.size, threshold);
            self.gate_depth(coarse, rig);
            self.morphology.open(&mut self.masks.salient, OPENING);
            self.morphology.close(&mut self.masks.salient, CLOSING);
            self.components.remove_small(&mut self.masks.salient, self.min_area);
            self.dilate();
            self.keep_budget(attention);
        }
        self.masks.salient.write(self.level, &mut out.salient);
        self.masks.matched.write(self.level, &mut out.matched);
        out.fraction = self.area as f32 / self.size.area().max(1) as f32;
    }

    /// A rectangle of the image's aspect around its centre.
    fn mark_rectangle(&mut self, fraction: f64) {
        self.masks.salient.reset(self.size);
        let side = |length: usize| {
            let part = (length as f64 * fraction.sqrt()).round() as usize;
            let start = (length - part) / 2;
            (start, start + part)
        };
        self.masks.salient.set_rectangle(side(self.size.width), side(self.size.height));
        self.dilate();
    }

    fn dilate(&mut self) {
        let Masks { salient, matched } = &mut self.masks;
        self.morphology.dilate_into(salient, self.dilation, matched);
        self.area = self.masks.matched.count(self.level);
    }

    /// Keeps `Z_min <= Z <= Z_max`, as `f B / Z_max <= d <= f B / Z_min`.
    fn gate_depth(&mut self, coarse: &CoarseDisparity, rig: &StereoRig) {
        let offset = rig.disparity_offset() as f32;
        let least = (rig.depth_scale() / self.depth_m.1) as f32 + offset - SLACK;
        let most = (rig.depth_scale() / self.depth_m.0) as f32 + offset + SLACK;
        retain_cells(&mut self.masks.salient, |x, y| {
            let d = coarse.checked.get(x, y);
            // NaN is neither.
            !(d < least || d > most)
        });
    }

    fn keep_budget(&mut self, attention: &Image<f32>) {
        let limit = self.limit();
        if self.area > limit {
            self.budget.choose(&self.masks.matched, attention, limit);
            self.budget.apply(&mut self.masks.matched);
            self.budget.apply(&mut self.masks.salient);
            self.area = self.masks.matched.count(self.level);
        }
    }
}
