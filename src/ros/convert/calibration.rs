//! `sensor_msgs/CameraInfo` to and from cameras.

use nalgebra::{Matrix3, Matrix3x4};

use super::shown;
use crate::camera::{Camera, Distortion, StereoRig};
use crate::error::CalibrationError;
use crate::image::Size;
use crate::ros::message::sensor_msgs::CameraInfo;
use crate::ros::message::std_msgs::Header;

/// The rectified pair of two camera infos, for images of `size`.
///
/// A `baseline_override` > 0 replaces the baseline of the projection matrices.
///
/// # Errors
/// When a camera info is unusable, describes images of another size, or the two
/// make no stereo pair; the text names the side and the likely cause.
pub fn rig(
    left: &CameraInfo,
    right: &CameraInfo,
    size: Size,
    baseline_override: f64,
) -> Result<StereoRig, CalibrationError> {
    let cameras = [("left", left), ("right", right)].map(|(side, info)| {
        let camera = camera(side, info)?;
        if camera.size == size {
            Ok(camera)
        } else {
            Err(CalibrationError::SizeMismatch { side, image: size, camera: camera.size })
        }
    });
    let [left, right] = cameras;
    StereoRig::new(left?, right?, baseline_override)
}

/// The camera that delivers the images of `info`: binning (0 means 1) and
/// region of interest are folded into its matrices, as `image_geometry` does.
///
/// A rotation of zeros stands for none. `side` is for the error text.
///
/// # Errors
/// When there is no calibration, or the distortion model is unknown or has a
/// wrong number of coefficients.
pub fn camera(side: &'static str, info: &CameraInfo) -> Result<Camera, CalibrationError> {
    if info.k[0] == 0.0 {
        return Err(CalibrationError::Uncalibrated { side, fx: info.k[0] });
    }
    let mut k = Matrix3::from_row_slice(&info.k);
    let mut p = Matrix3x4::from_row_slice(&info.p);
    let r = if info.r == [0.0; 9] { Matrix3::identity() } else { Matrix3::from_row_slice(&info.r) };
    let offset = [info.roi.x_offset, info.roi.y_offset].map(f64::from);
    let binning = [info.binning_x.max(1), info.binning_y.max(1)];
    for row in 0..2 {
        let scale = 1.0 / f64::from(binning[row]);
        k[(row, 2)] -= offset[row];
        p[(row, 2)] -= offset[row];
        k.row_mut(row).scale_mut(scale);
        p.row_mut(row).scale_mut(scale);
    }
    // Zero stands for the whole sensor.
    let width = if info.roi.width == 0 { info.width } else { info.roi.width };
    let height = if info.roi.height == 0 { info.height } else { info.roi.height };
    let size = Size::new((width / binning[0]) as usize, (height / binning[1]) as usize);
    Ok(Camera { size, k, distortion: distortion(side, info)?, r, p })
}

fn distortion(side: &'static str, info: &CameraInfo) -> Result<Distortion, CalibrationError> {
    if info.d.iter().all(|c| *c == 0.0) {
        return Ok(Distortion::None);
    }
    let count = CalibrationError::Matrix {
        side,
        matrix: "D",
        fault: "has a wrong number of coefficients for its distortion model",
    };
    match info.distortion_model.as_str() {
        // Four coefficients: calibrated without k3.
        "plumb_bob" if matches!(info.d.len(), 4 | 5) => Ok(polynomial(&info.d)),
        "rational_polynomial" if matches!(info.d.len(), 8 | 12) => Ok(polynomial(&info.d)),
        // OpenCV's tilted sensor, which we do not model: fine while it is not tilted.
        "rational_polynomial" if info.d.len() == 14 && info.d[12..] == [0.0, 0.0] => {
            Ok(polynomial(&info.d))
        }
        "equidistant" => match info.d[..] {
            [k1, k2, k3, k4] => Ok(Distortion::Equidistant([k1, k2, k3, k4])),
            _ => Err(count),
        },
        "plumb_bob" | "rational_polynomial" => Err(count),
        model => Err(CalibrationError::DistortionModel { side, model: shown(model) }),
    }
}

fn polynomial(d: &[f64]) -> Distortion {
    let mut coefficients = [0.0; 12];
    for (out, c) in coefficients.iter_mut().zip(d) {
        *out = *c;
    }
    Distortion::Polynomial(coefficients)
}

