//! Clothes, skin, bark, leaves, metal and signs.

use super::super::finish::{Finish, Spot, blend, gray, rgb};
use super::super::noise::{coverage, floor, fold, fractal2, fractal3, hash, stripe, unit};
use super::super::shape::Vec3;

/// A pattern woven into or printed on cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weave {
    /// One colour.
    Plain,
    /// Horizontal stripes.
    Striped,
    /// Checks.
    Checked,
}

/// Cloth with folds.
pub fn cloth(colour: Vec3, second: Vec3, weave: Weave, seed: u32, spot: &Spot) -> Finish {
    let p = spot.local;
    let fp = spot.blur;
    let folds = fractal3(seed, [9.0 * p.x, 9.0 * p.y, 4.0 * p.z], 4, 9.0 * fp);
    let albedo = match weave {
        Weave::Plain => colour,
        Weave::Striped => blend(colour, second, stripe(fold(p.z, 0.12), 0.03, fp)),
        Weave::Checked => {
            let a = stripe(fold(p.z, 0.11), 0.028, fp);
            let b = stripe(fold(p.y + 0.3 * p.x, 0.11), 0.028, fp);
            blend(colour, second, 0.5 * (a + b))
        }
    };
    let bump = Vec3::new(0.0, 0.7 * folds, 0.5 * folds);
    Finish { bump, ..Finish::matt(albedo * (1.0 + 0.5 * folds)) }
}

/// Striped canvas.
pub fn awning(colour: Vec3, second: Vec3, spot: &Spot) -> Finish {
    let p = spot.local;
    let dirt = fractal2(53, 3.0 * p.x, 3.0 * p.y, 4, 3.0 * spot.blur);
    let albedo = blend(colour, second, stripe(fold(p.x, 0.36), 0.09, spot.blur));
    Finish::matt(albedo * (0.9 + 0.4 * dirt))
}

/// Skin; the face looks along +x and has eyes and a mouth.
pub fn skin(colour: Vec3, is_face: bool, spot: &Spot) -> Finish {
    let p = spot.local;
    let fp = spot.blur;
    let mut albedo = colour;
    if is_face && spot.normal.x > 0.2 {
        let eye = coverage(((p.y.abs() - 0.032).abs() - 0.016).max((p.z - 0.02).abs() - 0.008), fp);
        let mouth = coverage((p.y.abs() - 0.025).max((p.z + 0.055).abs() - 0.006), fp);
        albedo = blend(albedo, gray(0.02), eye);
        albedo = blend(albedo, rgb(0x9A_48_40), mouth);
    }
    Finish::matt(albedo)
}

/// Hair.
pub fn hair(colour: Vec3, spot: &Spot) -> Finish {
    let p = spot.local;
    let strands = fractal2(41, 60.0 * p.y, 14.0 * p.z, 3, 60.0 * spot.blur);
    Finish::coated(colour * (1.0 + 0.6 * strands), 0.02, 4)
}

/// Bark of a trunk along z.
pub fn bark(seed: u32, spot: &Spot) -> Finish {
    let p = spot.local;
    let around = libm::atan2(p.y, p.x);
    let ridge = fractal2(seed, 5.0 * around, 3.5 * p.z, 4, 18.0 * spot.blur);
    let fine = fractal2(seed ^ 3, 14.0 * around, 16.0 * p.z, 3, 50.0 * spot.blur);
    let shade = (0.75 + 0.9 * ridge + 0.5 * fine).clamp(0.15, 1.6);
    let moss = (fractal2(seed ^ 8, 2.0 * around, p.z, 3, 0.0) - 0.1).clamp(0.0, 0.4);
    let albedo = blend(rgb(0x7C_68_54), rgb(0x66_74_44), moss) * shade;
    Finish { bump: Vec3::new(0.0, 0.0, 0.6 * ridge), ..Finish::matt(albedo) }
}

