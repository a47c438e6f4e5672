//! A scene of a data set: its frames as files, its calibration.

use std::path::PathBuf;

use super::TruthFiles;
use crate::camera::{Camera, StereoRig};
use crate::error::CalibrationError;
use crate::image::Size;

/// Stills are a minute apart, so that nothing smooths over from one to the next.
pub(super) const STILLS_RATE_HZ: f64 = 1.0 / 60.0;

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

impl Calibration {
    /// The rig for rectified images of `size`.
    pub(super) fn rig(&self, size: Size) -> Result<StereoRig, CalibrationError> {
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

/// The files of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFiles {
    /// Left image.
    pub left: PathBuf,
    /// Right image; `None` in monocular scenes.
    pub right: Option<PathBuf>,
    /// What is known to be true about the left image.
    pub truth: TruthFiles,
    /// Calibration of this frame where it is another one in every frame,
    /// instead of that of the scene.
    pub calibration: Option<Calibration>,
    /// Number of the frame in its scene.
    pub number: u32,
}

impl FrameFiles {
    /// A pair without truth.
    pub(super) fn pair(left: PathBuf, right: PathBuf, number: u32) -> Self {
        let truth = TruthFiles::default();
        Self { left, right: Some(right), truth, calibration: None, number }
    }
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
    /// There is no right view: the right picture of every frame is a copy of
    /// the left one, and disparity and distance mean nothing.
    pub monocular: bool,
    /// The frames are photographs of different things, perhaps of different
    /// sizes: nothing carries over from one to the next.
    pub stills: bool,
    /// Frames per second; one a minute for stills.
    pub frame_rate_hz: f64,
    /// What the layout leaves open and how it was decided, for the report.
    pub notes: Vec<String>,
}
