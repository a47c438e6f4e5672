//! Where each pixel was in the frame before, for measures of stability: the
//! same motion for every method and for the truth.

use crate::image::{Image, Picture, Size};
use crate::simd;
use crate::stage::coarse::CELL;
use crate::stage::preprocess::{luma, resize};
use crate::stage::saliency::flow::Flow;

/// Least trust in a match.
const LEAST_TRUST: f32 = 0.5;

/// Block matching at quarter size ([`Flow`]) from frame to frame.
pub struct Motion {
    flow: Flow,
    before: Image<u8>,
    now: Image<u8>,
    gray: Image<u8>,
    is_known: bool,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            flow: Flow::new(simd::detect()),
            before: Image::default(),
            now: Image::default(),
            gray: Image::default(),
            is_known: false,
        }
    }
}

impl Motion {
    /// Forgets the frame before.
    pub fn clear(&mut self) {
        self.now = Image::default();
        self.is_known = false;
    }

    /// Takes the next frame.
    pub fn run(&mut self, left: &Picture) {
        let level = simd::detect();
        match left {
            Picture::Gray(gray) => self.gray.copy_from(gray),
            Picture::Rgb(rgb) => luma::luma(level, rgb, &mut self.gray),
        }
        std::mem::swap(&mut self.before, &mut self.now);
        let size = self.gray.size().divided_by(CELL);
        self.now.resize(size);
        let width = self.gray.width();
        resize::box_mean::<1, CELL>(
            level,
            self.gray.pixels(),
            width,
            self.now.pixels_mut(),
            size.width,
        );
        self.is_known = self.before.size() == size;
        if self.is_known {
            self.flow.run(&self.before, &self.now);
        }
    }

    /// How many columns and rows away pixel `(x, y)` of the last frame was in
    /// the one before; nothing where it was not seen. `None` on a first frame, and when the views do
    /// not have the size of the pictures.
    pub fn flow(&self, view: Size) -> Option<impl Fn(usize, usize) -> Option<(f32, f32)> + '_> {
        (self.is_known && view == self.gray.size()).then_some(|x: usize, y: usize| {
            let (u, v) = (x / CELL, y / CELL);
            let shift = |map: &Image<f32>| map.get(u, v) * CELL as f32;
            (self.flow.trust.get(u, v) >= LEAST_TRUST)
                .then(|| (shift(&self.flow.dx), shift(&self.flow.dy)))
        })
    }
}
