//! Spectral residual saliency as a mode of its own.

mod fft;

use crate::image::{Image, Size};
use crate::stage::saliency::AttentionScene;
use crate::stage::saliency::integral::Integral;
use crate::stage::saliency::normalize::normalize;

pub use fft::{Plane, SIDE, Spectrum};

/// Standard deviation of the smoothing of the result, in pixels of the small image.
const SIGMA: f32 = 2.5;
/// Taps of the smoothing on each side.
const TAPS: usize = 7;
/// An image of less contrast (standard deviation in gray levels) is salient
/// in proportion to its contrast only: the residual itself knows no amplitude.
const LEAST_DEVIATION: f32 = 8.0;
/// Keeps the logarithm finite; spectra of real images lie far above.
const TINY: f32 = 1e-6;

/// Saliency as what is unexpected in the log spectrum (Hou and Zhang 2007), on
/// the gray image at 64x64: `|F⁻¹[exp(L - h*L + iφ)]|²` smoothed, where L is the
/// log amplitude, h the 3x3 mean and φ the phase.
#[derive(Default)]
pub struct SpectralResidual {
    integral: Integral,
    spectrum: Spectrum,
    small: Image<f32>,
    scratch: Image<f32>,
}

impl SpectralResidual {
    /// Writes the attention map.
    pub fn run(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let gray = &scene.cells.gray;
        out.resize(gray.size());
        if gray.size().is_empty() {
            return;
        }
        let deviation = self.shrink(gray);
        self.spectrum.forward();
        whiten(&mut self.spectrum);
        self.spectrum.inverse();

        self.small.resize(Size::new(SIDE, SIDE));
        let energy = self.spectrum.re.iter().flatten().zip(self.spectrum.im.iter().flatten());
        for (value, (&re, &im)) in self.small.pixels_mut().iter_mut().zip(energy) {
            *value = re * re + im * im;
        }
        smooth(&mut self.small, &mut self.scratch);
        normalize(&mut self.small, TINY);
        let gate = (deviation / LEAST_DEVIATION).min(1.0);
        stretch(&self.small, out);
        for value in out.pixels_mut() {
            *value *= gate;
        }
    }

    /// Puts area means of `gray` less their mean into the spectrum and returns
    /// their standard deviation.
    fn shrink(&mut self, gray: &Image<u8>) -> f32 {
        self.integral.take(gray);
        let part = |i: usize, length: usize| {
            let start = i * length / SIDE;
            (start, ((i + 1) * length / SIDE).max(start + 1))
        };
        let mut sum = 0.0;
        for (v, row) in self.spectrum.re.iter_mut().enumerate() {
            let rows = part(v, gray.height());
            for (u, value) in row.iter_mut().enumerate() {
                let columns = part(u, gray.width());
                let area = (rows.1 - rows.0) * (columns.1 - columns.0);
                *value = self.integral.sum(columns, rows) as f32 / area as f32;
                sum += *value;
            }
        }
        let area = (SIDE * SIDE) as f32;
        let mean = sum / area;
        let mut squares = 0.0;
        for value in self.spectrum.re.iter_mut().flatten() {
            *value -= mean;
            squares += *value * *value;
        }
        self.spectrum.im.iter_mut().flatten().for_each(|value| *value = 0.0);
        (squares / area).sqrt()
    }
}

/// Replaces the amplitude by exp(L - h*L): since L is the log amplitude itself,
/// that divides each value by exp(h*L).
fn whiten(spectrum: &mut Spectrum) {
    let Spectrum { re, im, scratch, .. } = spectrum;
    for (log, (re, im)) in
        scratch.iter_mut().flatten().zip(re.iter().flatten().zip(im.iter().flatten()))
    {
        *log = 0.5 * (re * re + im * im + TINY).ln();
    }
    for v in 0..SIDE {
        let rows = [(v + SIDE - 1) % SIDE, v, (v + 1) % SIDE];
        for u in 0..SIDE {
            // The spectrum of a sampled image is periodic.
            let columns = [(u + SIDE - 1) % SIDE, u, (u + 1) % SIDE];
            let sum: f32 = rows.iter().flat_map(|&y| columns.map(|x| scratch[y][x])).sum();
            let factor = (-sum / 9.0).exp();
            re[v][u] *= factor;
            im[v][u] *= factor;
        }
    }
}

/// Gaussian, both directions; beyond the edge the outermost pixels continue.
fn smooth(map: &mut Image<f32>, scratch: &mut Image<f32>) {
    let taps: [f32; TAPS + 1] =
        std::array::from_fn(|i| (-((i * i) as f32) / (2.0 * SIGMA * SIGMA)).exp());
    let total = taps[0] + 2.0 * taps[1..].iter().sum::<f32>();
    for _ in 0..2 {
        // Columns, then the transposed image's columns.
        scratch.resize(Size::new(map.height(), map.width()));
        for y in 0..map.height() {
            for x in 0..map.width() {
                let mut sum = taps[0] * map.get(x, y);
                for (i, tap) in taps.iter().enumerate().skip(1) {
                    let (above, below) = (y.saturating_sub(i), (y + i).min(map.height() - 1));
                    sum += tap * (map.get(x, above) + map.get(x, below));
                }
                scratch.set(y, x, sum / total);
            }
        }
        std::mem::swap(map, scratch);
    }
}

/// Bilinear stretch of a small map over the cells.
fn stretch(small: &Image<f32>, out: &mut Image<f32>) {
    let place = |i: usize, length: usize, small: usize| {
        let at =
            ((i as f32 + 0.5) * small as f32 / length as f32 - 0.5).clamp(0.0, (small - 1) as f32);
        let first = (at as usize).min(small - 2);
        (first, at - first as f32)
    };
    let (width, height) = (out.width(), out.height());
    for y in 0..height {
        let (v, fy) = place(y, height, small.height());
        let (upper, lower) = (small.row(v), small.row(v + 1));
        for (x, value) in out.row_mut(y).iter_mut().enumerate() {
            let (u, fx) = place(x, width, small.width());
            let above = upper[u] + fx * (upper[u + 1] - upper[u]);
            let below = lower[u] + fx * (lower[u + 1] - lower[u]);
            *value = above + fy * (below - above);
        }
    }
}
