//! Wood, plaster, paper, ceramics and glass.

use super::super::finish::{Finish, Spot, blend, gray, rgb};
use super::super::noise::{
    cell, coverage, floor, fold, fractal2, fractal3, hash, noise2, stripe, unit,
};
use super::super::shape::Vec3;
use super::print::{carton, landscape, lettering, text_block};

/// A table top of boards along x.
pub fn boards(spot: &Spot) -> Finish {
    let (x, y) = (spot.local.x, spot.local.y);
    let blur = spot.blur;
    let width = 0.14;
    let board = (y / width).floor();
    let key = hash(61, board as i32, 0, 0);
    let shift = 40.0 * unit(key);
    let tint = 0.82 + 0.36 * unit(key.rotate_left(9));
    // Year rings: bands of the distance from a wandering line.
    let bend = 0.10 * fractal2(62, 1.1 * x + shift, 3.0 * y, 3, 0.0);
    let across = fold(y, width) + bend + 0.02 * noise2(63, 3.0 * x + shift, 9.0 * y);
    let ring = 55.0 * across + 2.0 * fractal2(64, 2.0 * x + shift, 14.0 * y, 2, 14.0 * blur);
    let phase = 2.0 * fold(ring, 1.0).abs();
    let clear = (1.4 - 80.0 * blur).clamp(0.0, 1.0);
    let late = clear * phase * phase * phase + 0.25 * (1.0 - clear);
    let fibre = fractal2(65, 9.0 * x + shift, 260.0 * y, 3, 120.0 * blur);
    let pores = fractal2(66, 40.0 * x + shift, 420.0 * y, 2, 200.0 * blur);
    let mut colour = blend(rgb(0xC8_92_58), rgb(0x8A_52_28), 0.75 * late) * tint;
    colour *= 1.0 + 0.30 * fibre + 0.22 * pores;
    colour *= 1.0 + 0.25 * fractal2(67, 3.0 * x, 5.0 * y, 4, 5.0 * blur);
    // A knot in some boards.
    let knot_x = fold(x + shift, 0.9);
    let knot_y = fold(y, width) - 0.03 * (unit(key.rotate_left(17)) - 0.5);
    let r = (0.3 * knot_x * knot_x + knot_y * knot_y).sqrt();
    colour *= 1.0 - 0.7 * coverage(r - 0.008, blur) - 0.3 * stripe(r - 0.014, 0.003, blur);
    // Butt joints between boards, and scratches.
    let joint = stripe(fold(y + width / 2.0, width), 0.0012, blur);
    let end = stripe(fold(x + 0.7 * shift, 1.7), 0.0012, blur);
    colour *= 1.0 - 0.75 * joint.max(end);
    let scratch = fractal2(68, 2.0 * x + 9.0 * y, 5.0 * x - 7.0 * y, 2, 0.0);
    colour = blend(colour, rgb(0xD8_B0_80), 0.35 * stripe(scratch, 0.003, 8.0 * blur));
    Finish { bump: Vec3::new(0.0, 0.12 * fibre, 0.0), ..Finish::coated(colour, 0.025, 4) }
}

/// Wallpaper with a woven ground and a repeated leaf, on x and z.
pub fn wallpaper(spot: &Spot) -> Finish {
    let (x, z) = (spot.local.x, spot.local.z);
    let blur = spot.blur;
    let weave = fractal2(71, 130.0 * x, 130.0 * z, 2, 130.0 * blur);
    let shade = fractal2(72, 1.4 * x, 1.4 * z, 4, 1.4 * blur);
    let mottle = fractal2(73, 14.0 * x, 14.0 * z, 4, 14.0 * blur);
    let row = (z / 0.16).floor();
    let u = fold(x + 0.08 * row, 0.16) / 0.16;
    let v = fold(z - 0.08, 0.16) / 0.16;
    // Two leaves on a stem.
    let leaf = |cx: f64, cz: f64, slope: f64| {
        let (a, b) = (u - cx, v - cz);
        let (along, across) = (a * 0.8 + b * slope, b * 0.8 - a * slope);
        (along * along * 6.0 + across * across * 45.0) - 0.16
    };
    let stem = (u - 0.03 * fold(3.0 * v, 1.0)).abs() - 0.012;
    let figure = leaf(-0.16, 0.08, 0.5).min(leaf(0.16, -0.08, -0.5)).min(stem.max(v.abs() - 0.4));
    let ground = rgb(0xB9_C2_B4) * (1.0 + 0.12 * weave + 0.20 * shade + 0.16 * mottle);
    let ink = rgb(0x7C_92_84) * (1.0 + 0.3 * mottle);
    Finish::matt(blend(ground, ink, 0.8 * coverage(figure, 2.0 * blur / 0.16)))
}

