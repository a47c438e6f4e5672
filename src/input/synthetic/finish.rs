//! What a texture says about a surface point, and helpers to say it.

use super::shape::Vec3;

/// The point whose look is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// In the part's coordinates, metres.
    pub local: Vec3,
    /// Normal in the part's coordinates.
    pub normal: Vec3,
    /// Face of the shape.
    pub face: usize,
    /// Distance to the border of the face, where the shape knows.
    pub inset: f64,
    /// Size of a sample on the surface across the view, metres.
    pub footprint: f64,
    /// Mean size of a sample on the surface, larger at grazing angles.
    pub blur: f64,
}

/// How a surface point answers to light.
#[derive(Clone, Copy, Debug)]
pub struct Finish {
    /// Diffuse reflectance, linear.
    pub albedo: Vec3,
    /// Reflectance of the clear coat seen head-on; 0 for matt surfaces.
    pub coat: f64,
    /// Sharpness of the sun's reflection: the number of squarings.
    pub polish: u32,
    /// Light of its own.
    pub glow: Vec3,
    /// Added to the normal before it is made of length 1.
    pub bump: Vec3,
}

impl Finish {
    /// A matt surface.
    pub fn matt(albedo: Vec3) -> Self {
        Self { albedo, coat: 0.0, polish: 3, glow: Vec3::zeros(), bump: Vec3::zeros() }
    }

    /// A surface under clear coat.
    pub fn coated(albedo: Vec3, coat: f64, polish: u32) -> Self {
        Self { coat, polish, ..Self::matt(albedo) }
    }
}

/// A colour given as `0xRRGGBB` of a picture, made linear by squaring.
pub const fn rgb(hex: u32) -> Vec3 {
    const fn channel(value: u32) -> f64 {
        let v = (value & 255) as f64 / 255.0;
        v * v
    }
    Vec3::new(channel(hex >> 16), channel(hex >> 8), channel(hex))
}

/// Gray of a linear value.
pub fn gray(value: f64) -> Vec3 {
    Vec3::repeat(value)
}

/// `a` for share 0, `b` for share 1.
pub fn blend(a: Vec3, b: Vec3, share: f64) -> Vec3 {
    a + (b - a) * share
}