/// The camera info of images that `camera` delivers.
pub fn camera_info(camera: &Camera, header: Header) -> CameraInfo {
    let (model, d) = match camera.distortion {
        Distortion::None => ("plumb_bob", vec![0.0; 5]),
        Distortion::Equidistant(c) => ("equidistant", c.to_vec()),
        Distortion::Polynomial(c) if c[5..] == [0.0; 7] => ("plumb_bob", c[..5].to_vec()),
        Distortion::Polynomial(c) if c[8..] == [0.0; 4] => ("rational_polynomial", c[..8].to_vec()),
        Distortion::Polynomial(c) => ("rational_polynomial", c.to_vec()),
    };
    let mut info = CameraInfo {
        header,
        height: camera.size.height as u32,
        width: camera.size.width as u32,
        distortion_model: model.into(),
        d,
        ..Default::default()
    };
    for row in 0..3 {
        for column in 0..3 {
            info.k[3 * row + column] = camera.k[(row, column)];
            info.r[3 * row + column] = camera.r[(row, column)];
        }
        for column in 0..4 {
            info.p[4 * row + column] = camera.p[(row, column)];
        }
    }
    info
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::message::sensor_msgs::RegionOfInterest;

    const SIZE: Size = Size::new(640, 480);

    fn info(tx: f64) -> CameraInfo {
        camera_info(&Camera::pinhole(SIZE, 400.0, 320.0, 240.0, tx), Header::default())
    }

    #[test]
    fn cameras_survive_the_round_trip_with_every_distortion() {
        let mut camera = Camera::pinhole(SIZE, 400.0, 320.0, 240.0, -40.0);
        camera.r = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let p = |n: usize| {
            let mut c = [0.0; 12];
            for (i, c) in c.iter_mut().take(n).enumerate() {
                *c = 0.01 * (i + 1) as f64;
            }
            Distortion::Polynomial(c)
        };
        for (distortion, model, count) in [
            (Distortion::None, "plumb_bob", 5),
            (p(5), "plumb_bob", 5),
            (p(8), "rational_polynomial", 8),
            (p(12), "rational_polynomial", 12),
            (Distortion::Equidistant([0.1, 0.2, 0.3, 0.4]), "equidistant", 4),
        ] {
            camera.distortion = distortion;
            let info = camera_info(&camera, Header::default());
            assert_eq!((info.distortion_model.as_str(), info.d.len()), (model, count));
            assert_eq!(super::camera("left", &info).unwrap(), camera);
        }
    }

    #[test]
    fn binning_zero_means_one() {
        let mut one = info(-40.0);
        let zero = camera("left", &one).unwrap();
        (one.binning_x, one.binning_y) = (1, 1);
        assert_eq!(camera("left", &one).unwrap(), zero);
        assert_eq!(zero.size, SIZE);
    }

    #[test]
    fn region_of_interest_and_binning_are_folded_in() {
        let mut info = info(-40.0);
        info.roi = RegionOfInterest {
            x_offset: 100,
            y_offset: 40,
            width: 400,
            height: 300,
            do_rectify: false,
        };
        (info.binning_x, info.binning_y) = (2, 4);
        let camera = camera("left", &info).unwrap();
        assert_eq!(camera.size, Size::new(200, 75));
        assert_eq!((camera.k[(0, 0)], camera.k[(1, 1)]), (200.0, 100.0));
        assert_eq!((camera.k[(0, 2)], camera.k[(1, 2)]), (110.0, 50.0));
        assert_eq!((camera.p[(0, 2)], camera.p[(1, 2)]), (110.0, 50.0));
        assert_eq!(camera.p[(0, 3)], -20.0);
    }

    #[test]
    fn the_baseline_does_not_depend_on_binning() {
        let (mut left, mut right) = (info(0.0), info(-40.0));
        for info in [&mut left, &mut right] {
            (info.binning_x, info.binning_y) = (2, 2);
        }
        let rig = rig(&left, &right, Size::new(320, 240), 0.0).unwrap();
        assert!((rig.baseline_m - 0.1).abs() < 1e-12);
        assert_eq!(rig.focal_px(), 200.0);
    }

    #[test]
    fn the_baseline_can_be_overridden() {
        assert_eq!(rig(&info(0.0), &info(-40.0), SIZE, 0.25).unwrap().baseline_m, 0.25);
        assert_eq!(rig(&info(0.0), &info(0.0), SIZE, 0.25).unwrap().baseline_m, 0.25);
    }

    #[test]
    fn an_uncalibrated_camera_is_named() {
        let text = rig(&info(0.0), &CameraInfo::default(), SIZE, 0.0).unwrap_err().to_string();
        assert!(text.contains("right") && text.contains("uncalibrated"), "{text}");
    }

    #[test]
    fn a_camera_info_of_another_size_is_refused() {
        let text = rig(&info(0.0), &info(-40.0), Size::new(320, 240), 0.0).unwrap_err().to_string();
        assert_eq!(text, "left image is 320x240, but its camera info describes 640x480");
    }

    #[test]
    fn swapped_cameras_and_a_missing_baseline_are_refused() {
        assert!(matches!(
            rig(&info(-40.0), &info(0.0), SIZE, 0.0),
            Err(CalibrationError::BaselineNegative { .. })
        ));
        assert!(matches!(
            rig(&info(0.0), &info(0.0), SIZE, 0.0),
            Err(CalibrationError::BaselineZero { .. })
        ));
    }

    #[test]
    fn distortion_models_are_checked() {
        let with = |model: &str, d: &[f64]| CameraInfo {
            distortion_model: model.into(),
            d: d.to_vec(),
            ..info(0.0)
        };
        let ok = |model: &str, d: &[f64]| camera("left", &with(model, d)).unwrap().distortion;
        assert_eq!(ok("", &[]), Distortion::None);
        assert_eq!(ok("plumb_bob", &[0.0; 5]), Distortion::None);
        assert!(matches!(ok("plumb_bob", &[0.1; 4]), Distortion::Polynomial(c) if c[4] == 0.0));
        let mut tilted = [0.1; 14];
        tilted[12..].fill(0.0);
        assert!(matches!(ok("rational_polynomial", &tilted), Distortion::Polynomial(_)));
        for (model, count, part) in [
            ("plumb_bob", 3, "wrong number"),
            ("rational_polynomial", 5, "wrong number"),
            ("rational_polynomial", 14, "wrong number"),
            ("equidistant", 5, "wrong number"),
            ("kannala_brandt9", 9, "'kannala_brandt9'"),
            ("", 5, "unknown distortion model"),
        ] {
            let text = camera("right", &with(model, &vec![0.1; count])).unwrap_err().to_string();
            assert!(text.contains("right") && text.contains(part), "{text}");
        }
    }

    #[test]
    fn a_rotation_of_zeros_is_none() {
        let info = CameraInfo { r: [0.0; 9], ..info(0.0) };
        assert_eq!(camera("left", &info).unwrap().r, Matrix3::identity());
    }
}
