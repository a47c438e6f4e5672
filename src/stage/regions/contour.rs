//! The outer boundary of a mask as a polygon.

use super::simplify::Simplify;
use crate::simd::{Level, Simd, dispatch, padded, prelude::*, u8x64};

/// Steps to the 8 neighbours, clockwise in image coordinates (y points down), from east.
const STEPS: [(isize, isize); 8] =
    [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
const WEST: u32 = 4;

/// Pixels per word.
const WORD: usize = u64::BITS as usize;

/// The boundary follower with its buffers.
#[derive(Debug)]
pub struct Contour {
    level: Level,
    /// The mask in bits, and which of its pixels a boundary has passed.
    mask: Bits,
    met: Bits,
    boundary: Vec<[i32; 2]>,
    part: Vec<[i32; 2]>,
    simplify: Simplify,
}

impl Contour {
    /// The follower with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            mask: Bits::default(),
            met: Bits::default(),
            boundary: Vec::new(),
            part: Vec::new(),
            simplify: Simplify::new(level),
        }
    }

    /// The outer boundary of the largest part of `mask` (rows of `width` pixels,
    /// inside where not 0) through the centres of its boundary pixels, clockwise
    /// on the screen, in coordinates of the mask: border following (Moore;
    /// Suzuki and Abe 1985) over 8-connected pixels. The largest part is the one
    /// whose boundary encloses most. Empty for an empty mask.
    pub fn follow(&mut self, mask: &[u8], width: usize) -> &[[i32; 2]] {
        self.boundary.clear();
        let height = mask.len() / width.max(1);
        self.mask.clear(width, height);
        self.met.clear(width, height);
        let bits = &mut self.mask;
        dispatch!(self.level, simd => bits.take(simd, mask, width));
        let mut most = i64::MIN;
        for y in 0..height {
            for from in (0..width).step_by(WORD) {
                let mut starts = self.mask.upper_ends(from, y);
                while starts != 0 {
                    let x = from + starts.trailing_zeros() as usize;
                    starts &= starts - 1;
                    if self.met.is_set(x, y) {
                        continue;
                    }
                    // The boundary of a hole runs the other way round and counts negative.
                    let enclosed = self.follow_from((x, y));
                    if enclosed > most {
                        most = enclosed;
                        std::mem::swap(&mut self.boundary, &mut self.part);
                    }
                }
            }
        }
        &self.boundary
    }

    /// The boundary on which the pixel `start` lies whose northern and western
    /// neighbours are outside, into `part`. Returns twice the enclosed area
    /// (shoelace formula), positive for a boundary that runs clockwise on the screen.
    fn follow_from(&mut self, start: (usize, usize)) -> i64 {
        self.part.clear();
        let (mut x, mut y) = start;
        // The western neighbour is outside; the search goes clockwise from there.
        let mut from = WEST;
        let mut first_step = None;
        let mut enclosed = 0;
        loop {
            self.met.set(x, y);
            let around = self.mask.neighbours(x, y);
            if around == 0 {
                self.part.push([x as i32, y as i32]);
                break;
            }
            let step = (from + around.rotate_right(from).trailing_zeros()) % 8;
            // Round when the first step is about to be taken again (Jacob's
            // criterion: passing the first pixel alone is not enough).
            if (x, y) == start {
                match first_step {
                    None => first_step = Some(step),
                    Some(first_step) if first_step == step => break,
                    Some(_) => {}
                }
            }
            self.part.push([x as i32, y as i32]);
            let (dx, dy) = STEPS[step as usize];
            enclosed += (x as isize * dy - y as isize * dx) as i64;
            x = x.wrapping_add_signed(dx);
            y = y.wrapping_add_signed(dy);
            // Go on from the last neighbour known to be outside.
            from = (step + if step.is_multiple_of(2) { 6 } else { 5 }) % 8;
        }
        enclosed
    }

    /// Follows the boundary, simplifies it so that no boundary pixel is farther
    /// than `tolerance_px` from the polygon, and writes it shifted by `origin`.
    pub fn run(
        &mut self,
        mask: &[u8],
        width: usize,
        origin: [u32; 2],
        tolerance_px: f32,
        out: &mut Vec<[f32; 2]>,
    ) {
        self.follow(mask, width);
        let keep = self.simplify.run(&self.boundary, tolerance_px);
        out.clear();
        for (point, _) in self.boundary.iter().zip(keep).filter(|(_, keep)| **keep) {
            out.push([point[0] as f32 + origin[0] as f32, point[1] as f32 + origin[1] as f32]);
        }
    }
}

