//! What can be wrong with a data set.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::error::CalibrationError;
use crate::image::Size;

/// What can be wrong with a data set.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// The system refuses.
    #[error("cannot read {path}: {source}")]
    Io {
        /// File or folder.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// The published layout has a file or folder that is not there.
    #[error("{path} is missing: {needed}")]
    Missing {
        /// File or folder.
        path: PathBuf,
        /// What it is for.
        needed: String,
    },
    /// No scene of that name.
    #[error("{path} has no scene '{scene}'; it has {available}")]
    NoScene {
        /// The folder of the data set.
        path: PathBuf,
        /// As asked for.
        scene: String,
        /// Names of those there are.
        available: String,
    },
    /// A split of a data set that has none.
    #[error("only DAVIS has splits: there is no '@{split}' here")]
    NoSplit {
        /// As asked for, without the `@`.
        split: String,
    },
    /// A calibration file that says something else than it should.
    #[error("calibration {path}: {fault}")]
    CalibrationFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// A calibration that makes no stereo pair.
    #[error("{path}: {source}")]
    Calibration {
        /// Calibration file or left image.
        path: PathBuf,
        /// What is wrong with it.
        source: CalibrationError,
    },
    /// A text file of a layout that says something else than it should.
    #[error("{path}: {fault}")]
    Text {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// A file that is not the image or map it should be.
    #[error("image {path}: {fault}")]
    Image {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// Images of one frame that differ in size.
    #[error("{path} is {found}, but the left image is {left}")]
    SizesDiffer {
        /// Right image or truth.
        path: PathBuf,
        /// Its size.
        found: Size,
        /// Size of the left image.
        left: Size,
    },
}
