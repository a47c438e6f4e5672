//! The table: a few things stand on it, others lie flat. x right, y away from
//! the camera, z up from the table top.

mod things;

use super::finish::rgb;
use super::grid::Stage;
use super::material::Material;
use super::part::{Part, Pose};
use super::shape::{Convex, Shape, Vec3};
use super::world::{Backdrop, Lighting, World, camera_pose};

/// Distance of the wall.
const WALL: f64 = 1.95;

/// The table at `time` seconds.
pub fn compose(time: f64) -> World {
    let mut parts = room();
    flat_things(&mut parts);
    things::mug(&mut parts, 1, Pose::at(-0.235, 0.80, 0.0).turned(2, 0.5));
    things::bottle(&mut parts, 2, Pose::at(0.085, 1.02, 0.0).turned(2, -1.2));
    things::carton(&mut parts, 3, Pose::at(-0.33, 1.17, 0.0).turned(2, 0.32));
    things::ball(&mut parts, 4, time);
    things::book_stack(&mut parts, 5, Pose::at(0.36, 0.93, 0.0).turned(2, -0.35));
    things::plant(&mut parts, 6, Pose::at(0.42, 1.30, 0.0));
    World { parts, lighting: lighting(), backdrop: Backdrop::Room, camera: camera(time) }
}

/// Pose of the left camera: it drifts like a head that looks around.
fn camera(time: f64) -> Pose {
    let x = -0.05 + 0.020 * libm::sin(0.9 * time);
    let y = 0.015 * libm::sin(0.7 * time + 1.0);
    let z = 0.46 + 0.006 * libm::sin(1.3 * time);
    let heading = 0.010 * libm::sin(0.9 * time + 0.3);
    let pitch = -0.345 + 0.004 * libm::sin(1.1 * time);
    camera_pose(Vec3::new(x, y, z), heading, pitch, 0.003 * libm::sin(0.8 * time))
}

fn slab(parts: &mut Vec<Part>, low: [f64; 3], high: [f64; 3], material: Material, softness: f64) {
    let shape = Convex::cuboid(Vec3::from(low), Vec3::from(high), softness);
    parts.push(Part::new(Shape::Convex(shape), Pose::at(0.0, 0.0, 0.0), material, 0));
}

fn room() -> Vec<Part> {
    let mut parts = Vec::new();
    slab(&mut parts, [-0.95, 0.12, -0.04], [0.95, 1.52, 0.0], Material::Boards, 0.006);
    slab(&mut parts, [-4.0, WALL, -1.2], [4.0, WALL + 0.2, 2.0], Material::Wallpaper, 0.0);
    let panel = Material::Plain { colour: rgb(0xD8_D2_C2), seed: 801 };
    slab(&mut parts, [-4.0, WALL - 0.02, -1.2], [4.0, WALL, 0.02], panel, 0.0);
    slab(&mut parts, [-4.0, WALL - 0.045, 0.02], [4.0, WALL, 0.05], panel, 0.012);
    // Boards of the panelling.
    for k in -9..9 {
        let x = 0.22 * f64::from(k) + 0.04;
        slab(&mut parts, [x, WALL - 0.032, -1.2], [x + 0.15, WALL, 0.0], panel, 0.01);
    }
    // Nothing is to be seen behind the wall or below the table.
    for part in &mut parts {
        part.casts = false;
    }
    let half = (0.26, 0.19);
    let shape =
        Convex::cuboid(Vec3::new(-half.0, -0.025, -half.1), Vec3::new(half.0, 0.0, half.1), 0.006);
    let material = Material::Picture { seed: 802, half };
    parts.push(Part::new(Shape::Convex(shape), Pose::at(0.02, WALL, 0.36), material, 0));
    let half = (0.13, 0.17);
    let shape =
        Convex::cuboid(Vec3::new(-half.0, -0.02, -half.1), Vec3::new(half.0, 0.0, half.1), 0.006);
    let material = Material::Picture { seed: 813, half };
    parts.push(Part::new(Shape::Convex(shape), Pose::at(-0.72, WALL, 0.34), material, 0));
    parts
}

/// Things with strong edges that do not stand out: a mat, a printed sheet, a
/// thin booklet and a pencil.
fn flat_things(parts: &mut Vec<Part>) {
    let mut lay = |half: (f64, f64), thickness: f64, pose: Pose, material| {
        let shape = Convex::cuboid(
            Vec3::new(-half.0, -half.1, 0.0),
            Vec3::new(half.0, half.1, thickness),
            0.0,
        );
        parts.push(Part::new(Shape::Convex(shape), pose, material, 0));
    };
    let half = (0.19, 0.13);
    lay(
        half,
        0.002,
        Pose::at(-0.20, 0.79, 0.0).turned(2, 0.12),
        Material::Mat { colour: rgb(0x8A_9A_B4), second: rgb(0xD8_D0_BC), half },
    );
    let size = (0.16, 0.226);
    lay(
        (size.0 / 2.0, size.1 / 2.0),
        0.0006,
        Pose::at(0.17, 0.72, 0.0).turned(2, -0.30),
        Material::Sheet { seed: 821, size },
    );
    let size = (0.13, 0.18, 0.008);
    lay(
        (size.0 / 2.0, size.1 / 2.0),
        size.2,
        Pose::at(-0.56, 0.98, 0.0).turned(2, 0.5),
        Material::Book { cover: rgb(0xC2_3A_2A), ink: rgb(0xF0_E0_B0), seed: 822, size },
    );
    lay(
        (0.085, 0.0035),
        0.007,
        Pose::at(0.20, 0.70, 0.0006).turned(2, 0.9),
        Material::Plain { colour: rgb(0xE0_B0_20), seed: 823 },
    );
}

fn lighting() -> Lighting {
    // A window on the left: sixteen points of it, in an order in which any
    // four in a row surround the middle.
    let main = Vec3::new(-0.80, -0.30, 0.78).normalize();
    let aside = main.cross(&Vec3::z()).normalize();
    let above = aside.cross(&main);
    let quarters = [(-0.25, -0.25), (0.25, 0.25), (0.25, -0.25), (-0.25, 0.25)];
    let sun = quarters
        .iter()
        .flat_map(|(p, q)| {
            [(-0.5, -0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, 0.5)].map(|(a, b)| {
                (main + aside * (0.11 * (a + p)) + above * (0.11 * (b + q))).normalize()
            })
        })
        .collect();
    let pale = rgb(0xE4_E0_DA) * 0.34;
    let high = |x: f64, y: f64| (Vec3::new(x, y, 1.5).normalize(), pale * 0.9);
    let low = |x: f64, y: f64, share: f64| (Vec3::new(x, y, 0.5).normalize(), pale * share);
    Lighting {
        sun,
        sun_colour: Vec3::new(1.75, 1.68, 1.55),
        ambient: vec![
            high(1.0, 0.3),
            low(-0.5, -1.0, 1.5),
            high(-0.3, 1.0),
            low(1.0, -0.5, 0.5),
            high(-1.0, -0.3),
            low(0.5, 1.0, 0.4),
            high(0.3, -1.0),
            low(-1.0, 0.5, 1.6),
        ],
        bounce: Vec3::new(0.20, 0.18, 0.16),
        haze: 1e9,
        stage: Stage {
            low: Vec3::new(-1.2, 0.0, -0.1),
            high: Vec3::new(1.2, 2.0, 0.8),
            cell: 0.03,
        },
    }
}
