//! Mode `scene`: what stands on the ground, stands out, is near, or moves.
//!
//! On roads no cue of appearance finds what matters, height above the ground
//! does; in pictures of things the minimum barrier distance does, and where a
//! table is seen from above the relief. The plane decides which is asked.

mod on_plane;
mod on_table;
mod without_plane;

use super::barrier::Barrier;
use super::ego::EgoMotion;
use super::{AttentionScene, Scene};
use crate::image::Image;
use crate::perception::View;
use crate::simd::{Level, Simd, dispatch, f32x16, i32x16, prelude::*};
use crate::stage::ground::{Footing, Ground};
use crate::stage::table::Table;

use on_plane::OnPlane;
use on_table::OnTable;
use without_plane::{Cues, WithoutPlane, even_contrast};

/// Share of measured cells from which a frame counts as one with depth.
const LEAST_MEASURED: f32 = 0.15;

/// Cosine between a ground's normal and the image's vertical below which it may
/// be seen as a table as well, and the same when it was one in the frame before.
const STEEP: f32 = 0.4;
const STEEP_STILL: f32 = 0.5;

/// The mode with its cues.
#[derive(Debug)]
pub struct SceneSaliency {
    level: Level,
    ground: Ground,
    table: Table,
    barrier: Barrier,
    ego: EgoMotion,
    on_plane: OnPlane,
    on_table: OnTable,
    without_plane: WithoutPlane,
    is_still: bool,
    fourth: Image<u8>,
    color: Image<f32>,
    relief: Image<f32>,
}

impl SceneSaliency {
    /// The mode at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            ground: Ground::default(),
            table: Table::default(),
            barrier: Barrier::new(level),
            ego: EgoMotion::new(level),
            on_plane: OnPlane::new(level),
            on_table: OnTable::default(),
            without_plane: WithoutPlane::default(),
            is_still: false,
            fourth: Image::default(),
            color: Image::default(),
            relief: Image::default(),
        }
    }

    /// The plane that attention reckoned with in the last frame: a table before
    /// the ground, which is only asked for where there is none or a steep one.
    pub fn footing(&self) -> Footing {
        match self.table.plane() {
            Some(&plane) => Footing { state: self.table.state(), plane: Some(plane) },
            None => Footing { state: self.ground.state(), plane: self.ground.plane().copied() },
        }
    }

    /// Looks for the ground, and for a table where there is none or a steep one.
    fn find_footing(&mut self, scene: &Scene<'_>, first: bool) {
        if first {
            self.ground.reset();
            self.table.reset();
            self.ego.reset();
        }
        self.ground.run(&scene.coarse.checked, scene.rig);
        let steep = if self.table.plane().is_some() { STEEP_STILL } else { STEEP };
        if self.ground.plane().is_none_or(|plane| plane.upright(scene.rig) < steep) {
            self.table.run(&scene.coarse.checked, scene.rig);
        } else {
            self.table.reset();
        }
    }

    /// Evens out the contrast of the map where it was that of a still: with
    /// neither a plane nor motion. Not for the frame after it, which has a scale.
    pub fn even_contrast(&self, attention: &mut Image<f32>) {
        if self.is_still {
            even_contrast(attention);
        }
    }

    /// What needs no flow, so that it can run beside it: the plane, which is
    /// searched anew when the frame is the `first` one, and the barriers.
    pub fn prepare(&mut self, scene: &Scene<'_>, cells: &View, first: bool) {
        self.find_footing(scene, first);
        self.scale_disparity(&scene.coarse.filled);
        self.barrier.run(&cells.rgb, &self.fourth, &mut self.color, &mut self.relief);
    }

    /// Writes S per cell, after [`SceneSaliency::prepare`].
    pub fn run(&mut self, scene: &AttentionScene<'_>, out: &mut Image<f32>) {
        let checked = scene.coarse.checked.pixels();
        let measured = dispatch!(self.level, _simd => count_measured(checked));
        let has_depth = measured as f32 >= LEAST_MEASURED * out.size().area() as f32;
        let motion = match scene.flow {
            Some(flow) if self.ego.run(flow, scene, has_depth) => Some(&self.ego),
            _ => None,
        };
        let footing = self.footing();
        self.is_still = footing.plane.is_none() && motion.is_none();
        if let Some(plane) = footing.ground() {
            let motion = motion.map(|ego| &ego.motion);
            self.on_plane.run(plane, scene, &self.color, motion, out);
        } else if let Some(plane) = footing.table() {
            let motion = motion.map(|ego| &ego.motion);
            self.on_table.run(plane, scene, &self.color, motion, out);
        } else {
            let cues = Cues { barrier: &self.color, relief: &self.relief, motion };
            self.without_plane.run(scene, &cues, has_depth, out);
        }
    }

    /// Disparity as a byte, 0 at infinity and 255 at the largest one.
    fn scale_disparity(&mut self, filled: &Image<f32>) {
        self.fourth.resize(filled.size());
        let out = self.fourth.pixels_mut();
        dispatch!(self.level, simd => scale_to_bytes(simd, filled.pixels(), out));
    }
}

/// How many disparities are at least one pixel.
#[inline(always)]
fn count_measured(disparity: &[f32]) -> u32 {
    disparity.iter().map(|d| u32::from(*d >= 1.0)).sum()
}

#[inline(always)]
fn scale_to_bytes<S: Simd>(simd: S, values: &[f32], out: &mut [u8]) {
    // The largest of every sixteenth value, and of those.
    let mut largest = [1.0_f32; 16];
    let (whole, rest) = values.as_chunks::<16>();
    for values in whole {
        for i in 0..16 {
            largest[i] = largest[i].max(values[i]);
        }
    }
    let largest = largest.iter().chain(rest).fold(1.0_f32, |most, &value| most.max(value));
    let out = out.as_chunks_mut::<16>();
    for (out, values) in out.0.iter_mut().zip(whole) {
        let bytes = (f32x16::from_slice(simd, values) / largest * 255.0).max(0.0);
        let bytes: i32x16<S> = bytes.to_int();
        for (out, byte) in out.iter_mut().zip(bytes.as_slice()) {
            *out = *byte as u8;
        }
    }
    for (out, &value) in out.1.iter_mut().zip(rest) {
        *out = (value / largest * 255.0).max(0.0) as u8;
    }
}
