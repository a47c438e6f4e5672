//! Cars: a lower body, a cabin, four wheels and two mirrors.

use super::super::finish::rgb;
use super::super::material::Material;
use super::super::part::{Part, Pose};
use super::super::shape::{Convex, Ellipsoid, Lathe, Shape, Vec3};
use super::super::texture::car::CarLook;

/// The body styles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Three boxes.
    Saloon,
    /// Short, steep rear.
    Hatchback,
    /// High and long cabin.
    Van,
}

impl Model {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Hatchback, Self::Saloon, Self::Van];
}

/// One car at one instant.
#[derive(Clone, Copy, Debug)]
pub struct CarPlace {
    /// Middle of the car, across the road.
    pub x: f64,
    /// Middle of the car, along the road.
    pub y: f64,
    /// Direction of its front, radians from +x.
    pub heading: f64,
    /// Body style.
    pub model: Model,
    /// Colour.
    pub paint: Vec3,
    /// Distance driven, which turns the wheels.
    pub rolled: f64,
    /// Brake lights on.
    pub braking: bool,
    /// Plate and dirt.
    pub seed: u32,
}

/// Points of the side view that differ between styles, in metres from the
/// middle of the car.
struct Outline {
    half_length: f64,
    half_width: f64,
    belt: f64,
    roof: f64,
    wheel: f64,
    axles: (f64, f64),
    /// Foot and head of the windscreen.
    windscreen: (f64, f64),
    /// Foot and head of the rear window.
    rear: (f64, f64),
    bonnet: f64,
    boot: f64,
}

fn outline(model: Model) -> Outline {
    match model {
        Model::Saloon => Outline {
            half_length: 2.28,
            half_width: 0.90,
            belt: 0.93,
            roof: 1.44,
            wheel: 0.32,
            axles: (1.40, -1.34),
            windscreen: (0.98, 0.22),
            rear: (-1.58, -0.98),
            bonnet: 0.72,
            boot: 0.90,
        },
        Model::Hatchback => Outline {
            half_length: 1.98,
            half_width: 0.87,
            belt: 0.95,
            roof: 1.50,
            wheel: 0.30,
            axles: (1.24, -1.22),
            windscreen: (0.98, 0.24),
            rear: (-1.92, -1.52),
            bonnet: 0.74,
            boot: 0.94,
        },
        Model::Van => Outline {
            half_length: 2.36,
            half_width: 0.95,
            belt: 1.08,
            roof: 1.90,
            wheel: 0.33,
            axles: (1.48, -1.42),
            windscreen: (1.62, 0.88),
            rear: (-2.32, -2.20),
            bonnet: 0.90,
            boot: 1.08,
        },
    }
}

/// Adds a car standing on z = 0.
pub fn car(parts: &mut Vec<Part>, object: u16, place: &CarPlace) {
    let o = outline(place.model);
    let pose = Pose::at(place.x, place.y, 0.0).turned(2, place.heading);
    let look = CarLook {
        paint: place.paint,
        half_width: o.half_width,
        axles: o.axles,
        wheel: o.wheel,
        belt: o.belt,
        seed: place.seed,
        braking: place.braking,
    };
    let mut add = |shape, local: Pose, material| {
        parts.push(Part::new(shape, local.within(&pose), material, object));
    };
    let here = Pose::at(0.0, 0.0, 0.0);
    add(Shape::Convex(lower_body(&o)), here, Material::CarBody(look));
    add(Shape::Convex(cabin(&o)), here, Material::CarCabin(look));
    let turn = place.rolled / o.wheel;
    for (x, side) in [(o.axles.0, 1.0), (o.axles.0, -1.0), (o.axles.1, 1.0), (o.axles.1, -1.0)] {
        let r = o.wheel;
        let profile = vec![
            (0.0, 0.0),
            (r, 0.0),
            (r, 0.19),
            (0.93 * r, 0.215),
            (0.70 * r, 0.205),
            (0.0, 0.195),
        ];
        // The wheel's axis points outward.
        let local = Pose::at(x, side * (o.half_width - 0.195), r)
            .turned(0, -side * std::f64::consts::FRAC_PI_2);
        let turn = turn * side;
        add(Shape::Lathe(Lathe::new(profile)), local, Material::Wheel { radius: r, turn });
    }
    for side in [1.0, -1.0] {
        let local = Pose::at(o.windscreen.0 - 0.28, side * (o.half_width + 0.07), o.belt + 0.06);
        let shape = Shape::Ellipsoid(Ellipsoid { radii: Vec3::new(0.07, 0.12, 0.075) });
        add(
            shape,
            local,
            Material::Plain { colour: place.paint * 0.8 + rgb(0x10_10_10), seed: place.seed },
        );
    }
}

