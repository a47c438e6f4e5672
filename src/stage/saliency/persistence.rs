//! What was attended to a moment ago is attended to now.

#![allow(
    clippy::inline_always,
    reason = "a kernel gets the wide instructions only where `dispatch` inlines it"
)]

use crate::config::{Config, SaliencyMode, ThresholdMode};
use crate::image::{Image, Size};
use crate::simd::{Level, dispatch};
use crate::stage::saliency::PreviousFrame;
use crate::stage::saliency::flow::Flow;

/// What a cell gains that was attended to in the frame before, and one loses
/// that was not: about the noise of a smoothed map. On video clips with masks
/// outlines keep their place the better the larger both are; from twice as much
/// on overlap is lost.
const STAYS: f32 = 0.05;
const COMES: f32 = 0.02;

/// The map's memory along the flow, with its buffer.
#[derive(Debug)]
pub struct Persistence {
    level: Level,
    share: f32,
    threshold: Option<f32>,
    gain: Image<f32>,
}

impl Persistence {
    /// The memory that `saliency.temporal_smoothing` asks for; 0 is none.
    pub fn new(config: &Config, level: Level) -> Self {
        let saliency = &config.saliency;
        let stays =
            saliency.mode == SaliencyMode::Scene && saliency.threshold_mode == ThresholdMode::Fixed;
        Self {
            level,
            share: saliency.temporal_smoothing as f32,
            threshold: stays.then_some(saliency.threshold as f32),
            gain: Image::default(),
        }
    }

    /// Whether the frame before is asked for.
    pub fn is_on(&self) -> bool {
        self.share > 0.0
    }

    /// (1 - a) of this frame's map and a of the one before, the latter read where
    /// each cell was then. What was not seen before has no past: there `a` fades
    /// with the flow's trust, so that a new thing is attended to at once.
    pub fn smooth(&mut self, attention: &mut Image<f32>, before: &PreviousFrame, flow: &Flow) {
        self.gain.resize(attention.size());
        let Self { level, share, gain, .. } = self;
        if before.attended.size() == attention.size() {
            dispatch!(*level, _simd => smooth::<true>(attention, before, flow, *share, gain));
        } else {
            gain.fill(0.0);
            dispatch!(*level, _simd => smooth::<false>(attention, before, flow, *share, gain));
        }
    }

    /// Adds to a smoothed map .05 where a cell was attended to in the frame before,
    /// else -.02, times the flow's trust (hysteresis), within 0..=1; marks in
    /// `attended` as 1 what is attended to now, at the fixed threshold. A map that
    /// was not smoothed is left as it is.
    pub fn stay(&mut self, attention: &mut Image<f32>, attended: &mut Image<f32>) {
        let Some(threshold) = self.threshold.filter(|_| self.is_on()) else { return };
        attended.resize(attention.size());
        if self.gain.size() == attention.size() {
            for (s, gain) in attention.pixels_mut().iter_mut().zip(self.gain.pixels()) {
                *s = (*s + gain).clamp(0.0, 1.0);
            }
        }
        for (out, s) in attended.pixels_mut().iter_mut().zip(attention.pixels()) {
            *out = f32::from(u8::from(*s >= threshold));
        }
        self.gain.fill(0.0);
    }
}

/// Smooths the map, and where the marks are `KEPT` fills what each cell gains.
#[inline(always)]
fn smooth<const KEPT: bool>(
    attention: &mut Image<f32>,
    before: &PreviousFrame,
    flow: &Flow,
    share: f32,
    gain: &mut Image<f32>,
) {
    let size = attention.size();
    for y in 0..size.height {
        let shifts = flow.dx.row(y).iter().zip(flow.dy.row(y)).zip(flow.trust.row(y));
        let cells = attention.row_mut(y).iter_mut().zip(gain.row_mut(y));
        for (x, ((now, gain), ((dx, dy), trust))) in cells.zip(shifts).enumerate() {
            let place = Place::new(size, x as f32 + dx, y as f32 + dy);
            *now += share * trust * (place.of(before.attention.pixels()) - *now);
            if KEPT {
                let attended = place.of(before.attended.pixels());
                *gain = trust * ((STAYS + COMES) * attended - COMES);
            }
        }
    }
}

/// Four cells around a place, and its distance from the upper left one.
struct Place {
    at: usize,
    right: usize,
    below: usize,
    fx: f32,
    fy: f32,
}

impl Place {
    /// `(x, y)` in an image of `size`, limited to it.
    #[inline(always)]
    fn new(Size { width, height }: Size, x: f32, y: f32) -> Self {
        let x = x.clamp(0.0, (width - 1) as f32);
        let y = y.clamp(0.0, (height - 1) as f32);
        let (x0, y0) = (x as usize, y as usize);
        Self {
            at: y0 * width + x0,
            right: usize::from(x0 + 1 < width),
            below: usize::from(y0 + 1 < height) * width,
            fx: x - x0 as f32,
            fy: y - y0 as f32,
        }
    }

    /// Bilinear value.
    #[inline(always)]
    fn of(&self, pixels: &[f32]) -> f32 {
        let (at, right) = (self.at, self.right);
        let upper = pixels[at] + self.fx * (pixels[at + right] - pixels[at]);
        let at = at + self.below;
        let lower = pixels[at] + self.fx * (pixels[at + right] - pixels[at]);
        upper + self.fy * (lower - upper)
    }
}
