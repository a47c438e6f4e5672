//! Rectification by a map made once per calibration.

use rayon::prelude::*;

use crate::camera::Camera;
use crate::image::Size;

/// Steps per pixel of a map's coordinates.
const STEPS: u32 = 32;

/// Where a rectified pixel comes from.
#[derive(Clone, Copy, Default)]
struct Tap {
    /// Index of the upper left of four raw pixels, or [`OUTSIDE`].
    index: u32,
    /// Share of the right two in 1/[`STEPS`].
    fx: u8,
    /// Share of the lower two in 1/[`STEPS`].
    fy: u8,
}

/// A rectified pixel that the raw image does not show.
const OUTSIDE: u32 = u32::MAX;

/// For every pixel of a rectified image the place in the raw image, to 1/32 px.
#[derive(Default)]
pub struct RectifyMap {
    size: Size,
    taps: Vec<Tap>,
}

impl RectifyMap {
    /// The map from K, D, R and P of `camera`.
    ///
    /// A camera whose P R has no inverse shows nothing: its map is black.
    pub fn new(camera: &Camera) -> Self {
        let size = camera.size;
        let mut taps = vec![Tap { index: OUTSIDE, fx: 0, fy: 0 }; size.area()];
        if let Some(to_ray) = camera.rectified_to_ray() {
            taps.par_chunks_mut(size.width.max(1)).enumerate().for_each(|(v, row)| {
                for (u, tap) in row.iter_mut().enumerate() {
                    let (u, v) = (u as f64, v as f64);
                    let depth = to_ray[(2, 0)] * u + to_ray[(2, 1)] * v + to_ray[(2, 2)];
                    // A ray that points backwards meets no pixel.
                    if depth > 0.0 {
                        let raw = camera.raw_pixel(&to_ray, u, v);
                        *tap = Tap::new(size, raw.x, raw.y);
                    }
                }
            });
        }
        Self { size, taps }
    }

    /// The rectified image of a raw one of `C` interleaved channels: bilinear,
    /// rounded to nearest, 0 where the raw image shows nothing.
    ///
    /// Both hold as many pixels as the map.
    pub fn apply<const C: usize>(&self, raw: &[u8], out: &mut [u8]) {
        let Size { width, height } = self.size;
        // A raw image of one column or row has no neighbour to the right or below.
        let right = if width > 1 { C } else { 0 };
        let below = if height > 1 { width * C } else { 0 };
        let rows = self.taps.par_chunks_exact(width.max(1));
        rows.zip(out.par_chunks_exact_mut((width * C).max(1))).with_min_len(8).for_each(
            |(taps, out)| {
                for (tap, out) in taps.iter().zip(out.chunks_exact_mut(C)) {
                    if tap.index == OUTSIDE {
                        out.fill(0);
                        continue;
                    }
                    let at = tap.index as usize * C;
                    let (fx, fy) = (u32::from(tap.fx), u32::from(tap.fy));
                    for (c, value) in out.iter_mut().enumerate() {
                        let p = |offset: usize| u32::from(raw[at + c + offset]);
                        let upper = p(0) * (STEPS - fx) + p(right) * fx;
                        let lower = p(below) * (STEPS - fx) + p(below + right) * fx;
                        let sum = upper * (STEPS - fy) + lower * fy;
                        *value = ((sum + STEPS * STEPS / 2) / (STEPS * STEPS)) as u8;
                    }
                }
            },
        );
    }
}

impl Tap {
    fn new(size: Size, x: f64, y: f64) -> Self {
        let outside = Self { index: OUTSIDE, fx: 0, fy: 0 };
        let along = |at: f64, length: usize| {
            let step = (at * f64::from(STEPS)).round();
            let last = (length - 1) as f64 * f64::from(STEPS);
            // False for NaN too.
            if !(0.0..=last).contains(&step) {
                return None;
            }
            let step = step as usize;
            // On the last pixel the pair of pixels is the last one, and all of
            // the weight lies on its second.
            let first = (step / STEPS as usize).min(length.saturating_sub(2));
            Some((first, (step - first * STEPS as usize) as u8))
        };
        match (along(x, size.width), along(y, size.height)) {
            (Some((x, fx)), Some((y, fy))) => Self { index: (y * size.width + x) as u32, fx, fy },
            _ => outside,
        }
    }
}
