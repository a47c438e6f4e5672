//! Walls, windows and shops of house fronts.

use super::super::finish::{Finish, Spot, blend, gray, rgb};
use super::super::noise::{cell, coverage, floor, fold, fractal2, hash, stripe, unit};
use super::super::shape::{Facade, Opening, Vec3, facade_face};
use super::print::lettering;

/// What a wall is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Masonry {
    /// Running bond.
    Brick,
    /// Rendered and painted.
    Plaster,
    /// Cut blocks.
    Stone,
}

/// The look of one house.
#[derive(Clone, Copy, Debug)]
pub struct Front {
    /// Geometry of its windows.
    pub form: Facade,
    /// Wall above the ground floor.
    pub masonry: Masonry,
    /// Its colour.
    pub colour: Vec3,
    /// Colour of shop fronts and doors.
    pub accent: Vec3,
    /// Everything that differs from house to house.
    pub seed: u32,
}

impl Front {
    /// The look at a spot.
    pub fn finish(&self, spot: &Spot) -> Finish {
        let p = spot.local;
        match spot.face {
            facade_face::PANE => self.pane(spot),
            facade_face::SILL => Finish::matt(rgb(0xB8_B2_A6) * (0.9 + 0.2 * p.x.fract())),
            facade_face::ROOF => Finish::matt(rgb(0x6A_4A_40)),
            facade_face::END_LOW | facade_face::END_HIGH => {
                Finish::matt(masonry(self, p.y, p.z, spot.blur))
            }
            facade_face::WALL => self.wall(spot),
            _ => Finish::matt(masonry(self, p.x + p.y, p.z, spot.blur) * 0.9),
        }
    }

    fn wall(&self, spot: &Spot) -> Finish {
        let (x, z) = (spot.local.x, spot.local.z);
        let blur = spot.blur;
        let mut colour = masonry(self, x, z, blur);
        if z < self.form.base {
            // The ground floor: rusticated stone, sign boards over the shops.
            let block = masonry(&Self { masonry: Masonry::Stone, ..*self }, x, z, blur);
            colour = blend(block, colour, 0.25);
            if let Some(shop) = self.form.opening(x, z) {
                let inside = x > shop.x.0 - 0.12 && x < shop.x.1 + 0.12;
                let board = z > shop.z.1 + 0.06 && z < self.form.base - 0.08;
                if inside && board {
                    colour = self.sign_board(&shop, x, z, blur);
                }
            }
        } else if let Some(w) = self.form.opening(x, z) {
            // Painted frame around each window, stronger under it.
            let outside = (w.x.0 - x).max(x - w.x.1).max((w.z.0 - z).max(z - w.z.1));
            let trim =
                if self.masonry == Masonry::Brick { rgb(0xC9_C2_B2) } else { rgb(0xE6_E0_D2) };
            colour = blend(colour, trim * 0.9, coverage(outside - 0.13, blur));
            // Rain streaks below the sills.
            let below = w.z.0 - z;
            if below > 0.1 && x > w.x.0 - 0.1 && x < w.x.1 + 0.1 {
                let streak = fractal2(self.seed ^ 5, 5.0 * x, 0.4 * z, 3, 5.0 * blur) + 0.2;
                colour *= 1.0 - (0.5 * streak * (1.0 - below)).clamp(0.0, 0.4);
            }
        }
        // Damp and dirt towards the ground.
        let damp = (1.2 - z + 0.8 * fractal2(self.seed ^ 9, 0.8 * x, 0.8 * z, 3, 0.8 * blur)) / 1.2;
        colour *= 1.0 - 0.35 * damp.clamp(0.0, 1.0);
        Finish::matt(colour)
    }

    fn sign_board(&self, shop: &Opening, x: f64, z: f64, blur: f64) -> Vec3 {
        let key = hash(self.seed, shop.bay, 0, 3);
        let height = self.form.base - 0.08 - shop.z.1 - 0.06;
        let u = (x - shop.x.0) / (0.75 * height);
        let v = (z - shop.z.1 - 0.06) / height;
        let ink = lettering(key, u, v, blur / height);
        let light = unit(key) > 0.5;
        let (ground, text) =
            if light { (rgb(0xEC_E6_D4), self.accent) } else { (self.accent, rgb(0xF4_EC_D0)) };
        blend(ground, text, ink)
    }

    /// Glass with what is behind it, in its frame.
    fn pane(&self, spot: &Spot) -> Finish {
        let (x, z) = (spot.local.x, spot.local.z);
        let blur = spot.blur;
        let Some(w) = self.form.opening(x, z) else { return Finish::matt(gray(0.05)) };
        let key = hash(self.seed, w.bay, w.storey, 1);
        let (u, v) = ((x - w.x.0) / (w.x.1 - w.x.0), (z - w.z.0) / (w.z.1 - w.z.0));
        let edge = (x - w.x.0).min(w.x.1 - x).min((z - w.z.0).min(w.z.1 - z));
        if w.storey == 0 {
            return self.shop(&w, key, u, v, edge, blur);
        }
        let middle = f64::midpoint(w.x.0, w.x.1);
        let rail = w.z.0 + 0.68 * (w.z.1 - w.z.0);
        let frame = coverage(edge - 0.07, blur).max(stripe(x - middle, 0.035, blur)).max(stripe(
            z - rail,
            0.03,
            blur,
        ));
        // Behind the glass: a dark room, curtains, sometimes a blind.
        let mut room = rgb(0x2A_2C_30) * (0.6 + 0.6 * v);
        let kind = unit(key);
        let folds = 0.75 + 0.25 * fold(x * 7.0 + f64::from(w.bay), 1.0).abs() * 2.0;
        let drawn = 0.12 + 0.36 * unit(key.rotate_left(8));
        if kind < 0.55 && (u < drawn || u > 1.0 - drawn) {
            room =
                blend(rgb(0xD8_D0_C0), rgb(0x9A_6A_58), unit(key.rotate_left(16))) * (0.55 * folds);
        } else if kind > 0.78 && v > 0.35 + 0.5 * unit(key.rotate_left(4)) {
            room = rgb(0xC8_C2_B4) * (0.55 + 0.25 * stripe(fold(z, 0.09), 0.03, blur));
        }
        let albedo = blend(room, rgb(0xE8_E4_DC) * 0.85, frame);
        Finish { coat: 0.14 * (1.0 - frame), polish: 7, ..Finish::matt(albedo) }
    }

