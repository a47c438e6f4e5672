//! What can be wrong with parameters and calibrations. Each door has an error
//! type of its own beside its code.

use thiserror::Error;

use crate::config::FIELDS;
use crate::image::Size;

/// A parameter that cannot be taken.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ConfigError {
    /// No parameter has this name.
    #[error("there is no parameter '{name}'; did you mean '{nearest}'?")]
    UnknownName {
        /// The name as given.
        name: String,
        /// The most similar name that exists.
        nearest: &'static str,
    },
    /// A value of another type.
    #[error("parameter '{name}' wants {wanted}, not {value}")]
    WrongType {
        /// The parameter.
        name: &'static str,
        /// What it takes.
        wanted: &'static str,
        /// What was given.
        value: String,
    },
    /// A value outside the range.
    #[error("parameter '{name}' = {value} is out of range: allowed is {allowed}")]
    OutOfRange {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// Values that contradict each other.
    #[error("{reason}")]
    Inconsistent {
        /// Which parameters, and how.
        reason: String,
    },
}

impl ConfigError {
    /// [`ConfigError::UnknownName`] with the most similar existing name.
    pub fn unknown(name: &str) -> Self {
        let nearest = FIELDS
            .iter()
            .map(|f| f.name)
            .min_by_key(|candidate| edit_distance(name, candidate))
            .unwrap_or_default();
        Self::UnknownName { name: name.to_owned(), nearest }
    }
}

/// Levenshtein distance, by bytes.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.bytes().enumerate() {
            let substituted = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// A calibration from which no depth can be computed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CalibrationError {
    /// K is zero: the driver says that it has no calibration.
    #[error(
        "{side} camera info is uncalibrated: K[0] is {fx}; calibrate the camera or set camera_info.{side}_url"
    )]
    Uncalibrated {
        /// `left` or `right`.
        side: &'static str,
        /// `K[0]`.
        fx: f64,
    },
    /// P has no usable focal length.
    #[error(
        "{side} camera info has no usable projection matrix: P[0] is {fx}; rectified stereo needs P of both cameras"
    )]
    FocalLength {
        /// `left` or `right`.
        side: &'static str,
        /// `P[0]`.
        fx: f64,
    },
    /// The two projection matrices do not belong to one rectified pair.
    #[error(
        "left P[0] is {left} and right P[0] is {right}: not a rectified pair; recalibrate the two cameras together"
    )]
    FocalLengthsDiffer {
        /// Left focal length in pixels.
        left: f64,
        /// Right focal length in pixels.
        right: f64,
    },
    /// Both cameras at one place.
    #[error(
        "the baseline is zero: P[3] of the right camera info is {tx}; it must be -f*B of a stereo calibration (or set calibration.baseline_override)"
    )]
    BaselineZero {
        /// Right `P[3]`.
        tx: f64,
    },
    /// The right camera stands left of the left one.
    #[error(
        "the baseline is negative ({baseline_m} m): left and right cameras are most likely swapped"
    )]
    BaselineNegative {
        /// Baseline in metres.
        baseline_m: f64,
    },
    /// Image and camera info are of different size.
    #[error("{side} image is {image}, but its camera info describes {camera}")]
    SizeMismatch {
        /// `left` or `right`.
        side: &'static str,
        /// Size of the image.
        image: Size,
        /// Size in the camera info, after binning and region of interest.
        camera: Size,
    },
    /// A matrix with a value that is not finite, or cannot be inverted.
    #[error("{side} camera info: {matrix} {fault}")]
    Matrix {
        /// `left` or `right`.
        side: &'static str,
        /// K, D, R or P.
        matrix: &'static str,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// A distortion model we do not know.
    #[error(
        "{side} camera info: unknown distortion model '{model}'; known are plumb_bob, rational_polynomial and equidistant"
    )]
    DistortionModel {
        /// `left` or `right`.
        side: &'static str,
        /// The model as given.
        model: String,
    },
}
