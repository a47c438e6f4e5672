//! Photographs with masks of what is salient in them, as DUTS (Wang et al. 2017)
//! and its kin come: a folder of images and one of masks side by side
//! (`DUTS-TE-Image` and `DUTS-TE-Mask`, `Images` and `GT`, …), or both in one
//! folder (JPEG and PNG), with the same names but for the extension. The path is
//! the folder that holds them, or one above it.
//!
//! Fifty photographs, in the order of their names, make one scene: `0000-0049`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::folder::{files, folders, missing};
use super::scene::STILLS_RATE_HZ;
use super::{
    Calibration, DatasetError, FrameFiles, Layout, ObjectCoding, ObjectFile, Scene, TruthFiles,
};

/// Photographs in a scene.
const CHUNK: usize = 50;
/// What the names of folders of masks have in them.
const MASK_NAMES: [&str; 5] = ["mask", "gt", "truth", "annotation", "label"];

/// Photographs in scenes.
pub struct Saliency {
    names: Vec<String>,
    scenes: Vec<Vec<Photograph>>,
}

#[derive(Clone)]
struct Photograph {
    image: PathBuf,
    mask: Option<PathBuf>,
}

impl Saliency {
    /// The photographs and masks in `path`, or in the folders below it.
    pub fn find(path: &Path) -> Result<Self, DatasetError> {
        if !path.is_dir() {
            return Err(missing(path, "a folder of photographs and one of masks"));
        }
        let mut sets = vec![(String::new(), best_pair(path)?)];
        if sets[0].1.is_empty() {
            sets.clear();
            for name in folders(path)? {
                let pair = best_pair(&path.join(&name))?;
                sets.push((format!("{name}/"), pair));
            }
        }
        let (mut names, mut scenes) = (Vec::new(), Vec::new());
        for (prefix, photographs) in sets {
            for (index, chunk) in photographs.chunks(CHUNK).enumerate() {
                let first = index * CHUNK;
                names.push(format!("{prefix}{first:04}-{:04}", first + chunk.len() - 1));
                scenes.push(chunk.to_vec());
            }
        }
        if names.is_empty() {
            return Err(missing(
                &path.join("Mask"),
                "no folders of photographs and of masks (named mask, gt, truth, …) whose files \
                 have the same names",
            ));
        }
        Ok(Self { names, scenes })
    }
}

impl Layout for Saliency {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn scene(&self, index: usize) -> Result<Scene, DatasetError> {
        let photographs = &self.scenes[index];
        let without = photographs.iter().filter(|photograph| photograph.mask.is_none()).count();
        let notes = (without > 0).then(|| format!("{without} photographs have no mask"));
        let frames = photographs.iter().zip(0..).map(|(Photograph { image, mask }, number)| {
            let objects = mask.clone().map(|path| ObjectFile { path, coding: ObjectCoding::Mask });
            let truth = TruthFiles { objects, ..TruthFiles::default() };
            FrameFiles { left: image.clone(), right: None, truth, calibration: None, number }
        });
        Ok(Scene {
            name: self.names[index].clone(),
            frames: frames.collect(),
            calibration: Calibration::Unknown,
            calibration_path: photographs
                .first()
                .map(|first| first.image.clone())
                .unwrap_or_default(),
            monocular: true,
            stills: true,
            frame_rate_hz: STILLS_RATE_HZ,
            notes: notes.into_iter().collect(),
        })
    }
}

/// The photographs below `path` with their masks: of all pairs of folders the one
/// with the most names in common. Empty when nothing has.
fn best_pair(path: &Path) -> Result<Vec<Photograph>, DatasetError> {
    let (mut images, mut masks) = (Vec::new(), Vec::new());
    for name in folders(path)? {
        let pictures = pictures(&path.join(&name))?;
        let lower = name.to_lowercase();
        let is_mask = MASK_NAMES.iter().any(|part| lower.contains(part));
        let (jpegs, pngs): (Vec<_>, Vec<_>) =
            pictures.iter().cloned().partition(|(_, path)| is_jpeg(path));
        if !jpegs.is_empty() && !pngs.is_empty() {
            images.push(jpegs);
            masks.push(pngs);
        } else if is_mask {
            masks.push(pictures);
        } else {
            images.push(pictures);
        }
    }
    let (mut best, mut most) = (Vec::new(), 0);
    for masks in masks {
        let masks: BTreeMap<String, PathBuf> = masks.into_iter().collect();
        for images in &images {
            let photographs: Vec<Photograph> = images
                .iter()
                .map(|(stem, image)| Photograph {
                    image: image.clone(),
                    mask: masks.get(stem).cloned(),
                })
                .collect();
            let common = photographs.iter().filter(|photograph| photograph.mask.is_some()).count();
            if common > most {
                (best, most) = (photographs, common);
            }
        }
    }
    Ok(best)
}

/// The images of a folder by the stems of their names.
fn pictures(path: &Path) -> Result<Vec<(String, PathBuf)>, DatasetError> {
    let stem = |name: String| {
        let (stem, extension) = name.rsplit_once('.')?;
        let known = ["jpg", "jpeg", "png", "ppm", "pgm"];
        known
            .contains(&extension.to_lowercase().as_str())
            .then(|| (stem.to_owned(), path.join(&name)))
    };
    Ok(files(path)?.into_iter().filter_map(stem).collect())
}

fn is_jpeg(path: &Path) -> bool {
    path.extension().is_some_and(|extension| {
        extension.eq_ignore_ascii_case("jpg") || extension.eq_ignore_ascii_case("jpeg")
    })
}
