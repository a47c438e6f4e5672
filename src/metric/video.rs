//! Masks over time against true masks.

mod boundary;

use serde::{Deserialize, Serialize};

pub use boundary::boundary_f;

use super::{Mean, share};
use crate::image::Image;

/// J and F from which a frame counts as found.
const RECALL_THRESHOLD: f64 = 0.5;

/// Collects the frames of videos; every measure but the warped IoU is averaged
/// per video first.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VideoStats {
    videos: Vec<Video>,
    warped: Mean,
    true_warped: Mean,
}

/// J and F of the frames of one video.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Video {
    j: Vec<f64>,
    f: Vec<f64>,
}

impl VideoStats {
    /// From here on frames belong to a new video.
    pub fn begin_video(&mut self) {
        self.videos.push(Video::default());
    }

    /// Adds the next frame: our mask and the true one, non-zero where salient,
    /// equally large (others have J and F 0). Without a video it begins one.
    pub fn add_frame(&mut self, mask: &Image<u8>, truth: &Image<u8>) {
        if self.videos.is_empty() {
            self.begin_video();
        }
        if let Some(video) = self.videos.last_mut() {
            video.j.push(region_similarity(mask, truth));
            video.f.push(boundary_f(mask, truth));
        }
    }

    /// Adds our masks of two frames; `flow` leads back from a pixel of the
    /// later one, as for `warped_iou`.
    pub fn add_stability(
        &mut self,
        previous: &Image<u8>,
        mask: &Image<u8>,
        flow: impl Fn(usize, usize) -> Option<(f32, f32)>,
    ) {
        self.warped.merge(&warped_iou(previous, mask, flow));
    }

    /// [`VideoStats::add_stability`] of the true masks.
    pub fn add_true_stability(
        &mut self,
        previous: &Image<u8>,
        mask: &Image<u8>,
        flow: impl Fn(usize, usize) -> Option<(f32, f32)>,
    ) {
        self.true_warped.merge(&warped_iou(previous, mask, flow));
    }

    /// Adds the videos of another one.
    pub fn merge(&mut self, other: &Self) {
        self.videos.extend_from_slice(&other.videos);
        self.warped.merge(&other.warped);
        self.true_warped.merge(&other.true_warped);
    }

    /// Everything in one row; `None` without frames.
    pub fn total(&self) -> Option<VideoScore> {
        let over_videos = |of: &dyn Fn(&Video) -> Option<f64>| {
            mean(&self.videos.iter().filter_map(of).collect::<Vec<_>>())
        };
        Some(VideoScore {
            j_mean: over_videos(&|video| mean(inner(&video.j)))?,
            j_recall: over_videos(&|video| recall(inner(&video.j)))?,
            j_decay: over_videos(&|video| decay(inner(&video.j)))?,
            f_mean: over_videos(&|video| mean(inner(&video.f)))?,
            f_recall: over_videos(&|video| recall(inner(&video.f)))?,
            f_decay: over_videos(&|video| decay(inner(&video.f)))?,
            warped_iou: self.warped.value(),
            true_warped_iou: self.true_warped.value(),
        })
    }
}

/// Without the first and the last frame, which the benchmark leaves out; all
/// of a video too short for that.
fn inner(values: &[f64]) -> &[f64] {
    if values.len() > 2 { &values[1..values.len() - 1] } else { values }
}

fn mean(values: &[f64]) -> Option<f64> {
    let mut mean = Mean::default();
    for value in values {
        mean.add(*value);
    }
    mean.value()
}

fn recall(values: &[f64]) -> Option<f64> {
    let found = values.iter().filter(|value| **value > RECALL_THRESHOLD).count();
    share(found as u64, values.len() as u64)
}

/// Mean of the first quarter less that of the last. The quarters meet in a
/// frame that belongs to both, as in the benchmark's program.
fn decay(values: &[f64]) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    // Ends of the quarters on 1..=n, rounded to the nearest, halves up.
    let end = |quarter: usize| (2 * last * quarter + 4) / 8;
    Some(mean(&values[..=end(1)])? - mean(&values[end(3)..])?)
}

/// J: IoU of two masks; 1 when both are empty.
fn region_similarity(mask: &Image<u8>, truth: &Image<u8>) -> f64 {
    if mask.size() != truth.size() {
        return 0.0;
    }
    let pixels = mask.pixels().iter().zip(truth.pixels()).map(|(a, b)| (*a != 0, *b != 0));
    iou(pixels).unwrap_or(1.0)
}

