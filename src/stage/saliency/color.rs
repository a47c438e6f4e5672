//! Colour contrast.

use crate::image::Image;
use crate::simd::Level;
use crate::stage::preprocess::denoise::gaussian3;
use crate::stage::saliency::{AttentionScene, Cue};

/// The colour difference that counts as 1: CIE 1976 ΔE, where 100 lies between
/// black and white.
const FULL: f32 = 100.0;

/// `C_C`: frequency-tuned contrast (Achanta et al. 2009), the distance in CIE
/// L*a*b* of each slightly blurred pixel from the mean of the image, in units
/// of ΔE = 100.
pub struct Color {
    level: Level,
    lab: Lab,
    blurred: Vec<u8>,
    colors: Vec<[f32; 3]>,
}

impl Color {
    /// The cue at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, lab: Lab::default(), blurred: Vec::new(), colors: Vec::new() }
    }
}

impl Cue for Color {
    fn conspicuity(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let rgb = &scene.cells.rgb;
        out.resize(rgb.size());
        let bytes = rgb.pixels().as_flattened();
        self.blurred.resize(bytes.len(), 0);
        gaussian3::<3>(self.level, bytes, rgb.width(), &mut self.blurred);
        let (pixels, _) = self.blurred.as_chunks::<3>();
        self.colors.resize(pixels.len(), [0.0; 3]);
        let mut sum = [0.0_f64; 3];
        for (color, &pixel) in self.colors.iter_mut().zip(pixels) {
            *color = self.lab.of(pixel);
            for (sum, &channel) in sum.iter_mut().zip(color.iter()) {
                *sum += f64::from(channel);
            }
        }
        let mean = sum.map(|sum| (sum / pixels.len().max(1) as f64) as f32);
        for (c, color) in out.pixels_mut().iter_mut().zip(&self.colors) {
            let [l, a, b] = [color[0] - mean[0], color[1] - mean[1], color[2] - mean[2]];
            *c = ((l * l + a * a + b * b).sqrt() / FULL).min(1.0);
        }
    }
}

/// sRGB to CIE L*a*b* (D65) by tables.
pub struct Lab {
    /// Linear light of an sRGB value.
    linear: [f32; 256],
    /// f(t) = cube root of t, linear near 0, at t = i / (len - 1).
    root: Vec<f32>,
}

/// Steps of the table of f(t). Interpolated, L* is off by less than 0.01
/// where t > 0.01 and by less than 0.02 below.
const ROOT_STEPS: usize = 4096;

impl Default for Lab {
    fn default() -> Self {
        let linear = std::array::from_fn(|value| {
            let v = value as f64 / 255.0;
            let light = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
            light as f32
        });
        let root = (0..=ROOT_STEPS)
            .map(|i| {
                let t = i as f64 / ROOT_STEPS as f64;
                let f = if t > 216.0 / 24389.0 {
                    t.cbrt()
                } else {
                    (24389.0 / 27.0 * t + 16.0) / 116.0
                };
                f as f32
            })
            .collect();
        Self { linear, root }
    }
}

impl Lab {
    /// L* (0..=100), a* and b* of an sRGB pixel.
    pub fn of(&self, rgb: [u8; 3]) -> [f32; 3] {
        let [r, g, b] = rgb.map(|value| self.linear[usize::from(value)]);
        // Rows of the sRGB matrix divided by the white point, so that white is (1, 1, 1).
        let x = self.f(0.433_953 * r + 0.376_219 * g + 0.189_828 * b);
        let y = self.f(0.212_671 * r + 0.715_160 * g + 0.072_169 * b);
        let z = self.f(0.017_758 * r + 0.109_477 * g + 0.872_765 * b);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    fn f(&self, t: f32) -> f32 {
        let at = t * ROOT_STEPS as f32;
        let i = (at as usize).min(ROOT_STEPS - 1);
        let (low, high) = (self.root[i], self.root[i + 1]);
        low + (at - i as f32) * (high - low)
    }
}
