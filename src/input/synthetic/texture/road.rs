//! Asphalt, markings, kerbs and pavements. The road runs along y, its centre
//! line is x = 0.

use super::super::finish::{Finish, Spot, blend, gray, rgb};
use super::super::noise::{cell, coverage, floor, fold, fractal2, hash, noise2, stripe, unit};
use super::super::shape::Vec3;

/// Distance of the edge line from the centre line in metres.
const EDGE_LINE: f64 = 3.45;
/// Distance of the kerb from the centre line in metres.
pub const KERB: f64 = 5.7;
/// Where the zebra crossing lies along the road, from and to.
pub const ZEBRA: (f64, f64) = (38.0, 41.0);

/// The carriageway.
pub fn asphalt(spot: &Spot) -> Finish {
    let (x, y) = (spot.local.x, spot.local.y);
    let blur = spot.blur;
    let mut tone = 0.150;
    tone *= 1.0 + 0.30 * fractal2(11, 0.23 * x, 0.11 * y, 5, 0.23 * blur);
    // Stones in the binder, and wear along the wheel tracks.
    let grain = fractal2(12, 17.0 * x, 17.0 * y, 3, 17.0 * blur);
    tone *= 1.0 + 0.75 * grain;
    let clumps = fractal2(14, 3.1 * x, 3.1 * y, 3, 3.1 * blur);
    tone *= 1.0 + 0.42 * clumps;
    let track = (fold(x, 3.5).abs() - 0.85).abs();
    tone *= 1.0 - 0.13 * (1.0 - track / 0.35).max(0.0);
    let mut colour = Vec3::new(tone * 1.02, tone, tone * 0.97);

    // Repaired rectangles, one in some stretches of 9 m.
    let plot = floor(y / 9.0);
    if cell(15, plot, i32::from(x > 0.0)) > 0.45 {
        let middle = Vec3::new(
            x.signum() * (0.9 + 2.6 * cell(16, plot, i32::from(x > 0.0))),
            9.0 * (f64::from(plot) + 0.3 + 0.4 * cell(17, plot, 0)),
            0.0,
        );
        let half = (0.5 + 0.7 * cell(18, plot, 1), 0.9 + 1.6 * cell(19, plot, 2));
        let d = ((x - middle.x).abs() - half.0).max((y - middle.y).abs() - half.1);
        let shade = if cell(20, plot, 3) > 0.4 { 0.66 } else { 1.28 };
        colour *= 1.0 + (shade - 1.0) * coverage(d, 2.0 * blur);
        // Bitumen along the seam.
        colour *= 1.0 - 0.55 * stripe(d, 0.03, 2.0 * blur);
    }
    // Cracks: where a warped noise crosses zero.
    let warp = noise2(21, 1.7 * x, 1.7 * y);
    let crack = fractal2(22, 0.42 * x + 0.3 * warp, 0.30 * y + 0.2 * warp, 3, 0.0);
    let where_old = (fractal2(23, 0.15 * x, 0.09 * y, 2, 0.0) + 0.15).clamp(0.0, 0.4) / 0.4;
    colour *= 1.0 - 0.6 * where_old * stripe(crack, 0.006, 0.35 * blur);
    // Oil in the middle of the lanes.
    let stain = fractal2(24, 0.9 * x, 0.35 * y, 3, 0.9 * blur) - 0.22;
    colour *= 1.0 - (2.2 * stain).clamp(0.0, 0.45);
    colour = manhole(spot, colour);

    let paint = markings(x, y, spot.footprint, blur);
    let worn = (0.95 + 0.9 * fractal2(25, 6.0 * x, 4.0 * y, 4, 6.0 * blur)).clamp(0.15, 1.0);
    colour = blend(colour, rgb(0xD6_D2_C6) * (0.9 + 0.3 * grain), paint * worn);
    Finish { bump: Vec3::new(0.3 * grain, 0.3 * clumps, 0.0), ..Finish::matt(colour) }
}

