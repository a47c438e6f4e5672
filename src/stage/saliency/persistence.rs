//! What was attended to a moment ago is attended to now.

use crate::config::{Config, SaliencyMode, ThresholdMode};
use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, padded, prelude::*, store_inside, u32x16};
use crate::stage::saliency::PreviousFrame;
use crate::stage::saliency::flow::Flow;

/// Difference of two frames' maps up to which it is noise, and from which it is
/// news: of what appears, goes, or moves otherwise than the flow says.
const NOISE: f32 = 0.1;
const NEWS: f32 = 0.4;
/// What the past weighs against news, in parts of what it weighs against noise.
const OLD: f32 = 0.5;

/// What a cell gains that was attended to in the frame before, and one loses that was
/// not, less than a change that counts as noise. On video clips with masks outlines keep
/// their place the better the larger both are, and ghosts of what has gone stay longer.
const STAYS: f32 = 0.08;
const COMES: f32 = 0.03;

/// The map's memory along the flow, with its buffer.
#[derive(Debug)]
pub struct Persistence {
    level: Level,
    share: f32,
    threshold: Option<f32>,
    gain: Image<f32>,
    /// Attention and mark of each cell of the frame before.
    past: Vec<[f32; 2]>,
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
            past: Vec::new(),
        }
    }

    /// Whether the frame before is asked for.
    pub fn is_on(&self) -> bool {
        self.share > 0.0
    }

    /// (1 - a) of this frame's map and a of the one before, the latter read where
    /// each cell was then. `a` is the share that was asked for where they differ by .1
    /// and less, falling to half of it where they differ by .4 and more: small
    /// differences are noise, large ones are news. What was not seen before has no past:
    /// there `a` fades with the flow's trust, so that a new thing is attended to at once.
    pub fn smooth(&mut self, attention: &mut Image<f32>, before: &PreviousFrame, flow: &Flow) {
        self.gain.resize(attention.size());
        let kept = before.attended.size() == attention.size();
        let Self { level, share, gain, past, .. } = self;
        past.resize(attention.size().area(), [0.0; 2]);
        // Without marks the first map stands in for them, and says nothing.
        let marks = if kept { &before.attended } else { &before.attention };
        dispatch!(*level, simd => {
            pair(before.attention.pixels(), marks.pixels(), past);
            smooth(simd, attention, past, flow, *share, gain);
        });
        if !kept {
            gain.fill(0.0);
        }
    }

    /// Adds to a smoothed map .08 where a cell was attended to in the frame before,
    /// else -.03, times the flow's trust (hysteresis), within 0..=1; marks in
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

/// Puts the values of two maps side by side.
#[inline(always)]
fn pair(first: &[f32], second: &[f32], out: &mut [[f32; 2]]) {
    for ((out, first), second) in out.iter_mut().zip(first).zip(second) {
        *out = [*first, *second];
    }
}

/// Smooths the map, and fills what each cell gains.
#[inline(always)]
fn smooth<S: Simd>(
    simd: S,
    attention: &mut Image<f32>,
    past: &[[f32; 2]],
    flow: &Flow,
    share: f32,
    gain: &mut Image<f32>,
) {
    let size = attention.size();
    for y in 0..size.height {
        for x in (0..size.width).step_by(LANES) {
            let dx: f32x16<S> = padded(simd, flow.dx.row(y), x, 0.0);
            let dy: f32x16<S> = padded(simd, flow.dy.row(y), x, 0.0);
            let trust: f32x16<S> = padded(simd, flow.trust.row(y), x, 0.0);
            let here = f32x16::from_fn(simd, |i| (x + i) as f32);
            let place = Place::new(size, here + dx, dy + y as f32);
            let now: f32x16<S> = padded(simd, attention.row(y), x, 0.0);
            let [past, attended] = place.of(simd, past);
            let change = past - now;
            let news = ((change.abs() - NOISE) * (1.0 / (NEWS - NOISE))).max(0.0).min(1.0);
            let share = (1.0 - news * (1.0 - OLD)) * share;
            store_inside(attention.row_mut(y), x, now + trust * share * change);
            store_inside(gain.row_mut(y), x, trust * (attended * (STAYS + COMES) - COMES));
        }
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

    /// Bilinear values of two maps. The cells are fetched one place after the other; what
    /// is right of the last column or below the last row has no share.
    #[inline(always)]
    fn of(&self, simd: S, cells: &[[f32; 2]]) -> [f32x16<S>; 2] {
        let [mut upper, mut lower] = [[[0.0; 4]; LANES]; 2];
        for (i, at) in self.at.as_slice().iter().enumerate() {
            let (at, below) = (*at as usize, *at as usize + self.width);
            upper[i] = beside(cells, at);
            lower[i] = if below < cells.len() { beside(cells, below) } else { upper[i] };
        }
        let upper = self.across(simd, &upper);
        let lower = self.across(simd, &lower);
        let [first, second] = upper;
        [first + self.fy * (lower[0] - first), second + self.fy * (lower[1] - second)]
    }

    /// Of both maps between a cell and the next one.
    #[inline(always)]
    fn across(&self, simd: S, cells: &[[f32; 4]; LANES]) -> [f32x16<S>; 2] {
        let quarters = cells.as_flattened().as_chunks::<LANES>().0;
        let mut parts = [f32x16::splat(simd, 0.0); 4];
        for (part, quarter) in parts.iter_mut().zip(quarters) {
            *part = f32x16::from_slice(simd, quarter);
        }
        let (left, right) = (parts[0].deinterleave(parts[1]), parts[2].deinterleave(parts[3]));
        // The first map's cells and the next ones, by turns; the same of the second.
        let (first, first_next) = left.0.deinterleave(right.0);
        let (second, second_next) = left.1.deinterleave(right.1);
        [first + self.fx * (first_next - first), second + self.fx * (second_next - second)]
    }
}

/// A cell of two maps and the next one; twice the last one.
#[inline(always)]
fn beside(cells: &[[f32; 2]], at: usize) -> [f32; 4] {
    let [[a, b], [c, d]] = match cells[at..].first_chunk() {
        Some(pair) => *pair,
        None => [cells[at]; 2],
    };
    [a, b, c, d]
}
