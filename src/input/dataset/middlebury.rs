//! Middlebury Stereo (Scharstein and Szeliski 2002 to Scharstein et al. 2014, and
//! 2021). The path is a scene, a folder of scenes or some levels above them; a
//! scene is called by its path below the one given.
//!
//! | files of a scene | years | disparity | calibration |
//! |---|---|---|---|
//! | `im0`, `im1`, `calib.txt`, `disp0GT.pfm` or `disp0.pfm`, `mask0nocc.png` | 2014, 2021, version 3 of the evaluation | PFM | `calib.txt` |
//! | `view1`, `view5`, `disp1` | 2005, 2006 | 8 bits, value / 1, 2, 3 at full, half, third size, 0 unknown | f = 3740 px at full size, B = 160 mm |
//! | `imL`, `imR`, `groundtruth`, `nonocc`, `info.txt` | version 2 of the evaluation | 8 bits, scale in `info.txt` | none |
//! | `im2`, `im6`, `disp2` | 2001, 2003 | 8 bits, scale by size | none |
//! | `…L`, `…R`, `…GT` | scenes of 2006 under other names | as 2006 | as 2006 |

mod calibration;
mod levels;

use std::path::{Path, PathBuf};

use super::folder::{files, folders, missing, optional, present};
use super::scene::STILLS_RATE_HZ;
use super::{
    Calibration, DatasetError, DisparityCoding, DisparityFile, FrameFiles, Layout, MaskCoding,
    MaskFile, Scene, TruthFiles,
};

/// Levels of folders that are looked through below the path.
const DEPTH: usize = 4;
const EXTENSIONS: [&str; 5] = ["png", "ppm", "pgm", "jpg", "jpeg"];

/// Scenes of Middlebury.
pub struct Middlebury {
    names: Vec<String>,
    found: Vec<Found>,
}

/// A folder that holds a pair.
struct Found {
    folder: PathBuf,
    left: PathBuf,
    right: PathBuf,
    form: Form,
}

enum Form {
    /// 2014 and later.
    Float,
    /// 2005 and 2006, with the file of the disparity.
    Structured(Option<PathBuf>),
    /// Up to 2003, with the file of the disparity.
    Early(Option<PathBuf>),
}

impl Middlebury {
    /// The scenes in `path` and below.
    pub fn find(path: &Path) -> Result<Self, DatasetError> {
        let (mut names, mut found) = (Vec::new(), Vec::new());
        if let Some(scene) = probe(path)? {
            let name = path
                .canonicalize()
                .ok()
                .and_then(|path| path.file_name().map(|name| name.to_string_lossy().into_owned()));
            names.push(name.unwrap_or_else(|| path.display().to_string()));
            found.push(scene);
        } else {
            look_through(path, "", DEPTH, &mut names, &mut found)?;
        }
        if names.is_empty() {
            return Err(missing(
                &path.join("im0.png"),
                "neither here nor below is a pair of a Middlebury layout (im0 and im1, view1 and \
                 view5, imL and imR, im2 and im6)",
            ));
        }
        Ok(Self { names, found })
    }
}

impl Layout for Middlebury {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn scene(&self, index: usize) -> Result<Scene, DatasetError> {
        let Found { folder, left, right, form } = &self.found[index];
        let mut frame = FrameFiles::pair(left.clone(), right.clone(), 0);
        let mut notes = Vec::new();
        let (mut calibration, mut calibration_path) = (Calibration::Unknown, left.clone());
        match form {
            Form::Float => {
                calibration_path = folder.join("calib.txt");
                present(&calibration_path, "the calibration in Middlebury's layout of 2014")?;
                calibration = calibration::read(&calibration_path)?;
                let path = optional(folder.join("disp0GT.pfm"))
                    .or_else(|| optional(folder.join("disp0.pfm")));
                frame.truth = truth(path, DisparityCoding::Pfm, folder.join("mask0nocc.png"));
            }
            Form::Structured(path) => {
                let (factor, note) = levels::of_structured_light(left)?;
                calibration = Calibration::Pinhole {
                    focal_px: 3740.0 / f64::from(factor),
                    principal_point: None,
                    right_offset_px: 0.0,
                    baseline_m: 0.16,
                };
                notes.push(note);
                notes.push("the views are cropped (dmin.txt): distances are not to scale".into());
                let coding = DisparityCoding::Fixed8 { levels_per_px: factor as f32 };
                frame.truth = truth(path.clone(), coding, folder.join("mask0nocc.png"));
            }
            Form::Early(path) => {
                let (levels_per_px, note) = levels::of_early(folder, left)?;
                notes.push(note);
                let coding = DisparityCoding::Fixed8 { levels_per_px };
                frame.truth = truth(path.clone(), coding, folder.join("nonocc.png"));
            }
        }
        if frame.truth == TruthFiles::default() {
            notes.push("no true disparity".to_owned());
        }
        Ok(Scene {
            name: self.names[index].clone(),
            frames: vec![frame],
            calibration,
            calibration_path,
            monocular: false,
            stills: true,
            frame_rate_hz: STILLS_RATE_HZ,
            notes,
        })
    }
}

