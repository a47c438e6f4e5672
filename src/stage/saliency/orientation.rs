//! Orientation contrast.

use crate::image::Image;
use crate::stage::saliency::integral::{Integral, surrounds};
use crate::stage::saliency::{AttentionScene, Cue};

/// The difference of oriented energy that counts as 1: a straight step of this
/// many gray levels through every cell of the centre against a plain surround.
const FULL: f32 = 64.0;

/// Radius of the centre in cells: 3x3 cells pool the filter's phase.
const CENTRE: usize = 1;

/// `C_O`: how much the local energy at 0, 45, 90 and 135 degrees differs from
/// that of the surround.
///
/// The filters are steered from one pair of smoothed derivatives (Freeman and
/// Adelson 1991): the response at θ is `gx cos θ + gy sin θ`. Energy is the
/// mean of its magnitude over the centre; contrast is the mean over four
/// orientations and the three radii of [`surrounds`] of
/// `|energy(centre) - energy(surround)|`, in units of 64 gray levels.
#[derive(Default)]
pub struct Orientation {
    energy: [Image<u16>; 4],
    integral: Integral,
    centre: Vec<f32>,
    surround: Vec<f32>,
}

impl Cue for Orientation {
    fn conspicuity(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let gray = &scene.cells.gray;
        out.resize(gray.size());
        out.fill(0.0);
        oriented_energy(gray, &mut self.energy);
        self.centre.resize(gray.width(), 0.0);
        self.surround.resize(gray.width(), 0.0);
        let radii = surrounds(gray.size());
        for energy in &self.energy {
            self.integral.take(energy);
            for y in 0..gray.height() {
                let out = out.row_mut(y);
                self.integral.means(y, CENTRE, &mut self.centre);
                for r in radii {
                    self.integral.means(y, r, &mut self.surround);
                    let pairs = self.centre.iter().zip(&self.surround);
                    for (c, (&centre, &surround)) in out.iter_mut().zip(pairs) {
                        *c += (centre - surround).abs();
                    }
                }
            }
        }
        // Energy is in 1/8 gray levels: see `oriented_energy`.
        let scale = 1.0 / (8.0 * FULL * (self.energy.len() * radii.len()) as f32);
        for c in out.pixels_mut() {
            *c = (*c * scale).min(1.0);
        }
    }
}

/// Magnitudes of the responses at 0, 45, 90 and 135 degrees in 1/8 gray levels
/// (Sobel weights sum to 8 over a step), at most 2040.
pub fn oriented_energy(gray: &Image<u8>, out: &mut [Image<u16>; 4]) {
    let (width, height) = (gray.width(), gray.height());
    for image in out.iter_mut() {
        image.resize(gray.size());
    }
    let [e0, e45, e90, e135] = out;
    for y in 0..height {
        let rows = [gray.row(y.saturating_sub(1)), gray.row(y), gray.row((y + 1).min(height - 1))];
        let [o0, o45, o90, o135] = [e0.row_mut(y), e45.row_mut(y), e90.row_mut(y), e135.row_mut(y)];
        for x in 0..width {
            let (l, r) = (x.saturating_sub(1), (x + 1).min(width - 1));
            let p = |row: usize, x: usize| i32::from(rows[row][x]);
            let gx = p(0, r) - p(0, l) + 2 * (p(1, r) - p(1, l)) + p(2, r) - p(2, l);
            let gy = p(2, l) - p(0, l) + 2 * (p(2, x) - p(0, x)) + p(2, r) - p(0, r);
            // 181 / 256 is the cosine of 45 degrees.
            o0[x] = gx.unsigned_abs() as u16;
            o45[x] = ((gx + gy).unsigned_abs() * 181 / 256) as u16;
            o90[x] = gy.unsigned_abs() as u16;
            o135[x] = ((gx - gy).unsigned_abs() * 181 / 256) as u16;
        }
    }
}
