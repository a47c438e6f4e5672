//! What is true of a frame, in the size of the processed views.

use crate::image::{Image, Size};
use crate::input::Truth;
use crate::output::score::shrink_to;

/// The truth of the current frame, and the mask of the one before.
#[derive(Debug, Default)]
pub struct ViewTruth {
    size: Size,
    /// The truth of the current frame has not been brought to `size` yet.
    stale: bool,
    mask: Option<Image<u8>>,
    mask_before: Option<Image<u8>>,
    disparity: Option<Image<f32>>,
    all_disparity: Option<Image<f32>>,
}

impl ViewTruth {
    /// Goes on to the next frame.
    pub fn advance(&mut self) {
        self.mask_before = self.mask.take();
        self.stale = true;
    }

    /// Brings the truth of the current frame to the size of the views, once.
    pub fn fit(&mut self, truth: Option<&Truth>, size: Size) {
        if !self.stale && self.size == size {
            return;
        }
        (self.size, self.stale) = (size, false);
        let objects = truth.and_then(|truth| shrink_to(truth.objects.as_ref()?, size));
        self.mask = objects.map(|(objects, _)| {
            Image::from_fn(size, |x, y| if objects.get(x, y) == 0 { 0 } else { 255 })
        });
        let disparity = |image: Option<&Image<f32>>| {
            let (mut image, factor) = shrink_to(image?, size)?;
            image.pixels_mut().iter_mut().for_each(|d| *d /= factor as f32);
            Some(image)
        };
        self.disparity = disparity(truth.and_then(|truth| truth.disparity.as_ref()));
        let all = truth.and_then(|truth| truth.disparity_with_occluded.as_ref());
        self.all_disparity = disparity(all);
    }

    /// Size of the views; empty before the first frame.
    pub const fn size(&self) -> Size {
        self.size
    }

    /// 255 on true objects.
    pub const fn mask(&self) -> Option<&Image<u8>> {
        self.mask.as_ref()
    }

    /// The mask of the frame before, if it has the same size.
    pub fn mask_before(&self) -> Option<&Image<u8>> {
        self.mask_before.as_ref().filter(|mask| mask.size() == self.size)
    }

    /// True disparity of non-occluded pixels.
    pub const fn disparity(&self) -> Option<&Image<f32>> {
        self.disparity.as_ref()
    }

    /// True disparity of all pixels that are known; that of the non-occluded
    /// ones where the source knows no other.
    pub fn all_disparity(&self) -> Option<&Image<f32>> {
        self.all_disparity.as_ref().or(self.disparity.as_ref())
    }
}
