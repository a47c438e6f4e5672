//! The cues and their fusion by their definitions.

use salient_stereo::image::{Image, Size};

use super::preprocess::{channel, gaussian3};
use super::window;

/// Mean of `values` over the window of `radius` around `(x, y)`.
pub fn mean(values: &Image<f64>, x: usize, y: usize, radius: usize) -> f64 {
    let window = window(values.size(), x, y, radius);
    window.iter().map(|&(u, v)| values.get(u, v)).sum::<f64>() / window.len() as f64
}

/// The three radii of the surround.
pub fn radii(size: Size) -> [usize; 3] {
    let side = size.width.min(size.height);
    [16, 8, 4].map(|share| (side / share).clamp(1, 127))
}

/// Any image as real numbers.
pub fn real<T: Copy + Default + Into<f64>>(image: &Image<T>) -> Image<f64> {
    Image::from_fn(image.size(), |x, y| image.get(x, y).into())
}

/// Eq. 3 at three radii.
pub fn intensity(gray: &Image<u8>) -> Image<f64> {
    let values = real(gray);
    Image::from_fn(gray.size(), |x, y| {
        let contrast = |r: usize| (values.get(x, y) - mean(&values, x, y, r)).abs();
        (radii(gray.size()).map(contrast).iter().sum::<f64>() / 3.0 / 128.0).min(1.0)
    })
}

