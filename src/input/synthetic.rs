//! Scenes made by calculation: stereo pairs with exact truth, from no file.
//!
//! A deterministic ray caster with a true pinhole rig. It uses `+ - * /`, the
//! square root and the `libm` crate alone, so that every machine and any
//! number of threads gives the same bytes.
//!
//! What is known about the truth: disparity is exact at the pixel centre of
//! the left view, also where the right camera does not see the point; the sky
//! is unknown (NaN). Objects are the things that stand out of their ground
//! (cars, people, posts and trunks on the street; the things on the table),
//! with ids that stay the same over time.

mod backdrop;
mod finish;
mod grid;
mod material;
pub mod noise;
mod part;
mod renderer;
mod sensor;
mod shape;
mod street;
mod tabletop;
mod texture;
mod viewpoint;
mod world;

use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use thiserror::Error;

use crate::camera::{Camera, StereoRig};
use crate::error::CalibrationError;
use crate::image::{Image, Picture, Size};
use crate::input::{FrameSource, Observation, Tally, Truth};
use crate::perception::StereoFrame;
use crate::stamp::Stamp;
use part::Pose;
use renderer::{Exposure, Geometry, Renderer};
use sensor::Sensor;
use shape::Vec3;
use street::Variation;
use viewpoint::Viewpoint;
use world::World;

/// Frame id of the left camera.
pub const LEFT_FRAME_ID: &str = "left_optical";
/// Frame id of the right camera.
pub const RIGHT_FRAME_ID: &str = "right_optical";

/// Stamp of the first frame.
const START: Stamp = Stamp(1_700_000_000_000_000_000);

/// A scene that cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SyntheticError {
    /// No scene has this name.
    #[error("there is no scene '{name}'; known are street and tabletop")]
    UnknownScene {
        /// The name as given.
        name: String,
    },
    /// A picture too small to be seen or too large to be made.
    #[error("a rendered picture of {size} is not possible: each side must be 32 to 8192 pixels")]
    Size {
        /// The size as given.
        size: Size,
    },
    /// No picture at all, or more work than anyone will wait for.
    #[error("{what} is {value}, allowed is {allowed}")]
    OutOfRange {
        /// Which option.
        what: &'static str,
        /// What was given.
        value: String,
        /// What can be made.
        allowed: &'static str,
    },
    /// The rig of the scene is no stereo rig.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// The scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SceneKind {
    /// A car drives towards a zebra crossing.
    Street,
    /// Things on a table.
    Tabletop,
}

impl SceneKind {
    /// All scenes.
    pub const ALL: [Self; 2] = [Self::Street, Self::Tabletop];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Street => "street",
            Self::Tabletop => "tabletop",
        }
    }

    /// What the shipped bag of this scene was made with.
    pub const fn defaults(self) -> SceneOptions {
        let (size, frames) = match self {
            Self::Street => (Size::new(640, 240), 60),
            Self::Tabletop => (Size::new(480, 360), 30),
        };
        SceneOptions { size, frames, rate_hz: 10.0, samples: 2, noise: true, seed: 0 }
    }

    /// Focal length over picture width, baseline in metres, height of the
    /// principal point over picture height.
    const fn rig(self) -> (f64, f64, f64) {
        match self {
            Self::Street => (420.0 / 640.0, 0.5, 0.44),
            Self::Tabletop => (440.0 / 480.0, 0.1, 0.5),
        }
    }

    fn compose(self, time: f64, seed: u32) -> World {
        match self {
            Self::Street => street::compose(time, Variation(seed)),
            Self::Tabletop => tabletop::compose(time),
        }
    }
}

impl fmt::Display for SceneKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for SceneKind {
    type Err = SyntheticError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|scene| scene.name() == name)
            .ok_or_else(|| SyntheticError::UnknownScene { name: name.to_owned() })
    }
}

/// How a scene is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneOptions {
    /// Size of the pictures. The field of view follows from the width.
    pub size: Size,
    /// Number of pairs.
    pub frames: usize,
    /// Pairs per second.
    pub rate_hz: f64,
    /// Samples per pixel along x and along y.
    pub samples: usize,
    /// Sensor noise, and a right camera a little darker than the left one.
    pub noise: bool,
    /// Of the street: which one. 0 is the shipped one; in others cars, people, posts and trees
    /// are others and elsewhere.
    pub seed: u32,
}

/// One of the two views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The reference view.
    Left,
    /// The other one.
    Right,
}

/// A scene with its rig: frame `n` is the same whoever asks for it, and when.
#[derive(Clone, Debug)]
pub struct SyntheticScene {
    kind: SceneKind,
    options: SceneOptions,
    rig: Arc<StereoRig>,
    frame_id: Arc<str>,
}

