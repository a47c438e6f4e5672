//! Paint, glass, lamps and wheels of cars. Coordinates: x forward, y left,
//! z up from the road.

use super::super::finish::{Finish, Spot, blend, gray, rgb};
use super::super::noise::{coverage, fold, fractal3, stripe};
use super::super::shape::Vec3;
use super::print::plate;

/// What distinguishes one car from another.
#[derive(Clone, Copy, Debug)]
pub struct CarLook {
    /// Colour of the paint.
    pub paint: Vec3,
    /// Half of its width in metres.
    pub half_width: f64,
    /// x of the front and rear axle.
    pub axles: (f64, f64),
    /// Wheel radius in metres.
    pub wheel: f64,
    /// Height of the belt line, where the windows begin.
    pub belt: f64,
    /// Number plate and dirt.
    pub seed: u32,
    /// Brake lights on.
    pub braking: bool,
}

/// The lower body.
pub fn body(look: &CarLook, spot: &Spot) -> Finish {
    let p = spot.local;
    let n = spot.normal;
    let fp = spot.blur;
    let q = [3.0 * p.x, 3.0 * p.y, 3.0 * p.z];
    let dirt = fractal3(look.seed, q, 4, 3.0 * fp);
    let low = ((0.62 - p.z) / 0.4).clamp(0.0, 1.0);
    let mut albedo =
        blend(look.paint, rgb(0x7A_70_62), (0.10 + 0.5 * low + 0.35 * dirt).clamp(0.0, 0.55));
    let mut coat = 0.05 * (1.0 - 0.6 * low);
    let mut glow = Vec3::zeros();
    let mut cover = |colour: Vec3, share: f64, shine: f64| {
        albedo = blend(albedo, colour, share);
        coat += (shine - coat) * share;
    };
    // Sills and bumpers of dark plastic.
    cover(rgb(0x2E_2E_30), coverage(p.z - 0.34, fp), 0.02);
    let side = n.y.abs() > 0.6;
    if side {
        for axle in [look.axles.0, look.axles.1] {
            let (dx, dz) = (p.x - axle, p.z - look.wheel);
            let r = (dx * dx + dz * dz).sqrt();
            cover(gray(0.004), coverage(r - look.wheel - 0.06, fp), 0.0);
        }
        // Door gaps, a crease and the handles.
        let (front, rear) = look.axles;
        let span = front - rear;
        for share in [0.22, 0.55, 0.86] {
            let x = rear + share * span;
            cover(gray(0.006), 0.85 * stripe(p.x - x, 0.009, fp) * coverage(0.36 - p.z, fp), 0.0);
        }
        cover(look.paint * 0.55, 0.7 * stripe(p.z - (look.belt - 0.22), 0.008, fp), 0.05);
        for share in [0.30, 0.63] {
            let x = rear + share * span;
            let handle = stripe(p.x - x, 0.09, fp) * stripe(p.z - (look.belt - 0.10), 0.017, fp);
            cover(rgb(0x18_18_1A), handle, 0.1);
        }
    } else if n.x > 0.5 {
        let across = p.y.abs();
        let w = look.half_width;
        let grille = stripe(p.z - 0.52, 0.12, fp) * coverage(across - 0.55 * w, fp);
        let bars = stripe(fold(p.z, 0.05), 0.012, fp);
        cover(blend(gray(0.006), rgb(0xB8_B8_BC), 0.7 * bars), grille, 0.1);
        let lamp = stripe(p.z - 0.68, 0.075, fp) * stripe(across - 0.78 * w, 0.17 * w, fp);
        let bulb = coverage(((across - 0.78 * w).abs() - 0.05).max((p.z - 0.68).abs() - 0.05), fp);
        cover(blend(rgb(0x9A_A0_A6), rgb(0xFF_FC_F0), bulb), lamp, 0.25);
        glow += rgb(0xFF_F4_D8) * (1.1 * lamp * bulb);
        let at = ((p.y + 0.26) / 0.52, (p.z - 0.36) / 0.11);
        if (0.0..1.0).contains(&at.0) && (0.0..1.0).contains(&at.1) {
            cover(plate(look.seed, 1.0 - at.0, at.1, fp / 0.52), 1.0, 0.05);
        }
    } else if n.x < -0.5 {
        let across = p.y.abs();
        let w = look.half_width;
        let lamp = stripe(p.z - 0.74, 0.09, fp) * stripe(across - 0.80 * w, 0.15 * w, fp);
        cover(rgb(0xB0_12_10), lamp, 0.15);
        let brake = if look.braking { 1.6 } else { 0.25 };
        glow += rgb(0xE8_20_18) * (brake * lamp);
        cover(
            gray(0.008),
            0.8 * stripe(across - 0.72 * w, 0.008, fp) * coverage(p.z - 0.9, fp),
            0.0,
        );
        let at = ((p.y + 0.26) / 0.52, (p.z - 0.56) / 0.12);
        if (0.0..1.0).contains(&at.0) && (0.0..1.0).contains(&at.1) {
            cover(plate(look.seed, at.0, at.1, fp / 0.52), 1.0, 0.05);
        }
        cover(gray(0.01), stripe(p.z - 0.42, 0.014, fp) * coverage(across - 0.8 * w, fp), 0.02);
    } else if n.z > 0.6 && p.x > 0.0 {
        // The gap around the bonnet.
        let gap = stripe(p.y.abs() - 0.84 * look.half_width, 0.008, fp);
        cover(gray(0.01), 0.7 * gap, 0.0);
    }
    Finish { coat, polish: 6, glow, ..Finish::matt(albedo) }
}

