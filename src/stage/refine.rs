//! From raw matches to disparity and confidence.

pub mod median;
pub mod speckle;
pub mod trust;

use std::ops::Range;

use rayon::prelude::*;

use crate::camera::StereoRig;
use crate::config::{Config, Fill};
use crate::image::{Image, Size};
use crate::perception::{DISPARITY_STEP, RoiMask};
use crate::simd::{self, Level, Simd, dispatch};
use crate::stage::coarse::fill_row;
use crate::stage::refine::median::median_row;
use crate::stage::refine::speckle::Speckles;
use crate::stage::refine::trust::Trust;
use crate::stage::stereo::winner::STEPS;
use crate::stage::stereo::{Matches, NO_MATCH};

/// Confidence of a disparity that was not measured but taken from beside a
/// hole: less than any measured one has.
pub const FILLED: f32 = 0.5;

/// Least rows that are worth a task of their own.
const ROWS_AT_ONCE: usize = 32;

/// Left-right check, median, speckle filter, confidence, fill.
pub struct Refine {
    level: Level,
    size: Size,
    max_difference: Option<i32>,
    speckle_size: usize,
    speckle_range: i32,
    min_confidence: f32,
    fill: bool,
    checked: Image<i16>,
    /// Evidence of what passed the check, else 0.
    evidence: Image<u8>,
    smooth: Image<i16>,
    /// A row without any match.
    outside: Vec<i16>,
    speckles: Speckles,
    trust: Trust,
}

impl Refine {
    /// The stage for images of `size`.
    pub fn new(config: &Config, size: Size) -> Self {
        Self::with_level(config, size, simd::detect())
    }

    /// The stage with the instructions of `level`.
    pub fn with_level(config: &Config, size: Size, level: Level) -> Self {
        let stereo = &config.stereo;
        Self {
            level,
            size,
            max_difference: (stereo.disp12_max_diff >= 0)
                .then_some(stereo.disp12_max_diff as i32 * STEPS + STEPS / 2),
            speckle_size: stereo.speckle_size.max(0) as usize,
            speckle_range: (stereo.speckle_range * f64::from(STEPS)) as i32,
            min_confidence: config.min_confidence as f32,
            fill: stereo.fill == Fill::Roi && config.min_confidence <= f64::from(FILLED),
            checked: Image::default(),
            evidence: Image::default(),
            smooth: Image::default(),
            outside: Vec::new(),
            speckles: Speckles::default(),
            trust: Trust::default(),
        }
    }

    /// Disparity in pixels with `cx_l - cx_r` subtracted (NaN where there is
    /// none), and its confidence 0..=1.
    pub fn run(
        &mut self,
        matches: &Matches,
        roi: &RoiMask,
        rig: &StereoRig,
        disparity: &mut Image<f32>,
        confidence: &mut Image<f32>,
    ) {
        disparity.resize(self.size);
        disparity.fill(f32::NAN);
        confidence.resize(self.size);
        confidence.fill(0.0);
        let area = Area::of(&roi.matched);
        self.checked.resize(self.size);
        self.evidence.resize(self.size);
        self.smooth.resize(self.size);
        // Rows are independent of each other in all but the speckle filter and
        // the sums of the confidence.
        let width = self.size.width.max(1);
        let (first, most) = (area.rows.start, self.max_difference);
        let within = area.rows.start * width..area.rows.end * width;
        let checked = self.checked.pixels_mut()[within.clone()].par_chunks_exact_mut(width);
        let evidence = self.evidence.pixels_mut()[within.clone()].par_chunks_exact_mut(width);
        checked.zip(evidence).enumerate().with_min_len(ROWS_AT_ONCE).for_each(
            |(i, (checked, evidence))| {
                check_row(matches, first + i, most, &area, checked, evidence);
            },
        );
        self.outside.resize(self.size.width, NO_MATCH);
        let (level, checked, outside) = (self.level, &self.checked, &self.outside[..]);
        let smooth = self.smooth.pixels_mut()[within.clone()].par_chunks_exact_mut(width);
        smooth.enumerate().with_min_len(ROWS_AT_ONCE).for_each(|(i, smooth)| {
            dispatch!(level, simd => median(simd, checked, outside, &area, first + i, smooth));
        });
        if self.speckle_size > 1 {
            self.speckles.remove(&mut self.smooth, &area, self.speckle_size, self.speckle_range);
        }
        let (evidence, trust) = (&self.evidence, &mut self.trust);
        dispatch!(self.level, simd => trust.run(simd, evidence, &area, confidence));
        let offset = rig.disparity_offset() as f32;
        let columns = area.columns.clone();
        let (smooth, least, fills) = (&self.smooth, self.min_confidence, self.fill);
        let disparity = disparity.pixels_mut()[within.clone()].par_chunks_exact_mut(width);
        let confidence = confidence.pixels_mut()[within].par_chunks_exact_mut(width);
        disparity.zip(confidence).enumerate().with_min_len(ROWS_AT_ONCE).for_each(
            |(i, (disparity, confidence))| {
                let y = first + i;
                let smooth = &smooth.row(y)[columns.clone()];
                let disparity = &mut disparity[columns.clone()];
                let confidence = &mut confidence[columns.clone()];
                for ((d, c), &smooth) in disparity.iter_mut().zip(&mut *confidence).zip(smooth) {
                    if smooth != NO_MATCH && *c >= least {
                        *d = f32::from(smooth) * DISPARITY_STEP - offset;
                    } else {
                        *c = 0.0;
                    }
                }
                if fills {
                    fill(&roi.matched.row(y)[columns.clone()], disparity, confidence);
                }
            },
        );
    }
}