/// A framed picture in the x, z plane, `half` its half extents.
pub fn picture(seed: u32, half: (f64, f64), spot: &Spot) -> Finish {
    let (x, z) = (spot.local.x, spot.local.z);
    let edge = (half.0 - x.abs()).min(half.1 - z.abs());
    let blur = spot.blur;
    let (u, v) = (f64::midpoint(x / half.0, 1.0), f64::midpoint(z / half.1, 1.0));
    let painted = landscape(seed, u, v, blur / (2.0 * half.0));
    let mount = blend(rgb(0xE6_E0_D4), painted, coverage(0.05 - edge, blur));
    let grain = fractal2(75, 60.0 * (x + z), 9.0 * (x - z), 3, 60.0 * blur);
    let frame = rgb(0x5C_3A_20) * (1.0 + 0.6 * grain + 6.0 * edge);
    Finish::coated(blend(mount, frame, coverage(edge - 0.022, blur)), 0.03, 4)
}

/// A carton: printed front and back (faces ±y), plain sides with small print.
pub fn box_print(
    seed: u32,
    base: Vec3,
    accent: Vec3,
    size: (f64, f64, f64),
    spot: &Spot,
) -> Finish {
    let p = spot.local;
    let blur = spot.blur;
    let v = p.z / size.2;
    let albedo = if spot.normal.y.abs() > 0.7 {
        let u = 0.5 - spot.normal.y.signum() * p.x / size.0;
        carton(seed, base, accent, u, v, blur / size.0)
    } else if spot.normal.x.abs() > 0.7 {
        let u = 0.5 + spot.normal.x.signum() * p.y / size.1;
        let ink =
            text_block(seed ^ 7, (u - 0.12) / 0.76, (v - 0.1) / 0.55, 11.0, blur / (0.55 * size.2));
        blend(accent, gray(0.015), ink)
    } else {
        blend(accent, base, coverage((p.x / size.0).abs() - 0.3, blur / size.0))
    };
    let wear = fractal3(seed ^ 5, [30.0 * p.x, 30.0 * p.y, 30.0 * p.z], 3, 30.0 * blur);
    Finish::coated(albedo * (1.0 + 0.15 * wear), 0.03, 4)
}

/// A mug: glaze with two bands and a row of dots.
pub fn mug(colour: Vec3, band: Vec3, radius: f64, height: f64, spot: &Spot) -> Finish {
    let p = spot.local;
    let fp = spot.blur;
    let r = (p.x * p.x + p.y * p.y).sqrt();
    if r < 0.93 * radius && spot.normal.z > 0.7 && p.z > 0.3 * height {
        // Coffee.
        let foam = fractal2(81, 70.0 * p.x, 70.0 * p.y, 3, 70.0 * fp);
        return Finish::coated(blend(rgb(0x3A_20_10), rgb(0x9A_6A_40), 0.5 + foam), 0.04, 6);
    }
    let mut albedo = colour;
    if r > 0.97 * radius && spot.normal.z.abs() < 0.5 {
        let angle = libm::atan2(p.y, p.x);
        let bands =
            stripe(p.z - 0.8 * height, 0.004, fp).max(stripe(p.z - 0.2 * height, 0.004, fp));
        let step = std::f64::consts::TAU / 14.0;
        let (a, b) = (fold(angle, step) * radius, p.z - 0.5 * height);
        let petal = (a.abs() + 0.7 * b.abs()) - 0.011 - 0.004 * fold(9.0 * b / height, 1.0);
        albedo = blend(albedo, band, bands.max(coverage(petal, fp)));
    }
    let speck = fractal3(82, [90.0 * p.x, 90.0 * p.y, 90.0 * p.z], 3, 90.0 * fp);
    Finish::coated(albedo * (1.0 + 0.16 * speck), 0.04, 6)
}

