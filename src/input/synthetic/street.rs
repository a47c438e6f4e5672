//! The street: a car drives towards a zebra crossing between parked cars and
//! houses. The road runs along y; the camera's lane is right of x = 0.

mod car;
mod furniture;
mod houses;
mod person;
mod variation;

use super::finish::rgb;
use super::grid::Stage;
use super::material::Material;
use super::part::{Part, Pose};
use super::shape::{Convex, Shape, Vec3};
use super::texture::road::{KERB, ZEBRA};
use super::world::{Backdrop, Lighting, World, camera_pose};
use car::{CarPlace, Model, car};
use furniture::{bollard, hedge, lamp_post, sign_post, tree};
use person::{Walker, walker};
pub use variation::Variation;

/// Height of the pavement over the road in metres.
const STEP: f64 = 0.12;
/// Height of the cameras over the road.
pub const CAMERA_HEIGHT: f64 = 1.55;
/// Where the houses stand, left and right.
const FRONTS: f64 = 9.2;

/// How far the camera's car has driven at `time` seconds: it brakes gently
/// for the people on the crossing.
fn driven(time: f64) -> f64 {
    6.0 * time - 0.25 * time * time
}

/// What cars are painted with.
const PAINTS: [u32; 13] = [
    0x8C_92_98, 0x1E_5C_58, 0xC8_8A_20, 0xD8_D8_D4, 0x5A_16_22, 0x3A_5A_98, 0x22_24_28, 0x5A_76_8C,
    0x1C_1E_22, 0xC2_6A_1E, 0x9A_A2_A6, 0x34_5A_3A, 0xA0_22_22,
];

/// One of the streets at `time` seconds.
pub fn compose(time: f64, variation: Variation) -> World {
    let mut parts = ground();
    houses::add(&mut parts);
    let mut ids = 1..;
    let mut next = || ids.next().unwrap_or(0);

    for place in cars(time, variation) {
        car(&mut parts, next(), &place);
    }
    for person in people(variation) {
        walker(&mut parts, next(), &person, time);
    }
    for (x, y) in [(6.3, 17.0), (6.3, 36.2), (6.3, 57.0), (-6.3, 26.0), (-6.3, 44.0), (-6.3, 66.0)]
    {
        let id = y as u32;
        let x = x + variation.shift(900 + id, -0.3, 0.3);
        let y = y + variation.shift(800 + id, -2.0, 2.0);
        lamp_post(&mut parts, next(), x, y, STEP);
    }
    for (x, y) in
        [(6.05, 37.4), (6.05, 41.6), (-6.05, 37.4), (-6.05, 41.6), (6.05, 35.9), (-6.05, 43.1)]
    {
        // Those that face each other stay so.
        let y = y + variation.shift(1000 + (10.0 * y) as u32, -0.6, 0.6);
        bollard(&mut parts, next(), x, y, STEP);
    }
    let y = [(34.8, 31, -2.0, 1.0), (22.0, 32, -3.0, 3.0)]
        .map(|(y, id, low, high)| y + variation.shift(id, low, high));
    sign_post(&mut parts, next(), (6.2, y[0]), STEP, true);
    sign_post(&mut parts, next(), (6.2, y[1]), STEP, false);
    for (k, (x, y)) in (0..).zip([
        (6.6, 12.5),
        (6.6, 28.5),
        (6.6, 48.0),
        (-6.6, 18.5),
        (-6.6, 34.0),
        (-6.6, 53.0),
        (6.6, 70.0),
        (-6.6, 76.0),
    ]) {
        let y = y + variation.shift(400 + k, -3.0, 3.0);
        tree(&mut parts, next(), (x, y), STEP, variation.style(300 + k));
    }
    hedge(&mut parts, (8.6, 61.0), 9.0, STEP, 401);
    hedge(&mut parts, (-8.6, 84.0), 12.0, STEP, 402);

    World {
        parts,
        lighting: lighting(driven(time)),
        backdrop: Backdrop::Street,
        camera: camera(time, variation),
    }
}