/// Fills the holes of a row of the region with the smaller of the disparities
/// beside them, as what one view does not see lies behind. Nothing is taken
/// across a gap between regions.
fn fill(matched: &[u8], disparity: &mut [f32], confidence: &mut [f32]) {
    let mut x = 0;
    for span in matched.chunk_by(|a, b| (*a == 0) == (*b == 0)) {
        let end = x + span.len();
        if span[0] != 0 && fill_row(&mut disparity[x..end]) {
            for c in &mut confidence[x..end] {
                // What has no confidence so far has been filled.
                *c = if *c == 0.0 { FILLED } else { *c };
            }
        }
        x = end;
    }
}

/// Rows and columns that hold all pixels to match.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Area {
    /// From the first row with such a pixel to the last one.
    pub rows: Range<usize>,
    /// From the first column with such a pixel to the last one.
    pub columns: Range<usize>,
}

impl Area {
    /// The bounds of what is set in `mask`.
    pub fn of(mask: &Image<u8>) -> Self {
        let width = mask.width();
        let (mut rows, mut columns) = (0..0, width..0);
        for (y, row) in mask.rows().enumerate() {
            if row.iter().fold(0, |any, &v| any | v) == 0 {
                continue;
            }
            if rows.is_empty() {
                rows.start = y;
            }
            rows.end = y + 1;
            // Only what lies outside the columns so far is looked at.
            if let Some(x) = row[..columns.start].iter().position(|&v| v != 0) {
                columns.start = x;
            }
            if let Some(x) = row[columns.end..].iter().rposition(|&v| v != 0) {
                columns.end += x + 1;
            }
        }
        if rows.is_empty() { Self { rows: 0..0, columns: 0..0 } } else { Self { rows, columns } }
    }
}

#[inline(always)]
fn median<S: Simd>(
    simd: S,
    checked: &Image<i16>,
    outside: &[i16],
    area: &Area,
    y: usize,
    smooth: &mut [i16],
) {
    let (rows, columns) = (&area.rows, &area.columns);
    let above = if y > rows.start { checked.row(y - 1) } else { outside };
    let below = if y + 1 < rows.end { checked.row(y + 1) } else { outside };
    median_row(
        simd,
        &above[columns.clone()],
        &checked.row(y)[columns.clone()],
        &below[columns.clone()],
        &mut smooth[columns.clone()],
    );
}

/// Drops disparities that are not unique or that the right view contradicts,
/// and their evidence.
fn check_row(
    matches: &Matches,
    y: usize,
    max_difference: Option<i32>,
    area: &Area,
    out: &mut [i16],
    kept: &mut [u8],
) {
    let left = matches.left.row(y);
    let right = matches.right.row(y);
    let evidence = matches.evidence.row(y);
    for x in area.columns.clone() {
        let d = left[x];
        let agreed = d != NO_MATCH
            && evidence[x] != 0
            && max_difference.is_none_or(|most| {
                let partner = x as i32 - ((i32::from(d) + STEPS / 2) >> STEPS.trailing_zeros());
                // A partner outside the right image can neither agree nor contradict.
                usize::try_from(partner).map_or(true, |x| {
                    let there = right[x.min(right.len() - 1)];
                    (i32::from(there) - i32::from(d)).abs() <= most
                })
            });
        (out[x], kept[x]) = if agreed { (d, evidence[x]) } else { (NO_MATCH, 0) };
    }
}
