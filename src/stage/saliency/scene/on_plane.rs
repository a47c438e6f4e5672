//! Where there is a ground: what stands on it, stands out, or is near.

use crate::image::Image;
use crate::simd::{Level, dispatch};
use crate::stage::ground::height::LEAST_DISPARITY;
use crate::stage::ground::{Plane, cell_centre};
use crate::stage::saliency::AttentionScene;
use crate::stage::saliency::beside::Beside;
use crate::stage::saliency::columns::{Columns, FADE_IN_M, LOW_M};
use crate::stage::saliency::lateral::Lateral;
use crate::stage::saliency::structure::Structure;

/// Height in metres where things end, and over which they fade out.
const HIGH_M: f32 = 3.2;
const FADE_OUT_M: f32 = 0.5;
/// Distance in metres (of a road scene) up to which nearness is 1: what is met
/// within two seconds at 90 km/h.
const NEAR_M: f32 = 50.0;
/// What a structure that does not stand out loses.
const STRUCTURE: f32 = 0.8;
/// What a thing that moves by itself gains.
const MOTION: f32 = 0.5;
/// Sum of the barriers of Y, Cb and Cr that counts fully.
const FULL_BARRIER: f32 = 180.0;

/// Attention over a ground plane, with its cues.
#[derive(Debug)]
pub struct OnPlane {
    level: Level,
    lateral: Lateral,
    structure: Structure,
    columns: Columns,
    beside: Beside,
    disparity: Image<f32>,
    contrast: Image<f32>,
    tall: Image<f32>,
    cue: Image<f32>,
}

impl OnPlane {
    /// The cues at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            lateral: Lateral::new(level),
            structure: Structure::new(level),
            columns: Columns::new(level),
            beside: Beside::new(level),
            disparity: Image::default(),
            contrast: Image::default(),
            tall: Image::default(),
            cue: Image::default(),
        }
    }

    /// S = G · (.15 + .45 `C_lat` + .2 nearness + .2 `C_MB`) · (1 − .8 T (1 − `C_lat`))
    /// · (1 + .5 `C_M`) per cell, limited to 1: G is the gate by height above
    /// `plane`, T the share of structure ([`Structure`]), `barrier` the sum of
    /// the barriers of Y, Cb and Cr, `C_M` the motion where it is known. Before
    /// motion each upright surface is evened out and gains where it ends below what
    /// is farther ([`Columns`], [`Beside`]). A pole
    /// or a trunk is a structure that stands out on both sides: it loses nothing.
    pub fn run(
        &mut self,
        plane: &Plane,
        scene: &AttentionScene<'_>,
        barrier: &Image<f32>,
        motion: Option<&Image<f32>>,
        out: &mut Image<f32>,
    ) {
        let offset = scene.rig.disparity_offset() as f32;
        let filled = &scene.coarse.filled;
        self.disparity.resize(filled.size());
        for (out, d) in self.disparity.pixels_mut().iter_mut().zip(filled.pixels()) {
            *out = d - offset;
        }
        self.structure.run(&self.disparity, plane, &mut self.tall);
        self.columns.find(&mut self.disparity, plane);
        let px_per_m = 1.0 / scene.rig.baseline_m as f32;
        self.lateral.run(&self.disparity, px_per_m, plane.scale(), &mut self.contrast);
        self.cue.resize(out.size());
        let near = NEAR_M * plane.scale() / scene.rig.depth_scale() as f32;
        let Self { level, disparity, contrast, tall, cue, .. } = self;
        dispatch!(*level, _simd => {
            for y in 0..out.height() {
                let cues = Cues {
                    disparity: disparity.row(y),
                    contrast: contrast.row(y),
                    tall: tall.row(y),
                    barrier: barrier.row(y),
                };
                fuse(&cues, plane, y, near, cue.row_mut(y), out.row_mut(y));
            }
        });
        self.columns.even_out(&self.disparity, plane, &self.cue, out);
        self.beside.run(&self.disparity, out);
        if let Some(motion) = motion {
            for (s, &motion) in out.pixels_mut().iter_mut().zip(motion.pixels()) {
                *s = (*s * (1.0 + MOTION * motion)).min(1.0);
            }
        }
    }
}

/// One row of each cue.
struct Cues<'a> {
    disparity: &'a [f32],
    contrast: &'a [f32],
    tall: &'a [f32],
    barrier: &'a [f32],
}

/// What a cell is worth as part of a thing, and that with the gate by its own height.
#[inline(always)]
fn fuse(cues: &Cues<'_>, plane: &Plane, y: usize, near: f32, cue: &mut [f32], gated: &mut [f32]) {
    let scale = plane.scale();
    let (lowest, fade_in) = (LOW_M * scale, 1.0 / (FADE_IN_M * scale));
    let cells = cues.disparity.iter().zip(cues.contrast).zip(cues.tall).zip(cues.barrier);
    let out = cue.iter_mut().zip(gated);
    for (x, ((cue, gated), (((&d, &contrast), &tall), &barrier))) in out.zip(cells).enumerate() {
        let (u, v) = cell_centre(x, y);
        let known = d > LEAST_DISPARITY;
        let height = plane.height(u, v, if known { d } else { 1.0 });
        let low = ((height - lowest) * fade_in).clamp(0.0, 1.0);
        let high = ((HIGH_M - height) * (1.0 / FADE_OUT_M)).clamp(0.0, 1.0);
        let nearness = (near * d).clamp(0.0, 1.0);
        let barrier = (barrier * (1.0 / FULL_BARRIER)).min(1.0);
        let sum = 0.15 + 0.45 * contrast + 0.2 * nearness + 0.2 * barrier;
        *cue = sum * (1.0 - STRUCTURE * tall * (1.0 - contrast));
        *gated = if known { low * high * *cue } else { 0.0 };
    }
}
