//! The shapes scenes are made of, and where rays meet them.

mod convex;
mod facade;
mod lathe;
mod round;

pub use convex::Convex;
pub use facade::{Facade, Opening, face as facade_face};
pub use lathe::Lathe;
pub use round::{Capsule, Ellipsoid, Foliage};

/// A point, direction or colour.
pub type Vec3 = nalgebra::Vector3<f64>;

/// The points `origin + t * direction`. The direction need not have length 1:
/// for camera rays it has depth 1, so that `t` is the depth.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes per unit of `t`.
    pub direction: Vec3,
}

impl Ray {
    /// The point at `t`.
    pub fn at(&self, t: f64) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Where a ray meets a shape first.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// Parameter of the ray.
    pub t: f64,
    /// Which face of the shape, counted by the shape itself.
    pub face: usize,
}

/// A closed range of the ray parameter.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// Nothing nearer counts.
    pub near: f64,
    /// Nothing farther counts.
    pub far: f64,
}

impl Span {
    /// True when `t` counts.
    pub fn holds(self, t: f64) -> bool {
        t > self.near && t < self.far
    }
}

/// A shape in its own coordinates.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The plane z = 0, out to `reach` in x and y.
    Ground {
        /// Half extent in metres.
        reach: f64,
    },
    /// An intersection of half spaces.
    Convex(Convex),
    /// An ellipsoid around the origin.
    Ellipsoid(Ellipsoid),
    /// An ellipsoid with holes between leaves.
    Foliage(Foliage),
    /// A cylinder with round ends.
    Capsule(Capsule),
    /// A surface of revolution around z.
    Lathe(Lathe),
    /// A house front with recessed windows.
    Facade(Facade),
}

impl Shape {
    /// First point of the ray on the surface inside `span`.
    pub fn meet(&self, ray: &Ray, span: Span) -> Option<Contact> {
        match self {
            Self::Ground { reach } => {
                let t = -ray.origin.z / ray.direction.z;
                let inside = || {
                    let p = ray.at(t);
                    p.x.abs() < *reach && p.y.abs() < *reach
                };
                (ray.direction.z < 0.0 && span.holds(t) && inside())
                    .then_some(Contact { t, face: 0 })
            }
            Self::Convex(shape) => shape.meet(ray, span),
            Self::Ellipsoid(shape) => shape.meet(ray, span),
            Self::Foliage(shape) => shape.meet(ray, span),
            Self::Capsule(shape) => shape.meet(ray, span),
            Self::Lathe(shape) => shape.meet(ray, span),
            Self::Facade(shape) => shape.meet(ray, span),
        }
    }

    /// Normal of length 1 at a contact, outward where there is an outside.
    pub fn normal(&self, point: Vec3, face: usize) -> Vec3 {
        match self {
            Self::Ground { .. } => Vec3::z(),
            Self::Convex(shape) => shape.normal(point, face),
            Self::Ellipsoid(shape) => shape.normal(point),
            Self::Foliage(shape) => shape.normal(point),
            Self::Capsule(shape) => shape.normal(point),
            Self::Lathe(shape) => shape.normal(point, face),
            Self::Facade(_) => Facade::normal(face),
        }
    }

    /// Distance from a contact to the border of its face, where the shape knows.
    pub fn inset(&self, point: Vec3, face: usize) -> f64 {
        match self {
            Self::Convex(shape) => shape.inset(point, face),
            _ => f64::INFINITY,
        }
    }

    /// A box around the shape: least and greatest corner.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        match self {
            Self::Ground { reach } => {
                (Vec3::new(-reach, -reach, 0.0), Vec3::new(*reach, *reach, 0.0))
            }
            Self::Convex(shape) => shape.bounds,
            Self::Ellipsoid(shape) => (-shape.radii, shape.radii),
            Self::Foliage(shape) => (-shape.radii, shape.radii),
            Self::Capsule(shape) => shape.bounds(),
            Self::Lathe(shape) => shape.bounds(),
            Self::Facade(shape) => shape.bounds(),
        }
    }
}
