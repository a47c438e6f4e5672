//! Where there is no ground: what cannot be reached from the border, near the
//! centre, or moves by itself.

use crate::image::Image;
use crate::stage::roi::threshold::otsu;
use crate::stage::saliency::AttentionScene;
use crate::stage::saliency::boundary::Boundary;
use crate::stage::saliency::ego::EgoMotion;
use crate::stage::saliency::nearness::Nearness;

/// Sum of the barriers of Y, Cb and Cr that counts fully: in a still with
/// depth, in one without, and in a video.
const FULL_BARRIER: f32 = 180.0;
const FULL_BARRIER_PICTURE: f32 = 120.0;
const FULL_BARRIER_VIDEO: f32 = 90.0;
/// What falls off towards the edge, in squares of the relative distance from
/// the centre: as above. A camera that follows something need not hold it in
/// the middle.
const SPREAD: f32 = 2.0;
const SPREAD_PICTURE: f32 = 4.0;
const SPREAD_VIDEO: f32 = 1.0;
/// Sum of Mahalanobis distances from three sides that counts fully.
const FULL_BOUNDARY: f32 = 12.0;
/// What a barrier of disparity over the full range adds.
const RELIEF: f32 = 0.1;
/// What rests is worth beside what moves as this to this and 1, and so is the
/// background beside what is near.
const REST: f32 = 0.5;
/// Motion of the movers from which it says anything, and from which all: in a
/// small view or of people some blocks always differ from the camera's motion.
const LEAST_MOTION: f32 = 0.4;
const FULL_MOTION: f32 = 0.6;
/// The same for nearness.
const LEAST_NEARNESS: f32 = 0.3;
const FULL_NEARNESS: f32 = 0.6;

/// Where the two classes of a still are to be parted, and the least value at
/// which they are taken for two.
const CLASSES_PART: f32 = 0.55;
const LEAST_CLASSES_PART: f32 = 0.3;

/// What the mode knows of a frame, per cell.
pub struct Cues<'a> {
    /// Sum of the barriers of Y, Cb and Cr, 0..=765.
    pub barrier: &'a Image<f32>,
    /// Barrier of disparity, 0..=255.
    pub relief: &'a Image<f32>,
    /// Motion beside the camera's own, in a video.
    pub motion: Option<&'a EgoMotion>,
}

/// Attention without a ground, with its cues.
#[derive(Debug, Default)]
pub struct WithoutPlane {
    boundary: Boundary,
    nearness: Nearness,
    border: Image<f32>,
}

impl WithoutPlane {
    /// S per cell, r² being the squared relative distance from the centre:
    ///
    /// - in a still with depth (`C_MB` + .1 relief) · exp(−2 r²) · n;
    /// - in a picture without it 1.2 · √(`C_MB` · boundary contrast) · exp(−4 r²):
    ///   such a picture is of things more often than not. With disparity a bare
    ///   table or wall may fill the view, whose shading the boundary contrast
    ///   takes for a thing;
    /// - in a video (`C_MB` + .1 relief) · exp(−r²) · n · m, limited to 1.
    ///
    /// n is what a cell is worth for its [`Nearness`] (1 without depth), m for its
    /// motion: 1 − w + w · min(1, (.5 + c) / (.5 + most)), c being the cue there, `most`
    /// what a part of the view exceeds. w goes from 0 to 1 as `most` goes from .3 to
    /// .6, for motion from .4: where nothing is nearer than the rest, or all rests,
    /// the cue says nothing.
    pub fn run(
        &mut self,
        scene: &AttentionScene<'_>,
        cues: &Cues<'_>,
        has_depth: bool,
        out: &mut Image<f32>,
    ) {
        let of_things = cues.motion.is_none() && !has_depth;
        if of_things {
            self.boundary.run(&scene.cells.rgb, &mut self.border);
        }
        let (full, spread) = match cues.motion {
            Some(_) => (FULL_BARRIER_VIDEO, SPREAD_VIDEO),
            None if has_depth => (FULL_BARRIER, SPREAD),
            None => (FULL_BARRIER_PICTURE, SPREAD_PICTURE),
        };
        let near = has_depth.then(|| {
            self.nearness.run(&scene.coarse.filled, scene.rig.disparity_offset() as f32);
            (&self.nearness, Beside::new(self.nearness.most, LEAST_NEARNESS, FULL_NEARNESS))
        });
        let stirs =
            cues.motion.map(|ego| (&ego.motion, Beside::new(ego.most, LEAST_MOTION, FULL_MOTION)));
        let (width, height) = (out.width() as f32, out.height() as f32);
        for y in 0..out.height() {
            let (barrier, relief) = (cues.barrier.row(y), cues.relief.row(y));
            let v = (y as f32 + 0.5) / height - 0.5;
            for (x, out) in out.row_mut(y).iter_mut().enumerate() {
                let u = (x as f32 + 0.5) / width - 0.5;
                let barrier = (barrier[x] / full).min(1.0);
                let appearance = if of_things {
                    let contrast = (self.border.get(x, y) / FULL_BOUNDARY).min(1.0);
                    1.2 * (barrier * contrast).sqrt()
                } else {
                    barrier + RELIEF * relief[x] / 255.0
                };
                let near = near.as_ref().map_or(1.0, |(nearness, beside)| {
                    beside.worth(nearness.of(scene.coarse.filled.get(x, y)))
                });
                let stirs =
                    stirs.as_ref().map_or(1.0, |(motion, beside)| beside.worth(motion.get(x, y)));
                *out = (appearance * (-spread * (u * u + v * v)).exp() * near * stirs).min(1.0);
            }
        }
    }
}

/// What cells are worth beside those that have the most of a cue.
struct Beside {
    most: f32,
    weight: f32,
}

impl Beside {
    /// The cue says nothing while it reaches no more than `least`, and all from `full` on.
    fn new(most: f32, least: f32, full: f32) -> Self {
        Self { most, weight: ((most - least) / (full - least)).clamp(0.0, 1.0) }
    }

    fn worth(&self, cue: f32) -> f32 {
        1.0 - self.weight * (1.0 - ((REST + cue) / (REST + self.most)).min(1.0))
    }
}

/// Raises the map of a still until the threshold that parts its two classes best
/// (Otsu 1979) comes to .55, where attention is cut by default: pictures of low
/// contrast have no fixed scale. Below .3 it does not take them for two
/// classes, so that nothing comes of nothing, and it lowers no map.
pub fn even_contrast(map: &mut Image<f32>) {
    let gain = CLASSES_PART / otsu(map).clamp(LEAST_CLASSES_PART, CLASSES_PART);
    for s in map.pixels_mut() {
        *s = (*s * gain).min(1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;

    #[test]
    fn low_contrast_is_raised_to_the_threshold_and_noise_is_not() {
        let two = |low: f32, high: f32| {
            let mut map = Image::from_fn(Size::new(20, 20), |x, _| if x < 15 { low } else { high });
            even_contrast(&mut map);
            (map.get(0, 0), map.get(19, 0))
        };
        let (low, high) = two(0.1, 0.35);
        assert!(low < 0.2 && high >= 0.55, "{low} {high}");
        let (low, high) = two(0.45, 0.52);
        assert!(low < 0.55 && high >= 0.55, "{low} {high}");
        // Nothing comes of nothing, and what is well parted is not lowered.
        assert!(two(0.02, 0.25).1 < 0.5);
        assert_eq!(two(0.2, 0.2), (0.2, 0.2));
        let (low, high) = two(0.6, 0.9);
        assert_eq!((low, high), (0.6, 0.9));
    }
}
