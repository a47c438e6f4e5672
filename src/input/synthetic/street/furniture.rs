//! Lamp posts, signs, bollards, trees and hedges.

use super::super::finish::rgb;
use super::super::material::Material;
use super::super::noise::pick;
use super::super::part::{Part, Pose};
use super::super::shape::{Capsule, Convex, Ellipsoid, Foliage, Lathe, Shape, Vec3};
use super::super::texture::outdoor::Sign;

/// Adds a lamp post whose arm reaches over the road.
pub fn lamp_post(parts: &mut Vec<Part>, object: u16, x: f64, y: f64, ground: f64) {
    let colour = rgb(0x4A_5A_54);
    let metal = Material::Metal { colour, seed: 601 };
    let post = Lathe::new(vec![
        (0.0, 0.0),
        (0.13, 0.0),
        (0.13, 0.25),
        (0.10, 0.32),
        (0.085, 1.1),
        (0.07, 1.15),
        (0.045, 5.6),
        (0.0, 5.62),
    ]);
    let pose = Pose::at(x, y, ground);
    parts.push(Part::new(Shape::Lathe(post), pose, metal, object));
    let reach = -x.signum() * 1.5;
    let arm =
        Capsule { from: Vec3::new(0.0, 0.0, 5.5), to: Vec3::new(reach, 0.0, 5.85), radius: 0.035 };
    parts.push(Part::new(Shape::Capsule(arm), pose, metal, object));
    let head = Ellipsoid { radii: Vec3::new(0.34, 0.13, 0.08) };
    let at = Pose::at(reach, 0.0, 5.85).within(&pose);
    parts.push(Part::new(Shape::Ellipsoid(head), at, metal, object));
    let glass = Ellipsoid { radii: Vec3::new(0.24, 0.10, 0.07) };
    let at = Pose::at(reach, 0.0, 5.81).within(&pose);
    parts.push(Part::new(Shape::Ellipsoid(glass), at, Material::Lamp, object));
}

/// Adds a bollard of 0.95 m.
pub fn bollard(parts: &mut Vec<Part>, object: u16, x: f64, y: f64, ground: f64) {
    let shape = Lathe::new(vec![
        (0.0, 0.0),
        (0.09, 0.0),
        (0.085, 0.75),
        (0.095, 0.78),
        (0.08, 0.90),
        (0.045, 0.94),
        (0.0, 0.95),
    ]);
    let material = Material::Banded { colour: rgb(0x33_35_38), band: rgb(0xE8_E4_DC) };
    parts.push(Part::new(Shape::Lathe(shape), Pose::at(x, y, ground), material, object));
}

/// Adds a sign on a post that faces the camera's lane: the crossing's blue
/// square, or a speed limit.
pub fn sign_post(
    parts: &mut Vec<Part>,
    object: u16,
    (x, y): (f64, f64),
    ground: f64,
    crossing: bool,
) {
    let pose = Pose::at(x, y, ground);
    let steel = Material::Metal { colour: rgb(0xA0_A4_A8), seed: 602 };
    parts.push(Part::new(Shape::Lathe(Lathe::cylinder(0.038, 2.75)), pose, steel, object));
    let half = if crossing { 0.33 } else { 0.31 };
    let (shape, kind) = if crossing {
        let corner = Vec3::new(half, 0.012, half);
        (Shape::Convex(Convex::cuboid(-corner, corner, 0.0)), Sign::Crossing)
    } else {
        let around = std::f64::consts::TAU / 24.0;
        let mut faces: Vec<(Vec3, Vec3)> = (0..24)
            .map(|k| {
                let angle = around * f64::from(k);
                let out = Vec3::new(libm::cos(angle), 0.0, libm::sin(angle));
                (out * half, out)
            })
            .collect();
        faces.push((Vec3::new(0.0, 0.012, 0.0), Vec3::y()));
        faces.push((Vec3::new(0.0, -0.012, 0.0), -Vec3::y()));
        let corner = Vec3::new(half, 0.012, half);
        (Shape::Convex(Convex::new((-corner, corner), &faces, 0.0)), Sign::Limit)
    };
    let at = Pose::at(0.0, -0.055, 2.42).within(&pose);
    parts.push(Part::new(shape, at, Material::Sign { kind, half }, object));
}

/// Adds a tree. Its trunk up to 2.5 m is the object; the crown, out of the way
/// of traffic, is background.
pub fn tree(parts: &mut Vec<Part>, object: u16, (x, y): (f64, f64), ground: f64, seed: u32) {
    let pose = Pose::at(x, y, ground).turned(2, pick(seed, 0, 0.0, 6.0));
    let girth = pick(seed, 1, 0.13, 0.19);
    let trunk = Lathe::new(vec![
        (1.7 * girth, 0.0),
        (1.2 * girth, 0.15),
        (girth, 0.5),
        (0.85 * girth, 2.5),
    ]);
    parts.push(Part::new(Shape::Lathe(trunk), pose, Material::Bark(seed), object));
    let top = Lathe::new(vec![(0.85 * girth, 2.5), (0.6 * girth, 4.2), (0.0, 4.6)]);
    parts.push(Part::new(Shape::Lathe(top), pose, Material::Bark(seed), 0));
    for k in 0..5 {
        let angle = 1.257 * f64::from(k) + pick(seed, 10 + k as usize, -0.4, 0.4);
        let (s, c) = (libm::sin(angle), libm::cos(angle));
        let bough = Capsule {
            from: Vec3::new(0.0, 0.0, 2.7 + 0.25 * f64::from(k)),
            to: Vec3::new(1.3 * c, 1.3 * s, 4.0 + 0.25 * f64::from(k)),
            radius: 0.045,
        };
        parts.push(Part::new(Shape::Capsule(bough), pose, Material::Bark(seed ^ 1), 0));
    }
    let autumn = pick(seed, 3, 0.0, 0.75);
    let leaf = 0.10;
    for k in 0..26_usize {
        let angle = 2.4 * k as f64;
        let share = (k as f64 + 0.5) / 26.0;
        // A spiral over a rounded crown.
        let height = 3.3 + 3.2 * share;
        let girdle = 1.75 * (1.0 - (1.7 * share - 0.6) * (1.7 * share - 0.6)).max(0.05).sqrt();
        let r = girdle * pick(seed, 40 + k, 0.45, 1.0);
        let size = pick(seed, 80 + k, 0.50, 0.85);
        let shape =
            Foliage { radii: Vec3::new(size, size, 0.72 * size), leaf, seed: seed + k as u32 };
        let at = Pose::at(r * libm::cos(angle), r * libm::sin(angle), height).within(&pose);
        let material = Material::Leaves { seed: seed + k as u32, autumn, leaf };
        parts.push(Part::new(Shape::Foliage(shape), at, material, 0));
    }
}

/// Adds a hedge of `length` along the road.
pub fn hedge(parts: &mut Vec<Part>, (x, y): (f64, f64), length: f64, ground: f64, seed: u32) {
    let count = (length / 0.55) as usize;
    for k in 0..count {
        let size = pick(seed, k, 0.50, 0.66);
        let shape =
            Foliage { radii: Vec3::new(0.55, 0.6, size), leaf: 0.07, seed: seed + k as u32 };
        let at = Pose::at(x + pick(seed, 50 + k, -0.08, 0.08), y + 0.55 * k as f64, ground + 0.5);
        let material = Material::Leaves { seed: seed + k as u32, autumn: 0.08, leaf: 0.07 };
        parts.push(Part::new(Shape::Foliage(shape), at, material, 0));
    }
}
