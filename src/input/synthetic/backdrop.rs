//! Light that comes from no part: the sky, and what smooth surfaces mirror.

use super::finish::{blend, rgb};
use super::noise::{cell, fractal2};
use super::shape::Vec3;
use super::world::Backdrop;

impl Backdrop {
    /// Light from direction `d` of length 1.
    pub fn light(self, d: Vec3) -> Vec3 {
        match self {
            Self::Street => street(d),
            Self::Room => room(d),
        }
    }
}

fn street(d: Vec3) -> Vec3 {
    if d.z < 0.0 {
        return rgb(0x5C_5A_57) * (0.6 + 0.4 * (1.0 + d.z));
    }
    // In mirrors: houses to the left and right up to about 40 degrees.
    let sideways = d.x.abs() / (d.x * d.x + d.y * d.y).sqrt().max(1e-9);
    let roofs = 0.62 * sideways * (0.8 + 0.4 * cell(3, (d.y * 9.0).floor() as i32, 0));
    if d.z < roofs && sideways > 0.35 {
        return rgb(0x6E_62_58) * (0.5 + 0.5 * d.z);
    }
    let zenith = rgb(0x4F_8C_D6) * 1.15;
    let horizon = rgb(0xC9_DD_EE) * 1.25;
    let up = d.z.max(0.0);
    let clear = blend(horizon, zenith, (up * 1.9).min(1.0).sqrt());
    // Clouds on a plane overhead.
    let scale = 1.0 / (up + 0.12);
    let cover = fractal2(91, 1.3 * d.x * scale, 0.9 * d.y * scale, 5, 0.0);
    let thickness = ((cover + 0.02) * 2.6).clamp(0.0, 1.0);
    blend(clear, rgb(0xF6_F4_F0) * 1.3, thickness * (0.25 + up).min(0.8))
}

fn room(d: Vec3) -> Vec3 {
    // One window with a cross, left of the camera; a pale ceiling; dim walls.
    let wall = rgb(0x8C_84_78) * 0.55;
    if d.x < -0.3 {
        let (u, v) = (d.y / -d.x, d.z / -d.x);
        let inside = (u - 0.1).abs() < 0.75 && (v - 0.45).abs() < 0.5;
        let bar = (u - 0.1).abs() < 0.05 || (v - 0.45).abs() < 0.04;
        if inside && !bar {
            return rgb(0xE8_F0_FA) * 2.6;
        }
    }
    let ceiling = rgb(0xD8_D4_CC) * 0.7;
    let table = rgb(0x7A_58_3A) * 0.5;
    if d.z >= 0.0 {
        blend(wall, ceiling, (2.0 * d.z).min(1.0))
    } else {
        blend(wall, table, (-3.0 * d.z).min(1.0))
    }
}