impl SyntheticScene {
    /// The scene `kind`, taken with `options`.
    ///
    /// # Errors
    /// When an option is out of range.
    pub fn new(kind: SceneKind, options: SceneOptions) -> Result<Self, SyntheticError> {
        let SceneOptions { size, frames, rate_hz, samples, seed, .. } = options;
        if !(32..=8192).contains(&size.width) || !(32..=8192).contains(&size.height) {
            return Err(SyntheticError::Size { size });
        }
        let out_of_range =
            |what, value: String, allowed| Err(SyntheticError::OutOfRange { what, value, allowed });
        if !(1..=100_000).contains(&frames) {
            return out_of_range("number of frames", frames.to_string(), "1 to 100000");
        }
        if !(rate_hz > 0.0 && rate_hz <= 1000.0) {
            return out_of_range(
                "frame rate",
                format!("{rate_hz} Hz"),
                "more than 0 up to 1000 Hz",
            );
        }
        if !(1..=8).contains(&samples) {
            return out_of_range("samples per axis", samples.to_string(), "1 to 8");
        }
        if kind == SceneKind::Tabletop && seed != 0 {
            return out_of_range("seed of the tabletop", seed.to_string(), "0: there is only one");
        }
        let (focal_share, baseline, middle) = kind.rig();
        let f = focal_share * size.width as f64;
        let cx = (size.width as f64 - 1.0) / 2.0;
        let cy = (middle * size.height as f64).floor() - 0.5;
        let rig = StereoRig::new(
            Camera::pinhole(size, f, cx, cy, 0.0),
            Camera::pinhole(size, f, cx, cy, -f * baseline),
            0.0,
        )?;
        Ok(Self { kind, options, rig: Arc::new(rig), frame_id: Arc::from(LEFT_FRAME_ID) })
    }

    /// Which scene.
    pub const fn kind(&self) -> SceneKind {
        self.kind
    }

    /// How it is taken.
    pub const fn options(&self) -> &SceneOptions {
        &self.options
    }

    /// The calibration of both cameras.
    pub const fn rig(&self) -> &Arc<StereoRig> {
        &self.rig
    }

    /// When frame `index` is taken.
    pub fn stamp(&self, index: usize) -> Stamp {
        Stamp(START.0 + (index as f64 / self.options.rate_hz * 1e9 + 0.5) as i64)
    }

    fn world(&self, index: usize) -> World {
        self.kind.compose(index as f64 / self.options.rate_hz, self.options.seed)
    }

    fn viewpoint(&self, world: &World, side: Side) -> Viewpoint {
        let shift = match side {
            Side::Left => 0.0,
            Side::Right => self.rig.baseline_m,
        };
        let position = world.camera.point(Vec3::new(shift, 0.0, 0.0));
        Viewpoint {
            pose: Pose { position, ..world.camera },
            focal: self.rig.focal_px(),
            centre: self.rig.principal_point(),
            size: self.options.size,
        }
    }

    fn truth_of(&self, geometry: Geometry) -> Truth {
        let scale = self.rig.depth_scale();
        let depth = &geometry.depth;
        let disparity = Image::from_fn(depth.size(), |x, y| {
            let z = depth.get(x, y);
            if z.is_finite() { (scale / z) as f32 } else { f32::NAN }
        });
        Truth { disparity: Some(disparity), objects: Some(geometry.objects), ..Truth::default() }
    }

    /// Disparity and objects as seen from one side. For [`Side::Right`] the
    /// disparity is that of the right view: `x_l = x_r + d`.
    pub fn truth(&self, index: usize, side: Side) -> Truth {
        let world = self.world(index);
        let renderer = Renderer::new(&world);
        self.truth_of(renderer.geometry(&self.viewpoint(&world, side)))
    }

    /// Pair `index` and its truth.
    pub fn observation(&self, index: usize) -> Observation {
        let world = self.world(index);
        let renderer = Renderer::new(&world);
        let left = self.viewpoint(&world, Side::Left);
        let right = self.viewpoint(&world, Side::Right);
        let noise = if self.options.noise { 1.2 } else { 0.0 };
        let sensor = Sensor::new(1.0, noise);
        let seed = 2 * index as u32;
        let samples = self.options.samples;
        let exposure = Exposure { samples, gain: 1.0, noise_seed: seed };
        let other_gain = if self.options.noise { 0.965 } else { 1.0 };
        let other = Exposure { samples, gain: other_gain, noise_seed: seed + 1 };
        let frame = StereoFrame {
            stamp: self.stamp(index),
            right_stamp: self.stamp(index),
            frame_id: Arc::clone(&self.frame_id),
            left: Picture::Rgb(renderer.picture(&left, exposure, &sensor)),
            right: Picture::Rgb(renderer.picture(&right, other, &sensor)),
            rig: Arc::clone(&self.rig),
        };
        Observation { frame, truth: Some(self.truth_of(renderer.geometry(&left))) }
    }
}

/// A scene as a source of frames.
#[derive(Clone, Debug)]
pub struct SyntheticSource {
    scene: SyntheticScene,
    next: usize,
    tally: Tally,
}

impl SyntheticSource {
    /// All frames of `scene`, from the first.
    pub fn new(scene: SyntheticScene) -> Self {
        Self { scene, next: 0, tally: Tally::default() }
    }

    /// The scene.
    pub const fn scene(&self) -> &SyntheticScene {
        &self.scene
    }
}

impl FrameSource for SyntheticSource {
    type Error = Infallible;

    fn next_observation(&mut self) -> Result<Option<Observation>, Self::Error> {
        if self.next >= self.scene.options.frames {
            return Ok(None);
        }
        let observation = self.scene.observation(self.next);
        self.next += 1;
        self.tally.pairs += 1;
        Ok(Some(observation))
    }

    fn tally(&self) -> &Tally {
        &self.tally
    }

    fn progress(&self) -> Option<f64> {
        Some(self.next as f64 / self.scene.options.frames as f64)
    }
}
