//! DAVIS 2016 (Perazzi et al. 2016) and 2017 (Pont-Tuset et al. 2017) in their
//! published layout: `JPEGImages/480p/SEQUENCE/NNNNN.jpg` and
//! `Annotations/480p/SEQUENCE/NNNNN.png`. Other resolutions are taken where
//! there is no 480p.
//!
//! `@val` means the sequences of a split: `ImageSets/2016/val.txt`,
//! `ImageSets/2017/val.txt` (names of sequences) or `ImageSets/480p/val.txt`
//! (pairs of files), `@2017/val` that of one year when several have it.

use std::path::{Path, PathBuf};

use super::folder::{folders, missing, numbered, optional, text};
use super::{
    Calibration, DatasetError, FrameFiles, Layout, ObjectCoding, ObjectFile, Scene, TruthFiles,
};

/// Frame rate of the videos.
const FRAME_RATE_HZ: f64 = 24.0;

/// Sequences of DAVIS.
pub struct Davis {
    root: PathBuf,
    resolution: String,
    names: Vec<String>,
}

impl Davis {
    /// The sequences that have images.
    pub fn find(path: &Path) -> Result<Self, DatasetError> {
        let images = path.join("JPEGImages");
        if !images.is_dir() {
            return Err(missing(&images, "the images of DAVIS's published layout"));
        }
        let resolutions = folders(&images)?;
        let preferred = resolutions.iter().find(|name| *name == "480p").or(resolutions.first());
        let Some(resolution) = preferred.cloned() else {
            return Err(missing(&images.join("480p"), "the images of DAVIS's published layout"));
        };
        let annotations = path.join("Annotations").join(&resolution);
        if !annotations.is_dir() {
            return Err(missing(&annotations, "the masks of DAVIS's published layout"));
        }
        let names = folders(&images.join(&resolution))?;
        if names.is_empty() {
            return Err(missing(
                &images.join(&resolution).join("SEQUENCE"),
                "there is no sequence",
            ));
        }
        Ok(Self { root: path.to_owned(), resolution, names })
    }
}

impl Layout for Davis {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn scene(&self, index: usize) -> Result<Scene, DatasetError> {
        let name = self.names[index].clone();
        let images = self.root.join("JPEGImages").join(&self.resolution).join(&name);
        let masks = self.root.join("Annotations").join(&self.resolution).join(&name);
        let frames: Vec<FrameFiles> = numbered(&images, "", ".jpg")?
            .into_iter()
            .map(|(number, image)| {
                let objects = optional(masks.join(image.replace(".jpg", ".png")))
                    .map(|path| ObjectFile { path, coding: ObjectCoding::Indexed });
                let truth = TruthFiles { objects, ..TruthFiles::default() };
                let left = images.join(image);
                FrameFiles { left, right: None, truth, calibration: None, number }
            })
            .collect();
        if frames.iter().all(|frame| frame.truth.objects.is_none()) {
            return Err(missing(&masks.join("00000.png"), "no frame of the sequence has a mask"));
        }
        Ok(Scene {
            name,
            frames,
            calibration: Calibration::Unknown,
            calibration_path: images,
            monocular: true,
            stills: false,
            frame_rate_hz: FRAME_RATE_HZ,
            notes: Vec::new(),
        })
    }

    fn split(&self, split: &str) -> Result<Vec<String>, DatasetError> {
        let sets = self.root.join("ImageSets");
        let found: Vec<PathBuf> = match split.split_once('/') {
            Some((year, split)) => optional(sets.join(year).join(format!("{split}.txt"))),
            None => None,
        }
        .into_iter()
        .chain(["2016", "2017", "480p"].into_iter().filter_map(|year| {
            optional(sets.join(year).join(format!("{split}.txt"))).filter(|_| !split.contains('/'))
        }))
        .collect();
        match &found[..] {
            [] => {
                let path = sets.join("2017").join(format!("{split}.txt"));
                Err(missing(&path, &format!("the split '@{split}'")))
            }
            [path] => Ok(sequences(&text(path)?)),
            [first, ..] => Err(DatasetError::Text {
                path: first.clone(),
                fault: format!(
                    "'@{split}' is in several years: say @2016/{split} or @2017/{split}"
                ),
            }),
        }
    }
}

/// Names of the sequences of a split: a name on each line, or the paths of an
/// image and its mask.
fn sequences(text: &str) -> Vec<String> {
    let mut names: Vec<String> = text
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .filter_map(|word| match word.rsplit_once('/') {
            Some((folder, _)) => folder.rsplit('/').next(),
            None => Some(word),
        })
        .map(str::to_owned)
        .collect();
    names.dedup();
    names
}