/// The true disparity: of what both cameras see where there is a mask that tells.
fn truth(path: Option<PathBuf>, coding: DisparityCoding, mask: PathBuf) -> TruthFiles {
    let all = path.map(|path| DisparityFile { path, coding, masks: Vec::new() });
    let mask = optional(mask).map(|path| MaskFile { path, coding: MaskCoding::White });
    let visible = all.clone().zip(mask).map(|(mut visible, mask)| {
        visible.masks.push(mask);
        visible
    });
    match visible {
        Some(visible) => TruthFiles {
            disparity: Some(visible),
            disparity_with_occluded: all,
            ..TruthFiles::default()
        },
        None => TruthFiles { disparity: all, ..TruthFiles::default() },
    }
}

fn look_through(
    path: &Path,
    prefix: &str,
    levels: usize,
    names: &mut Vec<String>,
    found: &mut Vec<Found>,
) -> Result<(), DatasetError> {
    for name in folders(path)? {
        let (path, full) = (path.join(&name), format!("{prefix}{name}"));
        if let Some(scene) = probe(&path)? {
            names.push(full);
            found.push(scene);
        } else if levels > 1 {
            look_through(&path, &format!("{full}/"), levels - 1, names, found)?;
        }
    }
    Ok(())
}

/// The pair in a folder, if it is one of the layouts.
fn probe(folder: &Path) -> Result<Option<Found>, DatasetError> {
    let image = |stem: &str| {
        let file = |extension| optional(folder.join(format!("{stem}.{extension}")));
        EXTENSIONS.into_iter().find_map(file)
    };
    let pair = |left: &str, right: &str| image(left).zip(image(right));
    let (pair, form) = if let Some(pair) = pair("im0", "im1") {
        (pair, Form::Float)
    } else if let Some(pair) = pair("view1", "view5") {
        (pair, Form::Structured(image("disp1")))
    } else if let Some(pair) = pair("imL", "imR").or_else(|| pair("im2", "im6")) {
        (pair, Form::Early(image("groundtruth").or_else(|| image("disp2"))))
    } else {
        let Some([left, right, truth]) = renamed(folder)? else { return Ok(None) };
        ((left, right), Form::Structured(Some(truth)))
    };
    let (left, right) = pair;
    Ok(Some(Found { folder: folder.to_owned(), left, right, form }))
}

/// `aloeL.jpg`, `aloeR.jpg`, `aloeGT.png`: left, right and truth of one name.
fn renamed(folder: &Path) -> Result<Option<[PathBuf; 3]>, DatasetError> {
    let files = files(folder)?;
    let with_stem = |stem: &str| {
        let named = |name: &&String| {
            name.rsplit_once('.')
                .is_some_and(|(found, extension)| found == stem && EXTENSIONS.contains(&extension))
        };
        files.iter().find(named).map(|name| folder.join(name))
    };
    let stems = files.iter().filter_map(|name| name.rsplit_once('.')?.0.strip_suffix("GT"));
    Ok(stems.into_iter().find_map(|stem| {
        let left = with_stem(&format!("{stem}L"))?;
        let right = with_stem(&format!("{stem}R"))?;
        Some([left, right, with_stem(&format!("{stem}GT"))?])
    }))
}
