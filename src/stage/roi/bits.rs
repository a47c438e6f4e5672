//! A mask of one bit per pixel: 64 pixels are dilated by one instruction.

use rayon::prelude::*;

use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, mask8x64, prelude::*, u8x64};
use crate::stage::coarse::CELL;
use crate::stage::saliency::upsample::Rows;

/// Pixels per word; pixel `x` of a row is bit `x % 64` of its word `x / 64`.
const WORD: usize = u64::BITS as usize;

/// A binary mask. The bits beyond the width are 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BitMask {
    size: Size,
    stride: usize,
    words: Vec<u64>,
}

impl BitMask {
    /// Changes the size and clears all bits.
    pub fn reset(&mut self, size: Size) {
        self.size = size;
        self.stride = size.width.div_ceil(WORD);
        self.words.clear();
        self.words.resize(self.stride * size.height, 0);
    }

    /// Takes over size and bits of `other` and keeps the capacity.
    pub fn copy_from(&mut self, other: &Self) {
        self.size = other.size;
        self.stride = other.stride;
        self.words.clear();
        self.words.extend_from_slice(&other.words);
    }

    /// Width and height.
    pub const fn size(&self) -> Size {
        self.size
    }

    /// The words of row `y`.
    pub fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.stride..(y + 1) * self.stride]
    }

    /// The words of row `y`, to be written; bits beyond the width stay 0.
    pub fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.words[y * self.stride..(y + 1) * self.stride]
    }

    /// Number of set bits.
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Sets every bit.
    pub fn fill(&mut self) {
        self.words.fill(u64::MAX);
        self.clear_tails();
    }

    /// Sets the bits of a rectangle given by its first and past-the-end columns and rows.
    pub fn set_rectangle(&mut self, x: (usize, usize), y: (usize, usize)) {
        for y in y.0..y.1.min(self.size.height) {
            let width = self.size.width;
            let row = self.row_mut(y);
            for x in x.0..x.1.min(width) {
                row[x / WORD] |= 1 << (x % WORD);
            }
        }
    }

    /// The pixels of `map` that are at least `threshold` (NaN is not).
    pub fn set_from(&mut self, level: Level, map: &Image<f32>, threshold: f32) {
        self.reset(map.size());
        if self.size.is_empty() {
            return;
        }
        let rows = map.pixels().par_chunks_exact(self.size.width);
        self.words.par_chunks_exact_mut(self.stride).zip(rows).with_min_len(32).for_each(
            |(words, row)| dispatch!(level, simd => compare_row(simd, row, threshold, words)),
        );
    }

    /// The pixels of an image of `size` at which [`upsample`](crate::stage::saliency::upsample)
    /// makes at least `threshold` of a map over its cells.
    pub fn set_from_cells(&mut self, level: Level, cells: &Image<f32>, size: Size, threshold: f32) {
        self.reset(size);
        if size.is_empty() || cells.size() != size.divided_by(CELL) {
            return;
        }
        self.words.par_chunks_exact_mut(self.stride).with_min_len(32).enumerate().for_each(
            |(y, words)| {
                dispatch!(level, simd => Rows::at(cells, y).compare(simd, threshold, words));
            },
        );
        self.clear_tails();
    }

    /// Writes 255 for set bits and 0 for others.
    pub fn write(&self, level: Level, out: &mut Image<u8>) {
        out.resize(self.size);
        if self.size.is_empty() {
            return;
        }
        let rows = self.words.par_chunks_exact(self.stride);
        out.pixels_mut()
            .par_chunks_exact_mut(self.size.width)
            .zip(rows)
            .with_min_len(64)
            .for_each(|(row, words)| dispatch!(level, simd => write_row(simd, words, row)));
    }

    /// Sets every pixel that has a set pixel within `radius` rows and columns.
    pub fn dilate(&mut self, radius: usize) {
        if self.words.is_empty() {
            return;
        }
        for row in self.words.chunks_exact_mut(self.stride) {
            for step in steps(radius) {
                towards_higher(row, step);
            }
            for step in steps(radius) {
                towards_lower(row, step);
            }
        }
        for step in steps(radius) {
            // Downwards: rows from the last on, so that sources are still unchanged.
            for y in (step..self.size.height).rev() {
                let (above, here) = self.words.split_at_mut(y * self.stride);
                merge(&mut here[..self.stride], &above[(y - step) * self.stride..]);
            }
        }
        for step in steps(radius) {
            for y in step..self.size.height {
                let (above, here) = self.words.split_at_mut(y * self.stride);
                merge(&mut above[(y - step) * self.stride..][..self.stride], here);
            }
        }
        self.clear_tails();
    }

    /// Clears every pixel that has a cleared pixel of the image within `radius`
    /// rows and columns.
    pub fn erode(&mut self, radius: usize) {
        self.invert();
        self.dilate(radius);
        self.invert();
    }

    /// Erosion, then dilation: removes what is thinner than `2 radius + 1` pixels.
    pub fn open(&mut self, radius: usize) {
        self.erode(radius);
        self.dilate(radius);
    }

    /// Dilation, then erosion: fills gaps of up to `2 radius` pixels.
    pub fn close(&mut self, radius: usize) {
        self.dilate(radius);
        self.erode(radius);
    }

    fn invert(&mut self) {
        for word in &mut self.words {
            *word = !*word;
        }
        self.clear_tails();
    }

    fn clear_tails(&mut self) {
        let used = self.size.width % WORD;
        if used != 0 {
            for row in self.words.chunks_exact_mut(self.stride) {
                row[self.stride - 1] &= (1 << used) - 1;
            }
        }
    }
}

