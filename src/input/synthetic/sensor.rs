//! From light to 8-bit pixels: exposure, tone, gain and noise.

use super::noise::hash;
use super::shape::Vec3;

const STEPS: usize = 4096;

/// The camera's electronics.
#[derive(Clone, Debug)]
pub struct Sensor {
    /// Pixel value (0..255) over the square root of the exposed light.
    curve: Vec<f64>,
    exposure: f64,
    noise: f64,
}

impl Sensor {
    /// `exposure` scales light before the curve; `noise` is the standard
    /// deviation in pixel values.
    pub fn new(exposure: f64, noise: f64) -> Self {
        // The shoulder of Hable's filmic family in its simplest form:
        // 1 - exp(-x), then the sRGB curve.
        let curve = (0..=STEPS)
            .map(|i| {
                let root = 2.2 * i as f64 / STEPS as f64;
                let light = 1.0 - libm::exp(-root * root);
                let value = if light <= 0.003_130_8 {
                    12.92 * light
                } else {
                    1.055 * libm::pow(light, 1.0 / 2.4) - 0.055
                };
                255.0 * value
            })
            .collect();
        Self { curve, exposure, noise }
    }

    /// The pixel for `light`; `key` names the pixel for the noise.
    pub fn expose(&self, light: Vec3, gain: f64, key: (u32, usize, usize)) -> [u8; 3] {
        let h = hash(key.0, key.1 as i32, key.2 as i32, 77);
        std::array::from_fn(|channel| {
            let exposed = (light[channel] * self.exposure * gain).max(0.0);
            let place = (exposed.sqrt() / 2.2 * STEPS as f64).min(STEPS as f64 - 1.0);
            let index = place as usize;
            let (low, high) = (self.curve[index], self.curve[index + 1]);
            let value = low + (high - low) * (place - index as f64);
            let grain = self.noise * gaussian(h, channel as u32);
            (value + grain + 0.5).clamp(0.0, 255.0) as u8
        })
    }
}

/// About normally distributed, of standard deviation 1: the sum of four
/// uniform bytes.
fn gaussian(h: u32, channel: u32) -> f64 {
    let mut word = h ^ channel.wrapping_mul(0x9E37_79B1);
    word = (word ^ (word >> 15)).wrapping_mul(0x846C_A68B);
    word ^= word >> 13;
    let sum: u32 = word.to_le_bytes().iter().map(|b| u32::from(*b)).sum();
    // Four uniform bytes: mean 510, standard deviation sqrt(4 * 65535 / 12).
    (f64::from(sum) - 510.0) / 147.8
}