/// A bottle of coloured glass with a paper label and a cap.
pub fn bottle(
    glass: Vec3,
    label: Vec3,
    seed: u32,
    radius: f64,
    height: f64,
    spot: &Spot,
) -> Finish {
    let p = spot.local;
    let fp = spot.blur;
    let v = p.z / height;
    if v > 0.94 {
        let knurl = stripe(fold(libm::atan2(p.y, p.x), 0.2), 0.03, fp / 0.015);
        return Finish::coated(rgb(0xC8_A0_30) * (1.0 - 0.5 * knurl), 0.2, 5);
    }
    let around = libm::atan2(p.y, p.x) * radius;
    if (0.14..0.52).contains(&v) {
        let t = (v - 0.14) / 0.38;
        let width = std::f64::consts::TAU * radius;
        let u = around / width + 0.5;
        let rim = stripe(t - 0.06, 0.015, fp / 0.1).max(stripe(t - 0.94, 0.015, fp / 0.1));
        let name = lettering(seed, 12.0 * u, (t - 0.62) / 0.25, 12.0 * fp / width);
        let print = text_block(
            seed ^ 1,
            fold(3.0 * u, 1.0) + 0.5,
            (t - 0.12) / 0.3,
            5.0,
            fp / (0.3 * 0.38 * height),
        );
        let crest = ((fold(u, 0.25) * width) * (fold(u, 0.25) * width)
            + (t - 0.5) * (t - 0.5) * 0.009)
            .sqrt();
        let mut paper =
            label * (1.0 + 0.2 * fractal2(seed, 120.0 * around, 120.0 * p.z, 3, 120.0 * fp));
        paper = blend(paper, rgb(0x8A_1C_1C), name.max(rim));
        paper = blend(paper, gray(0.03), print);
        paper = blend(paper, rgb(0xB8_8A_2C), stripe(crest - 0.008, 0.002, fp));
        return Finish::matt(paper);
    }
    // The liquid ends in the neck.
    let level = coverage(v - 0.70, fp / height);
    let edge = 1.0 - spot.normal.y.abs();
    let body = glass * (0.35 + 0.9 * edge * edge) * (1.0 - 0.4 * level);
    Finish::coated(body, 0.08, 7)
}

/// A ball of six coloured segments around z with a thin seam.
pub fn ball(colours: [Vec3; 3], radius: f64, spot: &Spot) -> Finish {
    let p = spot.local;
    let angle = libm::atan2(p.y, p.x);
    let step = std::f64::consts::TAU / 6.0;
    let segment = ((angle + std::f64::consts::PI) / step).floor() as usize % 6;
    let seam = stripe(fold(angle, step) * (p.x * p.x + p.y * p.y).sqrt(), 0.0012, spot.blur);
    let cap = coverage((p.x * p.x + p.y * p.y).sqrt() - 0.22 * radius, spot.blur);
    let base = blend(colours[segment % 3], rgb(0xF0_EE_E6), cap);
    let felt = fractal3(83, [60.0 * p.x, 60.0 * p.y, 60.0 * p.z], 4, 60.0 * spot.blur);
    Finish::coated(blend(base, gray(0.03), seam) * (1.0 + 0.28 * felt), 0.03, 4)
}

