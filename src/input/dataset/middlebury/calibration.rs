//! `calib.txt`: lines `cam0=[f 0 cx; 0 f cy; 0 0 1]`, `doffs=`, `baseline=` (mm).

use std::path::Path;

use super::super::folder::text;
use super::super::{Calibration, DatasetError};

const MM_PER_M: f64 = 1000.0;

/// Reads the calibration of a scene.
///
/// # Errors
/// When a line that is needed is not there or not a number.
pub fn read(path: &Path) -> Result<Calibration, DatasetError> {
    let text = text(path)?;
    let fault = |fault: String| DatasetError::CalibrationFile { path: path.to_owned(), fault };
    let value = |name: &str| {
        let line = text.lines().find_map(|line| line.trim().strip_prefix(name)?.strip_prefix('='));
        line.ok_or_else(|| fault(format!("it has no line '{name}='")))
    };
    let number = |name: &str| {
        let text = value(name)?.trim();
        let number = text.parse::<f64>().ok().filter(|v| v.is_finite());
        number.ok_or_else(|| fault(format!("{name} is '{text}', not a number")))
    };
    let matrix = value("cam0")?;
    let numbers: Result<Vec<f64>, _> = matrix
        .trim_matches(|c: char| "[] \r".contains(c))
        .split([' ', ';'])
        .filter(|word| !word.is_empty())
        .map(str::parse)
        .collect();
    let numbers = numbers.map_err(|e| fault(format!("cam0: {e}")))?;
    let &[focal_px, _, cx, _, _, cy, _, _, _] = &numbers[..] else {
        let count = numbers.len();
        return Err(fault(format!("cam0 has {count} numbers, not 9")));
    };
    if !(focal_px > 0.0 && focal_px.is_finite()) {
        return Err(fault(format!("the focal length is {focal_px}")));
    }
    Ok(Calibration::Pinhole {
        focal_px,
        principal_point: Some((cx, cy)),
        right_offset_px: number("doffs")?,
        baseline_m: number("baseline")? / MM_PER_M,
    })
}
