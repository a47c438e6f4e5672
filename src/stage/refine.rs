//! From raw matches to disparity and confidence.

pub mod speckle;

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::{Image, Size};
use crate::perception::{DISPARITY_STEP, RoiMask};
use crate::stage::refine::speckle::Speckles;
use crate::stage::stereo::winner::STEPS;
use crate::stage::stereo::{Matches, NO_MATCH};

/// Left-right check, median, speckle filter, confidence.
pub struct Refine {
    size: Size,
    max_difference: Option<i32>,
    speckle_size: usize,
    speckle_range: i32,
    min_confidence: f32,
    checked: Image<i16>,
    smooth: Image<i16>,
    speckles: Speckles,
}

impl Refine {
    /// The stage for images of `size`.
    pub fn new(config: &Config, size: Size) -> Self {
        let stereo = &config.stereo;
        Self {
            size,
            max_difference: (stereo.disp12_max_diff >= 0)
                .then_some(stereo.disp12_max_diff as i32 * STEPS + STEPS / 2),
            speckle_size: stereo.speckle_size.max(0) as usize,
            speckle_range: (stereo.speckle_range * f64::from(STEPS)) as i32,
            min_confidence: config.min_confidence as f32,
            checked: Image::default(),
            smooth: Image::default(),
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
        let rows = matched_rows(&roi.matched);
        self.checked.resize(self.size);
        self.smooth.resize(self.size);
        for y in rows.clone() {
            check_row(matches, y, self.max_difference, self.checked.row_mut(y));
        }
        for y in rows.clone() {
            median_row(&self.checked, &rows, y, self.smooth.row_mut(y));
        }
        if self.speckle_size > 1 {
            self.speckles.remove(&mut self.smooth, &rows, self.speckle_size, self.speckle_range);
        }
        let offset = rig.disparity_offset() as f32;
        for y in rows {
            let evidence = matches.evidence.row(y);
            let raw = matches.left.row(y);
            let out = disparity.row_mut(y).iter_mut().zip(confidence.row_mut(y));
            for (x, ((d, c), &smooth)) in out.zip(self.smooth.row(y)).enumerate() {
                if smooth == NO_MATCH {
                    continue;
                }
                let moved = (i32::from(raw[x]) - i32::from(smooth)).abs();
                let value = trust(evidence[x], moved);
                if value >= self.min_confidence {
                    *d = f32::from(smooth) * DISPARITY_STEP - offset;
                    *c = value;
                }
            }
        }
    }
}

/// Confidence from the evidence of the cost curve; halved where the median
/// took the disparity from elsewhere.
fn trust(evidence: u8, moved: i32) -> f32 {
    let trust = 0.4 + 0.6 * (f32::from(evidence) / 255.0).sqrt();
    if moved > STEPS { 0.5 * trust } else { trust }
}

/// Rows from the first to the last that has a pixel to match.
fn matched_rows(mask: &Image<u8>) -> std::ops::Range<usize> {
    let any = |y: &usize| mask.row(*y).iter().fold(0, |any, &v| any | v) != 0;
    let first = (0..mask.height()).find(any);
    let last = (0..mask.height()).rev().find(any);
    match (first, last) {
        (Some(first), Some(last)) => first..last + 1,
        _ => 0..0,
    }
}

/// Drops disparities that the right view contradicts.
fn check_row(matches: &Matches, y: usize, max_difference: Option<i32>, out: &mut [i16]) {
    let left = matches.left.row(y);
    let Some(max_difference) = max_difference else {
        out.copy_from_slice(left);
        return;
    };
    let right = matches.right.row(y);
    for (x, (out, &d)) in out.iter_mut().zip(left).enumerate() {
        *out = NO_MATCH;
        if d == NO_MATCH {
            continue;
        }
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

/// Median of the valid pixels in the 3x3 window of every valid pixel.
fn median_row(image: &Image<i16>, rows: &std::ops::Range<usize>, y: usize, out: &mut [i16]) {
    let above = image.row(y.saturating_sub(1).max(rows.start));
    let here = image.row(y);
    let below = image.row((y + 1).min(rows.end - 1));
    let width = here.len();
    for x in 0..width {
        if here[x] == NO_MATCH {
            out[x] = NO_MATCH;
            continue;
        }
        let (l, r) = (x.saturating_sub(1), (x + 1).min(width - 1));
        let mut window =
            [above[l], above[x], above[r], here[l], here[x], here[r], below[l], below[x], below[r]];
        if window.contains(&NO_MATCH) {
            window.sort_unstable();
            let none = window.iter().take_while(|&&d| d == NO_MATCH).count();
            out[x] = window[none + (9 - none) / 2];
        } else {
            out[x] = median9(window);
        }
    }
}

/// Median of nine by the least number of exchanges (Paeth 1990).
fn median9(mut p: [i16; 9]) -> i16 {
    let mut sort = |a: usize, b: usize| {
        let (low, high) = (p[a].min(p[b]), p[a].max(p[b]));
        p[a] = low;
        p[b] = high;
    };
    for (a, b) in [
        (1, 2),
        (4, 5),
        (7, 8),
        (0, 1),
        (3, 4),
        (6, 7),
        (1, 2),
        (4, 5),
        (7, 8),
        (0, 3),
        (5, 8),
        (4, 7),
        (3, 6),
        (1, 4),
        (2, 5),
        (4, 7),
        (4, 2),
        (6, 4),
        (4, 2),
    ] {
        sort(a, b);
    }
    p[4]
}
