//! Pairs left images, right images and camera infos by stamp.
//!
//! Pure bookkeeping over payloads of any type: nothing is decoded, read or
//! timed here, and the same messages in the same order give the same pairs.
//!
//! # The rule
//!
//! Stamps of one camera increase. So the oldest waiting left and right image
//! decide, and let the earlier of the two be `a` (of one camera), the other `b`:
//!
//! 1. Equal stamps are a pair, in every mode.
//! 2. `exact`: `a` has no partner, as the other camera has already passed it.
//! 3. `approximate`: when `b - a` exceeds the tolerance, `a` has no partner.
//!    Otherwise `b` takes the nearer one of `a` and the next image `a'` of the
//!    same camera (the earlier one when both are equally near). While `a'` has
//!    not come, the two wait for it, unless it cannot be nearer: a camera is
//!    taken to never deliver two images closer together than half of the
//!    smallest of its last eight intervals, which leaves no room when
//!    `b - a` is at most a quarter of that interval. Pairing then costs no latency.
//! 4. `auto` follows rule 3 without the shortcut until the first pair whose
//!    stamps differ, which shows that the cameras are not stamped by one
//!    trigger; from then on it is `approximate`. Cameras that share their
//!    stamps thus pair as in `exact`, and a lost image never makes a wrong pair.
//!
//! A pair then waits for its camera infos: the latest ones (`cached`) or those
//! with the stamps of its images (`synced`). Pairs leave in the order of their stamps.
//!
//! An image that is older than the one before it from the same camera is a
//! jump back in time, as of a bag that plays in a loop: everything that waits
//! is dropped and counted, and the next pair says so.

mod count;
mod infos;
mod stream;

use std::collections::VecDeque;

pub use count::{Counts, Gaps, SideCounts};
use infos::{Found, Infos};
use stream::Stream;

use crate::config::{CameraInfoPolicy, Config, Input, SyncMode};
use crate::stamp::Stamp;

/// One of the two cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The reference view.
    Left,
    /// The other view.
    Right,
}

impl Side {
    /// `left` or `right`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    const fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

/// How to pair.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// When two stamps make a pair.
    pub mode: SyncMode,
    /// Largest difference of the stamps in a pair, nanoseconds.
    pub tolerance_ns: i64,
    /// Images kept per camera, camera infos kept per camera, and pairs kept
    /// while their camera infos are missing; at least 1.
    pub queue_size: usize,
    /// Which camera info belongs to an image.
    pub camera_info: CameraInfoPolicy,
    /// One image holds both views: every left image is complete by itself.
    pub side_by_side: bool,
}

impl Settings {
    /// The settings that `config` asks for.
    pub fn new(config: &Config) -> Self {
        Self {
            mode: config.sync.mode,
            tolerance_ns: (config.approximate_sync_tolerance_seconds * 1e9).round() as i64,
            queue_size: usize::try_from(config.queue_size).unwrap_or(1).max(1),
            camera_info: config.camera_info.policy,
            side_by_side: config.input == Input::SideBySide,
        }
    }
}

/// Two images of one instant with their calibrations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair<T, C> {
    /// Stamp of the left image.
    pub stamp: Stamp,
    /// Stamp of the right image; the left one's when one image holds both views.
    pub right_stamp: Stamp,
    /// Left image, or the image that holds both views.
    pub left: T,
    /// Right image; `None` when `left` holds both views.
    pub right: Option<T>,
    /// Camera info of the left camera.
    pub left_info: C,
    /// Camera info of the right camera.
    pub right_info: C,
    /// The first pair after a jump back in time: what was learnt before is void.
    pub after_jump: bool,
}

/// Pairs images `T` with camera infos `C`.
#[derive(Debug)]
pub struct Synchronizer<T, C> {
    settings: Settings,
    streams: [Stream<T>; 2],
    infos: [Infos<C>; 2],
    matched: VecDeque<Matched<T>>,
    /// The last jump back: newest stamp before it, first stamp after it.
    jump: Option<(Stamp, Stamp)>,
    after_jump: bool,
    stamps_differ: bool,
    counts: Counts,
}

#[derive(Debug)]
struct Matched<T> {
    stamp: Stamp,
    right_stamp: Stamp,
    left: T,
    right: Option<T>,
}

enum Step {
    Pair,
    Drop(Side),
    Wait,
}