fn lower_body(o: &Outline) -> Convex {
    let (l, w) = (o.half_length, o.half_width);
    let p = Vec3::new;
    let (front, rear) = (o.windscreen.0, o.rear.0);
    let mut faces = vec![
        (p(0.0, 0.0, 0.20), -Vec3::z()),
        (p(0.0, 0.0, o.belt + 0.02), Vec3::z()),
        // Bonnet and boot slope down from the belt line.
        (p(front, 0.0, o.belt + 0.01), p(o.belt - o.bonnet, 0.0, l - front)),
        (p(rear, 0.0, o.belt + 0.01), p(o.boot - o.belt, 0.0, l + rear)),
        // Bumpers: most prominent at 0.5 m.
        (p(l, 0.0, 0.50), p(1.0, 0.0, 0.16)),
        (p(l, 0.0, 0.50), p(1.0, 0.0, -0.22)),
        (p(-l, 0.0, 0.52), p(-1.0, 0.0, 0.10)),
        (p(-l, 0.0, 0.52), p(-1.0, 0.0, -0.22)),
        (p(l - 0.06, 0.0, o.bonnet - 0.06), p(0.7, 0.0, 0.7)),
    ];
    for side in [1.0, -1.0] {
        faces.push((p(0.0, side * w, 0.58), p(0.0, side, 0.17)));
        faces.push((p(0.0, side * w, 0.58), p(0.0, side, -0.10)));
        // Rounded in plan at both ends.
        faces.push((p(l - 0.24, side * w, 0.5), p(0.55, side * 0.8, 0.0)));
        faces.push((p(l - 0.05, side * (w - 0.30), 0.5), p(0.95, side * 0.38, 0.0)));
        faces.push((p(0.22 - l, side * w, 0.5), p(-0.55, side * 0.8, 0.0)));
    }
    Convex::new((p(-l, -w, 0.20), p(l, w, o.belt + 0.02)), &faces, 0.11)
}

fn cabin(o: &Outline) -> Convex {
    let w = o.half_width;
    let p = Vec3::new;
    let rise = o.roof - o.belt;
    let bottom = o.belt - 0.05;
    let mut faces = vec![
        (p(0.0, 0.0, bottom), -Vec3::z()),
        (p(0.0, 0.0, o.roof), Vec3::z()),
        (p(o.windscreen.0, 0.0, o.belt), p(rise, 0.0, o.windscreen.0 - o.windscreen.1)),
        (p(o.rear.0, 0.0, o.belt), p(-rise, 0.0, o.rear.1 - o.rear.0)),
        // The roof is curved a little.
        (p(o.windscreen.1 - 0.25, 0.0, o.roof), p(0.16, 0.0, 1.0)),
        (p(o.rear.1 + 0.35, 0.0, o.roof), p(-0.14, 0.0, 1.0)),
    ];
    for side in [1.0, -1.0] {
        faces.push((p(0.0, side * (w - 0.07), o.belt), p(0.0, side, 0.30)));
        faces.push((
            p(0.0, side * (w - 0.07 - 0.30 * rise - 0.06), o.roof),
            p(0.0, side * 0.5, 0.85),
        ));
    }
    Convex::new((p(o.rear.0 - 0.1, -w, bottom), p(o.windscreen.0 + 0.1, w, o.roof)), &faces, 0.07)
}
