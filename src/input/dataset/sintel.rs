//! MPI Sintel (Butler et al. 2012) in its published layouts, below `training`,
//! `test` or the path itself.
//!
//! | | stereo archive | flow archive |
//! |---|---|---|
//! | images | `PASS_left/SCENE/frame_NNNN.png`, `PASS_right` | `PASS/SCENE/frame_NNNN.png` |
//! | truth | `disparities`, `occlusions`, `outofframe` | `flow/SCENE/frame_NNNN.flo`, `invalid` |
//!
//! A pass is `clean` or `final`; a scene is called `PASS/SCENE`. Where a pass has
//! no stereo images, its scenes are monocular. Pixels that leave the right view
//! are left out of all disparity, as in the evaluation of the data set.
//!
//! The cameras are 10 cm apart (README of the stereo archive). Focal lengths
//! differ from scene to scene and are only in the depth archive
//! (`camdata_left/SCENE/frame_NNNN.cam`); without it they are unknown.

use std::path::{Path, PathBuf};

use super::file;
use super::folder::{first_folder, folders, missing, numbered, optional, present};
use super::{
    Calibration, DatasetError, DisparityCoding, DisparityFile, FlowCoding, FlowFile, FrameFiles,
    Layout, MaskCoding, MaskFile, Scene, TruthFiles,
};

/// Frame rate of the film.
const FRAME_RATE_HZ: f64 = 24.0;
const BASELINE_M: f64 = 0.1;
const PASSES: [&str; 2] = ["clean", "final"];

/// Scenes of Sintel.
pub struct Sintel {
    root: PathBuf,
    names: Vec<String>,
    scenes: Vec<Rendered>,
}

struct Rendered {
    scene: String,
    left: PathBuf,
    /// `None` in monocular scenes.
    right: Option<PathBuf>,
}

impl Sintel {
    /// The scenes of both passes.
    pub fn find(path: &Path) -> Result<Self, DatasetError> {
        let (mut root, mut names, mut scenes) = (path.to_owned(), Vec::new(), Vec::new());
        for candidate in [path.to_owned(), path.join("training"), path.join("test")] {
            for pass in PASSES {
                let stereo = candidate.join(format!("{pass}_left"));
                let Some(left) = first_folder(&[stereo.clone(), candidate.join(pass)]) else {
                    continue;
                };
                let right = (left == stereo).then(|| candidate.join(format!("{pass}_right")));
                for scene in folders(&left)? {
                    names.push(format!("{pass}/{scene}"));
                    let right = right.as_ref().map(|right| right.join(&scene));
                    scenes.push(Rendered { left: left.join(&scene), right, scene });
                }
            }
            if !names.is_empty() {
                root = candidate;
                break;
            }
        }
        if names.is_empty() {
            let path = path.join("training").join("clean_left");
            return Err(missing(&path, "the left images of Sintel's published layout (or clean)"));
        }
        Ok(Self { root, names, scenes })
    }

    fn truth(&self, scene: &str, image: &str, stereo: bool) -> TruthFiles {
        let file =
            |folder: &str, name: &str| optional(self.root.join(folder).join(scene).join(name));
        let hidden = |folder: &str| {
            file(folder, image).map(|path| MaskFile { path, coding: MaskCoding::Black })
        };
        let disparity = file("disparities", image).filter(|_| stereo).map(|path| DisparityFile {
            path,
            coding: DisparityCoding::Sintel,
            masks: hidden("outofframe").into_iter().collect(),
        });
        let visible = disparity.clone().map(|mut visible| {
            visible.masks.extend(hidden("occlusions"));
            visible
        });
        let flow = file("flow", &image.replace(".png", ".flo")).map(|path| FlowFile {
            path,
            coding: FlowCoding::Flo,
            masks: hidden("invalid").into_iter().collect(),
        });
        TruthFiles { disparity: visible, disparity_with_occluded: disparity, objects: None, flow }
    }
}

impl Layout for Sintel {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn scene(&self, index: usize) -> Result<Scene, DatasetError> {
        let Rendered { scene, left, right } = &self.scenes[index];
        let cameras = self.root.join("camdata_left").join(scene);
        let mut notes = Vec::new();
        if right.is_some() && !cameras.is_dir() {
            notes.push("no camdata_left: the focal length is not known".to_owned());
        }
        let frames: Result<Vec<FrameFiles>, DatasetError> = numbered(left, "frame_", ".png")?
            .into_iter()
            .map(|(number, image)| {
                let right = right.as_ref().map(|right| right.join(&image));
                if let Some(right) = &right {
                    present(right, "the right image of the frame in Sintel's published layout")?;
                }
                let camera = optional(cameras.join(image.replace(".png", ".cam")));
                Ok(FrameFiles {
                    left: left.join(&image),
                    truth: self.truth(scene, &image, right.is_some()),
                    right,
                    calibration: camera.map(|path| camera_file(&path)).transpose()?,
                    number,
                })
            })
            .collect();
        Ok(Scene {
            name: self.names[index].clone(),
            frames: frames?,
            calibration: Calibration::Unknown,
            calibration_path: cameras,
            monocular: right.is_none(),
            stills: false,
            frame_rate_hz: FRAME_RATE_HZ,
            notes,
        })
    }
}

/// The matrix of a `.cam` file: magic as in `.flo`, then nine doubles row by row.
fn camera_file(path: &Path) -> Result<Calibration, DatasetError> {
    let fault = |fault: &str| DatasetError::CalibrationFile {
        path: path.to_owned(),
        fault: fault.to_owned(),
    };
    let bytes = file::bytes(path)?;
    let Some((b"PIEH", payload)) = bytes.split_at_checked(4) else {
        return Err(fault("it does not start as a .cam file"));
    };
    let (words, _) = payload.as_chunks::<8>();
    let matrix: Vec<f64> = words.iter().take(9).map(|word| f64::from_le_bytes(*word)).collect();
    let &[focal_px, _, cx, _, _, cy, _, _, _] = &matrix[..] else {
        return Err(fault("its matrix is cut off"));
    };
    Ok(Calibration::Pinhole {
        focal_px,
        principal_point: Some((cx, cy)),
        right_offset_px: 0.0,
        baseline_m: BASELINE_M,
    })
}
