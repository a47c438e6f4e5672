//! What was attended to a moment ago is attended to now.

use crate::config::{Config, SaliencyMode, ThresholdMode};
use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, i32x16, padded, prelude::*, store_inside, u64x8};
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
    /// Attention of each cell of the frame before, its mark as the sign: see [`mark`].
    past: Vec<f32>,
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
        // Without marks the first map stands in for them, and says nothing.
        let marks = if kept { &before.attended } else { &before.attention };
        dispatch!(*level, simd => {
            mark(before.attention.pixels(), marks.pixels(), attention.width(), past);
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

/// Writes the values, which are not negative, those with a mark of 1 with the sign of
/// negative ones: a place is fetched once for both maps. Behind them the last row of
/// `width` cells once more, and one.
#[inline(always)]
fn mark(values: &[f32], marks: &[f32], width: usize, out: &mut Vec<f32>) {
    out.resize(values.len() + width + 1, 0.0);
    for ((out, value), mark) in out.iter_mut().zip(values).zip(marks) {
        *out = f32::from_bits(value.to_bits() | u32::from(*mark != 0.0) << 31);
    }
    let end = values.len();
    out.copy_within(end - width..end, end);
}

/// Smooths the map, and fills what each cell gains.
#[inline(always)]
fn smooth<S: Simd>(
    simd: S,
    attention: &mut Image<f32>,
    past: &[f32],
    flow: &Flow,
    share: f32,
    gain: &mut Image<f32>,
) {
    let size = attention.size();
    let lane = f32x16::from_fn(simd, |i| i as f32);
    for y in 0..size.height {
        let (dx, dy, trust) = (flow.dx.row(y), flow.dy.row(y), flow.trust.row(y));
        let (attention, gain) = (attention.row_mut(y), gain.row_mut(y));
        for x in (0..size.width).step_by(LANES) {
            let dx: f32x16<S> = padded(simd, dx, x, 0.0);
            let dy: f32x16<S> = padded(simd, dy, x, 0.0);
            let trust: f32x16<S> = padded(simd, trust, x, 0.0);
            let place = Place::new(size, lane + x as i32 as f32 + dx, dy + y as i32 as f32);
            let now: f32x16<S> = padded(simd, attention, x, 0.0);
            let [past, attended] = place.of(simd, past);
            let change = past - now;
            let news = ((change.abs() - NOISE) * (1.0 / (NEWS - NOISE))).max(0.0).min(1.0);
            let share = (1.0 - news * (1.0 - OLD)) * share;
            store_inside(attention, x, now + trust * share * change);
            store_inside(gain, x, trust * (attended * (STAYS + COMES) - COMES));
        }
    }
}

/// For each of several places the cell to its upper left, and its distance from that.
struct Place<S: Simd> {
    at: [i32; LANES],
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
        let (column, row): (i32x16<S>, i32x16<S>) = (x0.to_int(), y0.to_int());
        let at = (row * width as i32 + column).to_array();
        Self { at, width, fx: x - x0, fy: y - y0 }
    }

    /// Bilinear values of the two maps that [`mark`] made one. The cells are fetched one place
    /// after the other; what is right of the last column or below the last row has no share.
    #[inline(always)]
    fn of(&self, simd: S, cells: &[f32]) -> [f32x16<S>; 2] {
        let [mut upper, mut lower] = [[0; LANES]; 2];
        for i in 0..LANES {
            let cells = &cells[self.at[i] as usize..][..self.width + 2];
            upper[i] = pair(cells[0], cells[1]);
            lower[i] = pair(cells[self.width], cells[self.width + 1]);
        }
        let upper = self.across(simd, &upper);
        let lower = self.across(simd, &lower);
        let [first, second] = upper;
        [first + self.fy * (lower[0] - first), second + self.fy * (lower[1] - second)]
    }

    /// Of both maps between a cell and the next one.
    #[inline(always)]
    fn across(&self, simd: S, pairs: &[u64; LANES]) -> [f32x16<S>; 2] {
        let (low, high) = pairs.split_at(LANES / 2);
        let (low, high) = (u64x8::from_slice(simd, low), u64x8::from_slice(simd, high));
        let (low, high): (f32x16<S>, f32x16<S>) = (low.bitcast(), high.bitcast());
        let (here, next) = low.deinterleave(high);
        let (first, second) = (here.abs(), marked(simd, here));
        let (first_next, second_next) = (next.abs(), marked(simd, next));
        [first + self.fx * (first_next - first), second + self.fx * (second_next - second)]
    }
}

/// The bits of two values, the first one in the lower half.
#[inline(always)]
fn pair(first: f32, second: f32) -> u64 {
    u64::from(first.to_bits()) | u64::from(second.to_bits()) << 32
}

/// 1 where the sign is that of negative ones.
#[inline(always)]
fn marked<S: Simd>(simd: S, cells: f32x16<S>) -> f32x16<S> {
    let bits: i32x16<S> = cells.bitcast();
    bits.simd_lt(0).select(f32x16::splat(simd, 1.0), f32x16::splat(simd, 0.0))
}
