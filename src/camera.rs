//! Pinhole cameras with lens distortion, and the rectified pair made of two.

use nalgebra::{Matrix3, Matrix3x4, Vector2, Vector3};

use crate::error::CalibrationError;
use crate::image::Size;

/// Lens distortion, with the coefficients in the order of `sensor_msgs/CameraInfo`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Distortion {
    /// None.
    #[default]
    None,
    /// `plumb_bob` (5 coefficients) and `rational_polynomial` (8, or 12 with
    /// thin prism terms): k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, absent ones zero.
    Polynomial([f64; 12]),
    /// `equidistant` fisheye (Kannala and Brandt 2006): k1 k2 k3 k4.
    Equidistant([f64; 4]),
}

impl Distortion {
    /// Where the lens moves a point of the normalised image plane (z = 1).
    pub fn distort(&self, point: Vector2<f64>) -> Vector2<f64> {
        let (x, y) = (point.x, point.y);
        let r2 = x * x + y * y;
        match self {
            Self::None => point,
            Self::Polynomial([k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4]) => {
                let (r4, r6) = (r2 * r2, r2 * r2 * r2);
                let radial =
                    (1.0 + k1 * r2 + k2 * r4 + k3 * r6) / (1.0 + k4 * r2 + k5 * r4 + k6 * r6);
                Vector2::new(
                    x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + s1 * r2 + s2 * r4,
                    y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + s3 * r2 + s4 * r4,
                )
            }
            Self::Equidistant([k1, k2, k3, k4]) => {
                let r = r2.sqrt();
                if r < 1e-9 {
                    return point;
                }
                let theta = r.atan();
                let t2 = theta * theta;
                let distorted = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))));
                point * (distorted / r)
            }
        }
    }
}

/// One calibrated camera, in the terms of `sensor_msgs/CameraInfo` with binning
/// and region of interest already applied: all matrices refer to the pixels of
/// the image as delivered.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Size of the delivered image.
    pub size: Size,
    /// Intrinsics of the raw image.
    pub k: Matrix3<f64>,
    /// Lens distortion of the raw image.
    pub distortion: Distortion,
    /// Rotation from the camera frame into the rectified frame.
    pub r: Matrix3<f64>,
    /// Projection of the rectified frame into the rectified image.
    pub p: Matrix3x4<f64>,
}

impl Camera {
    /// An undistorted camera at `(-tx/f, 0, 0)` of the rectified frame, where
    /// `tx` is `P[0,3]`.
    pub fn pinhole(size: Size, f: f64, cx: f64, cy: f64, tx: f64) -> Self {
        let k = Matrix3::new(f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0);
        let mut p = Matrix3x4::zeros();
        p.fixed_columns_mut::<3>(0).copy_from(&k);
        p[(0, 3)] = tx;
        Self { size, k, distortion: Distortion::None, r: Matrix3::identity(), p }
    }

    /// Where the raw image shows what the rectified image has at `(u, v)`.
    ///
    /// The inverse of `P[3x3] * R` is passed in because a rectification map
    /// asks for every pixel: see [`Camera::rectified_to_ray`].
    pub fn raw_pixel(&self, rectified_to_ray: &Matrix3<f64>, u: f64, v: f64) -> Vector2<f64> {
        let ray = rectified_to_ray * Vector3::new(u, v, 1.0);
        let point = self.distortion.distort(Vector2::new(ray.x / ray.z, ray.y / ray.z));
        Vector2::new(
            self.k[(0, 0)] * point.x + self.k[(0, 1)] * point.y + self.k[(0, 2)],
            self.k[(1, 1)] * point.y + self.k[(1, 2)],
        )
    }

    /// The matrix from rectified pixels to viewing rays of the raw camera:
    /// `(P[3x3] * R)^-1`; `None` when it has no inverse.
    pub fn rectified_to_ray(&self) -> Option<Matrix3<f64>> {
        (self.p.fixed_columns::<3>(0) * self.r).try_inverse()
    }

    /// The camera of an image made smaller by a whole factor, where pixel
    /// `(x, y)` of the small image covers pixels `factor*x .. factor*x + factor`.
    #[must_use]
    pub fn divided_by(&self, factor: usize) -> Self {
        let s = 1.0 / factor as f64;
        // Pixel centres are whole numbers: the centre of the first cell lies
        // at (factor - 1) / 2 of the large image.
        let shift = (s - 1.0) / 2.0;
        let mut small = self.clone();
        small.size = Size::new(self.size.width / factor, self.size.height / factor);
        for row in 0..2 {
            for column in 0..3 {
                small.k[(row, column)] *= s;
            }
            for column in 0..4 {
                small.p[(row, column)] *= s;
            }
            small.k[(row, 2)] += shift;
            small.p[(row, 2)] += shift;
        }
        small
    }
}

/// A calibrated, rectified pair of cameras.
///
/// `f = P_left[0,0]`, `B = (P_left[0,3] - P_right[0,3]) / f`,
/// `d = x_l - x_r - (cx_l - cx_r)`, `Z = f * B / d`.
#[derive(Clone, Debug, PartialEq)]
pub struct StereoRig {
    /// The left camera: all outputs refer to its rectified image.
    pub left: Camera,
    /// The right camera.
    pub right: Camera,
    /// Distance of the optical centres in metres, > 0.
    pub baseline_m: f64,
}