/// Shifts that together spread a bit over every distance up to `radius`: each
/// may be one more than the distance already covered.
fn steps(radius: usize) -> impl Iterator<Item = usize> {
    let mut covered = 0;
    std::iter::from_fn(move || {
        let step = (covered + 1).min(radius - covered).min(WORD - 1);
        covered += step;
        (step > 0).then_some(step)
    })
}

/// Sets in one row what is set in another.
fn merge(row: &mut [u64], other: &[u64]) {
    for (word, other) in row.iter_mut().zip(other) {
        *word |= other;
    }
}

fn towards_higher(row: &mut [u64], step: usize) {
    let mut before = 0;
    for word in row {
        let here = *word;
        *word |= here << step | before >> (WORD - step);
        before = here;
    }
}

fn towards_lower(row: &mut [u64], step: usize) {
    let mut after = 0;
    for word in row.iter_mut().rev() {
        let here = *word;
        *word |= here >> step | after << (WORD - step);
        after = here;
    }
}

/// Bit `x` of `words` says whether value `x` is at least `threshold`.
#[inline(always)]
fn compare_row<S: Simd>(simd: S, values: &[f32], threshold: f32, words: &mut [u64]) {
    const LANES: usize = 16;
    for (word, values) in words.iter_mut().zip(values.chunks(WORD)) {
        *word = 0;
        let (whole, cut) = values.as_chunks::<LANES>();
        for (i, lanes) in whole.iter().enumerate() {
            let bits = f32x16::from_slice(simd, lanes).simd_ge(threshold).to_bitmask();
            *word |= bits << (i * LANES);
        }
        for (i, value) in cut.iter().enumerate() {
            *word |= u64::from(*value >= threshold) << (whole.len() * LANES + i);
        }
    }
}

/// The 64 bits from bit `from` on; beyond the end they are 0.
#[inline(always)]
pub fn bits_from(words: &[u64], from: usize) -> u64 {
    let word = |index: usize| words.get(index).copied().unwrap_or(0);
    let (index, shift) = (from / WORD, from % WORD);
    // In two steps, as nothing is shifted by 64.
    word(index) >> shift | word(index + 1) << 1 << (WORD - 1 - shift)
}

