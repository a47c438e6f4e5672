//! What was attended to a moment ago is attended to now.

use crate::config::{Config, SaliencyMode, ThresholdMode};
use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, prelude::*, u32x16};
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
            dispatch!(*level, simd => smooth::<_, true>(simd, attention, before, flow, *share, gain));
        } else {
            gain.fill(0.0);
            dispatch!(*level, simd => smooth::<_, false>(simd, attention, before, flow, *share, gain));
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

/// Cells that are smoothed at once.
const LANES: usize = 16;

/// Smooths the map, and where the marks are `KEPT` fills what each cell gains.
#[inline(always)]
fn smooth<S: Simd, const KEPT: bool>(
    simd: S,
    attention: &mut Image<f32>,
    before: &PreviousFrame,
    flow: &Flow,
    share: f32,
    gain: &mut Image<f32>,
) {
    let size = attention.size();
    for y in 0..size.height {
        for x in (0..size.width).step_by(LANES) {
            let (dx, dy) = (load(simd, flow.dx.row(y), x), load(simd, flow.dy.row(y), x));
            let trust = load(simd, flow.trust.row(y), x);
            let here = f32x16::from_fn(simd, |i| (x + i) as f32);
            let place = Place::new(size, here + dx, dy + y as f32);
            let now = load(simd, attention.row(y), x);
            let past = place.of(simd, before.attention.pixels());
            store(attention.row_mut(y), x, now + trust * share * (past - now));
            if KEPT {
                let attended = place.of(simd, before.attended.pixels());
                store(gain.row_mut(y), x, trust * (attended * (STAYS + COMES) - COMES));
            }
        }
    }
}

/// The values of a row from `x` on; beyond its end 0.
#[inline(always)]
fn load<S: Simd>(simd: S, row: &[f32], x: usize) -> f32x16<S> {
    let row = &row[x..];
    if let Some(values) = row.first_chunk::<LANES>() {
        return f32x16::from_slice(simd, values);
    }
    let mut values = [0.0; LANES];
    values[..row.len()].copy_from_slice(row);
    f32x16::from_slice(simd, &values)
}

/// Writes those of the values from `x` on that are inside a row.
#[inline(always)]
fn store<S: Simd>(row: &mut [f32], x: usize, values: f32x16<S>) {
    let row = &mut row[x..];
    if let Some(row) = row.first_chunk_mut::<LANES>() {
        values.store_slice(row);
    } else {
        row.copy_from_slice(&values.as_slice()[..row.len()]);
    }
}

/// For each of several places the cell to its upper left, and its distance from that.
struct Place<S: Simd> {
    at: u32x16<S>,
    width: usize,
    fx: f32x16<S>,
    fy: f32x16<S>,
}

impl<S: Simd> Place<S> {
    /// `(x, y)` in an image of `size`, limited to it.
    #[inline(always)]
    fn new(Size { width, height }: Size, x: f32x16<S>, y: f32x16<S>) -> Self {
        let x = x.max(0.0).min((width - 1) as f32);
        let y = y.max(0.0).min((height - 1) as f32);
        let (x0, y0) = (x.floor(), y.floor());
        let (column, row): (u32x16<S>, u32x16<S>) = (x0.to_int(), y0.to_int());
        Self { at: row * width as u32 + column, width, fx: x - x0, fy: y - y0 }
    }

    /// Bilinear values. The pixels are fetched one place after the other; what
    /// is right of the last column or below the last row has no share.
    #[inline(always)]
    fn of(&self, simd: S, pixels: &[f32]) -> f32x16<S> {
        let [mut upper, mut lower] = [[[0.0; 2]; LANES]; 2];
        for (i, at) in self.at.as_slice().iter().enumerate() {
            let (at, below) = (*at as usize, *at as usize + self.width);
            upper[i] = pair(pixels, at);
            lower[i] = if below < pixels.len() { pair(pixels, below) } else { upper[i] };
        }
        let upper = self.across(simd, &upper);
        let lower = self.across(simd, &lower);
        upper + self.fy * (lower - upper)
    }

    /// Between the two of each pair.
    #[inline(always)]
    fn across(&self, simd: S, pairs: &[[f32; 2]; LANES]) -> f32x16<S> {
        let (first, second) = pairs.as_flattened().split_at(LANES);
        let first = f32x16::from_slice(simd, first);
        let (from, to) = first.deinterleave(f32x16::from_slice(simd, second));
        from + self.fx * (to - from)
    }
}

/// A pixel and the next one; twice the last one.
#[inline(always)]
fn pair(pixels: &[f32], at: usize) -> [f32; 2] {
    if let Some(pair) = pixels[at..].first_chunk() { *pair } else { [pixels[at]; 2] }
}
