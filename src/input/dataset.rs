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
mod error;
mod file;
mod kind;
mod kitti;
mod pair;
mod scene;
mod source;
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

use kitti::Kitti;

/// A data set whose scenes are found.
trait Layout {
    /// Names of the scenes, in order.
    fn names(&self) -> &[String];

    /// The files of the scene with that index.
    ///
    /// # Errors
    /// When a file of the published layout is missing or a calibration unusable.
    fn scene(&self, index: usize) -> Result<Scene, DatasetError>;
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
/// mean `clean/alley_1`), numbers also without their leading zeros.
///
/// # Errors
/// When `path` is not laid out as published, when a scene that was asked for is
/// not there or lacks a file, or when no scene is whole. The text names the file.
pub fn open(kind: DatasetKind, path: &Path, scenes: &[String]) -> Result<Opened, DatasetError> {
    let layout: Box<dyn Layout> = match kind {
        DatasetKind::Kitti2012 => Box::new(Kitti::find_2012(path)?),
        DatasetKind::Kitti2015 => Box::new(Kitti::find_2015(path)?),
        _ => {
            return Err(DatasetError::Missing {
                path: path.to_owned(),
                needed: format!("{kind} cannot be read yet"),
            });
        }
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
    let mut opened = Opened::default();
    if wanted.is_empty() {
        for (index, name) in names.iter().enumerate() {
            match layout.scene(index) {
                Ok(scene) => opened.scenes.push(scene),
                Err(reason) => opened.skipped.push((name.clone(), reason)),
            }
        }
        if opened.scenes.is_empty() && !opened.skipped.is_empty() {
            return Err(opened.skipped.swap_remove(0).1);
        }
        return Ok(opened);
    }
    let mut taken = vec![false; names.len()];
    for wanted in wanted {
        for index in choice::matching(path, names, wanted)? {
            if !std::mem::replace(&mut taken[index], true) {
                opened.scenes.push(layout.scene(index)?);
            }
        }
    }
    Ok(opened)
}