/// The even ones of the bits, side by side.
#[inline(always)]
pub const fn even_bits(bits: u64) -> u64 {
    let mut bits = bits & 0x5555_5555_5555_5555;
    bits = (bits | bits >> 1) & 0x3333_3333_3333_3333;
    bits = (bits | bits >> 2) & 0x0f0f_0f0f_0f0f_0f0f;
    bits = (bits | bits >> 4) & 0x00ff_00ff_00ff_00ff;
    bits = (bits | bits >> 8) & 0x0000_ffff_0000_ffff;
    (bits | bits >> 16) & 0xffff_ffff
}

/// The first set bit from bit `from` on.
pub fn first_set(words: &[u64], from: usize) -> Option<usize> {
    let mut index = from / WORD;
    let mut word = words.get(index)? & (u64::MAX << (from % WORD));
    while word == 0 {
        index += 1;
        word = *words.get(index)?;
    }
    Some(index * WORD + word.trailing_zeros() as usize)
}

/// The first bit from bit `from` on that is not set; there is none beyond the end.
pub fn first_clear(words: &[u64], from: usize) -> usize {
    let mut index = from / WORD;
    let mut word = words.get(index).map_or(0, |word| word | !(u64::MAX << (from % WORD)));
    while word == u64::MAX {
        index += 1;
        word = words.get(index).copied().unwrap_or(0);
    }
    index * WORD + word.trailing_ones() as usize
}

/// The last set bit before bit `to`.
pub fn last_set(words: &[u64], to: usize) -> Option<usize> {
    let mut index = to / WORD;
    let mut word = words.get(index).map_or(0, |word| word & !(u64::MAX << (to % WORD)));
    while word == 0 {
        index = index.checked_sub(1)?;
        word = words[index];
    }
    Some(index * WORD + WORD - 1 - word.leading_zeros() as usize)
}

/// 255 for each set bit of `words`.
#[inline(always)]
fn write_row<S: Simd>(simd: S, words: &[u64], row: &mut [u8]) {
    let (none, all) = (u8x64::splat(simd, 0), u8x64::splat(simd, u8::MAX));
    for (word, pixels) in words.iter().zip(row.chunks_mut(WORD)) {
        let values = mask8x64::from_bitmask(simd, *word).select(all, none);
        if pixels.len() == WORD {
            values.store_slice(pixels);
        } else {
            pixels.copy_from_slice(&values.as_slice()[..pixels.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_found_across_words() {
        let words = [1 << 63, 0, 1 << 5];
        assert_eq!(first_set(&words, 0), Some(63));
        assert_eq!(first_set(&words, 64), Some(133));
        assert_eq!(first_set(&words, 134), None);
        assert_eq!(first_clear(&words, 0), 0);
        assert_eq!(first_clear(&words, 63), 64);
        assert_eq!(first_clear(&[u64::MAX, 7], 3), 67);
        assert_eq!(first_clear(&[u64::MAX; 2], 3), 128);
        assert_eq!(last_set(&words, 192), Some(133));
        assert_eq!(last_set(&words, 133), Some(63));
        assert_eq!(last_set(&words, 63), None);
    }

    #[test]
    fn bits_are_taken_from_any_place() {
        let words = [0x8000_0000_0000_0001, 0x5, 0xf0f0_f0f0_f0f0_f0f0];
        let bit = |i: usize| words.get(i / 64).map_or(0, |word| word >> (i % 64) & 1);
        for from in 0..200 {
            let expected = (0..64).fold(0, |bits, i| bits | bit(from + i) << i);
            assert_eq!(bits_from(&words, from), expected, "{from}");
        }
        for word in words {
            let expected = (0..32).fold(0, |bits, i| bits | (word >> (2 * i) & 1) << i);
            assert_eq!(even_bits(word), expected);
        }
    }
}
