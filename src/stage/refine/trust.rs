//! Confidence from the evidence around a pixel.

use crate::image::Image;
use crate::simd::Simd;
use crate::stage::refine::Area;
use crate::stage::stereo::NO_MATCH;

/// Pixels from the centre of the window to its edge.
pub const RADIUS: usize = 4;
const SIDE: usize = 2 * RADIUS + 1;

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

    /// Writes the confidence of the pixels of row `y` in `area`, from the mean of
    /// `evidence` over those of the 9x9 pixels around that are `matched`. A single
    /// cost curve says little: that its neighbours are as clear, and none was
    /// rejected, says more. Blocks of pixels without any disparity (`smooth`) get none.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "the inputs of one kernel")]
    pub fn row<S: Simd>(
        &self,
        _: S,
        evidence: &Image<u8>,
        matched: &Image<u8>,
        area: &Area,
        y: usize,
        smooth: &[i16],
        out: &mut [f32],
    ) {
        let rows =
            y.saturating_sub(RADIUS).max(area.rows.start)..(y + SIDE - RADIUS).min(area.rows.end);
        for (block, (out, smooth)) in out.chunks_mut(BLOCK).zip(smooth.chunks(BLOCK)).enumerate() {
            if smooth.iter().fold(NO_MATCH, |most, &d| most.max(d)) == NO_MATCH {
                out.fill(0.0);
                continue;
            }
            let x = area.columns.start + block * BLOCK;
            // The window's columns, those outside the area empty.
            let from = x.saturating_sub(RADIUS).max(area.columns.start);
            let to = (x + BLOCK + RADIUS).min(area.columns.end);
            let (mut sums, mut counts) = ([0_u16; SPAN], [0_u16; SPAN]);
            for y in rows.clone() {
                let (row, mask) = (&evidence.row(y)[from..to], &matched.row(y)[from..to]);
                let at = from + RADIUS - x;
                let pixels = sums[at..].iter_mut().zip(&mut counts[at..]).zip(row).zip(mask);
                for (((sum, count), &e), &m) in pixels {
                    *sum += e as u16;
                    *count += (m != 0) as u16;
                }
            }
            let (sums, counts) = (nine(&sums), nine(&counts));
            for ((out, sum), count) in out.iter_mut().zip(sums).zip(counts) {
                // Whole numbers: a quotient is cut as that of integers.
                let mean = sum as f32 / (count as f32).max(1.0);
                *out = self.table[(mean as u8) as usize];
            }
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
