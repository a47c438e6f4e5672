//! Convex bodies as intersections of half spaces.

use super::{Contact, Ray, Span, Vec3};

/// The points with `normal . p <= offset` for every face.
#[derive(Clone, Debug)]
pub struct Convex {
    faces: Vec<(Vec3, f64)>,
    /// Edges are shaded as if rounded with this radius; the geometry stays sharp.
    softness: f64,
    /// Box around the body.
    pub bounds: (Vec3, Vec3),
}

impl Convex {
    /// The body inside a box (which adds no faces of its own) and `faces`,
    /// each given by a point on it and an outward direction.
    pub fn new(bounds: (Vec3, Vec3), faces: &[(Vec3, Vec3)], softness: f64) -> Self {
        let faces = faces
            .iter()
            .map(|(point, outward)| {
                let normal = outward.normalize();
                (normal, normal.dot(point))
            })
            .collect();
        Self { faces, softness, bounds }
    }

    /// A box between two corners. Faces: 0 -x, 1 +x, 2 -y, 3 +y, 4 -z, 5 +z.
    pub fn cuboid(low: Vec3, high: Vec3, softness: f64) -> Self {
        let faces = [
            (low, -Vec3::x()),
            (high, Vec3::x()),
            (low, -Vec3::y()),
            (high, Vec3::y()),
            (low, -Vec3::z()),
            (high, Vec3::z()),
        ];
        Self::new((low, high), &faces, softness)
    }

    /// See [`super::Shape::meet`].
    pub fn meet(&self, ray: &Ray, span: Span) -> Option<Contact> {
        let (mut near, mut far, mut face) = (f64::NEG_INFINITY, span.far, usize::MAX);
        for (index, (normal, offset)) in self.faces.iter().enumerate() {
            let speed = normal.dot(&ray.direction);
            let room = offset - normal.dot(&ray.origin);
            if speed < 0.0 {
                let t = room / speed;
                if t > near {
                    near = t;
                    face = index;
                }
            } else if speed > 0.0 {
                far = far.min(room / speed);
            } else if room < 0.0 {
                return None;
            }
            if near > far {
                return None;
            }
        }
        (face != usize::MAX && span.holds(near)).then_some(Contact { t: near, face })
    }

    /// The face's normal, blended with those of faces nearer than the softness.
    pub fn normal(&self, point: Vec3, face: usize) -> Vec3 {
        let own = self.faces[face].0;
        if self.softness <= 0.0 {
            return own;
        }
        let mut sum = own;
        for (index, (normal, offset)) in self.faces.iter().enumerate() {
            let closeness = 1.0 - (offset - normal.dot(&point)) / self.softness;
            if index != face && closeness > 0.0 {
                sum += *normal * (closeness * closeness);
            }
        }
        // Two opposite faces closer than the softness could cancel.
        if sum.norm_squared() > 1e-6 { sum.normalize() } else { own }
    }

    /// Least distance of `point` to the planes of the other faces.
    pub fn inset(&self, point: Vec3, face: usize) -> f64 {
        self.faces
            .iter()
            .enumerate()
            .filter(|(index, _)| *index != face)
            .map(|(_, (normal, offset))| offset - normal.dot(&point))
            .fold(f64::INFINITY, f64::min)
    }
}
