//! A single pair of rectified images.

use std::path::PathBuf;

use super::{
    Calibration, DatasetError, DatasetSource, DisparityCoding, DisparityFile, FrameFiles, Scene,
};

/// A rectified pair as two files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairFiles {
    /// Left image (PNG, JPEG, PNM).
    pub left: PathBuf,
    /// Right image.
    pub right: PathBuf,
    /// True disparity: 16-bit PNG, value / 256 pixels, 0 unknown.
    pub disparity: Option<PathBuf>,
    /// Focal length in pixels.
    pub focal_px: Option<f64>,
    /// Distance of the cameras in metres.
    pub baseline_m: Option<f64>,
    /// `cx_r - cx_l` in pixels (`doffs` of Middlebury), 0 when not given.
    pub right_offset_px: Option<f64>,
}

impl PairFiles {
    /// One frame. Without focal length or baseline the calibration is
    /// [`Calibration::Unknown`] in that part.
    ///
    /// # Errors
    /// When a file is missing.
    pub fn open(self) -> Result<DatasetSource, DatasetError> {
        let files = [(&self.left, "the left image"), (&self.right, "the right image")];
        let truth = self.disparity.as_ref().map(|path| (path, "the true disparity"));
        for (path, needed) in files.into_iter().chain(truth) {
            if !path.is_file() {
                return Err(DatasetError::Missing {
                    path: path.clone(),
                    needed: format!("it was given as {needed}"),
                });
            }
        }
        let calibration = match (self.focal_px, self.baseline_m) {
            (Some(focal_px), baseline_m) => Calibration::Pinhole {
                focal_px,
                principal_point: None,
                right_offset_px: self.right_offset_px.unwrap_or(0.0),
                baseline_m: baseline_m.unwrap_or(0.1),
            },
            (None, None) => Calibration::Unknown,
            (None, Some(_)) => {
                return Err(DatasetError::CalibrationFile {
                    path: self.left,
                    fault: "a baseline without a focal length gives no depth: give both".to_owned(),
                });
            }
        };
        let name = self.left.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut frame = FrameFiles::pair(self.left.clone(), self.right, 0);
        frame.truth.disparity = self.disparity.map(|path| DisparityFile {
            path,
            coding: DisparityCoding::Fixed16,
            masks: Vec::new(),
        });
        Ok(DatasetSource::new(vec![Scene {
            name,
            calibration_path: self.left,
            frames: vec![frame],
            calibration,
            monocular: false,
            stills: true,
            frame_rate_hz: super::scene::STILLS_RATE_HZ,
            notes: Vec::new(),
        }]))
    }
}