/// Pose of the left camera: the car sways a little.
fn camera(time: f64, variation: Variation) -> Pose {
    let x = 1.65 + variation.shift(11, -0.25, 0.25) + 0.10 * libm::sin(0.9 * time + 0.4);
    let bob = 0.012 * libm::sin(7.1 * time) + 0.006 * libm::sin(11.3 * time + 1.0);
    let heading = 0.012 * libm::sin(0.8 * time + 1.2);
    let pitch = -0.010 + 0.0035 * libm::sin(5.3 * time) + 0.002 * libm::sin(9.1 * time);
    let roll = 0.004 * libm::sin(3.7 * time + 0.5);
    camera_pose(Vec3::new(x, driven(time), CAMERA_HEIGHT + bob), heading, pitch, roll)
}

fn ground() -> Vec<Part> {
    let slab = |x: (f64, f64), material| {
        let low = Vec3::new(x.0.min(x.1), -30.0, -0.5);
        let high = Vec3::new(x.0.max(x.1), 170.0, STEP);
        Part::new(
            Shape::Convex(Convex::cuboid(low, high, 0.015)),
            Pose::at(0.0, 0.0, 0.0),
            material,
            0,
        )
        .without_shadow()
    };
    let mut parts = vec![
        Part::new(Shape::Ground { reach: 400.0 }, Pose::at(0.0, 0.0, 0.0), Material::Asphalt, 0)
            .without_shadow(),
    ];
    for side in [-1.0, 1.0] {
        parts.push(slab((side * KERB, side * (KERB + 0.18)), Material::Kerb));
        parts.push(slab((side * (KERB + 0.18), side * 14.0), Material::Slabs));
        parts.push(slab((side * 14.0, side * 120.0), Material::Lawn));
    }
    parts
}

fn cars(time: f64, variation: Variation) -> Vec<CarPlace> {
    let north = std::f64::consts::FRAC_PI_2;
    let parked = |x: f64, y: f64, model, paint, seed: u32| CarPlace {
        x: x + 0.12 * super::noise::pick(seed, 1, -1.0, 1.0),
        y: y + variation.shift(seed, -0.9, 0.9),
        heading: if x > 0.0 { north } else { -north }
            + 0.02 * super::noise::pick(seed, 2, -1.0, 1.0),
        model: variation.choose(seed + 5000, model, &Model::ALL),
        paint: rgb(variation.choose(seed + 6000, paint, &PAINTS)),
        rolled: super::noise::pick(seed, 3, 0.0, 1.0),
        braking: false,
        seed,
    };
    // Oncoming, past the camera after two seconds.
    let near = 27.0 + variation.shift(1, -4.0, 6.0) - 7.5 * time;
    // Oncoming, stopping at the crossing.
    let brake = time.min(5.0);
    let far = 67.0 + variation.shift(2, -3.0, 6.0) - 8.0 * brake + 0.8 * brake * brake;
    // Ahead, driving off beyond the crossing.
    let ahead = 46.0 + variation.shift(3, -4.0, 8.0) + 5.0 * time;
    let moving = |x: f64, y: f64, heading, model, paint, seed, braking| CarPlace {
        x,
        y,
        heading,
        model,
        paint: rgb(paint),
        rolled: y,
        braking,
        seed,
    };
    vec![
        moving(-1.8, near, -north, Model::Hatchback, 0xB8_1E_1A, 201, false),
        moving(-1.75, far, -north, Model::Van, 0xE4_E2_DA, 202, false),
        moving(1.75, ahead, north, Model::Saloon, 0x2A_4A_86, 203, false),
        parked(4.65, 9.5, Model::Saloon, 0x8C_92_98, 210),
        parked(4.65, 15.6, Model::Hatchback, 0x1E_5C_58, 211),
        parked(4.70, 26.0, Model::Van, 0xC8_8A_20, 212),
        parked(4.65, 32.0, Model::Hatchback, 0xD8_D8_D4, 213),
        parked(4.65, 49.0, Model::Saloon, 0x5A_16_22, 214),
        parked(4.65, 55.2, Model::Hatchback, 0x3A_5A_98, 215),
        parked(4.65, 67.5, Model::Saloon, 0x22_24_28, 216),
        parked(-4.65, 13.0, Model::Van, 0x5A_76_8C, 220),
        parked(-4.65, 22.3, Model::Saloon, 0x1C_1E_22, 221),
        parked(-4.65, 28.2, Model::Hatchback, 0xC2_6A_1E, 222),
        parked(-4.65, 47.5, Model::Hatchback, 0x9A_A2_A6, 223),
        parked(-4.65, 53.6, Model::Saloon, 0x34_5A_3A, 224),
        parked(-4.65, 65.8, Model::Van, 0xA0_22_22, 225),
    ]
}

