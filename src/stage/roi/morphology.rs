//! Dilation and erosion of masks by squares.

use crate::simd::{Level, Simd, dispatch, padded, prelude::*, store_inside, u64x8};
use crate::stage::roi::bits::{BitMask, WORD};

/// Words that are taken at once: 512 pixels of a row.
const LANES: usize = 8;
type Words = [u64; LANES];

/// Largest radius at once: bits come from the words beside their own alone.
const REACH: usize = WORD - 1;

/// Morphology on masks of bits, with its buffers.
#[derive(Debug)]
pub struct Morphology {
    level: Level,
    other: BitMask,
    /// [`LANES`] words of each row.
    strip: Vec<Words>,
}

impl Morphology {
    /// The operations at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, other: BitMask::default(), strip: Vec::new() }
    }

    /// Sets every pixel that has a set pixel within `radius` rows and columns.
    pub fn dilate(&mut self, mask: &mut BitMask, radius: usize) {
        self.change::<false>(mask, radius);
    }

    /// Fills `out` with what dilation makes of `mask`.
    pub fn dilate_into(&mut self, mask: &BitMask, radius: usize, out: &mut BitMask) {
        self.sweep::<false>(mask, radius.min(REACH), out);
        self.dilate(out, radius.saturating_sub(REACH));
    }

    /// Clears every pixel that has a cleared pixel of the image within `radius`
    /// rows and columns.
    pub fn erode(&mut self, mask: &mut BitMask, radius: usize) {
        self.change::<true>(mask, radius);
    }

    /// Erosion, then dilation: removes what is thinner than `2 radius + 1` pixels.
    pub fn open(&mut self, mask: &mut BitMask, radius: usize) {
        self.erode(mask, radius);
        self.dilate(mask, radius);
    }

    /// Dilation, then erosion: fills gaps of up to `2 radius` pixels.
    pub fn close(&mut self, mask: &mut BitMask, radius: usize) {
        self.dilate(mask, radius);
        self.erode(mask, radius);
    }

    fn change<const ERODES: bool>(&mut self, mask: &mut BitMask, radius: usize) {
        let mut left = radius;
        while left > 0 {
            let mut out = std::mem::take(&mut self.other);
            self.sweep::<ERODES>(mask, left.min(REACH), &mut out);
            self.other = std::mem::replace(mask, out);
            left -= left.min(REACH);
        }
    }

    /// Fills `out` with the dilation of `mask`; if `ERODES`, of complements with complements.
    fn sweep<const ERODES: bool>(&mut self, mask: &BitMask, radius: usize, out: &mut BitMask) {
        out.resize(mask.size());
        let (height, words) = (mask.size().height, mask.row_words());
        // The rows below the image are empty, as those above it.
        self.strip.resize(height + radius, [0; LANES]);
        let Self { level, strip, .. } = self;
        dispatch!(*level, simd => {
            for first in (0..words).step_by(LANES) {
                // The last strip is a whole one too, where there are as many words.
                let first = first.min(words.saturating_sub(LANES));
                let spread = Spread::new(simd, mask, first, radius);
                for (y, out) in strip[..height].iter_mut().enumerate() {
                    spread.row::<ERODES>(y).store_slice(out);
                }
                strip[height..].fill([0; LANES]);
                join(strip, 2 * radius + 1);
                for (y, row) in strip[radius..].iter().enumerate() {
                    let row = u64x8::load_array_ref(simd, row);
                    let row = if ERODES { !row } else { row };
                    store_inside(out.row_mut(y), first, row & spread.inside);
                }
            }
        });
    }
}

/// The bits of words from `first` on that are pixels of a row.
#[inline(always)]
fn inside<S: Simd>(simd: S, mask: &BitMask, first: usize) -> u64x8<S> {
    let last = mask.row_words() - 1;
    u64x8::from_fn(simd, |i| match first + i {
        word if word < last => u64::MAX,
        word if word == last => mask.tail(),
        _ => 0,
    })
}

/// Spreads the bits of some words of rows to both sides.
struct Spread<'a, S: Simd> {
    simd: S,
    mask: &'a BitMask,
    first: usize,
    radius: usize,
    /// The bits that are pixels, of these words and of those one word further on.
    inside: u64x8<S>,
    inside_after: u64x8<S>,
}

impl<'a, S: Simd> Spread<'a, S> {
    #[inline(always)]
    fn new(simd: S, mask: &'a BitMask, first: usize, radius: usize) -> Self {
        let (inside, inside_after) = (inside(simd, mask, first), inside(simd, mask, first + 1));
        Self { simd, mask, first, radius, inside, inside_after }
    }

    #[inline(always)]
    fn row<const ERODES: bool>(&self, y: usize) -> u64x8<S> {
        let &Self { simd, mask, first, radius, .. } = self;
        let row = mask.row(y);
        let none = u64x8::splat(simd, 0);
        let mut here: u64x8<S> = padded(simd, row, first, 0);
        if ERODES {
            here = !here & self.inside;
        }
        let (mut before, mut after) = (none.slide::<{ LANES - 1 }>(here), here.slide::<1>(none));
        if first > 0 {
            before = padded(simd, row, first - 1, 0);
            before = if ERODES { !before } else { before };
        }
        if first + LANES < row.len() {
            after = padded(simd, row, first + 1, 0);
            after = if ERODES { !after & self.inside_after } else { after };
        }
        let (mut up, mut down) = (here, here);
        for step in steps(radius + 1) {
            let (step, rest) = (step as u32, (WORD - step) as u32);
            up |= up << step | before >> rest;
            before |= before << step;
            down |= down >> step | after << rest;
            after |= after >> step;
        }
        up | down
    }
}

/// Joins each row with those above it, `length` in all.
#[inline(always)]
fn join(rows: &mut [Words], length: usize) {
    for step in steps(length) {
        for y in (step..rows.len()).rev() {
            let above = rows[y - step];
            for (word, above) in rows[y].iter_mut().zip(above) {
                *word |= above;
            }
        }
    }
}

/// Steps that make a window of `length` places of one: each adds at most as many as there
/// are.
fn steps(length: usize) -> impl Iterator<Item = usize> {
    let mut covered = 1;
    std::iter::from_fn(move || {
        let step = covered.min(length - covered);
        covered += step;
        (step > 0).then_some(step)
    })
}
