//! A mask of one bit per pixel.

use rayon::prelude::*;

use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, mask8x64, prelude::*, u8x64};
use crate::stage::coarse::CELL;
use crate::stage::saliency::upsample::compare;

/// Pixels per word; pixel `x` of a row is bit `x % 64` of its word `x / 64`.
pub(super) const WORD: usize = u64::BITS as usize;

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
        self.words.clear();
        self.resize(size);
    }

    /// Changes the size. The bits are unspecified afterwards: whoever resizes writes
    /// them all.
    pub(super) fn resize(&mut self, size: Size) {
        self.size = size;
        self.stride = size.width.div_ceil(WORD);
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
    pub fn count(&self, level: Level) -> usize {
        dispatch!(level, _simd => count_words(&self.words))
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

    /// The pixels of an image of `size` at which [`upsample`](crate::stage::saliency::upsample())
    /// makes at least `threshold` of a map over its cells.
    pub fn set_from_cells(&mut self, level: Level, cells: &Image<f32>, size: Size, threshold: f32) {
        if size.is_empty() || cells.size() != size.divided_by(CELL) {
            self.reset(size);
            return;
        }
        self.resize(size);
        // Whole rows of cells, of which the last one may have fewer rows of pixels.
        self.words.par_chunks_mut(CELL * self.stride).with_min_len(8).enumerate().for_each(
            |(y, words)| {
                dispatch!(level, simd => compare(simd, cells, y, threshold, words));
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

    /// Words of a row.
    pub(super) const fn row_words(&self) -> usize {
        self.stride
    }

    /// The bits of a row's last word that are pixels.
    pub(super) const fn tail(&self) -> u64 {
        match self.size.width % WORD {
            0 => u64::MAX,
            used => (1 << used) - 1,
        }
    }

    fn clear_tails(&mut self) {
        let tail = self.tail();
        if tail != u64::MAX {
            for row in self.words.chunks_exact_mut(self.stride) {
                row[self.stride - 1] &= tail;
            }
        }
    }
}

#[inline(always)]
fn count_words(words: &[u64]) -> usize {
    words.iter().map(|word| word.count_ones() as usize).sum()
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
    let pixels = |word| mask8x64::from_bitmask(simd, word).select(all, none);
    for (word, out) in words.iter().zip(row.as_chunks_mut::<WORD>().0) {
        pixels(*word).store_slice(out);
    }
    let width = row.len();
    if let Some(last) = row.last_chunk_mut::<WORD>() {
        // Those that a word has too many of were written before.
        pixels(bits_from(words, width - WORD)).store_slice(last);
    } else if let Some(word) = words.first() {
        row.copy_from_slice(&pixels(*word).as_slice()[..width]);
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
