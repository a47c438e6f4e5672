//! Mode `scene`: what stands on the ground, stands out, is near, or moves.
//!
//! On roads no cue of appearance finds what matters, height above the ground
//! does; in pictures of things the minimum barrier distance does. The ground
//! plane decides which of the two is asked.

use super::AttentionScene;
use super::barrier::Barrier;
use super::boundary::Boundary;
use super::lateral::Lateral;
use crate::image::Image;
use crate::stage::ground::{Ground, Plane, cell_centre};
use crate::stage::standing::{Standing, Things};

/// Height above the ground in metres (of a road scene) where things begin, and
/// over which they fade in.
const LOW_M: f32 = 0.15;
const FADE_IN_M: f32 = 0.25;
/// Height where things end in metres, and over which they fade out.
const HIGH_M: f32 = 3.2;
const FADE_OUT_M: f32 = 0.5;
/// Disparity in pixels below which heights are noise.
const LEAST_DISPARITY: f32 = 1.2;
/// Distance in metres up to which nearness is 1.
const NEAR_M: f32 = 25.0;
/// Share of measured cells from which a frame counts as one with depth.
const LEAST_MEASURED: f32 = 0.15;
/// Cells of the smallest thing.
const LEAST_CELLS: u32 = 4;
/// Sum of the barriers of Y, Cb and Cr that counts fully.
const FULL_BARRIER: f32 = 180.0;
/// The same where there is no ground, and pictures are of things.
const FULL_BARRIER_STILL: f32 = 120.0;
/// Sum of Mahalanobis distances from three sides that counts fully.
const FULL_BOUNDARY: f32 = 12.0;

/// The mode with its cues.
#[derive(Debug, Default)]
pub struct SceneSaliency {
    ground: Ground,
    barrier: Barrier,
    boundary: Boundary,
    lateral: Lateral,
    standing: Standing,
    things: Things,
    disparity: Image<f32>,
    means: Vec<f32>,
    counts: Vec<f32>,
    fourth: Image<u8>,
    /// Sum of the barriers of Y, Cb, Cr per cell.
    pub color: Image<f32>,
    /// Barrier of disparity per cell.
    pub relief: Image<f32>,
    /// Boundary contrast per cell.
    pub border: Image<f32>,
    /// Lateral depth contrast per cell.
    pub contrast: Image<f32>,
}

impl SceneSaliency {
    /// The ground as estimated in the last frame.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// Writes S per cell.
    pub fn run(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        if scene.previous.is_none() {
            self.ground.reset();
        }
        self.ground.run(&scene.coarse.checked, scene.rig);
        self.scale_disparity(scene);
        self.barrier.run(&scene.cells.rgb, &self.fourth, &mut self.color, &mut self.relief);
        match self.ground.plane().copied() {
            Some(plane) => {
                self.run_on_plane(&plane, scene, out);
                self.even_out(&plane, scene, out);
            }
            None => self.run_without_plane(scene, out),
        }
    }

    /// Disparity as a byte, 0 at infinity and 255 at the largest one.
    fn scale_disparity(&mut self, scene: &AttentionScene<'_>) {
        let filled = &scene.coarse.filled;
        let largest = filled.pixels().iter().fold(1.0_f32, |m, &d| m.max(d));
        self.fourth.resize(filled.size());
        for (out, &d) in self.fourth.pixels_mut().iter_mut().zip(filled.pixels()) {
            *out = (d / largest * 255.0) as u8;
        }
    }

    fn run_on_plane(&mut self, plane: &Plane, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let filled = &scene.coarse.filled;
        let scale = plane.scale();
        let px_per_m = 1.0 / scene.rig.baseline_m as f32;
        self.lateral.run(filled, px_per_m, scale, &mut self.contrast);
        let offset = scene.rig.disparity_offset() as f32;
        let depth_scale = scene.rig.depth_scale() as f32;
        for y in 0..out.height() {
            let d = filled.row(y);
            let (contrast, color) = (self.contrast.row(y), self.color.row(y));
            for (x, out) in out.row_mut(y).iter_mut().enumerate() {
                let d = d[x] - offset;
                let (u, v) = cell_centre(x, y);
                if d <= LEAST_DISPARITY {
                    *out = 0.0;
                    continue;
                }
                let height = plane.height(u, v, d);
                let low = ((height - LOW_M * scale) / (FADE_IN_M * scale)).clamp(0.0, 1.0);
                let high = ((HIGH_M - height) / FADE_OUT_M).clamp(0.0, 1.0);
                let nearness = (NEAR_M * scale * d / depth_scale).min(1.0);
                let barrier = (color[x] / FULL_BARRIER).min(1.0);
                *out = low * high * (0.15 + 0.45 * contrast[x] + 0.2 * nearness + 0.2 * barrier);
            }
        }
    }

    /// A thing is as salient as its parts: no cell of it counts less than their mean.
    fn even_out(&mut self, plane: &Plane, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let offset = scene.rig.disparity_offset() as f32;
        self.disparity.resize(out.size());
        let checked = scene.coarse.checked.pixels();
        for (out, d) in self.disparity.pixels_mut().iter_mut().zip(checked) {
            *out = d - offset;
        }
        self.standing.run(&self.disparity, plane, scene.rig, LEAST_CELLS, &mut self.things);
        self.means.clear();
        self.means.resize(self.things.list.len(), 0.0);
        self.counts.clear();
        self.counts.resize(self.things.list.len(), 0.0);
        let ids = self.things.ids.pixels();
        for (&id, &s) in ids.iter().zip(out.pixels()).filter(|(id, _)| **id != 0) {
            self.means[id as usize - 1] += s;
            self.counts[id as usize - 1] += 1.0;
        }
        for (mean, count) in self.means.iter_mut().zip(&self.counts) {
            *mean /= count;
        }
        for (&id, s) in ids.iter().zip(out.pixels_mut()).filter(|(id, _)| **id != 0) {
            *s = s.max(self.means[id as usize - 1]);
        }
    }

    /// No ground: what cannot be reached from the border, near the centre.
    ///
    /// A picture without disparity is of things more often than not, and the
    /// boundary contrast helps: the geometric mean of both. With disparity a
    /// bare table or wall may fill the view, whose shading the boundary
    /// contrast takes for a thing: the barrier alone, and relief.
    fn run_without_plane(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        self.boundary.run(&scene.cells.rgb, &mut self.border);
        let measured = scene.coarse.checked.pixels().iter().filter(|d| **d >= 1.0).count();
        let has_depth = measured as f32 >= LEAST_MEASURED * out.size().area() as f32;
        let (width, height) = (out.width() as f32, out.height() as f32);
        for y in 0..out.height() {
            let (color, border) = (self.color.row(y), self.border.row(y));
            let relief = self.relief.row(y);
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
