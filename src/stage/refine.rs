//! From raw matches to disparity and confidence.

pub mod median;
pub mod speckle;

use std::ops::Range;

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::{Image, Size};
use crate::perception::{DISPARITY_STEP, RoiMask};
use crate::simd::{self, Level, Simd, dispatch};
use crate::stage::refine::median::median_row;
use crate::stage::refine::speckle::Speckles;
use crate::stage::stereo::winner::STEPS;
use crate::stage::stereo::{Matches, NO_MATCH};

/// Left-right check, median, speckle filter, confidence.
pub struct Refine {
    level: Level,
    size: Size,
    max_difference: Option<i32>,
    speckle_size: usize,
    speckle_range: i32,
    min_confidence: f32,
    checked: Image<i16>,
    smooth: Image<i16>,
    /// A row without any match.
    outside: Vec<i16>,
    speckles: Speckles,
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
            checked: Image::default(),
            smooth: Image::default(),
            outside: Vec::new(),
            speckles: Speckles::default(),
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
        self.smooth.resize(self.size);
        for y in area.rows.clone() {
            check_row(matches, y, self.max_difference, &area, self.checked.row_mut(y));
        }
        self.outside.resize(self.size.width, NO_MATCH);
        let (checked, outside, smooth) = (&self.checked, &self.outside[..], &mut self.smooth);
        dispatch!(self.level, simd => median(simd, checked, outside, &area, smooth));
        if self.speckle_size > 1 {
            self.speckles.remove(&mut self.smooth, &area, self.speckle_size, self.speckle_range);
        }
        let offset = rig.disparity_offset() as f32;
        let columns = area.columns.clone();
        for y in area.rows {
            let evidence = &matches.evidence.row(y)[columns.clone()];
            let raw = &matches.left.row(y)[columns.clone()];
            let smooth = &self.smooth.row(y)[columns.clone()];
            let disparity = &mut disparity.row_mut(y)[columns.clone()];
            let confidence = &mut confidence.row_mut(y)[columns.clone()];
            for (x, (d, c)) in disparity.iter_mut().zip(confidence).enumerate() {
                if smooth[x] == NO_MATCH {
                    continue;
                }
                let moved = (i32::from(raw[x]) - i32::from(smooth[x])).abs();
                let value = trust(evidence[x], moved);
                if value >= self.min_confidence {
                    *d = f32::from(smooth[x]) * DISPARITY_STEP - offset;
                    *c = value;
                }
            }
        }
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
    smooth: &mut Image<i16>,
) {
    let (rows, columns) = (&area.rows, &area.columns);
    for y in rows.clone() {
        let above = if y > rows.start { checked.row(y - 1) } else { outside };
        let below = if y + 1 < rows.end { checked.row(y + 1) } else { outside };
        median_row(
            simd,
            &above[columns.clone()],
            &checked.row(y)[columns.clone()],
            &below[columns.clone()],
            &mut smooth.row_mut(y)[columns.clone()],
        );
    }
}

/// Confidence from the evidence of the cost curve; halved where the median
/// took the disparity from elsewhere.
fn trust(evidence: u8, moved: i32) -> f32 {
    let trust = 0.4 + 0.6 * (f32::from(evidence) / 255.0).sqrt();
    if moved > STEPS { 0.5 * trust } else { trust }
}

/// Drops disparities that are not unique or that the right view contradicts.
fn check_row(
    matches: &Matches,
    y: usize,
    max_difference: Option<i32>,
    area: &Area,
    out: &mut [i16],
) {
    let left = matches.left.row(y);
    let right = matches.right.row(y);
    let evidence = matches.evidence.row(y);
    for (x, (out, &d)) in
        out.iter_mut().zip(left).enumerate().take(area.columns.end).skip(area.columns.start)
    {
        *out = NO_MATCH;
        if d == NO_MATCH || evidence[x] == 0 {
            continue;
        }
        let Some(max_difference) = max_difference else {
            *out = d;
            continue;
        };
        let partner = x as i32 - ((i32::from(d) + STEPS / 2) >> STEPS.trailing_zeros());
        // A partner outside the right image can neither agree nor contradict.
        let agreed = match usize::try_from(partner) {
            Ok(x) => {
                (i32::from(right[x.min(right.len() - 1)]) - i32::from(d)).abs() <= max_difference
            }
            Err(_) => true,
        };
        if agreed {
            *out = d;
        }
    }
}
