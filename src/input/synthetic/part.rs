//! Shapes placed in the world.

use nalgebra::Matrix3;

use super::material::Material;
use super::shape::{Contact, Ray, Shape, Span, Vec3};

/// Where a thing stands and how it is turned.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Its axes as columns, in world coordinates.
    pub rotation: Matrix3<f64>,
    /// Its origin in world coordinates.
    pub position: Vec3,
}

impl Pose {
    /// At `position`, not turned.
    pub fn at(x: f64, y: f64, z: f64) -> Self {
        Self { rotation: Matrix3::identity(), position: Vec3::new(x, y, z) }
    }

    /// Turned by `angle` (radians) around its own axis `axis`: 0 x, 1 y, 2 z.
    #[must_use]
    pub fn turned(mut self, axis: usize, angle: f64) -> Self {
        let (s, c) = (libm::sin(angle), libm::cos(angle));
        let turn = match axis {
            0 => Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
            1 => Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
            _ => Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
        };
        self.rotation *= turn;
        self
    }

    /// The pose of a thing whose pose is `self` in the coordinates of `parent`.
    #[must_use]
    pub fn within(&self, parent: &Self) -> Self {
        Self { rotation: parent.rotation * self.rotation, position: parent.point(self.position) }
    }

    /// A point of its own coordinates in the world.
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.rotation * p + self.position
    }

    /// A point of the world in its own coordinates.
    pub fn local(&self, p: Vec3) -> Vec3 {
        self.rotation.tr_mul(&(p - self.position))
    }

    /// A ray of the world in its own coordinates; `t` stays the same.
    pub fn local_ray(&self, ray: &Ray) -> Ray {
        Ray { origin: self.local(ray.origin), direction: self.rotation.tr_mul(&ray.direction) }
    }
}

/// One shape with its place, look and object.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its form.
    pub shape: Shape,
    /// Its place.
    pub pose: Pose,
    /// Its look.
    pub material: Material,
    /// Id of the salient object it belongs to, 0 for background.
    pub object: u16,
    /// False for ground, which has nothing below it to shade.
    pub casts: bool,
    centre: Vec3,
    radius: f64,
}

impl Part {
    /// A shape at a place.
    pub fn new(shape: Shape, pose: Pose, material: Material, object: u16) -> Self {
        let (low, high) = shape.bounds();
        let centre = pose.point((low + high) / 2.0);
        let radius = ((high - low) / 2.0).norm() * 1.0001;
        Self { shape, pose, material, object, casts: true, centre, radius }
    }

    /// The same as ground: it casts no shadow.
    #[must_use]
    pub fn without_shadow(self) -> Self {
        Self { casts: false, ..self }
    }

    /// Distance of its nearest point from `eye`, or less.
    pub fn distance(&self, eye: Vec3) -> f64 {
        (self.centre - eye).norm() - self.radius
    }

    /// First contact of a world ray inside `span`.
    pub fn meet(&self, ray: &Ray, span: Span) -> Option<Contact> {
        let to = self.centre - ray.origin;
        let along = to.dot(&ray.direction);
        let length2 = ray.direction.norm_squared();
        // The bounding sphere is beside the ray's line, or behind the end of the span.
        let reach2 = self.radius * self.radius;
        let beyond = along - span.far * length2;
        if to.norm_squared() * length2 - along * along > reach2 * length2
            || (beyond > 0.0 && beyond * beyond > reach2 * length2)
        {
            return None;
        }
        self.shape.meet(&self.pose.local_ray(ray), span)
    }

    /// The eight corners of its box, in the world. Corners whose numbers
    /// differ in one bit share an edge.
    pub fn corners(&self) -> [Vec3; 8] {
        let (low, high) = self.shape.bounds();
        std::array::from_fn(|i| {
            let side = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
            self.pose.point(Vec3::new(
                side(1, low.x, high.x),
                side(2, low.y, high.y),
                side(4, low.z, high.z),
            ))
        })
    }
}