/// A mask of one bit for each pixel, with a pixel outside on every side.
#[derive(Debug, Default)]
struct Bits {
    /// Bytes of a row. Pixel `(x, y)` is bit `(x + 1) % 8` of byte `(x + 1) / 8` of row `y + 1`.
    stride: usize,
    bytes: Vec<u8>,
}

impl Bits {
    /// Nothing is inside any more.
    fn clear(&mut self, width: usize, height: usize) {
        // With a word behind each row.
        self.stride = (width + 2).next_multiple_of(WORD) / 8 + WORD / 8;
        self.bytes.clear();
        self.bytes.resize(self.stride * (height + 2), 0);
    }

    /// Takes what is not 0 as inside.
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, mask: &[u8], width: usize) {
        let rows = self.bytes.chunks_exact_mut(self.stride).skip(1);
        for (bits, row) in rows.zip(mask.chunks_exact(width.max(1))) {
            // The pixel outside comes first.
            let mut before = 0;
            for (i, bytes) in bits.as_chunks_mut().0.iter_mut().enumerate() {
                let pixels: u8x64<S> = padded(simd, row, i * WORD, 0);
                let here = !pixels.simd_eq(0).to_bitmask();
                *bytes = (here << 1 | before).to_le_bytes();
                before = here >> (WORD - 1);
            }
        }
    }

    /// Of the pixels from `from` on, a multiple of 64, those inside whose neighbours to the
    /// west and to the north are all outside, as they are at the first pixel of every part.
    fn upper_ends(&self, from: usize, y: usize) -> u64 {
        let word = |row: usize, at: usize| {
            let bytes = self.bytes[row * self.stride + (from + at) / 8..].first_chunk();
            u64::from_le_bytes(bytes.copied().unwrap_or_default())
        };
        let (here, next) = (word(y + 1, 0), word(y + 1, WORD));
        let (above, next_above) = (word(y, 0), word(y, WORD));
        let north = above | above >> 1 | next_above << 63 | above >> 2 | next_above << 62;
        (here >> 1 | next << 63) & !here & !north
    }

    /// One bit for each of [`STEPS`] that leads to a pixel inside.
    #[inline(always)]
    fn neighbours(&self, x: usize, y: usize) -> u8 {
        // Of a row, the pixels to the west, here, and to the east.
        let near = |row: usize| {
            let bytes = self.bytes[row * self.stride + x / 8..].first_chunk();
            u16::from_le_bytes(bytes.copied().unwrap_or_default()) >> (x % 8) & 7
        };
        let (north, here, south) = (near(y), near(y + 1), near(y + 2));
        let east = here >> 2 | south >> 1 & 2 | (south & 2) << 1 | (south & 1) << 3;
        let west = (here & 1) << 4 | north << 5;
        (east | west) as u8
    }

    fn is_set(&self, x: usize, y: usize) -> bool {
        self.bytes[(y + 1) * self.stride + (x + 1) / 8] >> ((x + 1) % 8) & 1 != 0
    }

    fn set(&mut self, x: usize, y: usize) {
        self.bytes[(y + 1) * self.stride + (x + 1) / 8] |= 1 << ((x + 1) % 8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd;

    #[test]
    fn bits_tell_of_every_pixel_what_its_neighbours_are() {
        let levels = simd::available().into_iter();
        let mut bits: Vec<_> = levels.map(|level| (level, Bits::default())).collect();
        for (width, height) in
            [(1, 1), (1, 5), (7, 3), (61, 4), (62, 4), (63, 4), (64, 9), (200, 7)]
        {
            let noise = |i: usize| i * i * 7 + i * 3 + i / 5;
            let mask: Vec<u8> =
                (0..width * height).map(|i| if noise(i) % 11 < 6 { 255 } else { 0 }).collect();
            let inside = |x: usize, y: usize, step: usize| {
                let (dx, dy) = STEPS[step];
                let (x, y) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
                x < width && y < height && mask[y * width + x] != 0
            };
            for (level, bits) in &mut bits {
                bits.clear(width, height);
                dispatch!(*level, simd => bits.take(simd, &mask, width));
                for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                    let expected =
                        (0..8).fold(0, |around, i| around | u8::from(inside(x, y, i)) << i);
                    assert_eq!(bits.neighbours(x, y), expected, "{level:?}");
                    let own = mask[y * width + x] != 0;
                    assert_eq!(bits.is_set(x, y), own);
                    let first = own && (4..8).all(|i| !inside(x, y, i));
                    let ends = bits.upper_ends(x / WORD * WORD, y);
                    assert_eq!(ends >> (x % WORD) & 1 != 0, first, "{width} {x} {y}");
                }
                bits.set(width - 1, height - 1);
                assert!(bits.is_set(width - 1, height - 1));
            }
        }
    }
}