/// `None` when nothing is in either.
fn iou(pixels: impl Iterator<Item = (bool, bool)>) -> Option<f64> {
    let (mut both, mut either) = (0, 0);
    for (a, b) in pixels {
        both += u64::from(a && b);
        either += u64::from(a || b);
    }
    share(both, either)
}

/// IoU of a mask with the one before, moved along the flow. `flow` says for a
/// pixel (x, y) of now how many columns and rows away it was before, `None`
/// where that is not known; the nearest pixel there is compared. Pixels
/// without flow, or that come from beyond the border, are left out of both
/// masks. One value, or none when both masks are empty.
fn warped_iou(
    previous: &Image<u8>,
    mask: &Image<u8>,
    flow: impl Fn(usize, usize) -> Option<(f32, f32)>,
) -> Mean {
    let inside = |place: f32, end: usize| {
        let place = place.round();
        (place >= 0.0 && place < end as f32).then_some(place as usize)
    };
    let pixels = mask.rows().enumerate().flat_map(|(y, row)| {
        let flow = &flow;
        row.iter().enumerate().filter_map(move |(x, now)| {
            let (dx, dy) = flow(x, y)?;
            let before_x = inside(x as f32 + dx, previous.width())?;
            let before_y = inside(y as f32 + dy, previous.height())?;
            Some((*now != 0, previous.get(before_x, before_y) != 0))
        })
    });
    let mut mean = Mean::default();
    if let Some(iou) = iou(pixels) {
        mean.add(iou);
    }
    mean
}

/// Masks over time, by the definitions of DAVIS (Perazzi et al. 2016): means
/// over videos of means over frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VideoScore {
    /// Mean region similarity J: IoU of mask and truth.
    pub j_mean: f64,
    /// Share of the frames with J above 0.5.
    pub j_recall: f64,
    /// J of the first quarter of a video less that of the last.
    pub j_decay: f64,
    /// Mean boundary accuracy F.
    pub f_mean: f64,
    /// Share of the frames with F above 0.5.
    pub f_recall: f64,
    /// F of the first quarter of a video less that of the last.
    pub f_decay: f64,
    /// IoU of each mask with the one before, moved along the flow; mean over
    /// all pairs of frames.
    pub warped_iou: Option<f64>,
    /// The same of the true masks.
    pub true_warped_iou: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;

    #[test]
    fn quarters_are_those_of_the_benchmark() {
        // round(linspace(1, n, 5) + 1e-10) - 1, first and fourth bin.
        let ends = |n: usize| {
            let last = n - 1;
            let end = |quarter: usize| (2 * last * quarter + 4) / 8;
            (end(1), end(3))
        };
        assert_eq!(
            [1, 2, 3, 4, 5, 7, 70].map(ends),
            [(0, 0), (0, 1), (1, 2), (1, 2), (1, 3), (2, 5), (17, 52)]
        );
        assert_eq!(decay(&[]), None);
        assert_eq!(decay(&[0.7]), Some(0.0));
        assert_eq!(decay(&[1.0, 0.5, 0.5, 0.25, 0.25]), Some(0.5));
    }

    #[test]
    fn what_moves_along_the_flow_is_stable() {
        let size = Size::new(8, 4);
        let square = |left: usize| {
            Image::from_fn(size, |x, y| u8::from((left..left + 2).contains(&x) && y < 2))
        };
        let value = |previous: &_, now: &_, dx: f32| {
            warped_iou(previous, now, |_, _| Some((dx, 0.0))).value()
        };
        assert_eq!(value(&square(1), &square(3), -2.2), Some(1.0));
        assert_eq!(value(&square(1), &square(3), 0.0), Some(0.0));
        assert_eq!(value(&square(2), &square(3), 0.0), Some(1.0 / 3.0));
        // What was there is gone; what is there comes from beyond the border.
        assert_eq!(value(&square(0), &square(0), -2.0), Some(0.0));
        assert_eq!(value(&square(0), &square(0), -8.0), None);
        assert_eq!(warped_iou(&square(0), &square(0), |_, _| None).value(), None);
        assert_eq!(value(&square(0), &square(0), f32::NAN), None);
    }
}
