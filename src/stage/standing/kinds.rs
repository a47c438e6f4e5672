//! What each cell is evidence of.

use super::{WIDE, centre};
use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, prelude::*, u32x16};
use crate::stage::ground::Plane;

/// Height in metres (of a road scene) from which a cell is above the ground.
pub const LOW_M: f32 = 0.2;
/// Uncertainty of a cell's disparity in pixels; it lifts the lower limit far away.
const NOISE_PX: f32 = 0.4;
/// Height up to which surfaces are joined: the crowns of trees begin there, metres.
pub const HIGH_M: f32 = 2.6;
/// Disparity in pixels below which heights are noise.
const LEAST_DISPARITY: f32 = 1.2;

/// Columns whose cells are looked at side by side.
const LANES: usize = 16;
const LANE: [f32; LANES] =
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];
/// Rows whose bits are collected before they are written: a part of a word.
const ROWS: usize = 32;

/// Kinds and heights of all cells. Kinds are bits, one for each row, that stand
/// column by column.
#[derive(Debug, Default)]
pub struct Kinds {
    /// Words of a column.
    stride: usize,
    known: Vec<u64>,
    ground: Vec<u64>,
    evidence: Vec<u64>,
    /// Height above the ground, metres; anything where there is no disparity.
    pub heights: Image<f32>,
}

/// The bits of one column.
#[derive(Clone, Copy, Debug)]
pub struct Bits<'a> {
    /// Cells with a disparity.
    pub known: &'a [u64],
    /// Of them those that are no higher than the ground,
    pub ground: &'a [u64],
    /// and those that are higher, up to [`HIGH_M`].
    pub evidence: &'a [u64],
}

impl Kinds {
    /// The bits of column `x`.
    pub fn column(&self, x: usize) -> Bits<'_> {
        let words = x * self.stride..(x + 1) * self.stride;
        Bits {
            known: &self.known[words.clone()],
            ground: &self.ground[words.clone()],
            evidence: &self.evidence[words],
        }
    }

    /// Of the cells of a map of disparity, NaN where there is none.
    pub fn find(&mut self, level: Level, disparity: &Image<f32>, plane: &Plane) {
        self.stride = disparity.height().div_ceil(64);
        for words in [&mut self.known, &mut self.ground, &mut self.evidence] {
            words.clear();
            words.resize(disparity.width() * self.stride, 0);
        }
        self.heights.resize(disparity.size());
        dispatch!(level, simd => {
            for y in (0..disparity.height()).step_by(ROWS) {
                for x in (0..disparity.width()).step_by(LANES) {
                    self.look(simd, x, y, disparity, plane);
                }
            }
        });
    }

    /// The block of cells with its left upper corner at `(x, upper)`.
    #[inline(always)]
    fn look<S: Simd>(
        &mut self,
        simd: S,
        x: usize,
        upper: usize,
        disparity: &Image<f32>,
        plane: &Plane,
    ) {
        let columns = LANES.min(disparity.width() - x);
        let lower = (upper + ROWS).min(disparity.height());
        let noise = f32x16::splat(simd, NOISE_PX * plane.camera_height_m);
        let lowest = LOW_M * super::size_scale(plane);
        let column = f32x16::from_slice(simd, &LANE) * WIDE as f32 + centre(x, 0).0;
        let slope = column * plane.b;
        let none = u32x16::splat(simd, 0);
        let [mut known_bits, mut ground_bits, mut evidence_bits] = [none; 3];
        for y in upper..lower {
            let row = &disparity.row(y)[x..];
            let mut values = [f32::NAN; LANES];
            if let Some(whole) = row.first_chunk() {
                values = *whole;
            } else {
                values[..columns].copy_from_slice(row);
            }
            let d = f32x16::from_slice(simd, &values);
            // As `Plane::height` reckons.
            let at = slope + plane.a * centre(0, y).1 + plane.c;
            let height = (d - at) * plane.camera_height_m / d;
            let known = d.simd_gt(LEAST_DISPARITY);
            let ground = height.simd_lt(noise / d + lowest) & known;
            let evidence = height.simd_le(HIGH_M) & known & !ground;
            let bit = u32x16::splat(simd, 1 << (y - upper));
            known_bits |= known.select(bit, none);
            ground_bits |= ground.select(bit, none);
            evidence_bits |= evidence.select(bit, none);
            let heights = &mut self.heights.row_mut(y)[x..x + columns];
            if columns == LANES {
                height.store_slice(heights);
            } else {
                heights.copy_from_slice(&height.as_slice()[..columns]);
            }
        }
        for (words, bits) in [
            (&mut self.known, known_bits),
            (&mut self.ground, ground_bits),
            (&mut self.evidence, evidence_bits),
        ] {
            let words = words[x * self.stride + upper / 64..].iter_mut().step_by(self.stride);
            for (word, bits) in words.zip(&bits.as_slice()[..columns]) {
                *word |= u64::from(*bits) << (upper % 64);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, StereoRig};
    use crate::image::Size;
    use crate::simd;
    use crate::stage::roi::bits::is_set;

    #[test]
    fn every_cell_is_what_its_height_says() {
        let size = Size::new(640, 300);
        let camera = |tx| Camera::pinhole(size, 500.0, 320.0, 120.0, tx);
        let rig = StereoRig::new(camera(0.0), camera(-250.0), 0.0).unwrap();
        let plane = Plane::new(0.3, 0.01, -40.0, &rig).unwrap();
        // More than one word of rows, and columns that are no whole vector.
        let map = Image::from_fn(Size::new(37, 71), |x, y| {
            let d = ((x * 7 + y * 13) % 61) as f32 * 0.7;
            if (x + y) % 5 == 0 { f32::NAN } else { d }
        });
        for level in simd::available() {
            let mut kinds = Kinds::default();
            kinds.find(level, &map, &plane);
            let mut counts = [0; 4];
            for x in 0..map.width() {
                let bits = kinds.column(x);
                for y in 0..map.height() {
                    let d = map.get(x, y);
                    let (u, v) = centre(x, y);
                    let height = plane.height(u, v, d);
                    let known = d > LEAST_DISPARITY;
                    let low = LOW_M * super::super::size_scale(&plane);
                    let ground = known && height < low + NOISE_PX * plane.camera_height_m / d;
                    let evidence = known && !ground && height <= HIGH_M;
                    assert_eq!(is_set(bits.known, y), known, "({x}, {y})");
                    assert_eq!(is_set(bits.ground, y), ground, "({x}, {y})");
                    assert_eq!(is_set(bits.evidence, y), evidence, "({x}, {y})");
                    if known {
                        assert_eq!(kinds.heights.get(x, y).to_bits(), height.to_bits());
                    }
                    counts[usize::from(known) + usize::from(ground) + 2 * usize::from(evidence)] +=
                        1;
                }
            }
            assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
        }
    }
}