fn people(variation: Variation) -> Vec<Walker> {
    let mut people = shipped_people();
    for Walker { from, velocity, height, style, .. } in &mut people {
        let id = *style;
        // Who crosses the road stays on the crossing.
        let along = if velocity.0.abs() > 1.0 { 0.2 } else { 1.0 };
        from.0 += variation.shift(id, -0.4, 0.4);
        from.1 += along * variation.shift(id + 50, -3.0, 3.0);
        velocity.1 *= variation.scale(id + 100, 0.7, 1.3);
        *height *= variation.scale(id + 150, 0.93, 1.06);
        *style = variation.style(id);
    }
    people
}

fn shipped_people() -> Vec<Walker> {
    let middle = f64::midpoint(ZEBRA.0, ZEBRA.1);
    vec![
        // On the crossing, one from each side.
        Walker {
            from: (6.2, middle - 0.5),
            velocity: (-1.35, 0.0),
            height: 1.74,
            style: 501,
            ground: 0.0,
        },
        Walker {
            from: (-5.2, middle + 0.6),
            velocity: (1.25, 0.05),
            height: 1.66,
            style: 502,
            ground: 0.0,
        },
        Walker {
            from: (-6.0, middle - 0.3),
            velocity: (1.22, 0.02),
            height: 1.18,
            style: 503,
            ground: 0.0,
        },
        // On the pavements.
        Walker { from: (7.4, 14.5), velocity: (0.0, 1.3), height: 1.80, style: 504, ground: STEP },
        Walker { from: (7.9, 26.0), velocity: (0.0, -1.2), height: 1.70, style: 505, ground: STEP },
        Walker {
            from: (-7.6, 21.0),
            velocity: (0.03, 1.25),
            height: 1.76,
            style: 506,
            ground: STEP,
        },
        Walker {
            from: (-7.2, 33.0),
            velocity: (0.0, -1.4),
            height: 1.68,
            style: 507,
            ground: STEP,
        },
        Walker {
            from: (7.2, 44.0),
            velocity: (-0.05, -0.9),
            height: 1.72,
            style: 508,
            ground: STEP,
        },
    ]
}

fn lighting(driven: f64) -> Lighting {
    // The sun stands high on the left, a little behind the camera.
    let main = Vec3::new(-0.52, -0.38, 0.92).normalize();
    let aside = main.cross(&Vec3::z()).normalize();
    let above = aside.cross(&main);
    let spread = 0.012;
    let sun = [(-1.0, -0.4), (0.4, -1.0), (1.0, 0.4), (-0.4, 1.0)]
        .map(|(a, b)| (main + aside * (a * spread) + above * (b * spread)).normalize())
        .to_vec();
    let sky = rgb(0x9C_BE_E6) * 0.30;
    let high = |x: f64, y: f64| (Vec3::new(x, y, 1.5).normalize(), sky * 1.1);
    let low = |x: f64, y: f64| (Vec3::new(x, y, 0.42).normalize(), sky * 0.9);
    Lighting {
        sun,
        sun_colour: Vec3::new(2.6, 2.4, 2.1),
        ambient: vec![
            high(1.0, 0.3),
            low(-0.4, -1.0),
            high(-0.3, 1.0),
            low(1.0, -0.4),
            high(-1.0, -0.3),
            low(0.4, 1.0),
            high(0.3, -1.0),
            low(-1.0, 0.4),
        ],
        bounce: Vec3::new(0.26, 0.25, 0.25),
        haze: 900.0,
        stage: Stage {
            low: Vec3::new(-16.0, driven - 4.0, 0.0),
            high: Vec3::new(16.0, driven + 110.0, 9.0),
            cell: 0.5,
        },
    }
}

/// Distance of the house fronts from the middle of the road.
const fn front_line() -> f64 {
    FRONTS
}