/// CIE L*a*b* of an sRGB pixel.
pub fn lab(rgb: [u8; 3]) -> [f64; 3] {
    let [r, g, b] = rgb.map(|value| {
        let v = f64::from(value) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    });
    let x = (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47;
    let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b;
    let z = (0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83;
    let f = |t: f64| {
        if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 }
    };
    [116.0 * f(y) - 16.0, 500.0 * (f(x) - f(y)), 200.0 * (f(y) - f(z))]
}

/// Distance from the mean colour in L*a*b*, after a 3x3 binomial blur.
pub fn color(rgb: &Image<[u8; 3]>) -> Image<f64> {
    let [r, g, b] = [0, 1, 2].map(|c| gaussian3(&channel(rgb, c)));
    let colors: Vec<[f64; 3]> = (0..rgb.size().area())
        .map(|i| lab([r.pixels()[i], g.pixels()[i], b.pixels()[i]]))
        .collect();
    let mean =
        [0, 1, 2].map(|c| colors.iter().map(|color| color[c]).sum::<f64>() / colors.len() as f64);
    let distances = colors
        .iter()
        .map(|color| (0..3).map(|c| (color[c] - mean[c]).powi(2)).sum::<f64>().sqrt() / 100.0)
        .map(|distance| distance.min(1.0));
    Image::from_vec(rgb.size(), distances.collect()).unwrap()
}

/// Contrast of the magnitudes of the Sobel response steered to four angles.
pub fn orientation(gray: &Image<u8>) -> Image<f64> {
    let at = |x: usize, y: usize, dx: isize, dy: isize| {
        f64::from(gray.get_clamped(x as isize + dx, y as isize + dy))
    };
    let mut sum = Image::filled(gray.size(), 0.0);
    for angle in [0.0_f64, 45.0, 90.0, 135.0] {
        let (sin, cos) = angle.to_radians().sin_cos();
        let energy = Image::from_fn(gray.size(), |x, y| {
            let (mut gx, mut gy) = (0.0, 0.0);
            for (k, w) in [(-1, 1.0), (0, 2.0), (1, 1.0)] {
                gx += w * (at(x, y, 1, k) - at(x, y, -1, k));
                gy += w * (at(x, y, k, 1) - at(x, y, k, -1));
            }
            (gx * cos + gy * sin).abs() / 8.0
        });
        for y in 0..gray.height() {
            for x in 0..gray.width() {
                let centre = mean(&energy, x, y, 1);
                for r in radii(gray.size()) {
                    let contrast = (centre - mean(&energy, x, y, r)).abs();
                    sum.set(x, y, sum.get(x, y) + contrast / 12.0 / 64.0);
                }
            }
        }
    }
    Image::from_fn(gray.size(), |x, y| sum.get(x, y).min(1.0))
}

/// Relative contrast of disparity at three radii.
pub fn depth(disparity: &Image<f32>, offset: f64) -> Image<f64> {
    let d =
        Image::from_fn(disparity.size(), |x, y| (f64::from(disparity.get(x, y)) - offset).max(0.0));
    Image::from_fn(d.size(), |x, y| {
        let here = d.get(x, y);
        let contrast = |r: usize| {
            let around = mean(&d, x, y, r);
            (here - around).abs() / (here.max(around) + 4.0)
        };
        radii(d.size()).map(contrast).iter().sum::<f64>() / 3.0
    })
}

/// N of eq. 4.
pub fn normalize(map: &Image<f64>, least: f64) -> Image<f64> {
    let low = map.pixels().iter().copied().fold(f64::INFINITY, f64::min);
    let high = map.pixels().iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Image::from_fn(map.size(), |x, y| (map.get(x, y) - low) / (high - low).max(least))
}

/// Bilinear value at `(x, y)`, coordinates limited to the image.
pub fn bilinear(image: &Image<f64>, x: f64, y: f64) -> f64 {
    let (x, y) =
        (x.clamp(0.0, (image.width() - 1) as f64), y.clamp(0.0, (image.height() - 1) as f64));
    let value = |dx: usize, dy: usize| {
        image.get_clamped(x as isize + dx as isize, y as isize + dy as isize)
    };
    let (fx, fy) = (x.fract(), y.fract());
    let upper = value(0, 0) * (1.0 - fx) + value(1, 0) * fx;
    let lower = value(0, 1) * (1.0 - fx) + value(1, 1) * fx;
    upper * (1.0 - fy) + lower * fy
}

/// The value at each pixel between the centres of 4x4-pixel cells.
pub fn upsample(cells: &Image<f32>, size: Size) -> Image<f64> {
    let place = |at: usize, cells: usize| {
        let at = ((at as f64 - 1.5) / 4.0).clamp(0.0, (cells - 1) as f64);
        let first = at.floor() as usize;
        (first, (first + 1).min(cells - 1), at - at.floor())
    };
    Image::from_fn(size, |x, y| {
        let (l, r, fx) = place(x, cells.width());
        let (u, d, fy) = place(y, cells.height());
        let value = |x: usize, y: usize| f64::from(cells.get(x, y));
        let upper = value(l, u) * (1.0 - fx) + value(r, u) * fx;
        let lower = value(l, d) * (1.0 - fx) + value(r, d) * fx;
        upper * (1.0 - fy) + lower * fy
    })
}

/// A complex number.
pub type Complex = (f64, f64);

/// Discrete Fourier transform of a square image by its sum, rows then columns.
pub fn fourier(values: &[Vec<Complex>], sign: f64) -> Vec<Vec<Complex>> {
    let n = values.len();
    let line = |input: &[Complex]| -> Vec<Complex> {
        (0..n)
            .map(|k| {
                input.iter().enumerate().fold((0.0, 0.0), |(re, im), (i, &(a, b))| {
                    let angle = sign * std::f64::consts::TAU * (i * k % n) as f64 / n as f64;
                    let (sin, cos) = angle.sin_cos();
                    (re + a * cos - b * sin, im + a * sin + b * cos)
                })
            })
            .collect()
    };
    let transposed = |image: &[Vec<Complex>]| -> Vec<Vec<Complex>> {
        (0..n).map(|x| (0..n).map(|y| image[y][x]).collect()).collect()
    };
    let rows: Vec<_> = values.iter().map(|row| line(row)).collect();
    let columns: Vec<_> = transposed(&rows).iter().map(|column| line(column)).collect();
    transposed(&columns)
}
