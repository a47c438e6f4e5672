//! Confidence from the mean evidence of those of the 9x9 pixels around that are
//! matched.

use std::ops::Range;

use crate::image::Image;
use crate::simd::Simd;
use crate::stage::refine::Area;
use crate::stage::stereo::NO_MATCH;

/// Pixels from the centre of the window to its edge.
pub const RADIUS: usize = 4;

/// Columns at a time: their sums stay in registers and the nearest cache.
const BLOCK: usize = 64;
const SPAN: usize = BLOCK + 2 * RADIUS;

/// Share of wrong disparities where there is no evidence at all.
const WORST: f32 = 0.48;
/// How fast it falls with the mean peak ratio.
const FALL: f32 = 1.0 / 42.0;

/// The confidence that follows from the window's mean evidence.
pub struct Trust {
    /// By mean evidence: `1 - 0.48 exp(-e / 42)`, the share of disparities with an
    /// error of at most max(3 px, 5 %), as found on road and on indoor scenes
    /// alike; 0 where it is not enough.
    table: [f32; 256],
}

impl Trust {
    /// Confidence of disparities whose best cost beats the second best by
    /// `uniqueness_ratio` percent in the window's mean, and none of others.
    pub fn new(uniqueness_ratio: i64) -> Self {
        // Evidence is 255 (second - best) / second.
        let ratio = uniqueness_ratio.clamp(0, 10_000) as f32;
        let least = 255.0 * ratio / (100.0 + ratio);
        let confidence = |e: usize| 1.0 - WORST * (-(e as f32) * FALL).exp();
        let table = std::array::from_fn(|e| if e as f32 >= least { confidence(e) } else { 0.0 });
        Self { table }
    }

    /// Writes the confidence of the pixels of one row, from the mean evidence around
    /// them. A single cost curve says little: that its neighbours are as clear, and none
    /// was rejected, says more. Blocks of pixels without any disparity (`smooth`) get none.
    #[inline(always)]
    pub fn row<S: Simd>(&self, _: S, sums: &Sums, smooth: &[i16], out: &mut [f32]) {
        for (block, (out, smooth)) in out.chunks_mut(BLOCK).zip(smooth.chunks(BLOCK)).enumerate() {
            if smooth.iter().fold(NO_MATCH, |most, &d| most.max(d)) == NO_MATCH {
                out.fill(0.0);
                continue;
            }
            let [evidence, matched] = [&sums.evidence, &sums.matched]
                .map(|columns| columns[block * BLOCK..].first_chunk::<SPAN>());
            // There always are as many: the sums end with whole blocks.
            let (Some(evidence), Some(matched)) = (evidence, matched) else { continue };
            let (sums, counts) = (nine(evidence), nine(matched));
            for ((out, sum), count) in out.iter_mut().zip(sums).zip(counts) {
                // Whole numbers: a quotient is cut as that of integers.
                let mean = sum as f32 / (count as f32).max(1.0);
                *out = self.table[(mean as u8) as usize];
            }
        }
    }
}

/// Sums over the rows of the 9x9 windows of one row's pixels, column by column of the
/// area; [`RADIUS`] empty columns before, at least as many behind.
#[derive(Debug, Default)]
pub struct Sums {
    /// Of the evidence.
    evidence: Vec<u16>,
    /// Of the pixels to match.
    matched: Vec<u16>,
    /// Rows in the sums.
    rows: Range<usize>,
}

impl Sums {
    /// Forgets all rows, for an area of so many columns.
    pub fn clear(&mut self, columns: usize) {
        let length = columns.next_multiple_of(BLOCK) + 2 * RADIUS;
        for sums in [&mut self.evidence, &mut self.matched] {
            sums.clear();
            sums.resize(length, 0);
        }
        self.rows = 0..0;
    }

    /// Moves on to the windows around row `y`: not before the row it was moved to last.
    #[inline(always)]
    pub fn move_to<S: Simd>(
        &mut self,
        _: S,
        y: usize,
        evidence: &Image<u8>,
        matched: &Image<u8>,
        area: &Area,
    ) {
        let from = y.saturating_sub(RADIUS).max(area.rows.start);
        let to = (y + RADIUS + 1).min(area.rows.end);
        for y in self.rows.start..from.min(self.rows.end) {
            self.add(
                &evidence.row(y)[area.columns.clone()],
                &matched.row(y)[area.columns.clone()],
                |sum, v| sum - v,
            );
        }
        for y in from.max(self.rows.end)..to {
            self.add(
                &evidence.row(y)[area.columns.clone()],
                &matched.row(y)[area.columns.clone()],
                |sum, v| sum + v,
            );
        }
        self.rows = from..to;
    }

    #[inline(always)]
    fn add(&mut self, evidence: &[u8], matched: &[u8], sum: impl Fn(u16, u16) -> u16) {
        for (out, &e) in self.evidence[RADIUS..].iter_mut().zip(evidence) {
            *out = sum(*out, e as u16);
        }
        for (out, &m) in self.matched[RADIUS..].iter_mut().zip(matched) {
            *out = sum(*out, (m != 0) as u16);
        }
    }
}

/// Sums of nine neighbours each, as 1 + 2 * (2 * 2): at most 81 * 255, which fits.
#[inline(always)]
fn nine(columns: &[u16; SPAN]) -> [u16; BLOCK] {
    let (mut twos, mut fours, mut sums) = ([0; BLOCK + 7], [0; BLOCK + 4], [0; BLOCK]);
    for (i, two) in twos.iter_mut().enumerate() {
        *two = columns[i] + columns[i + 1];
    }
    for (i, four) in fours.iter_mut().enumerate() {
        *four = twos[i] + twos[i + 2];
    }
    for (i, sum) in sums.iter_mut().enumerate() {
        *sum = fours[i] + fours[i + 4] + columns[i + 8];
    }
    sums
}
