//! What is nearer than the background of the view.
//!
//! Without a plane nothing tells how high a thing stands, but most of what a
//! picture is of stands before the rest of it (the depth prior of Peng et al.,
//! "RGBD Salient Object Detection", ECCV 2014, taken relative to the background).

use crate::image::Image;

/// Share of the cells that is background at least.
const BACKGROUND: f32 = 0.4;
/// Lead over the background's disparity from which a cell is nearer, and that
/// over which it counts more and more: in parts of it, and at least in pixels,
/// one and two standard deviations of the coarse disparity.
const LEAST_PART: f32 = 0.1;
const FULL_PART: f32 = 0.3;
const LEAST_PX: f32 = 0.8;
const FULL_PX: f32 = 1.6;
/// Share of the cells that what is near exceeds.
const NEAR: f32 = 0.1;

/// The cue with its buffer.
#[derive(Debug, Default)]
pub struct Nearness {
    ranked: Vec<f32>,
    /// Disparity of the background, less `cx_l - cx_r`, pixels.
    background: f32,
    offset: f32,
    /// The nearness that a tenth of the cells exceeds.
    pub most: f32,
}

impl Nearness {
    /// Looks over the `filled` disparity per cell (full-size pixels), of which
    /// `offset` is that at infinity.
    pub fn run(&mut self, filled: &Image<f32>, offset: f32) {
        self.offset = offset;
        self.ranked.clear();
        self.ranked.extend(filled.pixels().iter().map(|d| d - offset));
        self.background = rank(&mut self.ranked, BACKGROUND).max(1.0);
        let near = rank(&mut self.ranked, 1.0 - NEAR) + offset;
        // Nearness grows with the disparity, so that the ranks are the same.
        self.most = self.of(near);
    }

    /// min(1, max(0, d − b − max(.1 b, .8 px)) / max(.3 b, 1.6 px)) of a cell of
    /// disparity `d`, b being the disparity that two fifths of the cells do not
    /// exceed.
    #[inline]
    pub fn of(&self, d: f32) -> f32 {
        let b = self.background;
        let least = (LEAST_PART * b).max(LEAST_PX);
        let full = (FULL_PART * b).max(FULL_PX);
        ((d - self.offset - b - least) / full).clamp(0.0, 1.0)
    }
}

/// The value that `share` of the values do not exceed; 0 of none.
fn rank(values: &mut [f32], share: f32) -> f32 {
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let at = (share * last as f32) as usize;
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;

    #[test]
    fn what_stands_before_the_background_is_near_and_noise_is_not() {
        let view = |near: f32| {
            Image::from_fn(Size::new(40, 30), |x, y| {
                let inside = (10..20).contains(&x) && (5..25).contains(&y);
                let wave = 0.3 * ((x * 7 + y * 3) % 5) as f32;
                12.0 + if inside { near } else { wave }
            })
        };
        let mut cue = Nearness::default();
        cue.run(&view(8.0), 2.0);
        assert_eq!((cue.of(20.0), cue.of(12.5), cue.most), (1.0, 0.0, 1.0));
        // As near as the waves of the wall.
        cue.run(&view(1.0), 2.0);
        assert!(cue.most < 0.2, "{}", cue.most);
        // Something fills most of the view: there is no background to tell.
        cue.run(&Image::filled(Size::new(8, 8), 30.0), 0.0);
        assert_eq!((cue.most, cue.of(30.0)), (0.0, 0.0));
        cue.run(&Image::default(), 0.0);
        assert_eq!(cue.most, 0.0);
    }
}
