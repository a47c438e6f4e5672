//! Where there is a ground: what stands on it, stands out, or is near.

#![allow(
    clippy::inline_always,
    reason = "a kernel gets the wide instructions only where `dispatch` inlines it"
)]

use crate::image::Image;
use crate::simd::{Level, dispatch};
use crate::stage::ground::{Plane, cell_centre};
use crate::stage::saliency::AttentionScene;
use crate::stage::saliency::lateral::Lateral;
use crate::stage::saliency::structure::Structure;
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
/// Distance in metres (of a road scene) up to which nearness is 1: what is met
/// within two seconds at 90 km/h.
const NEAR_M: f32 = 50.0;
/// What a structure that does not stand out loses.
const STRUCTURE: f32 = 0.7;
/// Cells of the smallest thing.
const LEAST_CELLS: u32 = 4;
/// Sum of the barriers of Y, Cb and Cr that counts fully.
const FULL_BARRIER: f32 = 180.0;

/// Attention over a ground plane, with its cues.
#[derive(Debug)]
pub struct OnPlane {
    level: Level,
    lateral: Lateral,
    structure: Structure,
    standing: Standing,
    things: Things,
    disparity: Image<f32>,
    contrast: Image<f32>,
    tall: Image<f32>,
    means: Vec<f32>,
    counts: Vec<f32>,
}

impl OnPlane {
    /// The cues at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            lateral: Lateral::default(),
            structure: Structure::new(level),
            standing: Standing::default(),
            things: Things::default(),
            disparity: Image::default(),
            contrast: Image::default(),
            tall: Image::default(),
            means: Vec::new(),
            counts: Vec::new(),
        }
    }

    /// S = G · (.15 + .45 `C_lat` + .2 nearness + .2 `C_MB`) · (1 − .7 T (1 − `C_lat`))
    /// per cell: G is the gate by height above `plane`, T the share of structure
    /// ([`Structure`]), `barrier` the sum of the barriers of Y, Cb and Cr. A pole
    /// or a trunk is a structure that stands out on both sides: it loses nothing.
    pub fn run(
        &mut self,
        plane: &Plane,
        scene: &AttentionScene<'_>,
        barrier: &Image<f32>,
        out: &mut Image<f32>,
    ) {
        let offset = scene.rig.disparity_offset() as f32;
        take(&scene.coarse.filled, offset, &mut self.disparity);
        let scale = plane.scale();
        let px_per_m = 1.0 / scene.rig.baseline_m as f32;
        self.lateral.run(&self.disparity, px_per_m, scale, &mut self.contrast);
        self.structure.run(&self.disparity, plane, &mut self.tall);
        let near = NEAR_M * scale / scene.rig.depth_scale() as f32;
        let (disparity, contrast, tall) = (&self.disparity, &self.contrast, &self.tall);
        dispatch!(self.level, _simd => {
            for y in 0..out.height() {
                let cues = Cues {
                    disparity: disparity.row(y),
                    contrast: contrast.row(y),
                    tall: tall.row(y),
                    barrier: barrier.row(y),
                };
                fuse(&cues, plane, y, near, out.row_mut(y));
            }
        });
        self.even_out(plane, scene, out);
    }

    /// A thing is as salient as its parts: no cell of it counts less than their mean.
    fn even_out(&mut self, plane: &Plane, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let offset = scene.rig.disparity_offset() as f32;
        take(&scene.coarse.checked, offset, &mut self.disparity);
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
}

/// Disparities with `cx_l - cx_r` subtracted.
fn take(disparity: &Image<f32>, offset: f32, out: &mut Image<f32>) {
    out.resize(disparity.size());
    for (out, d) in out.pixels_mut().iter_mut().zip(disparity.pixels()) {
        *out = d - offset;
    }
}

/// One row of each cue.
struct Cues<'a> {
    disparity: &'a [f32],
    contrast: &'a [f32],
    tall: &'a [f32],
    barrier: &'a [f32],
}

#[inline(always)]
fn fuse(cues: &Cues<'_>, plane: &Plane, y: usize, near: f32, out: &mut [f32]) {
    let scale = plane.scale();
    let (lowest, fade_in) = (LOW_M * scale, 1.0 / (FADE_IN_M * scale));
    let cells = cues.disparity.iter().zip(cues.contrast).zip(cues.tall).zip(cues.barrier);
    for (x, (out, (((&d, &contrast), &tall), &barrier))) in out.iter_mut().zip(cells).enumerate() {
        let (u, v) = cell_centre(x, y);
        let known = d > LEAST_DISPARITY;
        let height = plane.height(u, v, if known { d } else { 1.0 });
        let low = ((height - lowest) * fade_in).clamp(0.0, 1.0);
        let high = ((HIGH_M - height) * (1.0 / FADE_OUT_M)).clamp(0.0, 1.0);
        let nearness = (near * d).min(1.0);
        let barrier = (barrier * (1.0 / FULL_BARRIER)).min(1.0);
        let cue = 0.15 + 0.45 * contrast + 0.2 * nearness + 0.2 * barrier;
        let s = low * high * cue * (1.0 - STRUCTURE * tall * (1.0 - contrast));
        *out = if known { s } else { 0.0 };
    }
}
