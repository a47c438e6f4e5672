//! Salient regions, the list that reuses their buffers, and why some are refused.

use std::ops::{Deref, DerefMut};

/// Where a region stands in its track's life.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum TrackState {
    /// Tracking is off.
    #[default]
    None = 0,
    /// Not seen often enough yet (`tracking.confirm` of three frames).
    New = 1,
    /// Seen often enough.
    Active = 2,
    /// Predicted, not seen in this frame.
    Coasted = 3,
}

/// One salient region: the fields of `salient_stereo_msgs/SalientRegion`.
///
/// A quantity without a valid measurement is NaN.
#[derive(Debug, Default)]
pub struct Region {
    /// Value of its pixels in the label image: 1..N.
    pub label: u16,
    /// Identity over frames; 0 when tracking is off.
    pub track_id: u32,
    /// State of the track.
    pub track_state: TrackState,
    /// Seconds since the track was first seen.
    pub track_age: f32,
    /// Left edge of the tight box, pixels.
    pub x: u32,
    /// Upper edge of the tight box, pixels.
    pub y: u32,
    /// Width of the tight box, pixels.
    pub width: u32,
    /// Height of the tight box, pixels.
    pub height: u32,
    /// Outer boundary as a closed polygon `(x, y)` in pixels, simplified; the
    /// first point is not repeated.
    pub contour: Vec<[f32; 2]>,
    /// Mask of the box, `width * height`, row by row: 255 inside, else 0.
    pub mask: Vec<u8>,
    /// Number of mask pixels.
    pub area: u32,
    /// Mean saliency over the mask, 0..=1.
    pub mean_saliency: f32,
    /// Largest saliency in the mask, 0..=1.
    pub max_saliency: f32,
    /// Share of the mask with a valid disparity, 0..=1.
    pub valid_fraction: f32,
    /// Mean disparity in pixels.
    pub mean_disparity: f32,
    /// Standard deviation of disparity in pixels.
    pub disparity_stddev: f32,
    /// Mean depth in metres.
    pub mean_depth: f32,
    /// Median depth in metres.
    pub median_depth: f32,
    /// Standard deviation of depth in metres.
    pub depth_stddev: f32,
    /// 5th percentile of depth in metres.
    pub near_depth: f32,
    /// 95th percentile of depth in metres.
    pub far_depth: f32,
    /// Probability that the region is a real object at the stated depth, 0..=1.
    pub confidence: f32,
    /// Robust centroid in the left optical frame, metres.
    pub position: [f64; 3],
    /// Covariance of `position`, row-major, square metres.
    pub position_covariance: [f64; 9],
    /// Extent along x, y and z, metres.
    pub extent: [f64; 3],
    /// Velocity relative to the camera, metres per second; NaN until the track is active.
    pub velocity: [f64; 3],
}

impl Clone for Region {
    fn clone(&self) -> Self {
        Self { contour: self.contour.clone(), mask: self.mask.clone(), ..*self }
    }

    /// Keeps the buffers, so that a track's memory of its last region is
    /// renewed without an allocation.
    fn clone_from(&mut self, source: &Self) {
        let (mut contour, mut mask) =
            (std::mem::take(&mut self.contour), std::mem::take(&mut self.mask));
        contour.clone_from(&source.contour);
        mask.clone_from(&source.mask);
        *self = Self { contour, mask, ..*source };
    }
}

/// A list of regions that keeps the buffers of removed ones for the next frame,
/// so that filling it again allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct RegionList {
    items: Vec<Region>,
    len: usize,
}

impl RegionList {
    /// Removes all regions and keeps their buffers.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends a region with empty contour and mask and default values, and
    /// returns it to be filled.
    pub fn push_empty(&mut self) -> &mut Region {
        if self.len == self.items.len() {
            self.items.push(Region::default());
        }
        let region = &mut self.items[self.len];
        self.len += 1;
        let (mut contour, mut mask) =
            (std::mem::take(&mut region.contour), std::mem::take(&mut region.mask));
        contour.clear();
        mask.clear();
        *region = Region { contour, mask, ..Region::default() };
        region
    }

