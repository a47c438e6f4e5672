//! Contrast of colours against the image's border.
//!
//! What touches the border is mostly background: a colour that is unusual on
//! at least three of the four sides belongs to an object (the boundary cue of
//! MB+, Zhang et al., ICCV 2015).

use nalgebra::{Matrix3, Vector3};

use super::barrier::ycbcr;
use crate::image::Image;

/// Width of each side's strip in parts of the image.
const STRIP: f32 = 0.1;
/// Variance added per channel, in square gray levels: the noise of a cell's mean.
const NOISE: f32 = 12.0;

/// Mean and inverse covariance of one side's colours.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    mean: [f32; 3],
    /// Lower triangle L of the inverse covariance's Cholesky factor: the
    /// squared distance is |Lᵀ (x − mean)|².
    factor: [f32; 6],
}

/// The boundary contrast, with its buffers.
#[derive(Debug, Default)]
pub struct Boundary {
    colors: Vec<[u8; 3]>,
}

impl Boundary {
    /// Mahalanobis distance of each cell's colour from the strips on the four
    /// sides, summed without the largest (an object may touch one side); in
    /// standard deviations.
    pub fn run(&mut self, rgb: &Image<[u8; 3]>, out: &mut Image<f32>) {
        let size = rgb.size();
        out.resize(size);
        self.colors.clear();
        self.colors.extend(rgb.pixels().iter().map(|&c| ycbcr(c)));
        let (width, height) = (size.width, size.height);
        let strip = |length: usize| ((length as f32 * STRIP) as usize).clamp(1, length.max(1));
        let (dx, dy) = (strip(width), strip(height));
        let sides = [
            self.side(width, 0..width, 0..dy),
            self.side(width, 0..width, height.saturating_sub(dy)..height),
            self.side(width, 0..dx, 0..height),
            self.side(width, width.saturating_sub(dx)..width, 0..height),
        ];
        for (out, color) in out.pixels_mut().iter_mut().zip(&self.colors) {
            let mut sum = 0.0;
            let mut largest = 0.0_f32;
            for side in &sides {
                let distance = side.distance(*color);
                sum += distance;
                largest = largest.max(distance);
            }
            *out = sum - largest;
        }
    }

    fn side(
        &self,
        width: usize,
        columns: std::ops::Range<usize>,
        rows: std::ops::Range<usize>,
    ) -> Side {
        let mut n = 0.0_f32;
        let mut sum = Vector3::<f32>::zeros();
        for y in rows.clone() {
            for color in &self.colors[y * width + columns.start..y * width + columns.end] {
                sum += Vector3::from(color.map(f32::from));
                n += 1.0;
            }
        }
        let mean = sum / n.max(1.0);
        let mut covariance = Matrix3::<f32>::from_diagonal_element(NOISE);
        for y in rows {
            for color in &self.colors[y * width + columns.start..y * width + columns.end] {
                let off = Vector3::from(color.map(f32::from)) - mean;
                covariance += off * off.transpose() / n.max(1.0);
            }
        }
        // Positive definite by the noise term; the fallback is the plain distance.
        let inverse = covariance.try_inverse().unwrap_or_else(|| Matrix3::identity() / NOISE);
        let l = inverse.cholesky().map_or_else(|| Matrix3::identity() / NOISE.sqrt(), |c| c.l());
        Side {
            mean: mean.into(),
            factor: [l[(0, 0)], l[(1, 0)], l[(2, 0)], l[(1, 1)], l[(2, 1)], l[(2, 2)]],
        }
    }
}

impl Side {
    #[inline]
    fn distance(&self, color: [u8; 3]) -> f32 {
        let x = f32::from(color[0]) - self.mean[0];
        let y = f32::from(color[1]) - self.mean[1];
        let z = f32::from(color[2]) - self.mean[2];
        let f = &self.factor;
        let p = f[0] * x + f[1] * y + f[2] * z;
        let q = f[3] * y + f[4] * z;
        let r = f[5] * z;
        (p * p + q * q + r * r).sqrt()
    }
}
