//! Spectral residual saliency as a mode of its own.

mod fft;

use crate::image::{Image, Size};
use crate::stage::saliency::AttentionScene;
use crate::stage::saliency::normalize::normalize;

pub use fft::{Plane, SIDE, Spectrum};

/// Standard deviation of the smoothing of the result, in pixels of the small
/// image. The best of 2.5, 4, 6 and 8 by F-measure on photographs.
const SIGMA: f32 = 4.0;
/// Taps of the smoothing on each side.
const TAPS: usize = 12;
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
    spectrum: Spectrum,
    small: Image<f32>,
    scratch: Image<f32>,
}

impl SpectralResidual {
    /// Writes the attention map.
    pub fn run(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        out.resize(scene.cells.gray.size());
        if out.size().is_empty() {
            return;
        }
        let deviation = self.shrink(&scene.left.gray);
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

    /// Puts area means of `gray` into the spectrum and returns their standard
    /// deviation. The full-size view is used, since uneven areas of few cells
    /// would leave a pattern in the spectrum. The mean stays: without it the log spectrum would have a
    /// hole whose neighbours all look unexpected.
    fn shrink(&mut self, gray: &Image<u8>) -> f32 {
        let part = |i: usize, length: usize| {
            let start = i * length / SIDE;
            (start, ((i + 1) * length / SIDE).max(start + 1))
        };
        let mut total = 0.0;
        for (v, row) in self.spectrum.re.iter_mut().enumerate() {
            let rows = part(v, gray.height());
            let mut sums = [0_u32; SIDE];
            for y in rows.0..rows.1 {
                let pixels = gray.row(y);
                for (u, sum) in sums.iter_mut().enumerate() {
                    let columns = part(u, gray.width());
                    let pixels = &pixels[columns.0..columns.1];
                    *sum += pixels.iter().map(|&value| u32::from(value)).sum::<u32>();
                }
            }
            for (u, (value, sum)) in row.iter_mut().zip(sums).enumerate() {
                let columns = part(u, gray.width());
                let area = (rows.1 - rows.0) * (columns.1 - columns.0);
                *value = sum as f32 / area as f32;
                total += *value;
            }
        }
        let area = (SIDE * SIDE) as f32;
        let mean = total / area;
        let values = self.spectrum.re.iter().flatten();
        let squares: f32 = values.map(|value| (value - mean) * (value - mean)).sum();
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

/// Gaussian along both axes; beyond the edge nothing is salient.
fn smooth(map: &mut Image<f32>, scratch: &mut Image<f32>) {
    let taps: [f32; TAPS + 1] =
        std::array::from_fn(|i| (-((i * i) as f32) / (2.0 * SIGMA * SIGMA)).exp());
    let total = taps[0] + 2.0 * taps[1..].iter().sum::<f32>();
    for _ in 0..2 {
        // Columns, written transposed, so that the second time does the rows.
        let size = map.size();
        scratch.resize(Size::new(size.height, size.width));
        for y in 0..size.height {
            let rows = y.saturating_sub(TAPS)..(y + TAPS + 1).min(size.height);
            for x in 0..size.width {
                let sum: f32 = rows.clone().map(|v| taps[v.abs_diff(y)] * map.get(x, v)).sum();
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