impl StereoRig {
    /// The pair of two calibrated cameras.
    ///
    /// A `baseline_override` > 0 replaces the baseline of the projection matrices.
    ///
    /// # Errors
    /// When f or B cannot be used; the text names the likely cause.
    pub fn new(
        left: Camera,
        right: Camera,
        baseline_override: f64,
    ) -> Result<Self, CalibrationError> {
        for (side, camera) in [("left", &left), ("right", &right)] {
            check_finite(side, camera)?;
            if camera.k[(0, 0)] == 0.0 {
                return Err(CalibrationError::Uncalibrated { side, fx: camera.k[(0, 0)] });
            }
            if camera.p[(0, 0)] <= 0.0 || camera.p[(1, 1)] <= 0.0 {
                return Err(CalibrationError::FocalLength { side, fx: camera.p[(0, 0)] });
            }
            if camera.rectified_to_ray().is_none() {
                return Err(CalibrationError::Matrix {
                    side,
                    matrix: "R",
                    fault: "has no inverse",
                });
            }
        }
        let (f, f_right) = (left.p[(0, 0)], right.p[(0, 0)]);
        if (f - f_right).abs() > 1e-3 * f {
            return Err(CalibrationError::FocalLengthsDiffer { left: f, right: f_right });
        }
        let measured = (left.p[(0, 3)] - right.p[(0, 3)]) / f;
        let baseline_m = if baseline_override > 0.0 { baseline_override } else { measured };
        if baseline_m == 0.0 {
            return Err(CalibrationError::BaselineZero { tx: right.p[(0, 3)] });
        }
        if baseline_m < 0.0 {
            return Err(CalibrationError::BaselineNegative { baseline_m });
        }
        Ok(Self { left, right, baseline_m })
    }

    /// Focal length of the rectified pair in pixels.
    pub fn focal_px(&self) -> f64 {
        self.left.p[(0, 0)]
    }

    /// Vertical focal length of the rectified left camera in pixels.
    pub fn focal_y_px(&self) -> f64 {
        self.left.p[(1, 1)]
    }

    /// Principal point of the rectified left image in pixels.
    pub fn principal_point(&self) -> (f64, f64) {
        (self.left.p[(0, 2)], self.left.p[(1, 2)])
    }

    /// `cx_l - cx_r` in pixels: what is subtracted from `x_l - x_r`.
    pub fn disparity_offset(&self) -> f64 {
        self.left.p[(0, 2)] - self.right.p[(0, 2)]
    }

    /// `f * B` in pixel metres, so that `Z = depth_scale / d`.
    pub fn depth_scale(&self) -> f64 {
        self.focal_px() * self.baseline_m
    }

    /// The pair of both images made smaller by a whole factor.
    #[must_use]
    pub fn divided_by(&self, factor: usize) -> Self {
        Self {
            left: self.left.divided_by(factor),
            right: self.right.divided_by(factor),
            baseline_m: self.baseline_m,
        }
    }
}

fn check_finite(side: &'static str, camera: &Camera) -> Result<(), CalibrationError> {
    let distortion_finite = match &camera.distortion {
        Distortion::None => true,
        Distortion::Polynomial(c) => c.iter().all(|v| v.is_finite()),
        Distortion::Equidistant(c) => c.iter().all(|v| v.is_finite()),
    };
    let checks = [
        ("K", camera.k.iter().all(|v| v.is_finite())),
        ("D", distortion_finite),
        ("R", camera.r.iter().all(|v| v.is_finite())),
        ("P", camera.p.iter().all(|v| v.is_finite())),
    ];
    match checks.into_iter().find(|(_, finite)| !finite) {
        Some((matrix, _)) => {
            Err(CalibrationError::Matrix { side, matrix, fault: "has a value that is not finite" })
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rig(tx: f64) -> Result<StereoRig, CalibrationError> {
        let size = Size::new(640, 240);
        StereoRig::new(
            Camera::pinhole(size, 400.0, 320.0, 120.0, 0.0),
            Camera::pinhole(size, 400.0, 318.0, 120.0, tx),
            0.0,
        )
    }

    #[test]
    fn baseline_and_offset_come_from_the_projection_matrices() {
        let rig = rig(-200.0).unwrap();
        assert!((rig.baseline_m - 0.5).abs() < 1e-12);
        assert!((rig.disparity_offset() - 2.0).abs() < 1e-12);
        assert!((rig.depth_scale() - 200.0).abs() < 1e-12);
    }

    #[test]
    fn swapped_cameras_and_zero_baseline_are_named() {
        assert!(rig(200.0).unwrap_err().to_string().contains("swapped"));
        assert!(rig(0.0).unwrap_err().to_string().contains("baseline is zero"));
    }

    #[test]
    fn an_undistorted_camera_rectifies_to_itself() {
        let camera = Camera::pinhole(Size::new(640, 240), 400.0, 320.0, 120.0, 0.0);
        let to_ray = camera.rectified_to_ray().unwrap();
        let raw = camera.raw_pixel(&to_ray, 10.0, 200.0);
        assert!((raw - Vector2::new(10.0, 200.0)).norm() < 1e-9);
    }

    #[test]
    fn dividing_keeps_rays() {
        let camera = Camera::pinhole(Size::new(640, 240), 400.0, 320.0, 120.0, 0.0);
        let small = camera.divided_by(4);
        // The centre of small pixel 10 is large pixel 41.5.
        let large_ray = (41.5 - camera.p[(0, 2)]) / camera.p[(0, 0)];
        let small_ray = (10.0 - small.p[(0, 2)]) / small.p[(0, 0)];
        assert!((large_ray - small_ray).abs() < 1e-12);
    }
}
