//! What stands on the table.

use super::super::finish::rgb;
use super::super::material::Material;
use super::super::noise::pick;
use super::super::part::{Part, Pose};
use super::super::shape::{Capsule, Convex, Ellipsoid, Foliage, Lathe, Shape, Vec3};

/// Adds a mug with a handle and coffee in it.
pub fn mug(parts: &mut Vec<Part>, object: u16, pose: Pose) {
    let (radius, height) = (0.043, 0.098);
    let material = Material::Mug { colour: rgb(0xE6_DC_C4), band: rgb(0x1E_52_7E), radius, height };
    let wall = Lathe::new(vec![
        (0.0, 0.002),
        (radius - 0.006, 0.0),
        (radius, 0.006),
        (radius, height - 0.002),
        (radius - 0.002, height),
        (radius - 0.004, height - 0.002),
        (radius - 0.005, 0.7 * height),
        (0.0, 0.7 * height),
    ]);
    parts.push(Part::new(Shape::Lathe(wall), pose, material, object));
    // The handle: a chain of capsules on an arc.
    let points: Vec<Vec3> = (0..=7)
        .map(|k| {
            let angle = -1.45 + 2.9 * f64::from(k) / 7.0;
            let (s, c) = (libm::sin(angle), libm::cos(angle));
            Vec3::new(radius - 0.006 + 0.033 * c, 0.0, 0.5 * height + 0.031 * s)
        })
        .collect();
    for pair in points.windows(2) {
        let shape = Capsule { from: pair[0], to: pair[1], radius: 0.0062 };
        parts.push(Part::new(Shape::Capsule(shape), pose, material, object));
    }
}

/// Adds a bottle.
pub fn bottle(parts: &mut Vec<Part>, object: u16, pose: Pose) {
    let (radius, height) = (0.038, 0.285);
    let shape = Lathe::new(vec![
        (0.0, 0.0),
        (radius - 0.004, 0.0),
        (radius, 0.006),
        (radius, 0.165),
        (radius * 0.93, 0.182),
        (radius * 0.72, 0.200),
        (radius * 0.46, 0.218),
        (radius * 0.37, 0.235),
        (radius * 0.36, 0.262),
        (radius * 0.42, 0.264),
        (radius * 0.42, 0.285),
        (0.0, 0.285),
    ]);
    let material = Material::Bottle {
        glass: rgb(0x3A_6A_34),
        label: rgb(0xEE_E4_C8),
        seed: 841,
        radius,
        height,
    };
    parts.push(Part::new(Shape::Lathe(shape), pose, material, object));
}

/// Adds a printed carton.
pub fn carton(parts: &mut Vec<Part>, object: u16, pose: Pose) {
    let size = (0.19, 0.065, 0.27);
    let low = Vec3::new(-size.0 / 2.0, -size.1 / 2.0, 0.0);
    let high = Vec3::new(size.0 / 2.0, size.1 / 2.0, size.2);
    let material =
        Material::Carton { seed: 842, base: rgb(0x2C_5C_A8), accent: rgb(0xD8_2C_20), size };
    parts.push(Part::new(Shape::Convex(Convex::cuboid(low, high, 0.003)), pose, material, object));
}

/// Adds a ball that rolls from left to right and slows down.
pub fn ball(parts: &mut Vec<Part>, object: u16, time: f64) {
    let radius = 0.062;
    let way = 0.20 * time - 0.022 * time * time;
    let (x, y) = (-0.34 + 0.98 * way, 0.60 + 0.20 * way);
    // Rolls around the axis across its way.
    let pose = Pose::at(x, y, radius)
        .turned(2, 0.2)
        .turned(1, way / radius)
        .turned(0, 1.05)
        .turned(1, 0.4);
    let colours = [rgb(0xD8_34_28), rgb(0xE8_C0_30), rgb(0x2A_66_B0)];
    let shape = Shape::Ellipsoid(Ellipsoid { radii: Vec3::repeat(radius) });
    parts.push(Part::new(shape, pose, Material::Ball { colours, radius }, object));
}

/// Adds three thick books, one on the other.
pub fn book_stack(parts: &mut Vec<Part>, object: u16, pose: Pose) {
    let books = [
        ((0.24, 0.17, 0.040), 0.0, 0x2E_4A_3A, 0xE0_C8_80),
        ((0.21, 0.15, 0.032), 0.14, 0x8A_2A_24, 0xF0_E4_C0),
        ((0.19, 0.13, 0.036), -0.22, 0x2A_3A_6A, 0xD8_D8_E0),
    ];
    let mut height = 0.0;
    for (k, (size, turn, cover, ink)) in books.into_iter().enumerate() {
        let half = Vec3::new(size.0, size.1, size.2) / 2.0;
        let at = Pose::at(0.006 * k as f64, 0.0, height + half.z).turned(2, turn).within(&pose);
        let material =
            Material::Book { cover: rgb(cover), ink: rgb(ink), seed: 850 + k as u32, size };
        parts.push(Part::new(
            Shape::Convex(Convex::cuboid(-half, half, 0.003)),
            at,
            material,
            object,
        ));
        height += size.2;
    }
}

/// Adds a plant in a clay pot.
pub fn plant(parts: &mut Vec<Part>, object: u16, pose: Pose) {
    let pot = Lathe::new(vec![
        (0.0, 0.0),
        (0.048, 0.0),
        (0.064, 0.085),
        (0.071, 0.086),
        (0.074, 0.108),
        (0.066, 0.108),
        (0.062, 0.095),
        (0.0, 0.095),
    ]);
    let clay = Material::Plain { colour: rgb(0xB0_62_3C), seed: 861 };
    parts.push(Part::new(Shape::Lathe(pot), pose, clay, object));
    for k in 0..16_usize {
        let angle = 2.4 * k as f64;
        let share = (k as f64 + 0.5) / 16.0;
        let r = 0.075 * (1.0 - 0.6 * share) * pick(862, k, 0.6, 1.1);
        let size = pick(863, k, 0.030, 0.048);
        let leaf = 0.011;
        let seed = 870 + k as u32;
        let shape = Foliage { radii: Vec3::new(size, size, 0.8 * size), leaf, seed };
        let at =
            Pose::at(r * libm::cos(angle), r * libm::sin(angle), 0.12 + 0.12 * share).within(&pose);
        let material = Material::Leaves { seed, autumn: 0.05, leaf };
        parts.push(Part::new(Shape::Foliage(shape), at, material, object));
    }
}