    /// Keeps the first `len` regions.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    /// Keeps the regions for which `keep` is true, in their order.
    pub fn retain(&mut self, mut keep: impl FnMut(&Region) -> bool) {
        let mut kept = 0;
        for i in 0..self.len {
            if keep(&self.items[i]) {
                self.items.swap(kept, i);
                kept += 1;
            }
        }
        self.len = kept;
    }
}

impl Deref for RegionList {
    type Target = [Region];
    fn deref(&self) -> &[Region] {
        &self.items[..self.len]
    }
}

impl DerefMut for RegionList {
    fn deref_mut(&mut self) -> &mut [Region] {
        &mut self.items[..self.len]
    }
}

/// How many candidates of one frame were refused, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rejections {
    /// Fewer pixels than `regions.min_area`.
    pub small_area: u32,
    /// Mean confidence of the disparities too low, too few of them, or on a plane
    /// too little probability to be a thing.
    pub low_confidence: u32,
    /// Disparities that do not form one object.
    pub inconsistent_depth: u32,
    /// Large enough, but nothing carries it: the crown of a tree, a bridge.
    pub floating: u32,
    /// Goes on above a lorry's height, or shows only between nearer things: a
    /// house front.
    pub background: u32,
    /// Stands there, but the attention map passes over it; without a plane: weighs
    /// little beside the weightiest region.
    pub not_salient: u32,
    /// Seen in too few of the last frames.
    pub unstable: u32,
    /// Beyond `regions.max_count`.
    pub over_count: u32,
}

impl Rejections {
    /// Kinds of rejection.
    pub const KINDS: usize = 8;

    /// What each count is called, in reports and diagnostics.
    pub const REASONS: [&str; Self::KINDS] = [
        "smaller than regions.min_area",
        "low confidence or too few matches",
        "inconsistent depth",
        "not standing on the ground",
        "part of a house front, or only seen between nearer things",
        "not salient",
        "seen in too few frames",
        "beyond regions.max_count",
    ];

    /// The counts, in the order of [`Self::REASONS`].
    pub const fn counts(&self) -> [u32; Self::KINDS] {
        [
            self.small_area,
            self.low_confidence,
            self.inconsistent_depth,
            self.floating,
            self.background,
            self.not_salient,
            self.unstable,
            self.over_count,
        ]
    }

    /// All of them.
    pub fn total(&self) -> u32 {
        self.counts().iter().sum()
    }
}

impl std::ops::AddAssign for Rejections {
    fn add_assign(&mut self, other: Self) {
        self.small_area += other.small_area;
        self.low_confidence += other.low_confidence;
        self.inconsistent_depth += other.inconsistent_depth;
        self.floating += other.floating;
        self.background += other.background;
        self.not_salient += other.not_salient;
        self.unstable += other.unstable;
        self.over_count += other.over_count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refilled_list_reuses_buffers_and_shows_no_old_values() {
        let mut list = RegionList::default();
        let region = list.push_empty();
        region.mask.resize(1000, 255);
        region.area = 7;
        let buffer = list[0].mask.as_ptr();
        list.clear();
        assert!(list.is_empty());
        let region = list.push_empty();
        assert_eq!((region.area, region.mask.len()), (0, 0));
        region.mask.resize(1000, 0);
        assert_eq!(list[0].mask.as_ptr(), buffer);
    }

    #[test]
    fn retain_keeps_the_order() {
        let mut list = RegionList::default();
        for label in 1..=5 {
            list.push_empty().label = label;
        }
        list.retain(|r| r.label % 2 == 1);
        assert_eq!(list.iter().map(|r| r.label).collect::<Vec<_>>(), [1, 3, 5]);
    }
}
