//! Depth from disparity (eq. 2).

use std::ops::Range;

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::Image;
use crate::simd::{self, Level, Simd, dispatch, f32x16, prelude::*};

/// ε of eq. 2 in pixels. It keeps the division defined and is far below the
/// finest disparity step (1/32 px): at d = 1 px it moves Z by one millionth.
pub const EPSILON_PX: f32 = 1e-6;

/// Z = f B / (d + ε), clipped as REP 117 wants it.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    level: Level,
    min_m: f32,
    max_m: f32,
}

impl Depth {
    /// The stage with `depth.min` and `depth.max`.
    pub fn new(config: &Config) -> Self {
        let (min_m, max_m) = (config.depth.min as f32, config.depth.max as f32);
        Self { level: simd::detect(), min_m, max_m }
    }

    /// Depth in metres; NaN, +Inf, -Inf as in [`crate::perception::Perception::depth`].
    ///
    /// A disparity of zero or less belongs to a point at infinity (or to the
    /// noise around it): +Inf.
    pub fn run(&mut self, disparity: &Image<f32>, rig: &StereoRig, depth: &mut Image<f32>) {
        let scale = rig.depth_scale() as f32;
        let limits = *self;
        depth.resize(disparity.size());
        let level = self.level;
        dispatch!(level, simd => {
            limits.pixels(simd, disparity.pixels(), scale, depth.pixels_mut());
        });
    }

    #[inline(always)]
    fn pixels<S: Simd>(&self, simd: S, disparity: &[f32], scale_px_m: f32, depth: &mut [f32]) {
        let (groups, rest) = disparity.as_chunks::<16>();
        let (outs, out_rest) = depth.as_chunks_mut::<16>();
        for (d, out) in groups.iter().zip(outs) {
            let d = f32x16::load_array_ref(simd, d);
            self.of_lanes(simd, d, scale_px_m).store_array(out);
        }
        for (&d, out) in rest.iter().zip(out_rest) {
            *out = self.of(d, scale_px_m);
        }
    }

    /// One pixel of eq. 2; `scale_px_m` is f B in pixel metres.
    #[inline(always)]
    pub fn of(&self, d: f32, scale_px_m: f32) -> f32 {
        // Written as selections, not branches, so that whole rows become vectors.
        let z = scale_px_m / (d + EPSILON_PX);
        let z = if z < self.min_m { f32::NEG_INFINITY } else { z };
        let z = if z > self.max_m { f32::INFINITY } else { z };
        let z = if d <= 0.0 { f32::INFINITY } else { z };
        if d.is_nan() { f32::NAN } else { z }
    }

    /// The bits of the disparities whose depth is finite: depth falls with disparity, and
    /// bits of positive numbers have their order.
    pub fn finite_bits(&self, scale_px_m: f32) -> Range<u32> {
        let depth = |bits: u32| self.of(f32::from_bits(bits), scale_px_m);
        // The first one from which on it holds.
        let first = |holds: &dyn Fn(u32) -> bool| {
            let (mut from, mut to) = (1, f32::INFINITY.to_bits() + 1);
            while from < to {
                let middle = u32::midpoint(from, to);
                if holds(middle) { to = middle } else { from = middle + 1 }
            }
            from
        };
        let end = first(&|bits| depth(bits) == f32::NEG_INFINITY);
        first(&|bits| depth(bits) != f32::INFINITY)..end
    }

    /// The same of sixteen pixels.
    #[inline(always)]
    pub fn of_lanes<S: Simd>(&self, simd: S, d: f32x16<S>, scale_px_m: f32) -> f32x16<S> {
        let infinite = f32x16::splat(simd, f32::INFINITY);
        let z = f32x16::splat(simd, scale_px_m) / (d + EPSILON_PX);
        let z = z.simd_lt(self.min_m).select(-infinite, z);
        let z = z.simd_gt(self.max_m).select(infinite, z);
        // NaN stays.
        d.simd_le(0.0).select(infinite, z)
    }
}
