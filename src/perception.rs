//! What goes into the pipeline for one instant, and everything it yields.

mod region;
mod time;

use std::sync::Arc;

pub use region::{Region, RegionList, Rejections, TrackState};
pub use time::{Clock, Stage, StageTimes};

use crate::camera::StereoRig;
use crate::image::{Image, Picture, Size};
use crate::simd;
use crate::stage::coarse::CELL;
use crate::stage::ground::GroundState;
use crate::stage::saliency::upsample;
use crate::stamp::Stamp;

/// Sub-pixel step of [`Perception::disparity`] in pixels.
pub const DISPARITY_STEP: f32 = 1.0 / 32.0;

/// One stereo pair, decoded and calibrated.
///
/// The doors guarantee: both pictures have the same, non-empty size, and it is
/// the size that the rig's cameras describe.
#[derive(Clone, Debug)]
pub struct StereoFrame {
    /// Acquisition time of the left picture.
    pub stamp: Stamp,
    /// Acquisition time of the right picture.
    pub right_stamp: Stamp,
    /// Name of the left camera's optical frame, passed through to the outputs.
    pub frame_id: Arc<str>,
    /// Left picture: raw when `rectify` is on, else rectified.
    pub left: Picture,
    /// Right picture, as the left one.
    pub right: Picture,
    /// Calibration of both, shared by all frames until it changes.
    pub rig: Arc<StereoRig>,
}

/// The three forms of one view that the stages read, all of the same size.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Colours; a gray camera gives equal channels.
    pub rgb: Image<[u8; 3]>,
    /// True where `rgb` is known to say no more than `gray`: who reads that reads
    /// a third.
    pub is_gray: bool,
    /// Luma (ITU-R BT.601), after denoising and illumination normalisation.
    pub gray: Image<u8>,
    /// Gradient magnitude of `gray`: (|Sobel x| + |Sobel y|) / 8, saturated.
    pub gradient: Image<u8>,
}

/// The region of interest: what is salient, and what is matched because of it.
#[derive(Clone, Debug, Default)]
pub struct RoiMask {
    /// 255 where salient after clean-up and at poles, else 0; full size.
    pub salient: Image<u8>,
    /// 255 where disparity is computed: `salient` dilated by `roi.dilation`, and poles, which
    /// are matched as whole lines and not dilated; full size.
    pub matched: Image<u8>,
    /// Share of the image inside `matched`, 0..=1.
    pub fraction: f32,
}

/// Everything that one frame yields. Buffers are reused from frame to frame.
#[derive(Debug)]
pub struct Perception {
    /// Acquisition time of the left picture.
    pub stamp: Stamp,
    /// Acquisition time of the right picture.
    pub right_stamp: Stamp,
    /// Name of the left camera's optical frame.
    pub frame_id: Arc<str>,
    /// Calibration of the processed (rectified, possibly scaled) views.
    pub rig: Arc<StereoRig>,
    /// The left view as processed: every image below but the attention map has its size.
    pub left: View,
    /// Whether attention reckons with a ground plane.
    pub ground: GroundState,
    /// Attention map S of eq. 4, 0..=1, one value per cell of [`CELL`] pixels; those of
    /// pixels are [`Perception::saliency`].
    pub attention: Image<f32>,
    /// Region of interest.
    pub roi: RoiMask,
    /// Disparity `d = x_l - x_r - (cx_l - cx_r)` in pixels, in steps of
    /// [`DISPARITY_STEP`]; NaN where there is none.
    pub disparity: Image<f32>,
    /// Probability that the disparity is right, 0..=1; 0 where there is none.
    pub confidence: Image<f32>,
    /// Depth Z in metres along the optical axis (REP 118); NaN unknown, +Inf
    /// beyond `depth.max`, -Inf nearer than `depth.min` (REP 117).
    pub depth: Image<f32>,
    /// 0 background, else [`Region::label`].
    pub labels: Image<u16>,
    /// Salient regions by decreasing priority.
    pub regions: RegionList,
    /// Candidates that did not become regions, by reason.
    pub rejections: Rejections,
    /// Smallest disparity searched in pixels, `cx_l - cx_r` subtracted.
    pub min_disparity: f32,
    /// Largest disparity searched in pixels, `cx_l - cx_r` subtracted.
    pub max_disparity: f32,
    /// Milliseconds per stage.
    pub times: StageTimes,
}

impl Perception {
    /// Empty outputs for views of `size`, with `rig` until the first frame is processed.
    pub fn new(size: Size, rig: Arc<StereoRig>) -> Self {
        Self {
            stamp: Stamp::default(),
            right_stamp: Stamp::default(),
            frame_id: Arc::from(""),
            rig,
            left: View {
                rgb: Image::new(size),
                is_gray: false,
                gray: Image::new(size),
                gradient: Image::new(size),
            },
            ground: GroundState::default(),
            attention: Image::new(size.divided_by(CELL)),
            roi: RoiMask { salient: Image::new(size), matched: Image::new(size), fraction: 0.0 },
            disparity: Image::filled(size, f32::NAN),
            confidence: Image::new(size),
            depth: Image::filled(size, f32::NAN),
            labels: Image::new(size),
            regions: RegionList::default(),
            rejections: Rejections::default(),
            min_disparity: 0.0,
            max_disparity: 0.0,
            times: StageTimes::default(),
        }
    }

    /// Attention map S of eq. 4 at every pixel, 0..=1: made from
    /// [`Perception::attention`] whenever it is asked for, as no stage needs it.
    pub fn saliency(&self) -> Image<f32> {
        let mut map = Image::default();
        upsample(simd::detect(), &self.attention, self.left.gray.size(), &mut map);
        map
    }
}
