//! KITTI Stereo 2012 (Geiger et al. 2012) and 2015 (Menze and Geiger 2015) in
//! their published layouts.
//!
//! | | 2012 | 2015 |
//! |---|---|---|
//! | left, right | `image_0`, `image_1` (gray), `colored_0`, `colored_1` | `image_2`, `image_3` |
//! | calibration | `calib/NNNNNN.txt`: `P0:` … `P3:` | `calib_cam_to_cam/NNNNNN.txt`: `P_rect_02:`, `P_rect_03:` |
//! | truth | `disp_noc`, `disp_occ` | `disp_noc_0`, `disp_occ_0` |
//!
//! A scene `NNNNNN` has the frames `NNNNNN_FF.png`; `_10` is the one with
//! truth, the multi-view extension has 21 of them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::{Calibration, DatasetError, DatasetSource, FrameFiles, Scene};

/// Frame number that has truth.
const TRUTH_FRAME: u32 = 10;

/// Which of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KittiYear {
    /// Static scenes.
    Y2012,
    /// Dynamic scenes, in colour.
    Y2015,
}

/// Which pixels have truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KittiTruth {
    /// Those that both cameras see (`disp_noc`).
    #[default]
    NonOccluded,
    /// All that the laser measured (`disp_occ`).
    All,
}

/// What to read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kitti {
    /// Folder that holds `training` (or `testing`), or that one itself.
    pub path: PathBuf,
    /// Which of the two data sets.
    pub year: KittiYear,
    /// The one scene to read, as `000027` or `27`; `None`: all.
    pub scene: Option<String>,
    /// Colour images of 2012 instead of the gray ones.
    pub color: bool,
    /// Which truth to take when both are there.
    pub truth: KittiTruth,
}

