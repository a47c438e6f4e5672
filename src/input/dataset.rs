//! Frames from image files: a single pair, or scenes of a published data set.
//!
//! Which files belong together is found, and that they are all there is
//! checked, before the first frame; images are decoded one pair at a time.
//!
//! Data sets without time stamps get 10 Hz: frame number `n` of scene number
//! `s` has the stamp `1 + 3600 s + 0.1 n` seconds, so stamps increase over all
//! scenes. Whoever takes several scenes from one source starts anew whenever
//! [`DatasetSource::scene`] changes.

mod file;
pub mod kitti;
pub mod pair;

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use thiserror::Error;

pub use kitti::{Kitti, KittiTruth, KittiYear};
pub use pair::PairFiles;

use crate::camera::{Camera, StereoRig};
use crate::error::CalibrationError;
use crate::image::Size;
use crate::input::{FrameSource, Observation, Tally, Truth};
use crate::perception::StereoFrame;
use crate::stamp::Stamp;

/// What can be wrong with a data set.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// The system refuses.
    #[error("cannot read {path}: {source}")]
    Io {
        /// File or folder.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// The published layout has a file or folder that is not there.
    #[error("{path} is missing: {needed}")]
    Missing {
        /// File or folder.
        path: PathBuf,
        /// What it is for.
        needed: String,
    },
    /// No scene of that name.
    #[error("{path} has no scene '{scene}'; it has {available}")]
    NoScene {
        /// The folder of the left images.
        path: PathBuf,
        /// As asked for.
        scene: String,
        /// Names of those there are.
        available: String,
    },
    /// A calibration file that says something else than it should.
    #[error("calibration {path}: {fault}")]
    CalibrationFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// A calibration that makes no stereo pair.
    #[error("{path}: {source}")]
    Calibration {
        /// Calibration file or left image.
        path: PathBuf,
        /// What is wrong with it.
        source: CalibrationError,
    },
    /// A file that is not the image it should be.
    #[error("image {path}: {fault}")]
    Image {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// Images of one frame that differ in size.
    #[error("{path} is {found}, but the left image is {left}")]
    SizesDiffer {
        /// Right image or truth.
        path: PathBuf,
        /// Its size.
        found: Size,
        /// Size of the left image.
        left: Size,
    },
}

/// Where the calibration of a scene comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Calibration {
    /// Known for images of any size.
    Pinhole {
        /// Focal length in pixels.
        focal_px: f64,
        /// Principal point of the left image; `None`: its centre.
        principal_point: Option<(f64, f64)>,
        /// `cx_r - cx_l` in pixels (`doffs` of Middlebury).
        right_offset_px: f64,
        /// Distance of the cameras in metres.
        baseline_m: f64,
    },
    /// Not known: distances are multiples of something. The focal length is
    /// taken as the image width (53 degrees), the baseline as 0.1 m.
    Unknown,
}

/// The files of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFiles {
    /// Left image.
    pub left: PathBuf,
    /// Right image.
    pub right: PathBuf,
    /// True disparity of the left image: 16-bit PNG, value / 256 pixels, 0 unknown.
    pub disparity: Option<PathBuf>,
    /// Number of the frame in its scene.
    pub number: u32,
}

/// A scene: consecutive frames under one calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name in the data set.
    pub name: String,
    /// Its frames, in order.
    pub frames: Vec<FrameFiles>,
    /// Its calibration.
    pub calibration: Calibration,
    /// Where the calibration stands, for messages.
    pub calibration_path: PathBuf,
}

/// Stereo frames of scenes.
pub struct DatasetSource {
    scenes: Vec<Scene>,
    scene: usize,
    frame: usize,
    current: usize,
    rig: Option<(usize, Size, Arc<StereoRig>)>,
    tally: Tally,
}

impl DatasetSource {
    /// The frames of `scenes`, one scene after the other.
    pub fn new(scenes: Vec<Scene>) -> Self {
        Self { scenes, scene: 0, frame: 0, current: 0, rig: None, tally: Tally::default() }
    }

