//! Spring (Mehl et al. 2023) in its published layout, below `train`, `test` or the
//! path itself: `SCENE/frame_left/frame_left_NNNN.png`, `frame_right`,
//! `disp1_left/*.dsp5`, `flow_FW_left/*.flo5`, `cam_data/intrinsics.txt`, `maps`.
//!
//! Truth has twice the resolution of the images and pixels of the images as its
//! unit: every second sample is taken. The cameras are 0.065 m apart
//! (`spring_utils` of its authors). Pixels without partner are those that
//! `maps/matchmap_disp1_left` marks in red or green.

use std::path::{Path, PathBuf};

use super::folder::{folders, missing, numbered, optional, present, text};
use super::{
    Calibration, DatasetError, DisparityCoding, DisparityFile, FlowCoding, FlowFile, FrameFiles,
    Layout, MaskCoding, MaskFile, Scene, TruthFiles,
};

/// Frame rate of the film.
const FRAME_RATE_HZ: f64 = 24.0;
const BASELINE_M: f64 = 0.065;

/// Scenes of Spring.
pub struct Spring {
    root: PathBuf,
    names: Vec<String>,
}

impl Spring {
    /// The scenes: folders with a folder of left images.
    pub fn find(path: &Path) -> Result<Self, DatasetError> {
        for root in [path.to_owned(), path.join("train"), path.join("test")] {
            if !root.is_dir() {
                continue;
            }
            let mut names = folders(&root)?;
            names.retain(|name| root.join(name).join("frame_left").is_dir());
            if !names.is_empty() {
                return Ok(Self { root, names });
            }
        }
        let path = path.join("train").join("0001").join("frame_left");
        Err(missing(&path, "the left images of Spring's published layout"))
    }
}

impl Layout for Spring {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn scene(&self, index: usize) -> Result<Scene, DatasetError> {
        let name = self.names[index].clone();
        let root = self.root.join(&name);
        let (left, right) = (root.join("frame_left"), root.join("frame_right"));
        // The right images are an archive of their own; flow needs none.
        let monocular = !right.is_dir();
        let calibration_path = root.join("cam_data").join("intrinsics.txt");
        let (mut notes, mut cameras) = (Vec::new(), None);
        if calibration_path.is_file() {
            cameras = Some(intrinsics(&calibration_path)?);
        } else if !monocular {
            notes.push("no cam_data/intrinsics.txt: the focal length is not known".to_owned());
        }
        let frames: Result<Vec<FrameFiles>, DatasetError> = numbered(&left, "frame_left_", ".png")?
            .into_iter()
            .map(|(number, image)| {
                let right = right.join(format!("frame_right_{number:04}.png"));
                if !monocular {
                    present(&right, "the right image of the frame in Spring's layout")?;
                }
                let calibration = match &cameras {
                    None => None,
                    Some(cameras) => Some(camera(cameras, number, &calibration_path)?),
                };
                Ok(FrameFiles {
                    left: left.join(image),
                    right: (!monocular).then_some(right),
                    truth: truth(&root, number, monocular),
                    calibration,
                    number,
                })
            })
            .collect();
        Ok(Scene {
            name,
            frames: frames?,
            calibration: Calibration::Unknown,
            calibration_path,
            monocular,
            stills: false,
            frame_rate_hz: FRAME_RATE_HZ,
            notes,
        })
    }
}

fn truth(root: &Path, number: u32, monocular: bool) -> TruthFiles {
    let file = |folder: &str, extension: &str| {
        let kind = folder.rsplit('/').next().unwrap_or(folder);
        optional(root.join(folder).join(format!("{kind}_{number:04}.{extension}")))
    };
    let disparity = file("disp1_left", "dsp5").filter(|_| !monocular).map(|path| DisparityFile {
        path,
        coding: DisparityCoding::Spring,
        masks: Vec::new(),
    });
    let unmatched = file("maps/matchmap_disp1_left", "png");
    let known_to_match = disparity.clone().zip(unmatched).map(|(mut disparity, path)| {
        disparity.masks.push(MaskFile { path, coding: MaskCoding::Black });
        disparity
    });
    let flow = file("flow_FW_left", "flo5").map(|path| FlowFile {
        path,
        coding: FlowCoding::Spring,
        masks: Vec::new(),
    });
    let (disparity, disparity_with_occluded) = match known_to_match {
        Some(matched) => (Some(matched), disparity),
        None => (disparity, None),
    };
    TruthFiles { disparity, disparity_with_occluded, objects: None, flow }
}

/// `fx fy cx cy`, a line for each frame from number 1 on.
fn intrinsics(path: &Path) -> Result<Vec<Vec<f64>>, DatasetError> {
    let line = |line: &str| line.split_whitespace().map(str::parse).collect();
    let lines: Result<Vec<Vec<f64>>, std::num::ParseFloatError> =
        text(path)?.lines().filter(|line| !line.trim().is_empty()).map(line).collect();
    lines.map_err(|e| DatasetError::CalibrationFile { path: path.to_owned(), fault: e.to_string() })
}

fn camera(cameras: &[Vec<f64>], number: u32, path: &Path) -> Result<Calibration, DatasetError> {
    let line = (number as usize).checked_sub(1).and_then(|line| cameras.get(line));
    let Some(&[focal_px, _, cx, cy]) = line.map(Vec::as_slice) else {
        return Err(DatasetError::CalibrationFile {
            path: path.to_owned(),
            fault: format!("it has no four numbers for frame {number}"),
        });
    };
    Ok(Calibration::Pinhole {
        focal_px,
        principal_point: Some((cx, cy)),
        right_offset_px: 0.0,
        baseline_m: BASELINE_M,
    })
}
