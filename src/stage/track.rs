//! Identity of regions over frames.

pub mod common;
pub mod follow;
pub mod kalman;

use nalgebra::Vector3;

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::Image;
use crate::perception::{Region, RegionList, Rejections, TrackState};
use crate::stamp::Stamp;
use common::CommonMotion;
use follow::{Box2, Follow, Life};

/// An active track is remembered for so many times `tracking.max_age`.
const REMEMBERED: f64 = 3.0;
/// So many at most, the latest: each is held against every region.
const MOST_REMEMBERED: usize = 64;
/// What the score of one that was given up is multiplied by: tracks that are
/// followed come first as a rule.
const LOST: f32 = 0.5;
/// Squared Mahalanobis distance beyond which two positions are not the same
/// point: 99.9 % of the chi-squared distribution with 3 degrees of freedom.
const GATE: f64 = 16.27;
/// Where boxes overlap too little, positions may continue a track up to this
/// many times the largest lateral extent of track and region, across the line of
/// sight. Along it their covariances tell: far away depth is known to metres only.
const REACH: f64 = 1.0;
/// Largest ratio of the boxes' widths and heights in that case: of what stands, more
/// or less of the height is seen.
const MAX_GROWTH: [f32; 2] = [2.0, 3.0];
/// A longer time between two frames in seconds is another recording.
const LONGEST_GAP: f64 = 5.0;

/// Differences in disparity within which a predicted thing and what is measured
/// are at the same distance: in parts, and pixels.
const SAME_PART: f32 = 0.1;
const SAME_PX: f32 = 1.0;
/// Share of a prediction's pixels that must speak for it: an outline of which less
/// is left is not that of the thing any more.
const LEAST_FOR: f32 = 0.75;

/// A track and a region that may be the same thing.
#[derive(Clone, Copy, Debug)]
struct Pair {
    score: f32,
    track: u32,
    region: u32,
}

/// The tracker: association by overlap of the predicted box and by distance in
/// space, the best pair first; a constant-velocity Kalman filter per track.
pub struct Track {
    enabled: bool,
    min_iou: f32,
    confirm: u32,
    max_age: f64,
    max_count: usize,
    last: Option<Stamp>,
    next_id: u32,
    tracks: Vec<Follow>,
    pairs: Vec<Pair>,
    taken: Vec<bool>,
    order: Vec<(u32, u32)>,
    common: CommonMotion,
}

impl Track {
    /// The stage with the parameters `tracking.*`.
    pub fn new(config: &Config) -> Self {
        Self {
            enabled: config.tracking.enabled,
            min_iou: config.tracking.min_iou as f32,
            confirm: u32::try_from(config.tracking.confirm).unwrap_or(1),
            max_age: config.tracking.max_age,
            max_count: usize::try_from(config.regions.max_count).unwrap_or(1),
            last: None,
            next_id: 1,
            tracks: Vec::new(),
            pairs: Vec::new(),
            taken: Vec::new(),
            order: Vec::new(),
            common: CommonMotion::default(),
        }
    }

    /// Takes other parameters and goes on with the tracks, unless the views have
    /// changed their size: then the tracks end, and ids still are not used again.
    pub fn configure(&mut self, config: &Config, same_size: bool) {
        let fresh = Self::new(config);
        self.enabled = fresh.enabled;
        self.min_iou = fresh.min_iou;
        self.confirm = fresh.confirm;
        self.max_age = fresh.max_age;
        self.max_count = fresh.max_count;
        if !same_size {
            self.last = None;
            for track in &mut self.tracks {
                track.life = Life::Over;
            }
        }
    }

    /// Forgets all tracks; ids start again from 1.
    pub fn reset(&mut self) {
        self.last = None;
        self.next_id = 1;
        for track in &mut self.tracks {
            track.life = Life::Over;
        }
    }

