//! Bands of rows, and the ridges in them.

use std::ops::Range;

use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*};

/// Rows of a band: what stands upright stays in its column over so many, and noise
/// evens out.
pub const ROWS: usize = 8;
/// Widths of ridges, pixels.
const WIDTHS: [usize; 6] = [2, 3, 4, 5, 6, 8];
/// The widest.
pub const WIDEST: usize = WIDTHS[WIDTHS.len() - 1];
/// Pixels beside a ridge that it is told from, and how many lie between.
const ASIDE: usize = 2;
const APART: usize = 1;
/// Least difference of brightness from both sides, of 255.
const LEAST: f32 = 10.0;
/// What a pixel of width is worth: of two widths with the same difference the larger.
const PER_PIXEL: f32 = 1.0;
/// Pixels to each side within which a ridge is the strongest.
const ALONE: usize = 2;

const LANES: usize = 16;
/// Pixels before and after those of a group that it looks at.
const BEFORE: usize = ASIDE + APART;
const AFTER: usize = WIDEST + APART + ASIDE;

/// Fills `out` with the mean brightness of every whole band, of 255, one row each.
pub fn shrink(level: Level, gray: &Image<u8>, out: &mut Image<f32>) {
    let Size { width, height } = gray.size();
    out.resize(Size::new(width, height / ROWS));
    dispatch!(level, _simd => {
        for band in 0..out.height() {
            let rows: [&[u8]; ROWS] = std::array::from_fn(|i| gray.row(band * ROWS + i));
            for (x, out) in out.row_mut(band).iter_mut().enumerate() {
                let sum: u16 = rows.iter().map(|row| u16::from(row[x])).sum();
                *out = f32::from(sum) / ROWS as f32;
            }
        }
    });
}

/// A ridge in a band: columns that are all brighter, or all darker, than both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ridge {
    /// First column.
    pub x: usize,
    /// Columns.
    pub width: usize,
    /// Difference from the side from which it differs less.
    pub strength: f32,
    /// Its mean brightness.
    pub mean: f32,
}

impl Ridge {
    /// Where its middle is; pixel x reaches from x to x + 1.
    pub fn centre(&self) -> f32 {
        self.x as f32 + self.width as f32 / 2.0
    }
}

/// The finder of ridges, with its buffers.
#[derive(Debug)]
pub struct Ridges {
    level: Level,
    /// A row with pixels beyond its ends.
    row: Vec<f32>,
    strength: Vec<f32>,
    width: Vec<f32>,
    /// Those of all bands from left to right.
    list: Vec<Ridge>,
    /// Index of the first one of each group of columns, band by band, and the number of all.
    first: Vec<usize>,
    /// Groups of a band.
    groups: usize,
}

impl Ridges {
    /// The finder with instructions of `level`.
    pub const fn new(level: Level) -> Self {
        Self {
            level,
            row: Vec::new(),
            strength: Vec::new(),
            width: Vec::new(),
            list: Vec::new(),
            first: Vec::new(),
            groups: 1,
        }
    }

    /// Finds the ridges of the `upper` ones of `bands`; none in images narrower than what
    /// one is told from.
    pub fn find(&mut self, bands: &Image<f32>, upper: usize) {
        self.list.clear();
        self.first.clear();
        let width = bands.width();
        self.groups = width.div_ceil(LANES).max(1);
        let lanes = self.groups * LANES;
        self.row.clear();
        self.row.resize(BEFORE + lanes + AFTER, 0.0);
        self.strength.resize(lanes, 0.0);
        self.width.resize(lanes, 0.0);
        let upper = if width < BEFORE + AFTER { 0 } else { upper };
        for band in bands.rows().take(upper) {
            self.row[BEFORE..BEFORE + width].copy_from_slice(band);
            dispatch!(self.level, simd => self.measure(simd));
            // Beyond the image there is no side.
            self.strength[..BEFORE].fill(0.0);
            self.strength[width - AFTER..].fill(0.0);
            dispatch!(self.level, simd => self.choose(simd, band));
        }
        self.first.push(self.list.len());
    }

    /// All ridges, band by band from left to right.
    pub fn list(&self) -> &[Ridge] {
        &self.list
    }

    /// Indices of the ridges of each band from above.
    pub fn bands(&self) -> impl Iterator<Item = Range<usize>> {
        let bands = (self.first.len() - 1) / self.groups;
        (0..bands).map(|band| self.first[band * self.groups]..self.first[(band + 1) * self.groups])
    }

    /// Indices of the ridges of a band but for some that begin before column `x`; none of a
    /// band beyond those that were looked at.
    pub fn from(&self, band: usize, x: usize) -> Range<usize> {
        let place = |group: usize| self.first.get(band * self.groups + group).copied();
        let group = (x / LANES).min(self.groups - 1);
        place(group).zip(place(self.groups)).map_or(0..0, |(from, to)| from..to)
    }

