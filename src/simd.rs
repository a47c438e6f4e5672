//! The SIMD room: the one place that decides which instructions are used.
//!
//! A [`Level`] is chosen once and handed to every stage; kernels are generic
//! over it and give the same result at every level. Calls of
//! [`fearless_simd::dispatch`] stand inside rayon closures, never around them:
//! around them the closures would be compiled without the wide instructions.

pub use fearless_simd::prelude;
pub use fearless_simd::{
    Level, Simd, dispatch, f32x16, f64x8, i16x16, i32x16, mask8x16, mask8x64, mask16x16, mask32x16,
    mask64x8, u8x16, u8x32, u8x64, u16x16, u32x16, u64x8,
};

use fearless_simd::prelude::*;

/// Bytes in the vectors of the byte kernels: one AVX2 register, whatever the
/// level, so that every level computes the same blocks.
pub const LANES: usize = 32;

/// One vector's worth of bytes in memory.
pub type Block = [u8; LANES];

/// The best instruction set of this processor.
pub fn detect() -> Level {
    Level::new()
}

/// Every instruction set that this processor can run, the plainest first: for
/// tests that compare them.
pub fn available() -> Vec<Level> {
    let best = Level::new();
    let mut levels = Vec::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    {
        levels.extend(best.as_sse2().map(Level::Sse2));
        levels.extend(best.as_sse4_2().map(Level::Sse4_2));
        levels.extend(best.as_avx2().map(Level::Avx2));
        levels.extend(best.as_avx512().map(Level::Avx512));
    }
    if levels.is_empty() {
        levels.push(best);
    }
    levels
}

/// The ends of rows are taken value by value in vectors of up to so many: a copy is a call,
/// before which all others are put away, even if it is not met.
const ONE_BY_ONE: usize = 16;

/// The values from `at` on; `beyond` where the row has ended.
#[inline(always)]
pub(crate) fn padded<S: Simd, V: SimdBase<S>>(
    simd: S,
    row: &[V::Element],
    at: usize,
    beyond: V::Element,
) -> V {
    let row = &row[at.min(row.len())..];
    if row.len() >= V::LEN {
        return V::from_slice(simd, &row[..V::LEN]);
    }
    let mut values = V::splat(simd, beyond);
    if V::LEN > ONE_BY_ONE {
        values.as_mut_slice()[..row.len()].copy_from_slice(row);
    } else {
        for (i, value) in values.as_mut_slice().iter_mut().enumerate() {
            *value = row.get(i).copied().unwrap_or(beyond);
        }
    }
    values
}

/// Writes those of the values from `at` on that are inside a row.
#[inline(always)]
pub(crate) fn store_inside<S: Simd, V: SimdBase<S>>(row: &mut [V::Element], at: usize, values: V) {
    let row = &mut row[at..];
    if row.len() >= V::LEN {
        values.store_slice(&mut row[..V::LEN]);
    } else {
        for (i, value) in values.as_slice().iter().enumerate() {
            if let Some(out) = row.get_mut(i) {
                *out = *value;
            }
        }
    }
}

/// The 32 bytes from `at`.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, bytes: &[u8], at: usize) -> u8x32<S> {
    u8x32::from_slice(simd, &bytes[at..at + LANES])
}

/// Writes 32 bytes from `at`.
#[inline(always)]
pub(crate) fn store<S: Simd>(bytes: &mut [u8], at: usize, value: u8x32<S>) {
    value.store_slice(&mut bytes[at..at + LANES]);
}

/// The bytes of a block.
#[inline(always)]
pub(crate) fn load_block<S: Simd>(simd: S, block: &Block) -> u8x32<S> {
    u8x32::load_array_ref(simd, block)
}

/// |a - b| per lane.
#[inline(always)]
pub(crate) fn abs_diff<S: Simd>(a: u8x32<S>, b: u8x32<S>) -> u8x32<S> {
    a.saturating_sub(b) | b.saturating_sub(a)
}

/// Transposes 32 blocks: lane `j` of `blocks[i]` changes places with lane `i`
/// of `blocks[j]`.
#[inline(always)]
pub(crate) fn transpose<S: Simd>(simd: S, blocks: &[Block; LANES]) -> [u8x32<S>; LANES] {
    transpose_every(simd, blocks, 1)
}

/// Transposes every `step`-th of `blocks`, 32 in all.
///
/// Five rounds of interleaving the upper with the lower half are a perfect
/// shuffle of all 1024 bytes by five bits of their index, which swaps row and
/// column.
#[inline(always)]
pub(crate) fn transpose_every<S: Simd>(
    simd: S,
    blocks: &[Block],
    step: usize,
) -> [u8x32<S>; LANES] {
    let mut rows = [u8x32::splat(simd, 0); LANES];
    for (i, row) in rows.iter_mut().enumerate() {
        *row = load_block(simd, &blocks[i * step]);
    }
    for _ in 0..5 {
        let mut next = rows;
        for i in 0..LANES / 2 {
            let (low, high) = rows[i].interleave(rows[i + LANES / 2]);
            next[2 * i] = low;
            next[2 * i + 1] = high;
        }
        rows = next;
    }
    rows
}

/// Transposes 16 vectors of words: four rounds, as above.
#[inline(always)]
pub(crate) fn transpose_words<S: Simd>(mut rows: [u32x16<S>; 16]) -> [u32x16<S>; 16] {
    for _ in 0..4 {
        let mut next = rows;
        for i in 0..8 {
            (next[2 * i], next[2 * i + 1]) = rows[i].interleave(rows[i + 8]);
        }
        rows = next;
    }
    rows
}
