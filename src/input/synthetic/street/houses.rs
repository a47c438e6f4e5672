//! The two rows of houses.

use super::super::finish::rgb;
use super::super::material::Material;
use super::super::noise::pick;
use super::super::part::{Part, Pose};
use super::super::shape::{Convex, Facade, Shape, Vec3};
use super::super::texture::front::{Front, Masonry};
use super::{STEP, front_line};

const COLOURS: [u32; 8] = [
    0xA8_58_44, 0xD8_C4_98, 0x94_4A_3A, 0xC8_CC_C8, 0xB8_9A_70, 0xD0_A0_88, 0x8E_9A_A0, 0xB4_6C_50,
];
const ACCENTS: [u32; 5] = [0x1E_4A_38, 0x6A_1E_22, 0x20_34_5C, 0x4A_34_20, 0x2A_2C_30];

/// Adds both rows, with gaps for side streets, and a house across the far end.
pub fn add(parts: &mut Vec<Part>) {
    for (side, seed) in [(1.0, 701_u32), (-1.0, 702)] {
        let mut y = -14.0;
        let mut index = 0_usize;
        while y < 128.0 {
            let width = pick(seed, index, 9.0, 16.0);
            let gap = if index % 3 == 2 { pick(seed, 300 + index, 4.0, 7.0) } else { 0.0 };
            house(parts, seed + 16 * index as u32, side, y + width / 2.0, width);
            y += width + gap;
            index += 1;
        }
    }
    let form = facade(740, 46.0, 10.0);
    let pose = Pose::at(2.0, 150.0, 0.0).turned(2, std::f64::consts::PI);
    let look = Front {
        form,
        masonry: Masonry::Plaster,
        colour: rgb(0xC8_B0_90),
        accent: rgb(0x40_30_28),
        seed: 740,
    };
    parts.push(Part::new(Shape::Facade(form), pose, Material::Front(look), 0));
}

fn facade(seed: u32, width: f64, height: f64) -> Facade {
    let base = pick(seed, 20, 3.1, 3.7);
    let floors = ((height - base) / pick(seed, 21, 2.8, 3.3)).floor().max(1.0);
    Facade {
        width,
        height,
        depth: 9.0,
        bays: (width / pick(seed, 22, 2.3, 3.3)) as i32,
        base,
        floor: (height - base - 0.7) / floors,
        window_width: pick(seed, 23, 0.36, 0.52),
        window_height: pick(seed, 24, 0.52, 0.66),
        shop_width: pick(seed, 25, 0.55, 0.82),
        recess: pick(seed, 26, 0.14, 0.24),
    }
}

fn house(parts: &mut Vec<Part>, seed: u32, side: f64, y: f64, width: f64) {
    let height = pick(seed, 1, 8.5, 12.5);
    let form = facade(seed, width, height);
    let masonry = [Masonry::Brick, Masonry::Plaster, Masonry::Brick, Masonry::Stone]
        [pick(seed, 2, 0.0, 4.0) as usize % 4];
    let colour = rgb(COLOURS[pick(seed, 3, 0.0, 8.0) as usize % 8]);
    let accent = rgb(ACCENTS[pick(seed, 4, 0.0, 5.0) as usize % 5]);
    let setback = pick(seed, 5, 0.0, 0.35);
    let pose = Pose::at(side * (front_line() + setback), y, STEP)
        .turned(2, side * std::f64::consts::FRAC_PI_2);
    let look = Front { form, masonry, colour, accent, seed };
    parts.push(Part::new(Shape::Facade(form), pose, Material::Front(look), 0));

    let mut slab = |low: Vec3, high: Vec3, colour: Vec3| {
        let shape = Shape::Convex(Convex::cuboid(low, high, 0.02));
        parts.push(Part::new(shape, pose, Material::Plain { colour, seed }, 0));
    };
    let half = width / 2.0;
    // Cornice and the string course over the ground floor.
    slab(Vec3::new(-half, -0.3, height - 0.35), Vec3::new(half, 0.32, height), rgb(0xB8_B0_A0));
    slab(
        Vec3::new(-half, -0.3, form.base - 0.06),
        Vec3::new(half, 0.12, form.base + 0.1),
        rgb(0xC4_BC_AC),
    );
    // Sills of the upper windows.
    let storeys = ((height - form.base) / form.floor) as i32;
    for storey in 0..storeys {
        let z = form.base + (f64::from(storey) + 0.5) * form.floor;
        let Some(row) = form.opening(0.0, z) else { continue };
        for bay in 0..form.bays {
            let x = (f64::from(bay) + 0.5) * width / f64::from(form.bays) - half;
            let Some(w) = form.opening(x, z) else { continue };
            let low = Vec3::new(w.x.0 - 0.08, -0.05, row.z.0 - 0.09);
            let high = Vec3::new(w.x.1 + 0.08, 0.09, row.z.0);
            slab(low, high, rgb(0xCC_C6_B8));
        }
    }
    // A drain pipe at one end.
    let x = half - 0.22;
    slab(Vec3::new(x, 0.02, 0.0), Vec3::new(x + 0.1, 0.12, height - 0.3), rgb(0x5A_62_60));
    if pick(seed, 6, 0.0, 1.0) > 0.45 {
        awnings(parts, &pose, &form, accent, seed);
    }
}

/// Sloping awnings over some of the shops.
fn awnings(parts: &mut Vec<Part>, pose: &Pose, form: &Facade, accent: Vec3, seed: u32) {
    for bay in 0..form.bays {
        if pick(seed, 60 + bay as usize, 0.0, 1.0) < 0.4 {
            continue;
        }
        let x = (f64::from(bay) + 0.5) * form.width / f64::from(form.bays) - form.width / 2.0;
        let Some(shop) = form.opening(x, 1.0) else { continue };
        let (low, high) = (shop.z.1 - 0.42, shop.z.1 + 0.03);
        let reach = 0.95;
        let p = Vec3::new;
        let slope = p(0.0, high - low, reach);
        let faces = [
            (p(shop.x.0 - 0.1, 0.0, 0.0), -Vec3::x()),
            (p(shop.x.1 + 0.1, 0.0, 0.0), Vec3::x()),
            (p(0.0, 0.0, high), slope),
            (p(0.0, 0.0, high - 0.05), -slope),
            (p(0.0, 0.0, 0.0), -Vec3::y()),
            (p(0.0, reach, 0.0), Vec3::y()),
        ];
        let bounds = (p(shop.x.0 - 0.1, 0.0, low - 0.06), p(shop.x.1 + 0.1, reach, high));
        let cloth = Material::Awning { colour: accent * 1.6, second: rgb(0xE8_E2_D4) };
        parts.push(Part::new(Shape::Convex(Convex::new(bounds, &faces, 0.0)), *pose, cloth, 0));
    }
}