/// Leaves of a crown or hedge.
pub fn leaves(seed: u32, autumn: f64, leaf: f64, spot: &Spot) -> Finish {
    let q = spot.local / leaf;
    let h = hash(seed, floor(q.x), floor(q.y), floor(q.z));
    let green = blend(rgb(0x3E_62_22), rgb(0x8A_A8_44), unit(h));
    let yellow = blend(rgb(0xA8_7A_24), rgb(0xC8_A8_3C), unit(h.rotate_left(9)));
    let clump = fractal3(seed ^ 2, [0.3 * q.x, 0.3 * q.y, 0.3 * q.z], 2, 0.3 * spot.blur / leaf);
    Finish::matt(blend(green, yellow, autumn) * (0.8 + 0.7 * clump))
}

/// Painted or galvanised metal.
pub fn metal(colour: Vec3, seed: u32, spot: &Spot) -> Finish {
    let p = spot.local;
    let rust = fractal3(seed, [8.0 * p.x, 8.0 * p.y, 5.0 * p.z], 4, 8.0 * spot.blur);
    let worn = ((rust - 0.25) * 3.0).clamp(0.0, 0.6);
    let albedo = blend(colour * (1.0 + 0.3 * rust), rgb(0x7A_50_34), worn);
    Finish::coated(albedo, 0.05, 4)
}

/// A bollard with two reflecting bands, or a marker of that kind.
pub fn banded(colour: Vec3, band: Vec3, spot: &Spot) -> Finish {
    let at = stripe(spot.local.z - 0.82, 0.05, spot.blur).max(stripe(
        spot.local.z - 0.62,
        0.05,
        spot.blur,
    ));
    let dirt = fractal3(
        51,
        [6.0 * spot.local.x, 6.0 * spot.local.y, 4.0 * spot.local.z],
        3,
        6.0 * spot.blur,
    );
    Finish::coated(blend(colour, band, at) * (1.0 + 0.4 * dirt), 0.03, 4)
}

/// The face of a traffic sign in the x, z plane around the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Blue square, white triangle, walking figure.
    Crossing,
    /// Red ring around white, two digits.
    Limit,
}

/// A traffic sign of half size `half`; its back is bare metal.
pub fn sign(kind: Sign, half: f64, spot: &Spot) -> Finish {
    let (x, z) = (spot.local.x / half, spot.local.z / half);
    let fp = spot.blur / half;
    if spot.normal.y > -0.5 {
        return Finish::coated(rgb(0x9A_9C_9E), 0.1, 4);
    }
    let albedo = match kind {
        Sign::Crossing => {
            let triangle = (x.abs() * 1.73 + z - 0.75).max(-z - 0.62);
            let figure = ((x * x + (z - 0.25) * (z - 0.25)).sqrt() - 0.11)
                .min((x - 0.25 * (z + 0.1)).abs().max((z + 0.02).abs() - 0.2) - 0.08)
                .min((x.abs() - 0.55 * (-z - 0.1)).abs().max((z + 0.35).abs() - 0.2) - 0.06);
            let ground = blend(rgb(0x1E_50_A8), rgb(0xF2_F2_F0), coverage(triangle, fp));
            let border = coverage(0.9 - x.abs().max(z.abs()), fp);
            blend(blend(ground, gray(0.02), coverage(figure, fp)), rgb(0xF2_F2_F0), border)
        }
        Sign::Limit => {
            let r = (x * x + z * z).sqrt();
            let ring = coverage(0.70 - r, fp);
            let three = (x + 0.25).abs() - 0.17;
            let zero = (x - 0.25).abs() - 0.17;
            let digit = three.max(z.abs() - 0.34);
            let other = zero.max(z.abs() - 0.34);
            let holes = ((x + 0.31).abs() - 0.14).max((z.abs() - 0.17).abs() - 0.09);
            let hole = ((x - 0.25).abs() - 0.07).max(z.abs() - 0.24);
            let ink = digit.max(-holes).min(other.max(-hole));
            let inner = blend(rgb(0xF2_F2_F0), gray(0.01), coverage(ink, fp));
            blend(inner, rgb(0xC0_14_14), ring)
        }
    };
    Finish::coated(albedo, 0.03, 4)
}
