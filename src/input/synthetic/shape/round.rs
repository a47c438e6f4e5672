//! Ellipsoids, foliage and capsules.

use super::super::noise::{floor, hash, noise3, unit};
use super::{Contact, Ray, Span, Vec3};

/// An ellipsoid around the origin.
#[derive(Clone, Copy, Debug)]
pub struct Ellipsoid {
    /// Half axes along x, y and z.
    pub radii: Vec3,
}

/// Roots of `|o + t d| = 1`, in order.
fn unit_sphere(o: Vec3, d: Vec3) -> Option<(f64, f64)> {
    let a = d.norm_squared();
    let b = o.dot(&d);
    let c = o.norm_squared() - 1.0;
    let q = b * b - a * c;
    (q >= 0.0).then(|| {
        let root = q.sqrt();
        ((-b - root) / a, (-b + root) / a)
    })
}

impl Ellipsoid {
    /// See [`super::Shape::meet`].
    pub fn meet(&self, ray: &Ray, span: Span) -> Option<Contact> {
        let o = ray.origin.component_div(&self.radii);
        let d = ray.direction.component_div(&self.radii);
        let (first, _) = unit_sphere(o, d)?;
        span.holds(first).then_some(Contact { t: first, face: 0 })
    }

    /// Outward normal.
    pub fn normal(&self, point: Vec3) -> Vec3 {
        point.component_div(&self.radii.component_mul(&self.radii)).normalize()
    }
}

/// An ellipsoid whose surface is broken up into leaves.
#[derive(Clone, Copy, Debug)]
pub struct Foliage {
    /// Half axes along x, y and z.
    pub radii: Vec3,
    /// Size of a leaf in metres.
    pub leaf: f64,
    /// Which pattern.
    pub seed: u32,
}

impl Foliage {
    /// See [`super::Shape::meet`]: the near or the far side, where a leaf is.
    pub fn meet(&self, ray: &Ray, span: Span) -> Option<Contact> {
        let o = ray.origin.component_div(&self.radii);
        let d = ray.direction.component_div(&self.radii);
        let (first, second) = unit_sphere(o, d)?;
        let leafy = |t: f64| span.holds(t) && self.is_leaf(ray.at(t));
        if leafy(first) {
            Some(Contact { t: first, face: 0 })
        } else if leafy(second) {
            Some(Contact { t: second, face: 1 })
        } else {
            None
        }
    }

    fn is_leaf(&self, p: Vec3) -> bool {
        let q = p / self.leaf;
        let clump = noise3(self.seed, 0.4 * q.x, 0.4 * q.y, 0.4 * q.z);
        noise3(self.seed ^ 0x55, q.x, q.y, q.z) + 0.6 * clump > -0.12
    }

    /// Outward normal, each leaf leaning its own way.
    pub fn normal(&self, point: Vec3) -> Vec3 {
        let out = point.component_div(&self.radii.component_mul(&self.radii)).normalize();
        let q = point / self.leaf;
        let h = hash(self.seed, floor(q.x), floor(q.y), floor(q.z));
        let lean = |shift: u32| unit(h.rotate_left(shift)) - 0.5;
        (out + 1.1 * Vec3::new(lean(0), lean(9), lean(18))).normalize()
    }
}

/// All points nearer than `radius` to the line from `from` to `to`.
#[derive(Clone, Copy, Debug)]
pub struct Capsule {
    /// One end of the axis.
    pub from: Vec3,
    /// The other end.
    pub to: Vec3,
    /// Radius in metres.
    pub radius: f64,
}

impl Capsule {
    /// See [`super::Shape::meet`].
    pub fn meet(&self, ray: &Ray, span: Span) -> Option<Contact> {
        let axis = self.to - self.from;
        let length2 = axis.norm_squared();
        let o = ray.origin - self.from;
        let (od, dd) = (axis.dot(&o), axis.dot(&ray.direction));
        // The infinite cylinder: the parts of o and d across the axis.
        let a = length2 * ray.direction.norm_squared() - dd * dd;
        let b = length2 * o.dot(&ray.direction) - od * dd;
        let c = length2 * (o.norm_squared() - self.radius * self.radius) - od * od;
        let q = b * b - a * c;
        if q < 0.0 {
            return None;
        }
        let side = if a > 1e-12 { (-b - q.sqrt()) / a } else { f64::NEG_INFINITY };
        let along = od + side * dd;
        let t = if a > 1e-12 && along >= 0.0 && along <= length2 {
            side
        } else {
            let end = if (a > 1e-12 && along < 0.0) || (a <= 1e-12 && dd > 0.0) {
                self.from
            } else {
                self.to
            };
            unit_sphere((ray.origin - end) / self.radius, ray.direction / self.radius)?.0
        };
        span.holds(t).then_some(Contact { t, face: 0 })
    }

    /// Outward normal.
    pub fn normal(&self, point: Vec3) -> Vec3 {
        let axis = self.to - self.from;
        let along = (axis.dot(&(point - self.from)) / axis.norm_squared()).clamp(0.0, 1.0);
        (point - self.from - axis * along) / self.radius
    }

    /// Box around it.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let r = Vec3::repeat(self.radius);
        (self.from.inf(&self.to) - r, self.from.sup(&self.to) + r)
    }
}
