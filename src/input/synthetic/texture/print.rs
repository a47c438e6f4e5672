//! Printed things: lettering, posters, labels, number plates.

use super::super::finish::{blend, gray, rgb};
use super::super::noise::{coverage, fractal2, hash, noise2, unit};
use super::super::shape::Vec3;

/// Share of ink of a line of made-up letters: each takes a square of size 1,
/// `v` runs 0..1 over the line. A letter is a 3 by 5 raster of hashed dots,
/// every fifth or so is a space.
pub fn lettering(seed: u32, u: f64, v: f64, footprint: f64) -> f64 {
    let index = u.floor();
    let key = hash(seed, index as i32, 17, 5);
    if unit(key) < 0.16 || !(0.0..1.0).contains(&v) {
        return 0.0;
    }
    let (a, b) = ((u - index - 0.15) / 0.7, (v - 0.18) / 0.64);
    if !(0.0..1.0).contains(&a) || !(0.0..1.0).contains(&b) {
        return 0.0;
    }
    let (column, row) = ((a * 3.0) as u32, (b * 5.0) as u32);
    // A stem at the left of most letters, bars and dots elsewhere.
    let stem = column == 0 && key & 7 != 0;
    let bar = row % 2 == 0 && key >> (8 + row) & 3 != 0;
    let dot = (key >> (12 + column + 3 * row)).trailing_zeros() >= 2;
    let solid = if stem || bar || dot { 1.0 } else { 0.0 };
    // Letters finer than a sample turn gray.
    let clear = coverage(footprint - 0.18, 0.12);
    0.45 + (solid - 0.45) * clear
}

/// Lines of small text on paper, in a block of `(0..1)^2`.
pub fn text_block(seed: u32, u: f64, v: f64, lines: f64, footprint: f64) -> f64 {
    let line = (v * lines).floor();
    let length = 0.6 + 0.4 * unit(hash(seed, line as i32, 2, 9));
    if u < 0.0 || u > length || !(0.0..1.0).contains(&v) {
        return 0.0;
    }
    lettering(hash(seed, line as i32, 3, 1), 1.7 * u * lines, v * lines - line, footprint * lines)
}

/// A painted landscape in `(0..1)^2`, v upward.
pub fn landscape(seed: u32, u: f64, v: f64, footprint: f64) -> Vec3 {
    let blur = footprint;
    let sky = blend(rgb(0xE8_C8_98), rgb(0x5C_88_B8), v);
    let cloud = fractal2(seed, 3.0 * u, 7.0 * v, 4, 7.0 * blur);
    let mut colour = blend(sky, rgb(0xF6_EE_E0), (1.6 * cloud).clamp(0.0, 0.8));
    let ridges = [
        (0.62, 2.1, rgb(0x6A_7C_98)),
        (0.48, 3.3, rgb(0x4C_6C_58)),
        (0.30, 5.0, rgb(0x7C_7A_38)),
        (0.14, 8.0, rgb(0x48_3C_24)),
    ];
    for (k, (height, roughness, tone)) in ridges.into_iter().enumerate() {
        let top = height + 0.13 * fractal2(seed + k as u32, roughness * u, 3.7, 4, 0.0);
        let brush = 1.0 + 0.5 * fractal2(seed ^ 0x63, 26.0 * u, 40.0 * v, 2, 40.0 * blur);
        colour = blend(colour, tone * brush, coverage(v - top, blur));
    }
    let sun = ((u - 0.72) * (u - 0.72) + (v - 0.8) * (v - 0.8)).sqrt();
    blend(colour, rgb(0xFF_F2_C0), coverage(sun - 0.06, blur))
}

/// The printed face of a carton in `(0..1)^2`, v upward.
pub fn carton(seed: u32, base: Vec3, accent: Vec3, u: f64, v: f64, footprint: f64) -> Vec3 {
    let wave = 0.42 + 0.09 * noise2(seed, 3.0 * u, 0.5);
    let mut colour = blend(base, accent, coverage(v - wave, footprint));
    // A bowl of something in front of a disc.
    let disc = ((u - 0.5) * (u - 0.5) + 0.8 * (v - 0.45) * (v - 0.45)).sqrt();
    colour = blend(colour, rgb(0xF8_E8_A0), coverage(disc - 0.30, footprint));
    let flakes = fractal2(seed ^ 1, 16.0 * u, 16.0 * v, 3, 16.0 * footprint);
    let food = blend(rgb(0xC8_7A_28), rgb(0x7A_3A_12), (0.5 + 1.4 * flakes).clamp(0.0, 1.0));
    colour = blend(colour, food, coverage(disc - 0.22, footprint) * coverage(0.42 - v, footprint));
    colour = blend(
        colour,
        rgb(0xF4_F4_F4),
        coverage(disc - 0.25, footprint) * coverage(v - 0.42, footprint),
    );
    // Its name, a line below it, small print at the foot.
    let name = lettering(seed, (u - 0.08) * 7.5, (v - 0.80) / 0.14, 7.5 * footprint);
    colour = blend(colour, rgb(0xFA_FA_F2), if (0.08..0.92).contains(&u) { name } else { 0.0 });
    let below = text_block(seed ^ 2, (u - 0.1) / 0.8, (v - 0.70) / 0.08, 2.0, footprint / 0.08);
    colour = blend(colour, gray(0.02), below);
    let foot = text_block(seed ^ 3, (u - 0.08) / 0.84, (v - 0.03) / 0.10, 4.0, footprint / 0.10);
    blend(colour, rgb(0xF0_F0_E8), foot)
}

/// A number plate, `u` and `v` in 0..1.
pub fn plate(seed: u32, u: f64, v: f64, footprint: f64) -> Vec3 {
    let ink = lettering(seed, 7.0 * u, v, 7.0 * footprint);
    blend(rgb(0xEE_EE_E6), gray(0.01), ink)
}