    /// Fills strength and width of the best ridge that begins at each pixel of the row.
    #[inline(always)]
    fn measure<S: Simd>(&mut self, simd: S) {
        let none = f32x16::splat(simd, 0.0);
        let out = self.strength.as_chunks_mut::<LANES>().0;
        let groups = out.iter_mut().zip(self.width.as_chunks_mut::<LANES>().0);
        for ((strength, width), at) in groups.zip((0..).step_by(LANES)) {
            let pixels = |i: usize| f32x16::from_slice(simd, &self.row[at + i..at + i + LANES]);
            let left = (pixels(0) + pixels(1)) * 0.5;
            let (mut best, mut best_worth, mut best_width) = (none, none, none);
            let (mut sum, mut summed) = (none, 0);
            for w in WIDTHS {
                while summed < w {
                    sum += pixels(BEFORE + summed);
                    summed += 1;
                }
                let right = BEFORE + w + APART;
                let right = (pixels(right) + pixels(right + 1)) * 0.5;
                let mean = sum * (1.0 / w as f32);
                let (a, b) = (mean - left, mean - right);
                let least = a.abs().min(b.abs());
                let ridge = (a * b).simd_gt(none);
                let worth = least + PER_PIXEL * w as f32;
                let better = ridge & worth.simd_gt(best_worth) & least.simd_ge(none + LEAST);
                best = better.select(least, best);
                best_worth = better.select(worth, best_worth);
                best_width = better.select(none + w as f32, best_width);
            }
            best.store_slice(strength);
            best_width.store_slice(width);
        }
    }

    /// Takes those that are the strongest around.
    #[inline(always)]
    fn choose<S: Simd>(&mut self, simd: S, band: &[f32]) {
        let Self { strength, width, list, first, .. } = self;
        for (group, at) in strength.as_chunks::<LANES>().0.iter().zip((0..).step_by(LANES)) {
            first.push(list.len());
            let some: mask32x16<S> = f32x16::load_array_ref(simd, group).simd_ge(LEAST);
            let mut bits = some.to_bitmask();
            while bits != 0 {
                let x = at + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let own = strength[x];
                // Of equal ones the first.
                let before = strength[x - ALONE..x].iter().all(|other| *other < own);
                if before && strength[x + 1..=x + ALONE].iter().all(|other| *other <= own) {
                    let w = width[x] as usize;
                    let mean = band[x..x + w].iter().sum::<f32>() / w as f32;
                    list.push(Ridge { x, width: w, strength: own, mean });
                }
            }
        }
    }
}

// Those next to the ends have none.
const _: () = assert!(ALONE <= BEFORE && ALONE < AFTER && ASIDE == 2);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd;

    /// As [`Ridges::find`] says, one pixel after the other.
    fn plain(bands: &Image<f32>) -> Vec<Ridge> {
        let width = bands.width();
        let mut all = Vec::new();
        for row in bands.rows() {
            let best: Vec<(f32, usize)> = (0..width)
                .map(|x| {
                    let mut best = (0.0, 0);
                    let mut most = 0.0;
                    for w in WIDTHS.into_iter().filter(|_| x >= BEFORE && x < width - AFTER) {
                        let mean = row[x..x + w].iter().sum::<f32>() * (1.0 / w as f32);
                        let left = mean - (row[x - 3] + row[x - 2]) * 0.5;
                        let right = mean - (row[x + w + 1] + row[x + w + 2]) * 0.5;
                        let least = left.abs().min(right.abs());
                        if left * right > 0.0 && least >= LEAST && least + w as f32 > most {
                            (best, most) = ((least, w), least + w as f32);
                        }
                    }
                    best
                })
                .collect();
            all.extend((0..width).filter(|x| best[*x].1 > 0).filter_map(|x| {
                let (strength, width) = best[x];
                let alone = best[x - 2..x].iter().all(|other| other.0 < strength)
                    && best[x + 1..x + 3].iter().all(|other| other.0 <= strength);
                let mean = row[x..x + width].iter().sum::<f32>() / width as f32;
                alone.then_some(Ridge { x, width, strength, mean })
            }));
        }
        all
    }

    #[test]
    fn ridges_are_the_same_at_every_level() {
        for width in [13, 14, 15, 40, 61, 64] {
            let bands = Image::from_fn(Size::new(width, 9), |x, y| {
                ((x * x * 7 + y * 31 + x * y * 3) % 97) as f32 + if x % 11 < 3 { 60.0 } else { 0.0 }
            });
            let expected = plain(&bands);
            assert_eq!(expected.is_empty(), width <= BEFORE + AFTER, "{width}");
            for level in simd::available() {
                let mut ridges = Ridges::new(level);
                ridges.find(&bands, 9);
                assert_eq!(ridges.list(), expected, "{width} {level:?}");
                let upper = ridges.bands().take(5).flatten().count();
                assert_eq!(ridges.bands().flatten().count(), expected.len());
                // Whatever is left out begins before.
                for (band, span) in ridges.bands().enumerate() {
                    let from = ridges.from(band, 20);
                    assert_eq!(from.end, span.end);
                    assert!(ridges.list()[span.start..from.start].iter().all(|r| r.x < 20));
                }
                assert_eq!(ridges.from(9, 0), 0..0);
                ridges.find(&bands, 5);
                assert_eq!(ridges.list(), &expected[..upper]);
            }
        }
    }

    #[test]
    fn a_band_is_the_mean_of_eight_rows() {
        let gray = Image::from_fn(Size::new(37, 23), |x, y| (x * 9 + y * 13 % 50) as u8);
        for level in simd::available() {
            let mut bands = Image::default();
            shrink(level, &gray, &mut bands);
            // What is left of rows is none.
            assert_eq!(bands.size(), Size::new(37, 2));
            for (x, y) in [(0, 0), (17, 1), (36, 0), (36, 1)] {
                let sum: u32 = (0..8).map(|i| u32::from(gray.get(x, y * 8 + i))).sum();
                assert_eq!(bands.get(x, y), sum as f32 / 8.0);
            }
        }
    }
}