/// Roof, pillars and windows.
pub fn cabin(look: &CarLook, spot: &Spot) -> Finish {
    let p = spot.local;
    let fp = spot.blur;
    let mut glass = coverage(0.055 - spot.inset, fp);
    if spot.normal.z > 0.86 || p.z < look.belt + 0.02 {
        glass = 0.0;
    }
    if spot.normal.y.abs() > 0.6 {
        // The pillar between the doors.
        let pillar = look.axles.1 + 0.55 * (look.axles.0 - look.axles.1);
        glass *= 1.0 - stripe(p.x - pillar, 0.05, fp);
    }
    // Seats and headrests seen dimly through the glass.
    let seat = coverage(
        (fold(p.y, 0.7).abs() - 0.16).max((p.z - look.belt - 0.22).abs() - 0.13),
        2.0 * fp,
    );
    let inside = blend(rgb(0x20_24_28), rgb(0x2E_2E_30), seat);
    let albedo = blend(look.paint, inside, glass);
    let rubber = stripe(spot.inset - 0.055, 0.012, fp) * f64::from(u8::from(glass > 0.0));
    let coat = 0.05 + 0.11 * glass;
    Finish::coated(blend(albedo, gray(0.008), rubber), coat * (1.0 - rubber), 7)
}

/// A wheel; its axis is z, the outside at large z.
pub fn wheel(radius: f64, turn: f64, spot: &Spot) -> Finish {
    let p = spot.local;
    let fp = spot.blur;
    let r = (p.x * p.x + p.y * p.y).sqrt() / radius;
    let tyre = rgb(0x0030_3032) * (0.8 + 0.3 * fold(r * 9.0, 1.0).abs());
    if spot.normal.z.abs() < 0.5 {
        let angle = libm::atan2(p.y, p.x) - turn;
        let tread = stripe(fold(angle * radius, 0.05), 0.008, fp);
        return Finish::matt(tyre * (1.0 - 0.6 * tread));
    }
    let angle = libm::atan2(p.y, p.x) - turn;
    // Five spokes, narrow at the hub.
    let from_spoke = fold(angle, std::f64::consts::TAU / 5.0).abs() * r * radius;
    let spoke = coverage(from_spoke - 0.035, fp);
    let rim = stripe(r - 0.66, 0.05, fp / radius).max(coverage(r - 0.2, fp / radius));
    let alloy = spoke.max(rim) * coverage(r - 0.71, fp / radius);
    let hole = blend(gray(0.006), rgb(0xB4_B6_BA), alloy);
    let albedo = blend(tyre, hole, coverage(r - 0.71, fp / radius));
    Finish::coated(albedo, 0.03 + 0.2 * alloy, 4)
}
