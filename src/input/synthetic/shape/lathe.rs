//! Surfaces of revolution: poles, wheels, mugs, bottles.

use super::{Contact, Ray, Span, Vec3};

/// A profile of radius over height, turned around the z axis. The surface is
/// seen from both sides, so that vessels may be open.
#[derive(Clone, Debug)]
pub struct Lathe {
    /// Radius and height of each corner.
    profile: Vec<(f64, f64)>,
    /// Radial and vertical part of the normal at both ends of each segment.
    normals: Vec<[(f64, f64); 2]>,
}

impl Lathe {
    /// The surface of a profile. Corners flatter than about 35 degrees are
    /// shaded smoothly.
    pub fn new(profile: Vec<(f64, f64)>) -> Self {
        let flat: Vec<(f64, f64)> = profile
            .windows(2)
            .map(|w| {
                // Outward is right of the direction of travel.
                let (dr, dz) = (w[1].0 - w[0].0, w[1].1 - w[0].1);
                let length = (dr * dr + dz * dz).sqrt().max(1e-12);
                (dz / length, -dr / length)
            })
            .collect();
        let joined = |own: (f64, f64), other: Option<&(f64, f64)>| match other {
            Some(o) if own.0 * o.0 + own.1 * o.1 > 0.82 => {
                let (r, z) = (own.0 + o.0, own.1 + o.1);
                let length = (r * r + z * z).sqrt();
                (r / length, z / length)
            }
            _ => own,
        };
        let normals = flat
            .iter()
            .enumerate()
            .map(|(i, own)| {
                let before = i.checked_sub(1).and_then(|j| flat.get(j));
                [joined(*own, before), joined(*own, flat.get(i + 1))]
            })
            .collect();
        Self { profile, normals }
    }

    /// An upright cylinder on z = 0, closed at both ends.
    pub fn cylinder(radius: f64, height: f64) -> Self {
        Self::new(vec![(0.0, 0.0), (radius, 0.0), (radius, height), (0.0, height)])
    }

    /// See [`super::Shape::meet`].
    pub fn meet(&self, ray: &Ray, span: Span) -> Option<Contact> {
        let (o, d) = (ray.origin, ray.direction);
        let mut best: Option<Contact> = None;
        let mut offer = |t: f64, face: usize| {
            if span.holds(t) && best.is_none_or(|b| t < b.t) {
                best = Some(Contact { t, face });
            }
        };
        for (face, w) in self.profile.windows(2).enumerate() {
            let ((r0, z0), (r1, z1)) = (w[0], w[1]);
            if (z1 - z0).abs() < 1e-9 {
                let t = (z0 - o.z) / d.z;
                let (x, y) = (o.x + t * d.x, o.y + t * d.y);
                let r2 = x * x + y * y;
                let (small, large) = (r0.min(r1), r0.max(r1));
                if d.z != 0.0 && r2 >= small * small && r2 <= large * large {
                    offer(t, face);
                }
                continue;
            }
            // x^2 + y^2 = (radius + slope * z)^2 along the ray.
            let slope = (r1 - r0) / (z1 - z0);
            let radius = r0 + slope * (o.z - z0);
            let change = slope * d.z;
            let a = d.x * d.x + d.y * d.y - change * change;
            let b = o.x * d.x + o.y * d.y - radius * change;
            let c = o.x * o.x + o.y * o.y - radius * radius;
            let q = b * b - a * c;
            if q < 0.0 || a == 0.0 {
                continue;
            }
            let root = q.sqrt();
            let (low, high) = (z0.min(z1), z0.max(z1));
            for t in [(-b - root) / a, (-b + root) / a] {
                let z = o.z + t * d.z;
                // Without this the mirror cone beyond the tip would count.
                if z >= low && z <= high && radius + t * change >= 0.0 {
                    offer(t, face);
                }
            }
        }
        best
    }

    /// Normal on the outer side of the profile.
    pub fn normal(&self, point: Vec3, face: usize) -> Vec3 {
        let ((r0, z0), (r1, z1)) = (self.profile[face], self.profile[face + 1]);
        let r = (point.x * point.x + point.y * point.y).sqrt();
        let share = if (z1 - z0).abs() > (r1 - r0).abs() {
            (point.z - z0) / (z1 - z0)
        } else {
            (r - r0) / (r1 - r0)
        };
        let [from, to] = self.normals[face];
        let radial = from.0 + (to.0 - from.0) * share;
        let vertical = from.1 + (to.1 - from.1) * share;
        let (x, y) = if r > 1e-12 { (point.x / r, point.y / r) } else { (0.0, 0.0) };
        Vec3::new(x * radial, y * radial, vertical).normalize()
    }

    /// Box around it.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let mut low = Vec3::repeat(f64::INFINITY);
        let mut high = Vec3::repeat(f64::NEG_INFINITY);
        for (r, z) in &self.profile {
            low = low.inf(&Vec3::new(-r, -r, *z));
            high = high.sup(&Vec3::new(*r, *r, *z));
        }
        (low, high)
    }
}
