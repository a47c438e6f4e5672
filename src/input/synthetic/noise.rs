//! Noise from integer hashes: the same value on every machine, in any order.

/// A hash of a lattice point: two multiplications and three shifts of a
/// linear combination, as in the low-bias finalisers of integer hashing.
pub fn hash(seed: u32, x: i32, y: i32, z: i32) -> u32 {
    let mut h = (x as u32)
        .wrapping_mul(0x8DA6_B343)
        .wrapping_add((y as u32).wrapping_mul(0xD816_3841))
        .wrapping_add((z as u32).wrapping_mul(0xCB1A_B31F))
        .wrapping_add(seed.wrapping_mul(0x9E37_79B1));
    h ^= h >> 16;
    h = h.wrapping_mul(0x7FEB_352D);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846C_A68B);
    h ^ (h >> 16)
}

/// A hash as a number in 0..1.
pub fn unit(hash: u32) -> f64 {
    f64::from(hash >> 8) / 16_777_216.0
}

/// The largest whole number not above `x`, for `|x| < 2^31`. Without the
/// newest instructions `f64::floor` is a call, and noise needs little else.
pub fn floor(x: f64) -> i32 {
    let whole = x as i32;
    whole - i32::from(x < f64::from(whole))
}

/// A number in 0..1 for a lattice point.
pub fn cell(seed: u32, x: i32, y: i32) -> f64 {
    unit(hash(seed, x, y, 0))
}

/// A number in `low..high` for item `index`.
pub fn pick(seed: u32, index: usize, low: f64, high: f64) -> f64 {
    low + (high - low) * unit(hash(seed, index as i32, 7, 11))
}

/// `3t^2 - 2t^3`.
pub fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// Value noise over the plane, -1..1, with cells of size 1.
pub fn noise2(seed: u32, x: f64, y: f64) -> f64 {
    let (ix, iy) = (floor(x), floor(y));
    let (tx, ty) = (smooth(x - f64::from(ix)), smooth(y - f64::from(iy)));
    let corner = |dx, dy| unit(hash(seed, ix + dx, iy + dy, 0));
    let low = mix(corner(0, 0), corner(1, 0), tx);
    let high = mix(corner(0, 1), corner(1, 1), tx);
    2.0 * mix(low, high, ty) - 1.0
}

/// Value noise in space, -1..1, with cells of size 1.
pub fn noise3(seed: u32, x: f64, y: f64, z: f64) -> f64 {
    let iz = floor(z);
    let (ix, iy) = (floor(x), floor(y));
    let (tx, ty) = (smooth(x - f64::from(ix)), smooth(y - f64::from(iy)));
    let layer = |dz: i32| {
        let corner = |dx, dy| unit(hash(seed, ix + dx, iy + dy, iz + dz));
        let low = mix(corner(0, 0), corner(1, 0), tx);
        let high = mix(corner(0, 1), corner(1, 1), tx);
        mix(low, high, ty)
    };
    2.0 * mix(layer(0), layer(1), smooth(z - f64::from(iz))) - 1.0
}

/// How much of an octave with cells of size `1 / frequency` survives a pixel
/// of size `footprint`: 1 well above, 0 below.
fn visible(frequency: f64, footprint: f64) -> f64 {
    (1.7 - 1.3 * frequency * footprint).clamp(0.0, 1.0)
}

/// Fractal noise over the plane, about -1..1: octaves of halved size and
/// strength, those finer than `footprint` left out.
pub fn fractal2(seed: u32, x: f64, y: f64, octaves: u32, footprint: f64) -> f64 {
    let (mut sum, mut strength, mut frequency) = (0.0, 0.5, 1.0);
    let (mut px, mut py) = (x, y);
    for octave in 0..octaves {
        let share = visible(frequency, footprint);
        if share <= 0.0 {
            break;
        }
        sum += strength * share * noise2(seed.wrapping_add(octave), px, py);
        // Doubled and turned by the 3-4-5 angle: the lattices of the octaves
        // do not line up.
        (px, py) = (1.6 * px - 1.2 * py + 3.7, 1.2 * px + 1.6 * py - 1.3);
        strength *= 0.55;
        frequency *= 2.0;
    }
    sum
}

/// Fractal noise in space, as [`fractal2`].
pub fn fractal3(seed: u32, p: [f64; 3], octaves: u32, footprint: f64) -> f64 {
    let (mut sum, mut strength, mut frequency) = (0.0, 0.5, 1.0);
    let [mut x, mut y, mut z] = p;
    for octave in 0..octaves {
        let share = visible(frequency, footprint);
        if share <= 0.0 {
            break;
        }
        sum += strength * share * noise3(seed.wrapping_add(octave), x, y, z);
        (x, y, z) = (1.6 * x - 1.2 * y + 3.7, 1.2 * x + 1.6 * y - 1.3, 2.0 * z + 5.1);
        strength *= 0.55;
        frequency *= 2.0;
    }
    sum
}

/// Share of a pixel of size `footprint` that lies inside an edge at signed
/// distance `distance` (negative inside).
pub fn coverage(distance: f64, footprint: f64) -> f64 {
    (0.5 - distance / footprint.max(1e-9)).clamp(0.0, 1.0)
}

/// Share of a pixel covered by the stripe `|x| < half`.
pub fn stripe(x: f64, half: f64, footprint: f64) -> f64 {
    let width = (2.0 * half / footprint.max(1e-9)).min(1.0);
    coverage(x.abs() - half, footprint).min(width)
}

/// `x` folded into `-period / 2 .. period / 2`.
pub fn fold(x: f64, period: f64) -> f64 {
    x - period * f64::from(floor(x / period + 0.5))
}