    /// Gives ids, states, ages and velocities to `regions`.
    ///
    /// A new track is NEW until it was seen in `tracking.confirm` of the last
    /// three frames, then ACTIVE. An active track that is not seen is appended,
    /// oldest first, as COASTED for up to `tracking.max_age` seconds (at most
    /// 0.6 of the time for which it was seen), at its predicted place: it takes the
    /// next free label, which no pixel of the label image has; its disparity and depth
    /// are NaN (not measured) and its confidence falls to one half over that time.
    ///
    /// Then the track is given up; what was never active is so after two frames and is
    /// counted as `unstable`. An active one is remembered for three times
    /// `tracking.max_age`, another one once, the latest 64 of them: a region of its
    /// size where it is predicted, which continues no other track better, takes its
    /// id back.
    ///
    /// A coasted region is published only where the thing probably still is: at least
    /// three quarters of its predicted pixels must show in `disparity` (pixels, NaN
    /// where there is none) its own distance, outside of the regions of this frame in
    /// `labels`, or something nearer that hides it. What lies behind it, a region at the same
    /// distance (the thing under another identity) and what was not measured (of a
    /// post, what is above the region of interest) do not speak for it. Things that
    /// never had a position are published.
    ///
    /// A stamp that goes back, or more than 5 s ahead, resets the tracker.
    pub fn run(
        &mut self,
        stamp: Stamp,
        rig: &StereoRig,
        views: Views<'_>,
        regions: &mut RegionList,
        rejections: &mut Rejections,
    ) {
        if !self.enabled {
            return;
        }
        let dt = self.last.map_or(0.0, |last| stamp.seconds_since(last));
        if !(0.0..=LONGEST_GAP).contains(&dt) {
            self.reset();
        }
        self.last = Some(stamp);
        for track in self.tracks.iter_mut().filter(|t| t.is_alive()) {
            track.predict(dt);
        }
        self.associate(stamp, regions);
        self.common.find(&self.tracks);
        self.begin(stamp, rig, regions);
        self.end(stamp, rejections);
        for region in regions.iter_mut() {
            self.describe(stamp, region);
        }
        self.coast(stamp, rig, views, regions);
    }

    /// Continues tracks with regions, the best pairs first.
    fn associate(&mut self, stamp: Stamp, regions: &mut RegionList) {
        self.pairs.clear();
        for (i, track) in self.tracks.iter().enumerate().filter(|(_, t)| t.is_alive()) {
            for (j, region) in regions.iter().enumerate() {
                if let Some(score) = affinity(track, region, self.min_iou) {
                    self.pairs.push(Pair { score, track: i as u32, region: j as u32 });
                }
            }
        }
        self.pairs.sort_unstable_by(|a, b| {
            b.score.total_cmp(&a.score).then((a.track, a.region).cmp(&(b.track, b.region)))
        });
        self.taken.clear();
        self.taken.resize(regions.len(), false);
        for pair in &self.pairs {
            let track = &mut self.tracks[pair.track as usize];
            let taken = &mut self.taken[pair.region as usize];
            if !track.seen && !*taken {
                let region = &mut regions[pair.region as usize];
                track.observe(stamp, region, self.confirm);
                region.track_id = track.id;
                *taken = true;
            }
        }
    }

    /// Starts tracks for the regions that continue none.
    fn begin(&mut self, stamp: Stamp, rig: &StereoRig, regions: &mut RegionList) {
        let mut slot = 0;
        for (region, _) in regions.iter_mut().zip(&self.taken).filter(|(_, taken)| !**taken) {
            while self.tracks.get(slot).is_some_and(Follow::is_alive) {
                slot += 1;
            }
            if slot == self.tracks.len() {
                self.tracks.push(Follow::default());
            }
            region.track_id = self.next_id;
            self.tracks[slot].start(self.next_id, stamp, region, self.common.velocity, rig);
            self.next_id = self.next_id.checked_add(1).unwrap_or(1);
        }
    }

    /// Gives up tracks that were not seen for too long, and in the end forgets them.
    fn end(&mut self, stamp: Stamp, rejections: &mut Rejections) {
        for track in self.tracks.iter_mut().filter(|t| t.is_alive() && !t.seen) {
            let unseen = track.unseen_for(stamp);
            if track.life == Life::Followed && (track.is_hopeless() || unseen > self.max_age) {
                track.life = Life::Lost;
                rejections.unstable += u32::from(!track.active);
            }
            let remembered = if track.active { REMEMBERED } else { 1.0 };
            if unseen > remembered * self.max_age {
                track.life = Life::Over;
            }
        }
        let lost = self.tracks.iter().filter(|t| t.life == Life::Lost).count();
        for _ in MOST_REMEMBERED..lost {
            let lost = self.tracks.iter_mut().filter(|t| t.life == Life::Lost);
            let age = |t: &Follow| t.unseen_for(stamp);
            if let Some(oldest) = lost.max_by(|a, b| age(a).total_cmp(&age(b))) {
                oldest.life = Life::Over;
            }
        }
    }

    fn describe(&self, stamp: Stamp, region: &mut Region) {
        let Some(track) = self.tracks.iter().find(|t| t.is_alive() && t.id == region.track_id)
        else {
            return;
        };
        // With `confirm` 1 the first frame is still the first one.
        let active = track.active;
        region.track_state = if active { TrackState::Active } else { TrackState::New };
        region.track_age = track.age(stamp);
        region.velocity = track.velocity();
    }