/// Share of the point that is painted.
fn markings(x: f64, y: f64, footprint: f64, blur: f64) -> f64 {
    let long = 2.0 * blur;
    let zebra_near = coverage((y - f64::midpoint(ZEBRA.0, ZEBRA.1)).abs() - 1.5, long);
    let zebra =
        zebra_near * stripe(fold(x, 1.0), 0.26, footprint) * coverage(x.abs() - 5.2, footprint);
    let stop = |at: f64, low: f64, high: f64| {
        stripe(y - at, 0.15, long)
            * stripe(x - f64::midpoint(low, high), (high - low) / 2.0, footprint)
    };
    let stops = stop(ZEBRA.0 - 1.6, 0.2, 3.3).max(stop(ZEBRA.1 + 1.6, -3.3, -0.2));
    let beside = coverage(2.4 - (y - f64::midpoint(ZEBRA.0, ZEBRA.1)).abs(), long);
    let dash = coverage(fold(y - 1.0, 6.0).abs() - 1.5, long);
    let centre = stripe(x, 0.07, footprint) * dash * beside;
    let edge = stripe(x.abs() - EDGE_LINE, 0.06, footprint) * beside;
    // Bays for parked cars.
    let bay =
        stripe(fold(y + 1.0, 6.0), 0.05, long) * stripe(x.abs() - 4.6, 1.1, footprint) * beside;
    zebra.max(stops).max(centre).max(edge).max(bay)
}

fn manhole(spot: &Spot, ground: Vec3) -> Vec3 {
    let (x, y) = (spot.local.x, spot.local.y);
    let plot = floor(y / 13.0);
    let cx = -2.6 + 5.2 * cell(26, plot, 0);
    let cy = 13.0 * (f64::from(plot) + 0.2 + 0.6 * cell(27, plot, 0));
    let r = ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt();
    if r > 0.6 {
        return ground;
    }
    let blur = 1.5 * spot.blur;
    let studs = stripe(fold(x - cx, 0.11), 0.03, blur) * stripe(fold(y - cy, 0.11), 0.03, blur);
    let iron = rgb(0x5A_55_50) * (0.55 + 0.9 * studs);
    let ring = stripe(r - 0.36, 0.02, blur);
    let frame = blend(rgb(0x77_74_70), ground, coverage(0.44 - r, blur));
    let lid = blend(frame, iron, coverage(r - 0.36, blur));
    blend(lid, gray(0.012), ring)
}

/// Kerb stones.
pub fn kerb(spot: &Spot) -> Finish {
    let y = spot.local.y;
    let stone = floor(y / 1.0);
    let tint = 0.85 + 0.3 * cell(31, stone, 0);
    let joint = stripe(fold(y, 1.0), 0.012, 1.6 * spot.blur);
    let speck = fractal2(32, 30.0 * y, 30.0 * (spot.local.x + spot.local.z), 3, 30.0 * spot.blur);
    let colour = rgb(0xA8_A6_A0) * (tint * (1.0 + 0.4 * speck));
    Finish::matt(colour * (1.0 - 0.7 * joint))
}

/// Paving slabs, staggered row by row.
pub fn slabs(spot: &Spot) -> Finish {
    let (x, y) = (spot.local.x, spot.local.y);
    let blur = spot.blur;
    let row = (x / 0.4).floor();
    let along = y + 0.3 * (row - 2.0 * (row / 2.0).floor());
    let column = (along / 0.6).floor();
    let tint = unit(hash(33, row as i32, column as i32, 0));
    let joint = stripe(fold(x - 0.2, 0.4), 0.009, blur).max(stripe(
        fold(along - 0.3, 0.6),
        0.009,
        1.5 * blur,
    ));
    let grime = fractal2(34, 0.7 * x, 0.7 * y, 5, 0.7 * blur);
    let grain = fractal2(35, 22.0 * x, 22.0 * y, 3, 22.0 * blur);
    let mut colour = blend(rgb(0x9C_96_8C), rgb(0x86_84_82), tint) * (0.82 + 0.36 * tint);
    colour *= 1.0 + 0.5 * grime + 0.4 * grain;
    // Chewing gum and drips.
    let spot_noise = noise2(36, 2.3 * x, 2.3 * y);
    colour *= 1.0 - 0.4 * ((spot_noise - 0.72) * 9.0).clamp(0.0, 1.0);
    Finish::matt(colour * (1.0 - 0.65 * joint))
}

/// Lawn beside and beyond the street.
pub fn lawn(spot: &Spot) -> Finish {
    let (x, y) = (spot.local.x, spot.local.y);
    let tuft = fractal2(37, 2.4 * x, 2.4 * y, 5, 2.4 * spot.blur);
    let patch = fractal2(38, 0.2 * x, 0.2 * y, 3, 0.2 * spot.blur);
    let colour = blend(rgb(0x5E_76_38), rgb(0x8A_86_50), (0.5 + patch).clamp(0.0, 1.0));
    Finish::matt(colour * (0.8 + 0.9 * tuft))
}
