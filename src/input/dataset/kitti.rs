//! KITTI Stereo and Flow 2012 (Geiger et al. 2012) and 2015 (Menze and Geiger
//! 2015) in their published layouts, below `training`, `testing` or the path itself.
//!
//! | | 2012 | 2015 |
//! |---|---|---|
//! | left, right | `image_0`, `image_1` (gray), `colored_0`, `colored_1` | `image_2`, `image_3` |
//! | calibration | `calib/NNNNNN.txt`: `P0:` … `P3:` | `calib_cam_to_cam/NNNNNN.txt`: `P_rect_02:`, `P_rect_03:` |
//! | disparity | `disp_noc`, `disp_occ` | `disp_noc_0`, `disp_occ_0` |
//! | motion | `flow_occ`, `flow_noc` | `flow_occ`, `flow_noc` |
//! | objects | | `obj_map` |
//!
//! A scene `NNNNNN` has the frames `NNNNNN_FF.png`; `_10` is the one with
//! truth, the multi-view extension has 21 of them at 10 Hz.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::folder::{files, missing, optional, present, text};
use super::{
    Calibration, DatasetError, DisparityCoding, DisparityFile, FlowCoding, FlowFile, FrameFiles,
    Layout, ObjectCoding, ObjectFile, Scene, TruthFiles,
};

/// Frame number that has truth.
const TRUTH_FRAME: u32 = 10;
const FRAME_RATE_HZ: f64 = 10.0;

/// Names of the folders of one year and camera pair.
struct Folders {
    left: &'static str,
    right: &'static str,
    calibration: &'static str,
    /// Projection matrices of left and right camera.
    matrices: [&'static str; 2],
    non_occluded: &'static str,
    all: &'static str,
}

const GRAY_2012: Folders = Folders {
    left: "image_0",
    right: "image_1",
    calibration: "calib",
    matrices: ["P0", "P1"],
    non_occluded: "disp_noc",
    all: "disp_occ",
};

const COLOR_2012: Folders =
    Folders { left: "colored_0", right: "colored_1", matrices: ["P2", "P3"], ..GRAY_2012 };

const COLOR_2015: Folders = Folders {
    left: "image_2",
    right: "image_3",
    calibration: "calib_cam_to_cam",
    matrices: ["P_rect_02", "P_rect_03"],
    non_occluded: "disp_noc_0",
    all: "disp_occ_0",
};

/// Scenes of one of the two.
pub struct Kitti {
    root: PathBuf,
    folders: &'static Folders,
    names: Vec<String>,
    /// Frame numbers of each scene.
    numbers: Vec<Vec<u32>>,
}

impl Kitti {
    /// The scenes of 2012, the gray images where they are there.
    pub fn find_2012(path: &Path) -> Result<Self, DatasetError> {
        match root(path, &GRAY_2012) {
            Ok(root) => Self::list(root, &GRAY_2012),
            // Without colour images the missing folder of the gray ones is
            // what should be named.
            Err(missing) => match root(path, &COLOR_2012) {
                Ok(root) => Self::list(root, &COLOR_2012),
                Err(_) => Err(missing),
            },
        }
    }

    /// The colour images of 2012.
    pub fn find_2012_in_color(path: &Path) -> Result<Self, DatasetError> {
        Self::list(root(path, &COLOR_2012)?, &COLOR_2012)
    }

    /// The scenes of 2015.
    pub fn find_2015(path: &Path) -> Result<Self, DatasetError> {
        Self::list(root(path, &COLOR_2015)?, &COLOR_2015)
    }

    /// Scenes with their frame numbers, from the names of the left images.
    fn list(root: PathBuf, folders: &'static Folders) -> Result<Self, DatasetError> {
        let folder = root.join(folders.left);
        let mut scenes: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        for name in files(&folder)? {
            let parts = name.strip_suffix(".png").and_then(|stem| stem.split_once('_'));
            let Some((scene, number)) = parts else { continue };
            if scene.bytes().all(|b| b.is_ascii_digit())
                && number.len() == 2
                && let Ok(number) = number.parse()
            {
                scenes.entry(scene.to_owned()).or_default().push(number);
            }
        }
        if scenes.is_empty() {
            let path = folder.join("NNNNNN_10.png");
            return Err(missing(&path, "the folder holds no image of KITTI's naming"));
        }
        for numbers in scenes.values_mut() {
            numbers.sort_unstable();
        }
        let (names, numbers) = scenes.into_iter().unzip();
        Ok(Self { root, folders, names, numbers })
    }