impl<T, C: Clone> Synchronizer<T, C> {
    /// Empty queues.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            streams: [Stream::new(), Stream::new()],
            infos: [Infos::new(), Infos::new()],
            matched: VecDeque::new(),
            jump: None,
            after_jump: false,
            stamps_differ: false,
            counts: Counts::default(),
        }
    }

    /// Takes other settings from now on; what waits goes on waiting.
    pub fn set(&mut self, settings: Settings) {
        self.settings = settings;
    }

    /// The settings in force.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What happened so far.
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }

    /// True once pairs are made of differing stamps.
    pub const fn stamps_differ(&self) -> bool {
        self.stamps_differ
    }

    /// True when a camera info of `side` has ever come.
    pub fn has_info(&self, side: Side) -> bool {
        let infos = &self.infos[side as usize];
        infos.fixed.is_some() || infos.newest.is_some()
    }

    /// Number of images of `side` that wait for their partner.
    pub fn waiting(&self, side: Side) -> usize {
        self.streams[side as usize].queue.len()
    }

    /// Number of pairs that wait for camera infos.
    pub fn waiting_for_info(&self) -> usize {
        self.matched.len()
    }

    /// Takes an image. Call [`Synchronizer::pop`] until it is empty afterwards.
    pub fn push(&mut self, side: Side, stamp: Stamp, image: T) {
        self.counts.side_mut(side).received += 1;
        if !self.admit(side, stamp) {
            return;
        }
        if self.settings.side_by_side {
            self.matched.push_back(Matched { stamp, right_stamp: stamp, left: image, right: None });
        } else {
            self.streams[side as usize].queue.push_back((stamp, image));
            self.pair_up(false);
            let stream = &mut self.streams[side as usize];
            while stream.queue.len() > self.settings.queue_size {
                stream.queue.pop_front();
                self.counts.side_mut(side).overflow += 1;
            }
        }
    }

    /// Takes a camera info.
    pub fn push_info(&mut self, side: Side, stamp: Stamp, info: C) {
        let infos = &mut self.infos[side as usize];
        infos.newest = Some(stamp);
        infos.queue.push_back((stamp, info));
        let kept = match self.settings.camera_info {
            CameraInfoPolicy::Cached => 1,
            CameraInfoPolicy::Synced => self.settings.queue_size,
        };
        while infos.queue.len() > kept {
            infos.queue.pop_front();
        }
    }

    /// Uses `info` for every image of `side`, whatever comes by [`Synchronizer::push_info`].
    pub fn fix_info(&mut self, side: Side, info: C) {
        self.infos[side as usize].fixed = Some(info);
    }

    /// The next complete pair.
    pub fn pop(&mut self) -> Option<Pair<T, C>> {
        while let Some(head) = self.matched.front() {
            let wanted = [head.stamp, head.right_stamp];
            let found = [Side::Left, Side::Right]
                .map(|side| self.infos[side as usize].find(wanted[side as usize], &self.settings));
            match found {
                [Found::Info(left_info), Found::Info(right_info)] => {
                    let Matched { stamp, right_stamp, left, right } = self.matched.pop_front()?;
                    self.counts.pairs += 1;
                    let after_jump = std::mem::take(&mut self.after_jump);
                    return Some(Pair {
                        stamp,
                        right_stamp,
                        left,
                        right,
                        left_info,
                        right_info,
                        after_jump,
                    });
                }
                [Found::Never, _] | [_, Found::Never] => self.drop_matched(),
                _ if self.matched.len() > self.settings.queue_size => self.drop_matched(),
                _ => return None,
            }
        }
        None
    }

    /// Decides what still waits, as no message will come any more: call
    /// [`Synchronizer::pop`] until it is empty, then [`Synchronizer::close`].
    pub fn finish(&mut self) {
        self.pair_up(true);
        for side in [Side::Left, Side::Right] {
            let left_over = self.streams[side as usize].queue.len();
            self.streams[side as usize].queue.clear();
            self.counts.side_mut(side).unpaired += left_over as u64;
        }
    }

    /// Counts the pairs whose camera infos never came, and forgets everything
    /// but the counts.
    pub fn close(&mut self) {
        self.finish();
        while !self.matched.is_empty() {
            self.drop_matched();
        }
    }

    fn drop_matched(&mut self) {
        self.matched.pop_front();
        self.counts.without_info += 1;
    }

    /// Keeps track of the stamps of one camera; false when the image is not used.
    fn admit(&mut self, side: Side, stamp: Stamp) -> bool {
        let stream = &self.streams[side as usize];
        match stream.newest {
            Some(_) if stream.behind => {
                // The other camera has jumped back already. This image is
                // either a straggler from before the jump or this camera's
                // first one after it, whichever is nearer.
                if let Some((from, to)) = self.jump
                    && stamp.0.abs_diff(from.0) < stamp.0.abs_diff(to.0)
                {
                    self.counts.side_mut(side).cleared += 1;
                    return false;
                }
                self.streams[side as usize].restart();
            }
            Some(newest) if stamp == newest => {
                self.counts.side_mut(side).duplicate += 1;
                return false;
            }
            Some(newest) if stamp < newest => self.jump_back(side, newest, stamp),
            _ => {}
        }
        self.streams[side as usize].note(stamp);
        true
    }

    fn jump_back(&mut self, side: Side, from: Stamp, to: Stamp) {
        for each in [Side::Left, Side::Right] {
            let stream = &mut self.streams[each as usize];
            self.counts.side_mut(each).cleared += stream.queue.len() as u64;
            stream.queue.clear();
            stream.behind = stream.newest.is_some();
        }
        while !self.matched.is_empty() {
            self.drop_matched();
        }
        if self.settings.camera_info == CameraInfoPolicy::Synced {
            for infos in &mut self.infos {
                infos.queue.clear();
                infos.newest = None;
            }
        }
        self.streams[side as usize].restart();
        self.jump = Some((from, to));
        self.after_jump = true;
        self.stamps_differ = false;
        self.counts.jumps += 1;
    }

    fn pair_up(&mut self, at_end: bool) {
        loop {
            match self.step(at_end) {
                Step::Wait => return,
                Step::Drop(side) => {
                    self.note_gap(side);
                    self.streams[side as usize].queue.pop_front();
                    self.counts.side_mut(side).unpaired += 1;
                }
                Step::Pair => {
                    let [left, right] = &mut self.streams;
                    let (Some((stamp, left)), Some((right_stamp, right))) =
                        (left.queue.pop_front(), right.queue.pop_front())
                    else {
                        return;
                    };
                    if stamp != right_stamp {
                        self.stamps_differ = true;
                        self.counts.offset.note(stamp.0.abs_diff(right_stamp.0));
                    }
                    self.matched.push_back(Matched {
                        stamp,
                        right_stamp,
                        left,
                        right: Some(right),
                    });
                }
            }
        }
    }

    /// The rule of the module text, once.
    fn step(&self, at_end: bool) -> Step {
        let [left, right] = &self.streams;
        let (Some(&(l, _)), Some(&(r, _))) = (left.queue.front(), right.queue.front()) else {
            return Step::Wait;
        };
        if l == r {
            return Step::Pair;
        }
        let (earlier, a, b) = if l < r { (Side::Left, l, r) } else { (Side::Right, r, l) };
        let gap = b.0.abs_diff(a.0);
        if self.settings.mode == SyncMode::Exact || gap > self.settings.tolerance_ns.unsigned_abs()
        {
            return Step::Drop(earlier);
        }
        let stream = &self.streams[earlier as usize];
        if let Some((next, _)) = stream.queue.get(1) {
            return if b.0.abs_diff(next.0) < gap { Step::Drop(earlier) } else { Step::Pair };
        }
        let shortcut = self.settings.mode == SyncMode::Approximate || self.stamps_differ;
        if at_end || (shortcut && stream.leaves_no_room(gap)) {
            return Step::Pair;
        }
        Step::Wait
    }

    /// How near the nearest image of the other camera is to one without partner.
    fn note_gap(&mut self, side: Side) {
        let head = self.streams[side as usize].queue.front().map(|(stamp, _)| *stamp);
        let other = self.streams[side.other() as usize].queue.front().map(|(stamp, _)| *stamp);
        if let (Some(head), Some(other)) = (head, other) {
            let gap = head.0.abs_diff(other.0);
            let passed_over = self.settings.mode != SyncMode::Exact
                && gap <= self.settings.tolerance_ns.unsigned_abs();
            if !passed_over {
                self.counts.gaps.note(gap);
            }
        }
    }
}
