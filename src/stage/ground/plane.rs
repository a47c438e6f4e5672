//! A plane in disparity space, and how it is found among measured cells.

use nalgebra::{Matrix3, Vector3};

use crate::camera::StereoRig;

/// Camera heights in metres that a plane may have.
const HEIGHTS_M: std::ops::RangeInclusive<f32> = 0.05..=20.0;
/// Least doubled area in square pixels of three cells that tell a plane.
const LEAST_AREA: f32 = 400.0;

/// A plane in disparity space: d = a v + b u + c, with u, v in full-size pixels
/// and d in pixels (`cx_l - cx_r` subtracted).
///
/// In space it is n · P = f B with n = (b fx, a fy, a cy + b cx + c), because
/// d = f B / Z and u = fx X / Z + cx, v = fy Y / Z + cy. The height of a point
/// above it is therefore `(f B / |n|) (d − d_plane) / d`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Change of disparity per row.
    pub a: f32,
    /// Change of disparity per column.
    pub b: f32,
    /// Disparity at the origin of the image.
    pub c: f32,
    /// Height of the camera above the plane, metres.
    pub camera_height_m: f32,
    /// Median distance of what was seen of the plane along the optical axis, metres.
    pub distance_m: f32,
}

impl Plane {
    /// The plane with these coefficients; `None` when it is no plane in space, or
    /// nearer or farther than anything stands on.
    pub fn new(a: f32, b: f32, c: f32, rig: &StereoRig) -> Option<Self> {
        let n = normal(a, b, c, rig);
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        let camera_height_m = rig.depth_scale() as f32 / length;
        HEIGHTS_M.contains(&camera_height_m).then_some(Self {
            a,
            b,
            c,
            camera_height_m,
            distance_m: 10.0,
        })
    }

    /// Cosine between the plane's normal and the image's vertical: 1 for a floor
    /// under a level camera.
    pub fn upright(&self, rig: &StereoRig) -> f32 {
        normal(self.a, self.b, self.c, rig)[1] * self.camera_height_m / rig.depth_scale() as f32
    }

    /// Cosine between the plane's normal and the optical axis: 1 for what is seen
    /// straight from above.
    pub fn facing(&self, rig: &StereoRig) -> f32 {
        normal(self.a, self.b, self.c, rig)[2] * self.camera_height_m / rig.depth_scale() as f32
    }

    /// A plane between this one and `new`.
    #[must_use]
    pub fn mixed(&self, new: &Self, share: f32, rig: &StereoRig) -> Self {
        let blend = |o: f32, n: f32| o + share * (n - o);
        let mixed =
            Self::new(blend(self.a, new.a), blend(self.b, new.b), blend(self.c, new.c), rig);
        let distance_m = blend(self.distance_m, new.distance_m);
        // Two planes before the camera have one between them, but rounding may say otherwise.
        mixed.map_or(*new, |plane| Self { distance_m, ..plane })
    }

    /// Disparity of the plane at pixel (u, v).
    #[inline]
    pub fn disparity(&self, u: f32, v: f32) -> f32 {
        self.a * v + self.b * u + self.c
    }

    /// Height in metres above the plane of a point at pixel (u, v) with disparity `d` > 0.
    #[inline]
    pub fn height(&self, u: f32, v: f32, d: f32) -> f32 {
        self.camera_height_m * (d - self.disparity(u, v)) / d
    }

    /// Size of the scene against a road's, 0.03..=1: every length that has to
    /// do with the things on the plane is given for a plane seen at 10 m and
    /// multiplied by this.
    pub fn scale(&self) -> f32 {
        (self.distance_m / 10.0).clamp(0.03, 1.0)
    }
}

/// |n| is f B over the distance of the camera.
pub(in crate::stage) fn normal(a: f32, b: f32, c: f32, rig: &StereoRig) -> [f32; 3] {
    let (cx, cy) = rig.principal_point();
    [b * rig.focal_px() as f32, a * rig.focal_y_px() as f32, a * cy as f32 + b * cx as f32 + c]
}

/// A measured cell: pixel, and disparity less `cx_l - cx_r`.
#[derive(Clone, Copy, Debug)]
pub(in crate::stage) struct Measured {
    /// Column.
    pub u: f32,
    /// Row.
    pub v: f32,
    /// Disparity in pixels.
    pub d: f32,
}

/// a, b and c of the plane through three cells; `None` where they lie in a row.
pub(in crate::stage) fn through([p, q, r]: [Measured; 3]) -> Option<[f32; 3]> {
    let (du1, dv1, dd1) = (q.u - p.u, q.v - p.v, q.d - p.d);
    let (du2, dv2, dd2) = (r.u - p.u, r.v - p.v, r.d - p.d);
    let area = dv1 * du2 - dv2 * du1;
    if area.abs() < LEAST_AREA {
        return None;
    }
    let a = (dd1 * du2 - dd2 * du1) / area;
    let b = (dv1 * dd2 - dv2 * dd1) / area;
    Some([a, b, p.d - a * p.v - b * p.u])
}

/// Numbers to draw cells by, a fixed sequence (Knuth's MMIX generator): same
/// input, same plane.
pub(in crate::stage) struct Draws(u64);

impl Draws {
    pub(in crate::stage) const fn new() -> Self {
        Self(0x9e37_79b9_7f4a_7c15)
    }

    /// The next number below `n`, which is not 0.
    pub(in crate::stage) const fn below(&mut self, n: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }
}

/// Weighted least squares of a plane: its normal equations.
#[derive(Default)]
pub(in crate::stage) struct Fit {
    /// Sums of v², u v, v, u², u and 1, and of v d, u d and d.
    normal: [f64; 6],
    right: [f64; 3],
}

impl Fit {
    #[inline]
    pub(in crate::stage) fn add(&mut self, cell: Measured, weight: f32) {
        let (u, v, d) = (f64::from(cell.u), f64::from(cell.v), f64::from(cell.d));
        let n = f64::from(weight);
        let (wu, wv) = (n * u, n * v);
        for (sum, term) in self.normal.iter_mut().zip([wv * v, wv * u, wv, wu * u, wu, n]) {
            *sum += term;
        }
        for (sum, term) in self.right.iter_mut().zip([wv * d, wu * d, n * d]) {
            *sum += term;
        }
    }

    /// a, b and c; `None` when the cells tell none.
    pub(in crate::stage) fn solve(&self) -> Option<[f32; 3]> {
        let [vv, uv, v, uu, u, n] = self.normal;
        let normal = Matrix3::new(vv, uv, v, uv, uu, u, v, u, n);
        let solution = normal.try_inverse()? * Vector3::from(self.right);
        Some([solution.x as f32, solution.y as f32, solution.z as f32])
    }
}
