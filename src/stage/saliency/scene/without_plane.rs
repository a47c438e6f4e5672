//! Where there is no ground: what cannot be reached from the border, near the centre.

use crate::image::Image;
use crate::stage::saliency::AttentionScene;
use crate::stage::saliency::boundary::Boundary;

/// Share of measured cells from which a frame counts as one with depth.
const LEAST_MEASURED: f32 = 0.15;
/// Sum of the barriers of Y, Cb and Cr that counts fully, with depth and without.
const FULL_BARRIER: f32 = 180.0;
const FULL_BARRIER_STILL: f32 = 120.0;
/// Sum of Mahalanobis distances from three sides that counts fully.
const FULL_BOUNDARY: f32 = 12.0;

/// Attention without a ground, with its cues.
#[derive(Debug, Default)]
pub struct WithoutPlane {
    boundary: Boundary,
    border: Image<f32>,
}

impl WithoutPlane {
    /// S per cell from the sum of the `barriers` of Y, Cb and Cr and from
    /// `relief`, the barrier of disparity.
    ///
    /// A picture without disparity is of things more often than not, and the
    /// boundary contrast helps: the geometric mean of both. With disparity a
    /// bare table or wall may fill the view, whose shading the boundary
    /// contrast takes for a thing: the barrier alone, and relief.
    pub fn run(
        &mut self,
        scene: &AttentionScene<'_>,
        barrier: &Image<f32>,
        relief: &Image<f32>,
        out: &mut Image<f32>,
    ) {
        self.boundary.run(&scene.cells.rgb, &mut self.border);
        let measured = scene.coarse.checked.pixels().iter().filter(|d| **d >= 1.0).count();
        let has_depth = measured as f32 >= LEAST_MEASURED * out.size().area() as f32;
        let (width, height) = (out.width() as f32, out.height() as f32);
        for y in 0..out.height() {
            let (color, border) = (barrier.row(y), self.border.row(y));
            let relief = relief.row(y);
            let v = (y as f32 + 0.5) / height - 0.5;
            for (x, out) in out.row_mut(y).iter_mut().enumerate() {
                let u = (x as f32 + 0.5) / width - 0.5;
                let radius = u * u + v * v;
                let (appearance, spread) = if has_depth {
                    ((color[x] / FULL_BARRIER).min(1.0) + 0.1 * relief[x] / 255.0, 2.0)
                } else {
                    let barrier = (color[x] / FULL_BARRIER_STILL).min(1.0);
                    let contrast = (border[x] / FULL_BOUNDARY).min(1.0);
                    (1.2 * (barrier * contrast).sqrt(), 4.0)
                };
                *out = (appearance * (-spread * radius).exp()).min(1.0);
            }
        }
    }
}
