//! Mode `scene`: what stands on the ground, stands out, is near, or moves.
//!
//! On roads no cue of appearance finds what matters, height above the ground
//! does; in pictures of things the minimum barrier distance does. The ground
//! plane decides which of the two is asked.

mod on_plane;
mod without_plane;

use super::barrier::Barrier;
use super::ego::EgoMotion;
use super::{AttentionScene, Scene};
use crate::image::Image;
use crate::perception::View;
use crate::simd::Level;
use crate::stage::ground::Ground;

use on_plane::OnPlane;
use without_plane::{Cues, WithoutPlane};

/// Share of measured cells from which a frame counts as one with depth.
const LEAST_MEASURED: f32 = 0.15;

/// The mode with its cues.
#[derive(Debug)]
pub struct SceneSaliency {
    ground: Ground,
    barrier: Barrier,
    ego: EgoMotion,
    on_plane: OnPlane,
    without_plane: WithoutPlane,
    fourth: Image<u8>,
    color: Image<f32>,
    relief: Image<f32>,
}

impl SceneSaliency {
    /// The mode at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self {
            ground: Ground::default(),
            barrier: Barrier::new(level),
            ego: EgoMotion::new(level),
            on_plane: OnPlane::new(level),
            without_plane: WithoutPlane::default(),
            fourth: Image::default(),
            color: Image::default(),
            relief: Image::default(),
        }
    }

    /// The ground as estimated in the last frame.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// What needs no flow, so that it can run beside it: the ground, which is
    /// searched anew when the frame is the `first` one, and the barriers.
    pub fn prepare(&mut self, scene: &Scene<'_>, cells: &View, first: bool) {
        if first {
            self.ground.reset();
        }
        self.ground.run(&scene.coarse.checked, scene.rig);
        self.scale_disparity(&scene.coarse.filled);
        self.barrier.run(&cells.rgb, &self.fourth, &mut self.color, &mut self.relief);
    }

    /// Writes S per cell, after [`SceneSaliency::prepare`].
    pub fn run(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let measured = scene.coarse.checked.pixels().iter().filter(|d| **d >= 1.0).count();
        let has_depth = measured as f32 >= LEAST_MEASURED * out.size().area() as f32;
        let motion = match scene.flow {
            Some(flow) if self.ego.run(flow, scene, has_depth) => Some(&self.ego),
            _ => None,
        };
        if let Some(plane) = self.ground.plane() {
            let motion = motion.map(|ego| &ego.motion);
            self.on_plane.run(plane, scene, &self.color, motion, out);
        } else {
            let cues = Cues { barrier: &self.color, relief: &self.relief, motion };
            self.without_plane.run(scene, &cues, has_depth, out);
        }
    }

    /// Disparity as a byte, 0 at infinity and 255 at the largest one.
    fn scale_disparity(&mut self, filled: &Image<f32>) {
        let largest = filled.pixels().iter().fold(1.0_f32, |m, &d| m.max(d));
        self.fourth.resize(filled.size());
        for (out, &d) in self.fourth.pixels_mut().iter_mut().zip(filled.pixels()) {
            *out = (d / largest * 255.0) as u8;
        }
    }
}
