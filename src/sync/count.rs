//! What became of every image that was taken, and why pairs are missing.

use std::fmt::Write as _;

use super::{Settings, Side};
use crate::config::{CameraInfoPolicy, SyncMode};

/// What became of the images of one camera. Every image received is in exactly
/// one of: a pair, waiting, `unpaired`, `overflow`, `duplicate`, `cleared`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SideCounts {
    /// Images taken.
    pub received: u64,
    /// The other camera has no image near enough.
    pub unpaired: u64,
    /// Pushed out of a full queue while the other camera was silent.
    pub overflow: u64,
    /// The stamp of the image before.
    pub duplicate: u64,
    /// Dropped by a jump back in time.
    pub cleared: u64,
}

impl SideCounts {
    /// Images that are in no pair.
    pub const fn lost(&self) -> u64 {
        self.unpaired + self.overflow + self.duplicate + self.cleared
    }
}

/// Differences of stamps in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gaps {
    /// How many were seen.
    pub count: u64,
    /// The smallest one.
    pub smallest_ns: u64,
    /// The largest one.
    pub largest_ns: u64,
    /// The latest one.
    pub latest_ns: u64,
}

impl Gaps {
    pub(super) fn note(&mut self, ns: u64) {
        self.smallest_ns = if self.count == 0 { ns } else { self.smallest_ns.min(ns) };
        self.largest_ns = self.largest_ns.max(ns);
        self.latest_ns = ns;
        self.count += 1;
    }
}

/// What happened so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Pairs delivered.
    pub pairs: u64,
    /// Pairs dropped because their camera infos did not come.
    pub without_info: u64,
    /// Jumps back in time.
    pub jumps: u64,
    /// Left images.
    pub left: SideCounts,
    /// Right images.
    pub right: SideCounts,
    /// Differences inside pairs, where the stamps differ.
    pub offset: Gaps,
    /// Distances of images without partner to the other camera's nearest image.
    pub gaps: Gaps,
}

impl Counts {
    /// The counts of one camera.
    pub const fn side(&self, side: Side) -> &SideCounts {
        match side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        }
    }

    pub(super) const fn side_mut(&mut self, side: Side) -> &mut SideCounts {
        match side {
            Side::Left => &mut self.left,
            Side::Right => &mut self.right,
        }
    }

    /// Why images were lost and what to do about it; `None` when none was.
    ///
    /// `has_info` says whether a left and a right camera info has ever come.
    pub fn explain(&self, settings: &Settings, has_info: [bool; 2]) -> Option<String> {
        let mut text = String::new();
        let mut say = |sentence: std::fmt::Arguments<'_>| {
            let separator = if text.is_empty() { "" } else { "; " };
            // Writing into a String cannot fail.
            let _ = write!(text, "{separator}{sentence}");
        };
        let two = !settings.side_by_side;
        for (side, other) in [(Side::Left, Side::Right), (Side::Right, Side::Left)] {
            let (counts, name, other_name) = (self.side(side), side.name(), other.name());
            if two && counts.received > 0 && self.side(other).received == 0 {
                say(format_args!("{} {name} images, but no {other_name} image", counts.received));
            } else if counts.overflow > 0 {
                say(format_args!(
                    "{} {name} images were pushed out of the queue before a {other_name} image came: raise queue_size (now {})",
                    counts.overflow, settings.queue_size
                ));
            }
            if counts.duplicate > 0 {
                say(format_args!(
                    "{} {name} images carry the stamp of the image before",
                    counts.duplicate
                ));
            }
        }
        if self.gaps.count > 0 {
            let ms = self.gaps.smallest_ns as f64 * 1e-6;
            let advice = match settings.mode {
                SyncMode::Exact => "set sync.mode to auto or approximate",
                _ => {
                    "trigger the cameras together, or raise approximate_sync_tolerance_seconds if they look at still things"
                }
            };
            say(format_args!(
                "{} left and {} right images had no partner: their stamps are {ms:.3} ms or more apart ({:.3} ms the last time, {:.3} ms allowed): {advice}",
                self.left.unpaired,
                self.right.unpaired,
                self.gaps.latest_ns as f64 * 1e-6,
                if settings.mode == SyncMode::Exact {
                    0.0
                } else {
                    settings.tolerance_ns as f64 * 1e-6
                },
            ));
        }
        if self.without_info > 0 {
            let missing = match has_info {
                [false, false] => "no camera info came from either camera",
                [false, true] => "no left camera info came",
                [true, false] => "no right camera info came",
                [true, true] if settings.camera_info == CameraInfoPolicy::Synced => {
                    "no camera info had their stamp: set camera_info.policy to cached"
                }
                [true, true] => "the camera infos came too late",
            };
            say(format_args!("{} pairs were dropped: {missing}", self.without_info));
        }
        (!text.is_empty()).then_some(text)
    }
}
