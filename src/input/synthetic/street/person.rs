//! Walking people: capsules and ellipsoids that swing as people do.

use super::super::finish::rgb;
use super::super::material::Material;
use super::super::noise::pick;
use super::super::part::{Part, Pose};
use super::super::shape::{Capsule, Ellipsoid, Shape, Vec3};
use super::super::texture::outdoor::Weave;

/// Someone who walks in a straight line.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    /// Place at time 0.
    pub from: (f64, f64),
    /// Metres per second along x and y.
    pub velocity: (f64, f64),
    /// Height in metres.
    pub height: f64,
    /// Chooses clothes and gait.
    pub style: u32,
    /// Height of the ground.
    pub ground: f64,
}

const SHIRTS: [u32; 8] = [
    0xC8_2A_2A, 0x2E_6A_B0, 0xE8_E0_D0, 0x2C_7A_4A, 0xE0_A0_20, 0x7A_3A_80, 0x22_26_30, 0xD8_6A_90,
];
const TROUSERS: [u32; 4] = [0x2A_36_52, 0x3A_34_2E, 0x8A_7A_5C, 0x1C_1C_20];
const SKINS: [u32; 4] = [0xE0_AC_88, 0xC6_8A_62, 0x8A_58_3A, 0xF0_C4_A4];
const HAIRS: [u32; 4] = [0x2A_1C_12, 0x6A_46_22, 0xB8_9A_5A, 0x16_14_14];

fn choose(table: &[u32], style: u32, salt: usize) -> Vec3 {
    let index = pick(style, salt, 0.0, table.len() as f64) as usize;
    rgb(table.get(index).copied().unwrap_or(0x80_80_80))
}

/// Adds a person at `time` seconds. The frame: x forward, y left, z up.
pub fn walker(parts: &mut Vec<Part>, object: u16, person: &Walker, time: f64) {
    let (vx, vy) = person.velocity;
    let speed = (vx * vx + vy * vy).sqrt();
    let pose = Pose::at(person.from.0 + vx * time, person.from.1 + vy * time, person.ground)
        .turned(2, libm::atan2(vy, vx));
    let style = person.style;
    let s = person.height / 1.75;
    // One step per 0.7 m of way.
    let phase = std::f64::consts::PI * speed * time / (0.7 * s) + pick(style, 9, 0.0, 6.0);
    let swing = 0.48 * libm::sin(phase);
    let lift = 0.018 * libm::cos(2.0 * phase);

    let weave =
        [Weave::Plain, Weave::Striped, Weave::Checked][pick(style, 4, 0.0, 3.0) as usize % 3];
    let shirt = Material::Cloth {
        colour: choose(&SHIRTS, style, 1),
        second: choose(&SHIRTS, style, 5),
        weave,
        seed: style,
    };
    let trouser_colour = choose(&TROUSERS, style, 2);
    let trousers = Material::Cloth {
        colour: trouser_colour,
        second: trouser_colour,
        weave: Weave::Plain,
        seed: style ^ 0x4D,
    };
    let skin_colour = choose(&SKINS, style, 3);
    let skin = Material::Skin { colour: skin_colour, face: false };
    let mut add = |shape, local: Pose, material| {
        parts.push(Part::new(shape, local.within(&pose), material, object));
    };
    let here = Pose::at(0.0, 0.0, 0.0);
    let p = |x: f64, y: f64, z: f64| Vec3::new(x * s, y * s, z * s + lift);
    let limb = |from, to, radius: f64| Shape::Capsule(Capsule { from, to, radius: radius * s });
    let ball = |x: f64, y: f64, z: f64| {
        Shape::Ellipsoid(Ellipsoid { radii: Vec3::new(x * s, y * s, z * s) })
    };
    let at = |x: f64, y: f64, z: f64| Pose { position: p(x, y, z), ..here };

    // Trunk: hips, belly and shoulders.
    add(ball(0.125, 0.175, 0.15), at(0.0, 0.0, 0.93), trousers);
    add(ball(0.125, 0.165, 0.25), at(0.0, 0.0, 1.14), shirt);
    add(ball(0.13, 0.205, 0.20), at(0.0, 0.0, 1.31), shirt);
    add(limb(p(0.0, 0.0, 1.40), p(0.01, 0.0, 1.54), 0.055), here, skin);
    // Head and hair.
    add(
        ball(0.098, 0.08, 0.118),
        at(0.015, 0.0, 1.63),
        Material::Skin { colour: skin_colour, face: true },
    );
    add(ball(0.103, 0.09, 0.11), at(-0.015, 0.0, 1.66), Material::Hair(choose(&HAIRS, style, 6)));

    for side in [1.0, -1.0] {
        let angle = swing * side;
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        // The knee bends while the leg comes forward.
        let bend = (0.30 - 0.55 * libm::cos(phase) * side).max(0.06);
        let hip = (0.0, 0.095 * side, 0.92);
        let knee = (hip.0 + 0.43 * sin, hip.1, hip.2 - 0.43 * cos);
        let (ks, kc) = (libm::sin(angle - bend), libm::cos(angle - bend));
        let ankle = (knee.0 + 0.42 * ks, knee.1, knee.2 - 0.42 * kc);
        let v = |q: (f64, f64, f64)| p(q.0, q.1, q.2);
        add(limb(v(hip), v(knee), 0.082), here, trousers);
        add(limb(v(knee), v(ankle), 0.060), here, trousers);
        let sole = ankle.2.max(0.06) - 0.02;
        add(
            ball(0.135, 0.05, 0.05),
            at(ankle.0 + 0.06, ankle.1, sole),
            Material::Plain { colour: rgb(0x2A_20_1A), seed: style },
        );
        // Arms swing against the legs.
        let (sin, cos) = (libm::sin(-0.85 * angle), libm::cos(0.85 * angle));
        let shoulder = (0.0, 0.225 * side, 1.40);
        let elbow = (0.29 * sin, 0.25 * side, 1.40 - 0.29 * cos);
        let wrist = (elbow.0 + 0.24 * (sin + 0.25), 0.25 * side, elbow.2 - 0.24 * cos);
        add(limb(v(shoulder), v(elbow), 0.055), here, shirt);
        add(limb(v(elbow), v(wrist), 0.045), here, shirt);
        add(ball(0.05, 0.035, 0.075), at(wrist.0 + 0.01, wrist.1, wrist.2 - 0.08), skin);
    }
    if pick(style, 8, 0.0, 1.0) > 0.5 {
        // A rucksack.
        let colour = choose(&SHIRTS, style, 7);
        let bag = Material::Cloth { colour, second: colour, weave: Weave::Plain, seed: style ^ 5 };
        add(ball(0.11, 0.15, 0.22), at(-0.16, 0.0, 1.24), bag);
    }
}
