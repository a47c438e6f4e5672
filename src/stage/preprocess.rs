//! From pictures to the views that all other stages read.

pub mod denoise;
pub mod gradient;
pub mod illumination;
pub mod luma;
pub mod rectify;
pub mod resize;

use std::sync::Arc;

use crate::camera::StereoRig;
use crate::config::{Config, Denoise, Illumination};
use crate::image::{Image, Picture, Size};
use crate::perception::{Perception, StereoFrame, View};
use crate::simd::Level;

use denoise::{gaussian3, median3};
use gradient::gradient;
use illumination::{Clahe, match_contrast};
use luma::{luma, spread};
use rectify::RectifyMap;
use resize::box_mean;

/// Rectify, resize, denoise, normalise; RGB, gray and gradient forms.
///
/// Both gray views go the same way (luma of the raw picture, rectify, resize,
/// denoise), so that no step makes a difference between them; the colours of
/// the left view go that way beside them.
pub struct Preprocess {
    level: Level,
    size: Size,
    scale: usize,
    rectify: bool,
    illumination: Illumination,
    calibration: Option<Calibration>,
    luma: Image<u8>,
    gray: Chain<1>,
    rgb: Chain<3>,
    clahe: Clahe,
}

/// What is derived from one rig.
struct Calibration {
    source: Arc<StereoRig>,
    scaled: Arc<StereoRig>,
    /// Left and right map, when pictures are rectified here.
    maps: Option<[RectifyMap; 2]>,
}

impl Preprocess {
    /// The stage for pictures of `size`.
    pub fn new(config: &Config, size: Size, level: Level) -> Self {
        let scale = match config.preprocess.scale {
            2 => 2,
            4 => 4,
            _ => 1,
        };
        let denoise = config.preprocess.denoise;
        let scaled = Size::new((size.width / scale).max(1), (size.height / scale).max(1));
        Self {
            level,
            size: if size.is_empty() { size } else { scaled },
            scale,
            rectify: config.rectify,
            illumination: config.preprocess.illumination,
            calibration: None,
            luma: Image::default(),
            gray: Chain::new(level, scale, denoise),
            rgb: Chain::new(level, scale, denoise),
            clahe: Clahe::default(),
        }
    }

    /// Size of the views: the pictures' size divided by `preprocess.scale`,
    /// rounded down.
    pub fn output_size(&self) -> Size {
        self.size
    }

    /// Fills stamps, frame id, rig (of the views) and left view of `out`, and
    /// gray and gradient of the right view (its `rgb` stays empty).
    pub fn run(&mut self, frame: &StereoFrame, out: &mut Perception, right: &mut View) {
        self.calibrate(&frame.rig);
        let Some(calibration) = &self.calibration else { return };
        out.stamp = frame.stamp;
        out.right_stamp = frame.right_stamp;
        out.frame_id = Arc::clone(&frame.frame_id);
        out.rig = Arc::clone(&calibration.scaled);

        let [left_map, right_map] = match &calibration.maps {
            Some([left, right]) => [Some(left), Some(right)],
            None => [None, None],
        };
        for (picture, map, view) in
            [(&frame.left, left_map, &mut out.left), (&frame.right, right_map, &mut *right)]
        {
            let gray = match picture {
                Picture::Gray(gray) => gray,
                Picture::Rgb(rgb) => {
                    luma(self.level, rgb, &mut self.luma);
                    &self.luma
                }
            };
            view.gray.resize(self.size);
            let out = view.gray.pixels_mut();
            self.gray.run(gray.pixels(), gray.width(), map, out, self.size.width);
        }
        match &frame.left {
            Picture::Gray(_) => spread(&out.left.gray, &mut out.left.rgb),
            Picture::Rgb(rgb) => {
                out.left.rgb.resize(self.size);
                let out = out.left.rgb.pixels_mut().as_flattened_mut();
                let pixels = rgb.pixels().as_flattened();
                self.rgb.run(pixels, rgb.width(), left_map, out, self.size.width);
            }
        }
        // Later steps change the gray values alone.
        out.left.is_gray = matches!(frame.left, Picture::Gray(_))
            && matches!(self.illumination, Illumination::None);
        match self.illumination {
            Illumination::None => {}
            Illumination::Clahe => {
                self.clahe.run(&mut out.left.gray);
                self.clahe.run(&mut right.gray);
            }
            Illumination::Match => match_contrast(&out.left.gray, &mut right.gray),
        }
        gradient(self.level, &out.left.gray, &mut out.left.gradient);
        gradient(self.level, &right.gray, &mut right.gradient);
    }

    /// Makes maps and scaled rig anew when the calibration has changed. Frames
    /// share one rig as a rule, so the pointers are compared first.
    fn calibrate(&mut self, rig: &Arc<StereoRig>) {
        if let Some(known) = &mut self.calibration {
            if Arc::ptr_eq(&known.source, rig) {
                return;
            }
            if known.source == *rig {
                known.source = Arc::clone(rig);
                return;
            }
        }
        self.calibration = Some(Calibration {
            source: Arc::clone(rig),
            scaled: if self.scale == 1 {
                Arc::clone(rig)
            } else {
                Arc::new(rig.divided_by(self.scale))
            },
            maps: self.rectify.then(|| [RectifyMap::new(&rig.left), RectifyMap::new(&rig.right)]),
        });
    }
}

/// Rectify, resize, denoise for `C` interleaved channels, with the images in between.
struct Chain<const C: usize> {
    level: Level,
    scale: usize,
    denoise: Denoise,
    rectified: Vec<u8>,
    resized: Vec<u8>,
}

impl<const C: usize> Chain<C> {
    fn new(level: Level, scale: usize, denoise: Denoise) -> Self {
        Self { level, scale, denoise, rectified: Vec::new(), resized: Vec::new() }
    }

    /// From a picture of rows of `width` pixels to a view of rows of `out_width`.
    /// The last step that is switched on writes into `out`.
    fn run(
        &mut self,
        picture: &[u8],
        width: usize,
        map: Option<&RectifyMap>,
        out: &mut [u8],
        out_width: usize,
    ) {
        let mut source = picture;
        if let Some(map) = map {
            if self.scale == 1 && self.denoise == Denoise::None {
                return map.apply::<C>(source, out);
            }
            self.rectified.resize(picture.len(), 0);
            map.apply::<C>(source, &mut self.rectified);
            source = &self.rectified;
        }
        if self.scale > 1 {
            if self.denoise == Denoise::None {
                return shrink::<C>(self.level, self.scale, source, width, out, out_width);
            }
            self.resized.resize(out.len(), 0);
            shrink::<C>(self.level, self.scale, source, width, &mut self.resized, out_width);
            source = &self.resized;
        }
        match self.denoise {
            Denoise::None => out.copy_from_slice(source),
            Denoise::Median3 => median3::<C>(self.level, source, out_width, out),
            Denoise::Gaussian3 => gaussian3::<C>(self.level, source, out_width, out),
        }
    }
}

fn shrink<const C: usize>(
    level: Level,
    scale: usize,
    source: &[u8],
    width: usize,
    out: &mut [u8],
    out_width: usize,
) {
    match scale {
        2 => box_mean::<C, 2>(level, source, width, out, out_width),
        _ => box_mean::<C, 4>(level, source, width, out, out_width),
    }
}