/// A book lying or standing: cover with title on ±z, spine on -y, pages elsewhere.
pub fn book(cover: Vec3, ink: Vec3, seed: u32, size: (f64, f64, f64), spot: &Spot) -> Finish {
    let p = spot.local;
    let fp = spot.blur;
    let grain = fractal3(seed, [140.0 * p.x, 140.0 * p.y, 140.0 * p.z], 3, 140.0 * fp);
    let cloth = cover * (1.0 + 0.25 * grain);
    if spot.normal.z.abs() > 0.7 {
        let (u, v) = (p.x / size.0 + 0.5, p.y / size.1 + 0.5);
        let border = stripe((u - 0.5).abs() - 0.43, 0.008, fp / size.0).max(stripe(
            (v - 0.5).abs() - 0.44,
            0.006,
            fp / size.1,
        ));
        let title = lettering(seed, 9.0 * (u - 0.14), (v - 0.66) / 0.12, 9.0 * fp / size.0);
        let title = if (0.14..0.86).contains(&u) { title } else { 0.0 };
        let medal = ((u - 0.5) * (u - 0.5) + (v - 0.36) * (v - 0.36) * 1.8).sqrt();
        let figure = stripe(medal - 0.14, 0.012, fp / size.0)
            .max(coverage(medal - 0.07 - 0.03 * noise2(seed, 9.0 * u, 9.0 * v), fp / size.0));
        return Finish::coated(blend(cloth, ink, border.max(title).max(figure)), 0.02, 4);
    }
    if spot.normal.y < -0.7 {
        let u = p.x / size.0 + 0.5;
        let v = p.z / size.2 + 0.5;
        let name = lettering(seed ^ 1, 11.0 * (u - 0.12), (v - 0.2) / 0.6, 11.0 * fp / size.0);
        let name = if (0.12..0.7).contains(&u) { name } else { 0.0 };
        let bands = stripe((u - 0.5).abs() - 0.43, 0.01, fp / size.0);
        return Finish::coated(blend(cloth, ink, name.max(bands)), 0.02, 4);
    }
    let leaves = fractal2(84, 2.0 * (p.x + p.y), 900.0 * p.z, 2, 250.0 * fp);
    let boards = coverage(0.5 * size.2 - p.z.abs() - 0.0025, fp);
    Finish::matt(blend(rgb(0xDE_D4_BC) * (1.0 + 0.4 * leaves), cloth, boards))
}

/// A printed sheet lying in the x, y plane.
pub fn sheet(seed: u32, size: (f64, f64), spot: &Spot) -> Finish {
    let (u, v) = (spot.local.x / size.0 + 0.5, spot.local.y / size.1 + 0.5);
    let fp = spot.blur / size.1;
    let mut albedo = rgb(0xF0_EE_E8);
    let head = lettering(seed, 8.0 * (u - 0.1), (v - 0.87) / 0.08, 8.0 * spot.blur / size.0);
    albedo = blend(albedo, rgb(0x20_30_60), if (0.1..0.8).contains(&u) { head } else { 0.0 });
    let image = (0.55..0.9).contains(&u) && (0.52..0.82).contains(&v);
    if image {
        albedo = landscape(seed, (u - 0.55) / 0.35, (v - 0.52) / 0.3, fp / 0.3);
    } else {
        let column = if v > 0.5 { (u - 0.1) / 0.42 } else { (u - 0.1) / 0.8 };
        albedo =
            blend(albedo, gray(0.03), text_block(seed, column, (v - 0.08) / 0.74, 22.0, fp / 0.74));
    }
    Finish::matt(albedo)
}

/// A woven place mat.
pub fn mat(colour: Vec3, second: Vec3, half: (f64, f64), spot: &Spot) -> Finish {
    let (x, y) = (spot.local.x, spot.local.y);
    let fp = spot.blur;
    let (i, j) = (floor(x / 0.006), floor(y / 0.006));
    let over = if (i + j) & 1 == 0 { 1.0 } else { 0.72 };
    let thread = 0.85 + 0.3 * cell(85, if (i + j) & 1 == 0 { i } else { 9000 + j }, 0);
    let plaid = stripe(fold(x, 0.05), 0.009, fp).max(stripe(fold(y, 0.05), 0.009, fp));
    let edge = stripe((half.0 - x.abs()).min(half.1 - y.abs()) - 0.012, 0.004, fp);
    let albedo = blend(blend(colour, second, 0.7 * plaid), second, edge);
    Finish::matt(albedo * (over * thread))
}

/// Plain plastic or painted wood.
pub fn plain(colour: Vec3, seed: u32, spot: &Spot) -> Finish {
    let p = spot.local;
    let speck = fractal3(seed, [50.0 * p.x, 50.0 * p.y, 50.0 * p.z], 4, 50.0 * spot.blur);
    Finish::coated(colour * (1.0 + 0.35 * speck), 0.03, 4)
}