    fn shop(&self, w: &Opening, key: u32, u: f64, v: f64, edge: f64, blur: f64) -> Finish {
        let width = w.x.1 - w.x.0;
        let frame_colour = self.accent * 0.8;
        let is_door = unit(key.rotate_left(12)) < 0.35;
        let frame = coverage(edge - if is_door { 0.13 } else { 0.06 }, blur);
        if is_door && v < 0.8 {
            // Two leaves with panels.
            let panel_u = fold(2.0 * u - 0.5, 1.0).abs();
            let panel = stripe(panel_u - 0.33, 0.03, blur).max(stripe(
                fold(3.0 * v, 1.0).abs() - 0.38,
                0.03,
                blur,
            ));
            let handle =
                coverage((u - 0.55).abs() - 0.02, blur) * coverage((v - 0.42).abs() - 0.03, blur);
            let wood = blend(self.accent * 0.7, gray(0.02), 0.6 * panel);
            return Finish::coated(blend(wood, rgb(0xE0_C0_60), handle), 0.03, 5);
        }
        // Goods on shelves behind the glass, lit from inside.
        let (shelf, slot) = ((v * 4.0).floor(), (u * width * 3.2 + shelf_shift(v)).floor());
        let goods = hash(key, shelf as i32, slot as i32, 2);
        // Muted colours: the channels share one brightness.
        let light = 0.10 + 0.45 * unit(goods.rotate_left(5));
        let tone = |shift: u32| light * (0.55 + 0.6 * unit(goods.rotate_left(shift)));
        let height = 0.35 + 0.55 * unit(goods.rotate_left(21));
        let here = (v * 4.0).fract();
        let mut inside = if here < height && here > 0.06 {
            Vec3::new(tone(0), tone(7), tone(14))
        } else {
            rgb(0x3A_34_2C) * 0.7
        };
        inside = blend(inside, rgb(0x9A_80_5A), stripe(fold(v * 4.0, 1.0), 0.04, blur));
        let albedo = blend(inside, frame_colour, frame);
        Finish {
            coat: 0.10 * (1.0 - frame),
            polish: 7,
            glow: inside * (0.25 * (1.0 - frame)),
            ..Finish::matt(albedo)
        }
    }
}

fn shelf_shift(v: f64) -> f64 {
    0.37 * (v * 4.0).floor()
}

/// Wall colour at `(x, z)` of the front plane.
fn masonry(front: &Front, x: f64, z: f64, blur: f64) -> Vec3 {
    let seed = front.seed;
    let large = 1.0 + 0.28 * fractal2(seed, 0.35 * x, 0.35 * z, 4, 0.35 * blur);
    match front.masonry {
        Masonry::Brick => {
            let (long, high) = (0.25, 0.085);
            let course = (z / high).floor();
            let shifted = x + 0.5 * long * (course - 2.0 * (course / 2.0).floor());
            let tint = cell(seed ^ 1, floor(shifted / long), course as i32);
            let joint =
                stripe(fold(z, high), 0.007, blur).max(stripe(fold(shifted, long), 0.007, blur));
            let grain = fractal2(seed ^ 2, 24.0 * x, 24.0 * z, 2, 24.0 * blur);
            let burnt = if tint > 0.9 { 0.62 } else { 0.75 + 0.5 * tint };
            let brick = front.colour * (burnt * large * (1.0 + 0.3 * grain));
            blend(brick, rgb(0xB4_AC_A0) * large, joint)
        }
        Masonry::Plaster => {
            let rough = fractal2(seed ^ 3, 9.0 * x, 9.0 * z, 4, 9.0 * blur);
            let stain = fractal2(seed ^ 4, 1.3 * x, 0.3 * z, 4, 1.3 * blur);
            front.colour * (large * (1.0 + 0.22 * rough) * (1.0 - (0.7 * stain).clamp(0.0, 0.35)))
        }
        Masonry::Stone => {
            let (long, high) = (0.9, 0.42);
            let course = (z / high).floor();
            let shifted = x + 0.5 * long * (course - 2.0 * (course / 2.0).floor());
            let tint = cell(seed ^ 6, floor(shifted / long), course as i32);
            let joint =
                stripe(fold(z, high), 0.014, blur).max(stripe(fold(shifted, long), 0.014, blur));
            let rough = fractal2(seed ^ 7, 6.0 * x, 6.0 * z, 4, 6.0 * blur);
            front.colour * (large * (0.82 + 0.3 * tint) * (1.0 + 0.3 * rough) * (1.0 - 0.6 * joint))
        }
    }
}
