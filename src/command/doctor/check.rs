//! What frames tell about the cameras: calibration and alignment.

use super::finding::Finding;
use crate::config::Config;
use crate::image::Size;
use crate::metric::{Epipolar, MISALIGNED_PX, epipolar};
use crate::perception::{Perception, StereoFrame, View};
use crate::simd;
use crate::stage::preprocess::Preprocess;

/// Rows searched up and down: raw images of a hand-made rig are further apart
/// than those of a bad calibration.
const REACH: usize = 24;

/// Most frames whose alignment is measured, and the frames between two of them.
const MOST_MEASURED: usize = 8;
const STRIDE: usize = 5;

/// Median vertical offset from which the images cannot be rectified, pixels.
const UNRECTIFIED_PX: f64 = 3.0;

/// Longest baseline that a rig is believed to have, metres.
const LONGEST_BASELINE_M: f64 = 5.0;
/// Shortest one.
const SHORTEST_BASELINE_M: f64 = 0.002;

/// Looks at frames one by one.
pub struct FrameCheck {
    config: Config,
    views: Option<Views>,
    frames: usize,
    summary: String,
    baseline_m: f64,
    measured: Vec<Epipolar>,
    unmeasured: usize,
}

struct Views {
    size: Size,
    preprocess: Preprocess,
    left: Perception,
    right: View,
}

impl FrameCheck {
    /// A check of frames under these parameters.
    pub fn new(config: &Config) -> Self {
        Self {
            config: config.clone(),
            views: None,
            frames: 0,
            summary: String::new(),
            baseline_m: f64::NAN,
            measured: Vec::new(),
            unmeasured: 0,
        }
    }

    /// Number of frames seen.
    pub const fn frames(&self) -> usize {
        self.frames
    }

    /// Looks at one frame.
    pub fn take(&mut self, frame: &StereoFrame) {
        self.frames += 1;
        let size = frame.left.size();
        let rig = &frame.rig;
        self.baseline_m = rig.baseline_m;
        self.summary =
            format!("{size} pixels, f = {:.2} px, B = {:.4} m", rig.focal_px(), rig.baseline_m);
        let looked_at = self.measured.len() + self.unmeasured;
        if looked_at >= MOST_MEASURED || !(self.frames - 1).is_multiple_of(STRIDE) {
            return;
        }
        let views = match self.views.take() {
            Some(views) if views.size == size => views,
            _ => Views {
                size,
                preprocess: Preprocess::new(&self.config, size, simd::detect()),
                left: Perception::new(size, std::sync::Arc::clone(rig)),
                right: View::default(),
            },
        };
        let Views { preprocess, left, right, .. } = self.views.insert(views);
        preprocess.run(frame, left, right);
        let most = (self.config.stereo.min_disparity + self.config.stereo.disparity_range) as i32;
        // Both ways, so that swapped images are found too.
        match epipolar(&left.left.gray, &right.gray, -most..=most, REACH) {
            Some(found) => self.measured.push(found),
            None => self.unmeasured += 1,
        }
    }

    /// What was found.
    pub fn findings(&self) -> Vec<Finding> {
        if self.frames == 0 {
            return Vec::new();
        }
        let mut findings =
            vec![Finding::well(format!("{} usable pairs: {}", self.frames, self.summary))];
        findings.extend(self.baseline());
        findings.push(self.alignment());
        findings
    }

    fn baseline(&self) -> Option<Finding> {
        let b = self.baseline_m;
        if b > LONGEST_BASELINE_M {
            return Some(Finding::fault(
                format!("the baseline is {b:.3} m: most likely it was calibrated in millimetres"),
                format!(
                    "P[3] of the right camera info must be -f*B in pixels times metres: calibrate with the board's squares in metres, or set calibration.baseline_override to {}",
                    b / 1000.0
                ),
            ));
        }
        (b < SHORTEST_BASELINE_M).then(|| {
            Finding::fault(
                format!("the baseline is {b:.6} m, which no stereo camera has"),
                "P[3] of the right camera info must be -f*B in pixels times metres; set calibration.baseline_override to the distance of the lenses in metres",
            )
        })
    }

    fn alignment(&self) -> Finding {
        let Some(worst) = middle(&self.measured) else {
            return Finding::warning(
                format!(
                    "alignment not measured: too few corners of the left image were found in the right one ({} frames)",
                    self.unmeasured
                ),
                "show the cameras a scene with texture; if it has, the two images do not belong together",
            );
        };
        let Epipolar { error_px, offset_px, disparity_px, points } = worst;
        if disparity_px < -1.0 {
            return Finding::fault(
                format!(
                    "left and right images are swapped: things lie {:.1} px farther right in the right image",
                    -disparity_px
                ),
                "exchange the left and the right image topics",
            );
        }
        let fix = if self.config.rectify {
            "calibrate the two cameras together anew: the camera infos do not fit these images"
        } else {
            "if these are raw images, remap image_raw and set rectify:=true; else calibrate the two cameras together anew"
        };
        let text = format!(
            "rows are {error_px:.2} px apart (median of {points} points; the right image lies {offset_px:+.2} px lower)"
        );
        if error_px > UNRECTIFIED_PX {
            Finding::fault(format!("the images are not rectified: {text}"), fix)
        } else if error_px > MISALIGNED_PX {
            Finding::warning(format!("the images are badly aligned: {text}"), fix)
        } else {
            Finding::well(format!("the images are aligned: {text}"))
        }
    }
}

/// The measurement with the middle error.
fn middle(measured: &[Epipolar]) -> Option<Epipolar> {
    let mut sorted = measured.to_vec();
    sorted.sort_by(|a, b| a.error_px.total_cmp(&b.error_px));
    sorted.get(sorted.len() / 2).copied()
}
