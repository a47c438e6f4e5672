//! Frames from image files: a single pair, or scenes of a published data set.
//!
//! Which files belong together is found, and that they are all there is
//! checked, before the first frame; images are decoded one frame at a time.
//!
//! Stamps follow from the frame rate of the data set: frame number `n` of a
//! scene has the stamp `start + n / rate`, where the first scene starts at one
//! second and every other one a whole number of hours later, so that stamps
//! increase over all scenes. Whoever takes several scenes from one source starts
//! anew whenever [`DatasetSource::scene`] changes.

mod choice;
mod davis;
mod error;
mod file;
mod folder;
mod kind;
mod kitti;
mod middlebury;
mod pair;
mod saliency;
mod scene;
mod sintel;
mod source;
mod spring;
mod truth;

use std::path::Path;

pub use error::DatasetError;
pub use kind::DatasetKind;
pub use pair::PairFiles;
pub use scene::{Calibration, FrameFiles, Scene};
pub use source::DatasetSource;
pub use truth::{
    DisparityCoding, DisparityFile, FlowCoding, FlowFile, MaskCoding, MaskFile, ObjectCoding,
    ObjectFile, TruthFiles,
};

use davis::Davis;
use kitti::Kitti;
use middlebury::Middlebury;
use saliency::Saliency;
use sintel::Sintel;
use spring::Spring;

/// A data set whose scenes are found.
trait Layout {
    /// Names of the scenes, in order.
    fn names(&self) -> &[String];

    /// The files of the scene with that index.
    ///
    /// # Errors
    /// When a file of the published layout is missing or a calibration unusable.
    fn scene(&self, index: usize) -> Result<Scene, DatasetError>;

    /// Names of the scenes of a split that the data set is published with.
    ///
    /// # Errors
    /// When there is no such split.
    fn split(&self, split: &str) -> Result<Vec<String>, DatasetError> {
        Err(DatasetError::NoSplit { split: split.to_owned() })
    }
}

/// The scenes of a data set.
#[derive(Debug, Default)]
pub struct Opened {
    /// Those that are whole, in order.
    pub scenes: Vec<Scene>,
    /// Those that are not, by name, and why.
    pub skipped: Vec<(String, DatasetError)>,
}

/// Finds the scenes of the data set below `path` and checks that their files
/// are there. `scenes` names those wanted, all when it is empty: by their whole
/// name, or by some of its leading or trailing parts (`clean` and `alley_1` both
/// mean `clean/alley_1`), numbers also without their leading zeros. `@val` means
/// all scenes of a split of DAVIS.
///
/// # Errors
/// When `path` is not laid out as published, when a scene that was asked for is
/// not there or lacks a file, or when no scene is whole. The text names the file.
pub fn open(kind: DatasetKind, path: &Path, scenes: &[String]) -> Result<Opened, DatasetError> {
    let layout: Box<dyn Layout> = match kind {
        DatasetKind::Kitti2012 => Box::new(Kitti::find_2012(path)?),
        DatasetKind::Kitti2015 => Box::new(Kitti::find_2015(path)?),
        DatasetKind::Middlebury => Box::new(Middlebury::find(path)?),
        DatasetKind::Sintel => Box::new(Sintel::find(path)?),
        DatasetKind::Spring => Box::new(Spring::find(path)?),
        DatasetKind::Davis => Box::new(Davis::find(path)?),
        DatasetKind::Saliency => Box::new(Saliency::find(path)?),
    };
    choose(layout.as_ref(), path, scenes)
}

/// The same for the colour images of KITTI 2012, which has gray ones beside them.
///
/// # Errors
/// As [`open`].
pub fn open_kitti2012_in_color(path: &Path, scenes: &[String]) -> Result<Opened, DatasetError> {
    choose(&Kitti::find_2012_in_color(path)?, path, scenes)
}

fn choose(layout: &dyn Layout, path: &Path, wanted: &[String]) -> Result<Opened, DatasetError> {
    let names = layout.names();
    // What was asked for by name has to be there, what comes with a split or with
    // everything may be left out.
    let mut chosen: Vec<(Result<usize, String>, bool)> = Vec::new();
    for wanted in wanted {
        if let Some(split) = wanted.strip_prefix('@') {
            for name in layout.split(split)? {
                let index = names.iter().position(|n| *n == name).ok_or(name);
                chosen.push((index, false));
            }
        } else {
            let found = choice::matching(path, names, wanted)?;
            chosen.extend(found.into_iter().map(|index| (Ok(index), true)));
        }
    }
    if wanted.is_empty() {
        chosen.extend((0..names.len()).map(|index| (Ok(index), false)));
    }
    let mut opened = Opened::default();
    let mut taken = vec![false; names.len()];
    for (index, by_name) in chosen {
        let (name, scene) = match index {
            Ok(index) if std::mem::replace(&mut taken[index], true) => continue,
            Ok(index) => (names[index].clone(), layout.scene(index)),
            Err(name) => {
                let needed = "a scene of the split".to_owned();
                let path = path.join(&name);
                (name, Err(DatasetError::Missing { path, needed }))
            }
        };
        match scene {
            Ok(scene) => opened.scenes.push(scene),
            Err(reason) if by_name => return Err(reason),
            Err(reason) => opened.skipped.push((name, reason)),
        }
    }
    if opened.scenes.is_empty() && !opened.skipped.is_empty() {
        return Err(opened.skipped.swap_remove(0).1);
    }
    Ok(opened)
}