    /// All scenes.
    pub fn scenes(&self) -> &[Scene] {
        &self.scenes
    }

    /// Name of the scene of the last frame.
    pub fn scene(&self) -> &str {
        self.scenes.get(self.current).map_or("", |scene| &scene.name)
    }

    fn observe(&mut self, number: usize, files: &FrameFiles) -> Result<Observation, DatasetError> {
        let left = file::picture(&files.left)?;
        let right = file::picture(&files.right)?;
        let size = left.size();
        let check = |path: &PathBuf, found: Size| {
            let path = path.clone();
            if found == size {
                Ok(())
            } else {
                Err(DatasetError::SizesDiffer { path, found, left: size })
            }
        };
        check(&files.right, right.size())?;
        let rig = self.rig(number, size)?;
        let truth = match &files.disparity {
            None => None,
            Some(path) => {
                let mut disparity = file::disparity(path)?;
                check(path, disparity.size())?;
                let offset = rig.disparity_offset() as f32;
                for d in disparity.pixels_mut() {
                    *d -= offset;
                }
                Some(Truth { disparity: Some(disparity), ..Truth::default() })
            }
        };
        let stamp = stamp(number, files.number);
        let frame = StereoFrame {
            stamp,
            right_stamp: stamp,
            frame_id: Arc::from("left_optical"),
            left,
            right,
            rig,
        };
        Ok(Observation { frame, truth })
    }

    fn rig(&mut self, number: usize, size: Size) -> Result<Arc<StereoRig>, DatasetError> {
        if let Some((of, for_size, rig)) = &self.rig
            && (*of, *for_size) == (number, size)
        {
            return Ok(Arc::clone(rig));
        }
        let scene = &self.scenes[number];
        let rig = scene.calibration.rig(size).map_err(|source| DatasetError::Calibration {
            path: scene.calibration_path.clone(),
            source,
        })?;
        let rig = Arc::new(rig);
        self.rig = Some((number, size, Arc::clone(&rig)));
        Ok(rig)
    }
}

impl Calibration {
    /// The rig for rectified images of `size`.
    fn rig(&self, size: Size) -> Result<StereoRig, CalibrationError> {
        let centre = ((size.width as f64 - 1.0) / 2.0, (size.height as f64 - 1.0) / 2.0);
        let (f, (cx, cy), offset, baseline) = match *self {
            Self::Pinhole { focal_px, principal_point, right_offset_px, baseline_m } => {
                (focal_px, principal_point.unwrap_or(centre), right_offset_px, baseline_m)
            }
            Self::Unknown => (size.width as f64, centre, 0.0, 0.1),
        };
        let left = Camera::pinhole(size, f, cx, cy, 0.0);
        let right = Camera::pinhole(size, f, cx + offset, cy, -f * baseline);
        StereoRig::new(left, right, 0.0)
    }
}

/// The stamp of a frame; see the module text.
fn stamp(scene: usize, frame: u32) -> Stamp {
    Stamp(1_000_000_000 + scene as i64 * 3_600_000_000_000 + i64::from(frame) * 100_000_000)
}

impl FrameSource for DatasetSource {
    type Error = DatasetError;

    fn next_observation(&mut self) -> Result<Option<Observation>, DatasetError> {
        while let Some(scene) = self.scenes.get(self.scene) {
            if let Some(files) = scene.frames.get(self.frame) {
                let (files, number) = (files.clone(), self.scene);
                self.frame += 1;
                self.current = number;
                let observation = self.observe(number, &files)?;
                self.tally.pairs += 1;
                return Ok(Some(observation));
            }
            self.scene += 1;
            self.frame = 0;
        }
        Ok(None)
    }

    fn tally(&self) -> &Tally {
        &self.tally
    }

    fn progress(&self) -> Option<f64> {
        let all: usize = self.scenes.iter().map(|scene| scene.frames.len()).sum();
        let before: usize =
            self.scenes.iter().take(self.scene).map(|scene| scene.frames.len()).sum();
        Some(if all == 0 { 1.0 } else { (before + self.frame) as f64 / all as f64 })
    }
}
