//! From raw matches to disparity and confidence.

pub mod guided;
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
use crate::stage::per_thread::PerThread;
use crate::stage::refine::median::median_row;
use crate::stage::refine::speckle::Speckles;
use crate::stage::refine::trust::{Sums, Trust};
use crate::stage::stereo::winner::STEPS;
use crate::stage::stereo::{Matches, NO_MATCH};

/// Confidence of a disparity that was not measured but taken from beside a
/// hole: less than any measured one has.
pub const FILLED: f32 = 0.5;

/// Least rows that are worth a task of their own.
const ROWS_AT_ONCE: usize = 32;

/// Pixels whose partners are looked up at a time.
const BLOCK: usize = 64;

/// Left-right check, median, confidence, speckle filter, guided median, fill.
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
    /// `smooth` without speckles, filtered along its rows.
    across: Image<i16>,
    /// A row without any match.
    outside: Vec<i16>,
    speckles: Speckles,
    trust: Trust,
    sums: PerThread<Sums>,
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
            // Right disparities of wide ranges are known to two pixels only.
            max_difference: (stereo.disp12_max_diff >= 0).then_some(
                stereo.disp12_max_diff as i32 * STEPS
                    + if stereo.disparity_range > 256 { STEPS } else { STEPS / 2 },
            ),
            speckle_size: stereo.speckle_size.max(0) as usize,
            speckle_range: (stereo.speckle_range * f64::from(STEPS)) as i32,
            // None has a confidence of 0.
            min_confidence: (config.min_confidence as f32).max(f32::MIN_POSITIVE),
            fill: stereo.fill == Fill::Roi && config.min_confidence <= f64::from(FILLED),
            checked: Image::default(),
            evidence: Image::default(),
            smooth: Image::default(),
            across: Image::default(),
            outside: Vec::new(),
            speckles: Speckles::default(),
            trust: Trust::new(stereo.uniqueness_ratio),
            sums: PerThread::new(),
        }
    }

    /// Disparity in pixels with `cx_l - cx_r` subtracted (NaN where there is
    /// none), and its confidence 0..=1. `gray` is the left view.
    pub fn run(
        &mut self,
        matches: &Matches,
        gray: &Image<u8>,
        roi: &RoiMask,
        rig: &StereoRig,
        disparity: &mut Image<f32>,
        confidence: &mut Image<f32>,
    ) {
        disparity.resize(self.size);
        confidence.resize(self.size);
        self.checked.resize(self.size);
        self.evidence.resize(self.size);
        self.smooth.resize(self.size);
        self.across.resize(self.size);
        let (level, width) = (self.level, self.size.width.max(1));
        let area = Area::of(&roi.matched);
        // Rows are independent of each other in all but the joining of patches.
        let (first, most) = (area.rows.start, self.max_difference);
        let within = area.rows.start * width..area.rows.end * width;
        let checked = self.checked.pixels_mut()[within.clone()].par_chunks_exact_mut(width);
        let evidence = self.evidence.pixels_mut()[within.clone()].par_chunks_exact_mut(width);
        checked.zip(evidence).enumerate().with_min_len(ROWS_AT_ONCE).for_each(
            |(i, (checked, evidence))| {
                let y = first + i;
                dispatch!(level, _ => check_row(matches, y, most, &area, checked, evidence));
            },
        );
        self.outside.resize(self.size.width, NO_MATCH);
        let (checked, evidence) = (&self.checked, &self.evidence);
        let (outside, trust, least) = (&self.outside[..], &self.trust, self.min_confidence);
        let (smooth, columns) = (&mut self.smooth, &area.columns);
        self.sums.fit(Sums::default);
        let sums = &self.sums;
        // The sums over the windows of one row come from those of the row above.
        let bands = smooth.pixels_mut().par_chunks_mut(width * ROWS_AT_ONCE);
        let bands = bands.zip(confidence.pixels_mut().par_chunks_mut(width * ROWS_AT_ONCE));
        bands.enumerate().for_each(|(band, (smooth, confidence))| {
            let mut sums = sums.lock();
            sums.clear(columns.len());
            let rows = smooth.chunks_exact_mut(width).zip(confidence.chunks_exact_mut(width));
            for (y, (smooth, confidence)) in (band * ROWS_AT_ONCE..).zip(rows) {
                if !area.rows.contains(&y) {
                    confidence.fill(0.0);
                    continue;
                }
                confidence[..columns.start].fill(0.0);
                confidence[columns.end..].fill(0.0);
                let (smooth, confidence) =
                    (&mut smooth[columns.clone()], &mut confidence[columns.clone()]);
                dispatch!(level, simd => {
                    median(simd, checked, outside, &area, y, smooth);
                    sums.move_to(simd, y, evidence, &roi.matched, &area);
                    trust.row(simd, &sums, smooth, confidence);
                    distrust(smooth, confidence, least);
                });
            }
        });
        self.speckles.find(level, &self.smooth, &area, self.speckle_size, self.speckle_range);
        let speckles = &self.speckles;
        let smooth = self.smooth.pixels_mut()[within.clone()].par_chunks_exact_mut(width);
        let across = self.across.pixels_mut()[within].par_chunks_exact_mut(width);
        smooth.zip(across).enumerate().with_min_len(ROWS_AT_ONCE).for_each(
            |(i, (smooth, across))| {
                let y = first + i;
                let smooth = &mut smooth[columns.clone()];
                speckles.erase(y, smooth);
                let (gray, across) = (&gray.row(y)[columns.clone()], &mut across[columns.clone()]);
                dispatch!(level, simd => guided::across(simd, smooth, gray, across));
            },
        );
        let (across, offset, fills) = (&self.across, rig.disparity_offset() as f32, self.fill);
        let smooth = self.smooth.pixels_mut().par_chunks_exact_mut(width);
        let disparity = disparity.pixels_mut().par_chunks_exact_mut(width);
        let confidence = confidence.pixels_mut().par_chunks_exact_mut(width);
        smooth.zip(disparity).zip(confidence).enumerate().with_min_len(ROWS_AT_ONCE).for_each(
            |(y, ((smooth, disparity), confidence))| {
                if !area.rows.contains(&y) {
                    disparity.fill(f32::NAN);
                    return;
                }
                disparity[..columns.start].fill(f32::NAN);
                disparity[columns.end..].fill(f32::NAN);
                let smooth = &mut smooth[columns.clone()];
                let disparity = &mut disparity[columns.clone()];
                let confidence = &mut confidence[columns.clone()];
                dispatch!(level, simd => {
                    guide(simd, across, gray, outside, &area, y, smooth);
                    measure(smooth, offset, disparity, confidence);
                });
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
        smooth,
    );
}

/// The guided median along the columns: nothing is known beyond the area.
#[inline(always)]
fn guide<S: Simd>(
    simd: S,
    across: &Image<i16>,
    gray: &Image<u8>,
    outside: &[i16],
    area: &Area,
    y: usize,
    out: &mut [i16],
) {
    let rows = guided::TAPS.map(|k| y.checked_add_signed(k).filter(|y| area.rows.contains(y)));
    let disparity = rows.map(|row| &row.map_or(outside, |y| across.row(y))[area.columns.clone()]);
    let gray = rows.map(|row| &gray.row(row.unwrap_or(y))[area.columns.clone()]);
    guided::down(simd, disparity, gray, out);
}

/// Drops disparities that the right view contradicts, and their evidence.
#[inline(always)]
fn check_row(
    matches: &Matches,
    y: usize,
    max_difference: Option<i32>,
    area: &Area,
    out: &mut [i16],
    kept: &mut [u8],
) {
    let columns = area.columns.clone();
    let left = &matches.left.row(y)[columns.clone()];
    let evidence = &matches.evidence.row(y)[columns.clone()];
    let right = matches.right.row(y);
    let last = right.len() - 1;
    let most = max_difference.unwrap_or(i32::MAX);
    let blocks = left.chunks(BLOCK).zip(evidence.chunks(BLOCK));
    let outs = out[columns.clone()].chunks_mut(BLOCK).zip(kept[columns.clone()].chunks_mut(BLOCK));
    for (i, ((left, evidence), (out, kept))) in blocks.zip(outs).enumerate() {
        // Nothing was matched here: there is no evidence.
        if evidence.iter().fold(0, |any, &e| any | e) == 0 {
            out.fill(NO_MATCH);
            kept.fill(0);
            continue;
        }
        let x = (columns.start + i * BLOCK) as i32;
        // Three loops without branches, of which only the one that looks up
        // the partners goes pixel by pixel.
        let mut partners = [0_i32; BLOCK];
        for (k, (partner, &d)) in partners.iter_mut().zip(left).enumerate() {
            *partner = x + k as i32 - ((i32::from(d) + STEPS / 2) >> STEPS.trailing_zeros());
        }
        let mut there = [0_i16; BLOCK];
        for (there, &partner) in there.iter_mut().zip(&partners[..left.len()]) {
            *there = right[(partner.max(0) as usize).min(last)];
        }
        let pixels = left.iter().zip(evidence).zip(out.iter_mut().zip(kept));
        for (((&d, &e), (out, kept)), (&there, &partner)) in pixels.zip(there.iter().zip(&partners))
        {
            // A partner outside the right image can neither agree nor contradict.
            let agreed = (partner < 0) | ((i32::from(there) - i32::from(d)).abs() <= most);
            let keep = agreed && d != NO_MATCH && e != 0;
            *out = if keep { d } else { NO_MATCH };
            *kept = if keep { e } else { 0 };
        }
    }
}

/// Drops disparities that are trusted less than `least`.
#[inline(always)]
fn distrust(smooth: &mut [i16], confidence: &[f32], least: f32) {
    for (d, &c) in smooth.iter_mut().zip(confidence) {
        *d = if c >= least { *d } else { NO_MATCH };
    }
}

/// Disparities in pixels; no confidence where there is none.
#[inline(always)]
fn measure(smooth: &[i16], offset: f32, disparity: &mut [f32], confidence: &mut [f32]) {
    for ((d, c), &smooth) in disparity.iter_mut().zip(confidence).zip(smooth) {
        let measured = smooth as f32 * DISPARITY_STEP - offset;
        *d = if smooth == NO_MATCH { f32::NAN } else { measured };
        *c = if smooth == NO_MATCH { 0.0 } else { *c };
    }
}