/// Names of the folders of one year and camera pair.
struct Layout {
    left: &'static str,
    right: &'static str,
    calibration: &'static str,
    /// Projection matrices of left and right camera.
    matrices: [&'static str; 2],
    truth: [&'static str; 2],
}

const GRAY_2012: Layout = Layout {
    left: "image_0",
    right: "image_1",
    calibration: "calib",
    matrices: ["P0", "P1"],
    truth: ["disp_noc", "disp_occ"],
};

const COLOR_2012: Layout = Layout {
    left: "colored_0",
    right: "colored_1",
    calibration: "calib",
    matrices: ["P2", "P3"],
    truth: ["disp_noc", "disp_occ"],
};

const COLOR_2015: Layout = Layout {
    left: "image_2",
    right: "image_3",
    calibration: "calib_cam_to_cam",
    matrices: ["P_rect_02", "P_rect_03"],
    truth: ["disp_noc_0", "disp_occ_0"],
};

impl Kitti {
    /// All scenes of a data set, gray images, non-occluded truth.
    pub fn new(path: &Path, year: KittiYear) -> Self {
        let path = path.to_owned();
        Self { path, year, scene: None, color: false, truth: KittiTruth::default() }
    }

    /// Checks that all files are there and reads the calibrations.
    ///
    /// # Errors
    /// When a file of the published layout is missing or a calibration unusable;
    /// the text names the file.
    pub fn open(&self) -> Result<DatasetSource, DatasetError> {
        let root = self.root()?;
        let layout = self.layout(&root);
        let scenes = self.wanted(list(&root.join(layout.left))?, &root.join(layout.left))?;
        let scenes: Result<Vec<Scene>, DatasetError> = scenes
            .into_iter()
            .map(|(name, frames)| self.scene(&root, layout, name, frames))
            .collect();
        Ok(DatasetSource::new(scenes?))
    }

    /// `training`, `testing`, or the path itself.
    fn root(&self) -> Result<PathBuf, DatasetError> {
        let candidates = [self.path.clone(), self.path.join("training"), self.path.join("testing")];
        let has_images = |root: &&PathBuf| {
            [GRAY_2012.left, COLOR_2012.left, COLOR_2015.left]
                .iter()
                .any(|folder| root.join(folder).is_dir())
        };
        match candidates.iter().find(has_images) {
            Some(root) => Ok(root.clone()),
            None => Err(DatasetError::Missing {
                path: self.path.join("training").join(self.layout(&self.path).left),
                needed: "the left images of KITTI's published layout".to_owned(),
            }),
        }
    }

    fn layout(&self, root: &Path) -> &'static Layout {
        match self.year {
            KittiYear::Y2015 => &COLOR_2015,
            KittiYear::Y2012 if self.color || !root.join(GRAY_2012.left).is_dir() => {
                // Without colour images the missing folder of the gray ones is
                // what should be named.
                let color = self.color || root.join(COLOR_2012.left).is_dir();
                if color { &COLOR_2012 } else { &GRAY_2012 }
            }
            KittiYear::Y2012 => &GRAY_2012,
        }
    }

    fn wanted(
        &self,
        mut scenes: BTreeMap<String, Vec<u32>>,
        folder: &Path,
    ) -> Result<BTreeMap<String, Vec<u32>>, DatasetError> {
        let Some(wanted) = &self.scene else { return Ok(scenes) };
        let bare = |name: &str| name.trim_start_matches('0').to_owned();
        let found = scenes.keys().find(|name| bare(name) == bare(wanted)).cloned();
        match found.and_then(|name| scenes.remove_entry(&name)) {
            Some(scene) => Ok([scene].into()),
            None => Err(DatasetError::NoScene {
                path: folder.to_owned(),
                scene: wanted.clone(),
                available: some_of(scenes.keys()),
            }),
        }
    }

    fn scene(
        &self,
        root: &Path,
        layout: &Layout,
        name: String,
        numbers: Vec<u32>,
    ) -> Result<Scene, DatasetError> {
        let calibration_path = root.join(layout.calibration).join(format!("{name}.txt"));
        present(&calibration_path, "the calibration of the scene")?;
        let calibration = calibration(&calibration_path, layout.matrices)?;
        let truth_folder = match self.truth {
            KittiTruth::NonOccluded => layout.truth,
            KittiTruth::All => [layout.truth[1], layout.truth[0]],
        };
        let frames: Result<Vec<FrameFiles>, DatasetError> = numbers
            .into_iter()
            .map(|number| {
                let file = format!("{name}_{number:02}.png");
                let right = root.join(layout.right).join(&file);
                present(&right, "the right image of the frame")?;
                let truth = truth_folder.map(|folder| root.join(folder).join(&file));
                let disparity = (number == TRUTH_FRAME)
                    .then(|| truth.into_iter().find(|path| path.is_file()))
                    .flatten();
                Ok(FrameFiles {
                    left: root.join(layout.left).join(&file),
                    right,
                    disparity,
                    number,
                })
            })
            .collect();
        Ok(Scene { name, frames: frames?, calibration, calibration_path })
    }
}

fn present(path: &Path, needed: &str) -> Result<(), DatasetError> {
    if path.is_file() {
        return Ok(());
    }
    let needed = format!("{needed} in KITTI's published layout");
    Err(DatasetError::Missing { path: path.to_owned(), needed })
}

/// Scenes with their frame numbers, from the names of the left images.
fn list(folder: &Path) -> Result<BTreeMap<String, Vec<u32>>, DatasetError> {
    let io = |source| DatasetError::Io { path: folder.to_owned(), source };
    if !folder.is_dir() {
        return Err(DatasetError::Missing {
            path: folder.to_owned(),
            needed: "the left images of KITTI's published layout".to_owned(),
        });
    }
    let mut scenes: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    for entry in fs::read_dir(folder).map_err(io)? {
        let name = entry.map_err(io)?.file_name();
        let name = name.to_string_lossy();
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
        return Err(DatasetError::Missing {
            path: folder.join("NNNNNN_10.png"),
            needed: "the folder holds no image of KITTI's naming".to_owned(),
        });
    }
    for numbers in scenes.values_mut() {
        numbers.sort_unstable();
    }
    Ok(scenes)
}

fn some_of<'a>(names: impl ExactSizeIterator<Item = &'a String>) -> String {
    const MOST: usize = 20;
    let more = names.len().saturating_sub(MOST);
    let text = names.take(MOST).map(String::as_str).collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{text} and {more} more") } else { text }
}

/// Focal length, principal points and baseline from two projection matrices:
/// lines `NAME: ` and twelve numbers, row by row.
fn calibration(path: &Path, names: [&str; 2]) -> Result<Calibration, DatasetError> {
    let text = fs::read_to_string(path)
        .map_err(|source| DatasetError::Io { path: path.to_owned(), source })?;
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
