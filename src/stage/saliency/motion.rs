//! Motion difference.

use crate::image::Image;
use crate::stage::saliency::{AttentionScene, Cue};

/// Differences up to this many gray levels are noise.
const NOISE: f32 = 4.0;
/// The difference beyond noise that counts as 1, in gray levels.
const FULL: f32 = 64.0;
/// A change of illumination is looked for among cells that changed by at most
/// this many gray levels beyond it.
const INLIER: f32 = 12.0;

/// `C_M`: difference to the previous frame, less a change of illumination of
/// the whole image (gain and offset, fitted to the cells that agree with it),
/// less 4 gray levels of noise, in units of 64 gray levels. 0 without a
/// previous frame.
#[derive(Default)]
pub struct Motion;

impl Cue for Motion {
    fn conspicuity(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let now = &scene.cells.gray;
        out.resize(now.size());
        let Some(previous) = scene.previous.filter(|p| p.gray.size() == now.size()) else {
            out.fill(0.0);
            return;
        };
        let light = Illumination::between(previous.gray.pixels(), now.pixels());
        let expected: [f32; 256] = std::array::from_fn(|value| light.apply(value as f32));
        let pairs = previous.gray.pixels().iter().zip(now.pixels());
        for (c, (&before, &now)) in out.pixels_mut().iter_mut().zip(pairs) {
            let difference = (f32::from(now) - expected[usize::from(before)]).abs();
            *c = ((difference - NOISE) / FULL).clamp(0.0, 1.0);
        }
    }
}

/// now = gain * before + offset.
#[derive(Clone, Copy)]
struct Illumination {
    gain: f32,
    offset: f32,
}

impl Illumination {
    /// The change that most cells agree on: starts from the median difference
    /// and takes three steps of least squares over the cells near the last fit.
    fn between(before: &[u8], now: &[u8]) -> Self {
        let mut light = Self { gain: 1.0, offset: median_difference(before, now) };
        for _ in 0..3 {
            let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0_i64, 0_i64, 0_i64, 0_i64, 0_i64);
            let expected: [f32; 256] = std::array::from_fn(|value| light.apply(value as f32));
            for (&x, &y) in before.iter().zip(now) {
                let near = (f32::from(y) - expected[usize::from(x)]).abs() <= INLIER;
                let (x, y) = (i64::from(x), i64::from(y));
                if near {
                    n += 1;
                    sx += x;
                    sy += y;
                    sxx += x * x;
                    sxy += x * y;
                }
            }
            let spread = n * sxx - sx * sx;
            // Without some contrast (10 gray levels) there is no gain to be seen.
            if n == 0 || spread < 100 * n * n {
                break;
            }
            let gain = ((n * sxy - sx * sy) as f64 / spread as f64).clamp(0.5, 2.0);
            let offset = (sy as f64 - gain * sx as f64) / n as f64;
            light = Self { gain: gain as f32, offset: offset as f32 };
        }
        light
    }

    fn apply(self, before: f32) -> f32 {
        self.gain * before + self.offset
    }
}

fn median_difference(before: &[u8], now: &[u8]) -> f32 {
    let mut histogram = [0_usize; 511];
    for (&before, &now) in before.iter().zip(now) {
        histogram[255 + usize::from(now) - usize::from(before)] += 1;
    }
    let mut below = 0;
    let middle = histogram.iter().position(|&count| {
        below += count;
        2 * below >= before.len()
    });
    middle.map_or(0.0, |i| i as f32 - 255.0)
}
