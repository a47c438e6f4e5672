//! Calibration files of the `camera_calibration` package, as a stand-in for a
//! camera info topic.

use std::path::PathBuf;

use serde_json::Value;
use thiserror::Error;

use crate::ros::message::sensor_msgs::CameraInfo;
use crate::ros::yaml::Yaml;

/// Largest calibration file that is read.
const MAX_FILE_BYTES: u64 = 1 << 20;

/// Largest image side that a calibration may name.
const MAX_SIDE: i64 = 1 << 15;

/// A calibration file that cannot be used.
#[derive(Debug, Error)]
pub enum CalibrationFileError {
    /// Another place than a local file.
    #[error("calibration '{url}': only local files (a path or file:///…) are read")]
    Url {
        /// The URL.
        url: String,
    },
    /// The file cannot be read.
    #[error("cannot read calibration file '{}': {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no calibration.
    #[error("calibration file '{}': {reason}", file.display())]
    Content {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}

/// The camera info in the calibration file at `url` (a path or `file://…`).
///
/// # Errors
/// When it cannot be read, or lacks a matrix.
pub fn camera_info_from_url(url: &str) -> Result<CameraInfo, CalibrationFileError> {
    let path = url.strip_prefix("file://").unwrap_or(url);
    if path.contains("://") {
        return Err(CalibrationFileError::Url { url: url.to_owned() });
    }
    let file = PathBuf::from(path);
    let read = |source| CalibrationFileError::Read { file: file.clone(), source };
    let content = |reason| CalibrationFileError::Content { file: file.clone(), reason };
    let bytes = std::fs::metadata(&file).map_err(read)?.len();
    if bytes > MAX_FILE_BYTES {
        return Err(content(format!("{bytes} bytes are too many for a calibration")));
    }
    let text = std::fs::read_to_string(&file).map_err(read)?;
    camera_info_from_text(&text).map_err(content)
}

fn camera_info_from_text(text: &str) -> Result<CameraInfo, String> {
    let Yaml::Map(root) = Yaml::parse(text)? else {
        return Err("a mapping is wanted at the top".into());
    };
    let side = |name: &str| match entry(&root, name) {
        Some(Yaml::Scalar(value)) => value
            .as_i64()
            .filter(|side| (1..=MAX_SIDE).contains(side))
            .map(|side| side as u32)
            .ok_or_else(|| {
                format!("{name} is {value}, a whole number from 1 to {MAX_SIDE} is wanted")
            }),
        _ => Err(format!("{name} is missing")),
    };
    let distortion_model = match entry(&root, "distortion_model") {
        Some(Yaml::Scalar(Value::String(model))) => model.clone(),
        _ => "plumb_bob".to_owned(),
    };
    Ok(CameraInfo {
        height: side("image_height")?,
        width: side("image_width")?,
        distortion_model,
        d: numbers(&root, "distortion_coefficients")?,
        k: matrix(&root, "camera_matrix")?,
        r: matrix(&root, "rectification_matrix")?,
        p: matrix(&root, "projection_matrix")?,
        ..CameraInfo::default()
    })
}

fn entry<'a>(map: &'a [(String, Yaml)], name: &str) -> Option<&'a Yaml> {
    map.iter().find(|(key, _)| key == name).map(|(_, value)| value)
}

fn numbers(root: &[(String, Yaml)], name: &str) -> Result<Vec<f64>, String> {
    let Some(Yaml::Map(matrix)) = entry(root, name) else {
        return Err(format!("{name} is missing"));
    };
    let Some(Yaml::Sequence(data)) = entry(matrix, "data") else {
        return Err(format!("{name} has no data"));
    };
    data.iter()
        .map(|item| match item {
            Yaml::Scalar(value) => value.as_f64(),
            _ => None,
        })
        .collect::<Option<_>>()
        .ok_or_else(|| format!("{name} holds something that is no number"))
}

fn matrix<const N: usize>(root: &[(String, Yaml)], name: &str) -> Result<[f64; N], String> {
    let values = numbers(root, name)?;
    let count = values.len();
    values.try_into().map_err(|_| format!("{name} has {count} numbers, {N} are wanted"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "image_width: 640\nimage_height: 480\ncamera_name: left\n\
        camera_matrix:\n  rows: 3\n  cols: 3\n  data: [400, 0, 320, 0, 400, 240, 0, 0, 1]\n\
        distortion_model: plumb_bob\n\
        distortion_coefficients: {rows: 1, cols: 5, data: [0.1, -0.2, 0, 0, 0]}\n\
        rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n\
        projection_matrix:\n  rows: 3\n  cols: 4\n\
        \x20 data: [400.5, 0, 320, -40.0, 0, 400.5, 240, 0, 0, 0, 1, 0]\n";

    #[test]
    fn the_file_of_camera_calibration_is_read() {
        let info = camera_info_from_text(TEXT).unwrap();
        assert_eq!((info.width, info.height), (640, 480));
        assert_eq!((info.k[0], info.d[1], info.r[8]), (400.0, -0.2, 1.0));
        assert_eq!((info.p[0], info.p[3]), (400.5, -40.0));
    }

    #[test]
    fn what_is_missing_or_wrong_is_named() {
        for (from, to, named) in [
            ("image_width: 640", "image_width: 0", "image_width"),
            ("projection_matrix", "projection", "projection_matrix"),
            ("[400, 0, 320, 0, 400, 240, 0, 0, 1]", "[400, 0]", "camera_matrix"),
            ("[0.1, -0.2, 0, 0, 0]", "[a]", "distortion_coefficients"),
        ] {
            let error = camera_info_from_text(&TEXT.replacen(from, to, 1)).unwrap_err();
            assert!(error.contains(named), "{error}");
        }
        assert!(camera_info_from_url("package://x/y.yaml").is_err());
        assert!(camera_info_from_url("file:///no/such/file.yaml").is_err());
    }
}