    /// Appends the active tracks that were not seen.
    fn coast(&mut self, stamp: Stamp, rig: &StereoRig, views: Views<'_>, regions: &mut RegionList) {
        self.order.clear();
        for (i, track) in self.tracks.iter().enumerate() {
            let coasts = track.life == Life::Followed && !track.seen && track.active;
            if coasts && track.is_predictable(stamp) {
                self.order.push((track.id, i as u32));
            }
        }
        self.order.sort_unstable();
        for &(id, slot) in &self.order {
            if regions.len() >= self.max_count {
                return;
            }
            let label = regions.len() as u16 + 1;
            let track = &mut self.tracks[slot as usize];
            let region = regions.push_empty();
            if !track.coast(rig.left.size, region) {
                // It has left the image.
                track.life = Life::Over;
                regions.truncate(regions.len() - 1);
                continue;
            }
            if !views.bear_out(region, rig) {
                regions.truncate(regions.len() - 1);
                continue;
            }
            let missed = (track.unseen_for(stamp) / self.max_age).min(1.0) as f32;
            region.label = label;
            region.confidence = track.last.confidence * (1.0 - 0.5 * missed);
            region.track_id = id;
            region.track_state = TrackState::Coasted;
            region.track_age = track.age(stamp);
        }
    }
}

/// What was measured where a track is predicted; both have the same size.
#[derive(Clone, Copy)]
pub struct Views<'a> {
    /// Disparity in pixels, NaN where there is none.
    pub disparity: &'a Image<f32>,
    /// Label of the region of each pixel, else 0.
    pub labels: &'a Image<u16>,
}

impl Views<'_> {
    /// True when enough of the mask of a predicted region shows something at its
    /// distance that is no seen region, or something nearer.
    fn bear_out(&self, region: &Region, rig: &StereoRig) -> bool {
        if region.position[2].is_nan() {
            return true;
        }
        let expected = (rig.depth_scale() / region.position[2]) as f32;
        let tolerance = (SAME_PART * expected).max(SAME_PX);
        let (x, width) = (region.x as usize, region.width as usize);
        let mut supported = 0;
        for (dy, mask) in region.mask.chunks_exact(width.max(1)).enumerate() {
            let y = region.y as usize + dy;
            let disparity = &self.disparity.row(y)[x..x + width];
            let labels = &self.labels.row(y)[x..x + width];
            for ((&d, &label), &mask) in disparity.iter().zip(labels).zip(mask) {
                // NaN is neither. The mask is no branch, which nobody could foresee.
                let hidden = d > expected + tolerance;
                let there = label == 0 && d >= expected - tolerance;
                supported += u32::from(hidden || there) & u32::from(mask != 0);
            }
        }
        supported as f32 >= LEAST_FOR * region.area as f32
    }
}

/// How well a region continues a track, higher is better; `None` when it does not.
///
/// Boxes that overlap by `min_iou` score `1 + IoU`, lowered by the distance in
/// space; of boxes one of which lies in the other, as when a thing is seen in part or
/// together with another one for a frame, half as much. Boxes that do neither score
/// by that distance alone, if they have one size and it is small across the line of
/// sight against the object itself. A track that was given up is continued only by
/// what has its size.
fn affinity(track: &Follow, region: &Region, min_iou: f32) -> Option<f32> {
    let bounds = Box2::of(region);
    let iou = track.bounds.iou(&bounds);
    let same_size = track.bounds.growth(&bounds).iter().zip(MAX_GROWTH).all(|(g, most)| *g <= most);
    let lost = track.life == Life::Lost;
    if lost && !same_size {
        return None;
    }
    let distance = track.distance(region);
    if distance.is_some_and(|d| d > GATE) {
        return None;
    }
    let nearness = 1.0 / (1.0 + distance.unwrap_or(0.0) / GATE) as f32;
    let nearness = if lost { LOST * nearness } else { nearness };
    if iou >= min_iou && iou > 0.0 {
        return Some((1.0 + iou) * nearness);
    }
    let estimate = track.kalman.as_ref()?.position();
    distance?;
    if track.bounds.is_part(&bounds) {
        return Some(0.5 * (1.0 + iou) * nearness);
    }
    let across = across(&estimate, &region.position);
    let [width, height, _] = region.extent;
    let lateral = width.max(height).max(track.last.extent[0]).max(track.last.extent[1]);
    (across <= REACH * lateral && same_size).then_some(0.5 * nearness)
}

/// Distance of a point from another one across the line of sight to that, metres.
fn across(from: &[f64; 3], to: &[f64; 3]) -> f64 {
    let (from, to) = (Vector3::from(*from), Vector3::from(*to));
    let off = to - from;
    let along = from.try_normalize(0.0).map_or(0.0, |sight| off.dot(&sight));
    (off.norm_squared() - along * along).max(0.0).sqrt()
}