    /// The truth of a frame, as far as it is there.
    fn truth(&self, file: &str) -> TruthFiles {
        let present = |folder: &str| optional(self.root.join(folder).join(file));
        let disparity = |folder: &str| {
            let coding = DisparityCoding::Fixed16;
            present(folder).map(|path| DisparityFile { path, coding, masks: Vec::new() })
        };
        let all = disparity(self.folders.all);
        let flow = present("flow_occ").or_else(|| present("flow_noc"));
        TruthFiles {
            // What one cannot tell occluded pixels in is better than nothing.
            disparity: disparity(self.folders.non_occluded).or_else(|| all.clone()),
            disparity_with_occluded: all,
            objects: present("obj_map").map(|path| ObjectFile { path, coding: ObjectCoding::Ids }),
            flow: flow.map(|path| FlowFile {
                path,
                coding: FlowCoding::Fixed16,
                masks: Vec::new(),
            }),
        }
    }
}

impl Layout for Kitti {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn scene(&self, index: usize) -> Result<Scene, DatasetError> {
        let (name, root, folders) = (self.names[index].clone(), &self.root, self.folders);
        let calibration_path = root.join(folders.calibration).join(format!("{name}.txt"));
        present(&calibration_path, "the calibration of the scene in KITTI's published layout")?;
        let calibration = calibration(&calibration_path, folders.matrices)?;
        let frames: Result<Vec<FrameFiles>, DatasetError> = self.numbers[index]
            .iter()
            .map(|&number| {
                let file = format!("{name}_{number:02}.png");
                let right = root.join(folders.right).join(&file);
                present(&right, "the right image of the frame in KITTI's published layout")?;
                let mut frame =
                    FrameFiles::pair(root.join(folders.left).join(&file), right, number);
                if number == TRUTH_FRAME {
                    frame.truth = self.truth(&file);
                }
                Ok(frame)
            })
            .collect();
        Ok(Scene {
            name,
            frames: frames?,
            calibration,
            calibration_path,
            monocular: false,
            stills: false,
            frame_rate_hz: FRAME_RATE_HZ,
            notes: Vec::new(),
        })
    }
}

/// `training`, `testing`, or the path itself: whichever has the left images.
fn root(path: &Path, folders: &Folders) -> Result<PathBuf, DatasetError> {
    let candidates = [path.to_owned(), path.join("training"), path.join("testing")];
    candidates.into_iter().find(|root| root.join(folders.left).is_dir()).ok_or_else(|| {
        let path = path.join("training").join(folders.left);
        missing(&path, "the left images of KITTI's published layout")
    })
}

/// Focal length, principal points and baseline from two projection matrices:
/// lines `NAME: ` and twelve numbers, row by row.
fn calibration(path: &Path, names: [&str; 2]) -> Result<Calibration, DatasetError> {
    let text = text(path)?;
    let fault = |fault: String| DatasetError::CalibrationFile { path: path.to_owned(), fault };
    let matrix = |name: &str| -> Result<[f64; 12], DatasetError> {
        let line = text
            .lines()
            .find_map(|line| line.trim_start().strip_prefix(name)?.strip_prefix(':'))
            .ok_or_else(|| fault(format!("it has no line '{name}:'")))?;
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        let numbers = numbers.map_err(|e| fault(format!("{name}: {e}")))?;
        let count = numbers.len();
        numbers.try_into().map_err(|_| fault(format!("{name} has {count} numbers, not 12")))
    };
    let [left, right] = [matrix(names[0])?, matrix(names[1])?];
    // Both matrices refer to camera 0. What counts is the right camera seen
    // from the left one: f * (x_l - x_r) is the difference of the fourth column.
    let focal_px = left[0];
    if focal_px <= 0.0 || !left.iter().chain(&right).all(|v| v.is_finite()) {
        return Err(fault(format!("the focal length is {focal_px}")));
    }
    Ok(Calibration::Pinhole {
        focal_px,
        principal_point: Some((left[2], left[6])),
        right_offset_px: right[2] - left[2],
        baseline_m: (left[3] - right[3]) / focal_px,
    })
}
