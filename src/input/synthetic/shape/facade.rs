//! House fronts with recessed windows.

use super::{Contact, Ray, Span, Vec3};

/// Names of the faces of a [`Facade`].
pub mod face {
    /// The front between the windows.
    pub const WALL: usize = 0;
    /// The recessed pane.
    pub const PANE: usize = 1;
    /// Left side of a recess, facing +x.
    pub const REVEAL_LEFT: usize = 2;
    /// Right side of a recess, facing -x.
    pub const REVEAL_RIGHT: usize = 3;
    /// Bottom of a recess, facing up.
    pub const SILL: usize = 4;
    /// Top of a recess, facing down.
    pub const LINTEL: usize = 5;
    /// The end facing -x.
    pub const END_LOW: usize = 6;
    /// The end facing +x.
    pub const END_HIGH: usize = 7;
    /// The roof.
    pub const ROOF: usize = 8;
}

/// A block with its front at y = 0 facing +y, x along the front, z up.
#[derive(Clone, Copy, Debug)]
pub struct Facade {
    /// Length of the front in metres.
    pub width: f64,
    /// Height in metres.
    pub height: f64,
    /// Depth of the block behind the front.
    pub depth: f64,
    /// Number of window columns.
    pub bays: i32,
    /// Height of the ground floor, which has openings of its own.
    pub base: f64,
    /// Height of each floor above.
    pub floor: f64,
    /// Share of a bay that a window is wide.
    pub window_width: f64,
    /// Share of a floor that a window is high.
    pub window_height: f64,
    /// The same for the ground floor.
    pub shop_width: f64,
    /// How deep the openings are.
    pub recess: f64,
}

/// One opening of a front.
#[derive(Clone, Copy, Debug)]
pub struct Opening {
    /// Column, counted from -x.
    pub bay: i32,
    /// Floor, 0 is the ground floor.
    pub storey: i32,
    /// Extent along x.
    pub x: (f64, f64),
    /// Extent along z.
    pub z: (f64, f64),
}

impl Facade {
    /// The opening whose bay and floor hold `(x, z)`, if that floor is whole.
    pub fn opening(&self, x: f64, z: f64) -> Option<Opening> {
        let bay_width = self.width / f64::from(self.bays);
        let bay = ((x + self.width / 2.0) / bay_width).floor().clamp(0.0, f64::from(self.bays - 1));
        let middle = (bay + 0.5) * bay_width - self.width / 2.0;
        if z < self.base {
            let half = 0.5 * self.shop_width * bay_width;
            let z = (0.35, 0.78 * self.base);
            return Some(Opening {
                bay: bay as i32,
                storey: 0,
                x: (middle - half, middle + half),
                z,
            });
        }
        let storey = ((z - self.base) / self.floor).floor();
        let bottom = self.base + storey * self.floor;
        if bottom + self.floor > self.height {
            return None;
        }
        let half = 0.5 * self.window_width * bay_width;
        let margin = 0.5 * (1.0 - self.window_height) * self.floor;
        Some(Opening {
            bay: bay as i32,
            storey: storey as i32 + 1,
            x: (middle - half, middle + half),
            z: (bottom + margin, bottom + self.floor - margin),
        })
    }

    /// See [`super::Shape::meet`].
    pub fn meet(&self, ray: &Ray, span: Span) -> Option<Contact> {
        let (o, d) = (ray.origin, ray.direction);
        let half = self.width / 2.0;
        // The block first, as three slabs; the camera is never inside.
        let slabs = [
            (o.x, d.x, -half, half, face::END_LOW, face::END_HIGH),
            (o.y, d.y, -self.depth, 0.0, usize::MAX, face::WALL),
            (o.z, d.z, 0.0, self.height, usize::MAX, face::ROOF),
        ];
        let (mut near, mut far, mut hit) = (f64::NEG_INFINITY, span.far, usize::MAX);
        for (origin, speed, low, high, low_face, high_face) in slabs {
            if speed == 0.0 {
                if origin < low || origin > high {
                    return None;
                }
                continue;
            }
            let (enter, leave, face) = if speed > 0.0 {
                ((low - origin) / speed, (high - origin) / speed, low_face)
            } else {
                ((high - origin) / speed, (low - origin) / speed, high_face)
            };
            if enter > near {
                near = enter;
                hit = face;
            }
            far = far.min(leave);
        }
        if near > far || near >= span.far {
            return None;
        }
        if near < span.near {
            return self
                .blocked_from_recess(ray)
                .then_some(Contact { t: span.near, face: face::LINTEL });
        }
        if hit != face::WALL {
            return (span.holds(near) && hit != usize::MAX)
                .then_some(Contact { t: near, face: hit });
        }
        let p = ray.at(near);
        let opening = self
            .opening(p.x, p.z)
            .filter(|w| p.x > w.x.0 && p.x < w.x.1 && p.z > w.z.0 && p.z < w.z.1);
        let Some(opening) = opening else {
            return span.holds(near).then_some(Contact { t: near, face: face::WALL });
        };
        // Inside the opening: the pane, or a side that comes before it.
        let mut inner = Contact { t: (-self.recess - o.y) / d.y, face: face::PANE };
        let mut side = |bound: f64, origin: f64, speed: f64, face: usize| {
            let t = (bound - origin) / speed;
            if t > near && t < inner.t {
                inner = Contact { t, face };
            }
        };
        if d.x > 0.0 {
            side(opening.x.1, o.x, d.x, face::REVEAL_RIGHT);
        } else if d.x < 0.0 {
            side(opening.x.0, o.x, d.x, face::REVEAL_LEFT);
        }
        if d.z > 0.0 {
            side(opening.z.1, o.z, d.z, face::LINTEL);
        } else if d.z < 0.0 {
            side(opening.z.0, o.z, d.z, face::SILL);
        }
        span.holds(inner.t).then_some(inner)
    }

    /// Whether light that starts in a recess hits its sides on the way out.
    fn blocked_from_recess(&self, ray: &Ray) -> bool {
        let o = ray.origin;
        if o.y > 0.0 || o.y < -self.recess - 0.01 || ray.direction.y <= 0.0 {
            return o.y < 0.0;
        }
        let exit = ray.at(-o.y / ray.direction.y);
        self.opening(o.x, o.z)
            .is_none_or(|w| exit.x < w.x.0 || exit.x > w.x.1 || exit.z < w.z.0 || exit.z > w.z.1)
    }

    /// Normal of a face.
    pub fn normal(face: usize) -> Vec3 {
        match face {
            face::REVEAL_LEFT | face::END_HIGH => Vec3::x(),
            face::REVEAL_RIGHT | face::END_LOW => -Vec3::x(),
            face::SILL | face::ROOF => Vec3::z(),
            face::LINTEL => -Vec3::z(),
            _ => Vec3::y(),
        }
    }

    /// Box around it.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (
            Vec3::new(-self.width / 2.0, -self.depth, 0.0),
            Vec3::new(self.width / 2.0, 0.0, self.height),
        )
    }
}
