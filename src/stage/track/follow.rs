//! One track: a region followed over frames.

use super::kalman::Kalman;
use crate::camera::StereoRig;
use crate::image::Size;
use crate::perception::Region;
use crate::stamp::Stamp;

/// A box in pixels that may lie anywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Box2 {
    /// Left edge.
    pub x: f32,
    /// Upper edge.
    pub y: f32,
    /// Width.
    pub width: f32,
    /// Height.
    pub height: f32,
}

impl Box2 {
    /// The tight box of a region.
    pub fn of(region: &Region) -> Self {
        Self {
            x: region.x as f32,
            y: region.y as f32,
            width: region.width as f32,
            height: region.height as f32,
        }
    }

    /// Intersection over union, 0..=1.
    pub fn iou(&self, other: &Self) -> f32 {
        let both = self.both(other);
        let either = self.width * self.height + other.width * other.height - both;
        if either > 0.0 { both / either } else { 0.0 }
    }

    /// Ratio of the widths and of the heights, the larger one over the smaller one.
    pub fn growth(&self, other: &Self) -> [f32; 2] {
        let ratio = |a: f32, b: f32| (a / b).max(b / a);
        [ratio(self.width, other.width), ratio(self.height, other.height)]
    }

    /// True when most of one of them lies in the other, larger one: a thing seen in
    /// part, or together with something else.
    pub fn is_part(&self, other: &Self) -> bool {
        let smaller = (self.width * self.height).min(other.width * other.height);
        self.both(other) >= PART * smaller && self.iou(other) < SAME
    }

    /// Pixels in both.
    fn both(&self, other: &Self) -> f32 {
        let overlap = |a: f32, a_len: f32, b: f32, b_len: f32| {
            ((a + a_len).min(b + b_len) - a.max(b)).max(0.0)
        };
        overlap(self.x, self.width, other.x, other.width)
            * overlap(self.y, self.height, other.y, other.height)
    }

    fn centre(&self) -> [f32; 2] {
        [self.x + self.width / 2.0, self.y + self.height / 2.0]
    }
}

/// Share of the smaller box inside the other one from which it is a part, and the
/// overlap (IoU) from which both are one outline.
const PART: f32 = 0.7;
const SAME: f32 = 0.5;
/// Standard deviation of the centroid of one and the same object from frame to
/// frame, in parts of its extent: a region never covers exactly the same pixels.
const SEGMENTATION: f64 = 0.25;
/// Depth in metres below which the view of a point tells nothing.
const NEAREST: f64 = 0.1;
/// Longest time for which a track is predicted, in parts of the time it was seen.
const SEEN_PART: f64 = 0.6;

/// Covariance of a region's position as a measurement of its object's position.
fn noise(region: &Region) -> [f64; 9] {
    let mut noise = region.position_covariance;
    let lateral = region.extent[0].max(region.extent[1]);
    for (i, extent) in [region.extent[0], region.extent[1], lateral].into_iter().enumerate() {
        noise[4 * i] += (SEGMENTATION * extent).powi(2);
    }
    noise
}

/// Pixels per second at which a point (metres) that moves at `velocity` (m/s) goes
/// through the image; 0 when it is not before the camera.
fn image_velocity(point: &[f64; 3], velocity: &[f64; 3], rig: &StereoRig) -> [f32; 2] {
    let [x, y, z] = *point;
    if z.is_nan() || z < NEAREST {
        return [0.0; 2];
    }
    // u = f X/Z, so that u' = f (X' Z - X Z') / Z².
    let along = |f: f64, p: f64, v: f64| (f * (v - p * velocity[2] / z) / z) as f32;
    [along(rig.focal_px(), x, velocity[0]), along(rig.focal_y_px(), y, velocity[1])]
}

/// Where a track stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Life {
    /// Forgotten: the slot is free.
    #[default]
    Over,
    /// Seen lately.
    Followed,
    /// Not seen for so long that it is remembered only.
    Lost,
}

/// A track. Ended tracks keep their buffers for the next ones.
#[derive(Debug, Default)]
pub struct Follow {
    /// Whether the slot is taken, and the track still followed.
    pub life: Life,
    /// Identity, from 1.
    pub id: u32,
    /// Seen often enough to be believed.
    pub active: bool,
    /// Matched in the current frame.
    pub seen: bool,
    /// Predicted box.
    pub bounds: Box2,
    /// Filter in space; `None` until a position was measured.
    pub kalman: Option<Kalman>,
    /// The region as last seen.
    pub last: Region,
    born: Stamp,
    /// Since when it was not given up.
    since: Stamp,
    last_seen: Stamp,
    /// Bit 0: seen in this frame, bit 1: in the one before, …
    history: u8,
    sightings: u32,
    /// Pixels per second of the box's centre; what is expected until it was seen twice.
    drift: [f32; 2],
    /// Velocity to expect when it began, m/s.
    expected: Option<[f64; 3]>,
}

impl Follow {
    /// False when it is forgotten.
    pub fn is_alive(&self) -> bool {
        self.life != Life::Over
    }

    /// Starts a track with its first region in a free slot; `expected` is the
    /// velocity (m/s) that things have in common, if that is known.
    pub fn start(
        &mut self,
        id: u32,
        stamp: Stamp,
        region: &Region,
        expected: Option<[f64; 3]>,
        rig: &StereoRig,
    ) {
        self.life = Life::Followed;
        self.id = id;
        self.active = false;
        self.seen = true;
        self.bounds = Box2::of(region);
        self.expected = expected;
        self.kalman = Kalman::new(&region.position, &noise(region), expected.as_ref());
        self.last.clone_from(region);
        self.born = stamp;
        self.since = stamp;
        self.last_seen = stamp;
        self.history = 1;
        self.sightings = 1;
        self.drift = expected.map_or([0.0; 2], |v| image_velocity(&region.position, &v, rig));
    }

    /// Moves box and position `dt` seconds ahead; not seen until `observe`.
    pub fn predict(&mut self, dt: f64) {
        self.seen = false;
        self.history <<= 1;
        self.bounds.x += self.drift[0] * dt as f32;
        self.bounds.y += self.drift[1] * dt as f32;
        if let Some(kalman) = &mut self.kalman {
            kalman.predict(dt);
        }
    }

    /// Takes in the region that continues this track; active from the moment
    /// it was seen in `confirm` of the last three frames.
    pub fn observe(&mut self, stamp: Stamp, region: &Region, confirm: u32) {
        let elapsed = stamp.seconds_since(self.last_seen) as f32;
        let seen = Box2::of(region);
        // Where the centre of a part is says nothing about motion.
        if elapsed > 0.0 && !self.bounds.is_part(&seen) {
            // The error of the predicted centre came about since the last
            // sighting; half of it is taken for the box's own jitter, except
            // when there is no estimate yet.
            let unknown = self.sightings == 1 && self.drift == [0.0; 2];
            let gain = if unknown { 1.0 } else { 0.5 } / elapsed;
            let (seen, predicted) = (seen.centre(), self.bounds.centre());
            self.drift[0] += gain * (seen[0] - predicted[0]);
            self.drift[1] += gain * (seen[1] - predicted[1]);
        }
        if self.life == Life::Lost {
            self.life = Life::Followed;
            self.since = stamp;
        }
        self.seen = true;
        self.history |= 1;
        self.sightings += 1;
        self.last_seen = stamp;
        self.bounds = seen;
        let noise = noise(region);
        match &mut self.kalman {
            Some(kalman) => kalman.update(&region.position, &noise),
            None => self.kalman = Kalman::new(&region.position, &noise, self.expected.as_ref()),
        }
        self.active |= (self.history & 0b111).count_ones() >= confirm;
        self.last.clone_from(region);
    }

    /// Squared Mahalanobis distance of a region's position from the predicted
    /// one; `None` unless both were measured.
    pub fn distance(&self, region: &Region) -> Option<f64> {
        self.kalman.as_ref()?.distance(&region.position, &noise(region))
    }

    /// Seconds since the first sighting.
    pub fn age(&self, stamp: Stamp) -> f32 {
        stamp.seconds_since(self.born) as f32
    }

    /// Seconds since the last sighting.
    pub fn unseen_for(&self, stamp: Stamp) -> f64 {
        stamp.seconds_since(self.last_seen)
    }

    /// True while its prediction is worth publishing: the longer a track was
    /// seen without being given up, the longer it coasts.
    pub fn is_predictable(&self, stamp: Stamp) -> bool {
        self.unseen_for(stamp) <= SEEN_PART * self.last_seen.seconds_since(self.since)
    }

    /// True for a track that was never believed and can no longer become so
    /// without starting over: missed in the last two frames.
    pub fn is_hopeless(&self) -> bool {
        !self.active && self.history.trailing_zeros() >= 2
    }

    /// Velocity in m/s once the track is active and was seen in space, else NaN.
    pub fn velocity(&self) -> [f64; 3] {
        match &self.kalman {
            Some(kalman) if self.active => kalman.velocity(),
            _ => [f64::NAN; 3],
        }
    }

    /// Writes the last region at the predicted place into `out`, cut to the
    /// image. False when nothing of it is left inside.
    pub fn coast(&self, size: Size, out: &mut Region) -> bool {
        let last = &self.last;
        let (dx, dy) = (
            (self.bounds.x - last.x as f32).round() as i64,
            (self.bounds.y - last.y as f32).round() as i64,
        );
        let cut = |start: u32, length: u32, shift: i64, limit: usize| {
            let from = (i64::from(start) + shift).clamp(0, limit as i64);
            let to = (i64::from(start + length) + shift).clamp(0, limit as i64);
            (from, to - from)
        };
        let (x, width) = cut(last.x, last.width, dx, size.width);
        let (y, height) = cut(last.y, last.height, dy, size.height);
        if width == 0 || height == 0 {
            return false;
        }
        (out.x, out.y, out.width, out.height) = (x as u32, y as u32, width as u32, height as u32);

        let skip_x = (x - dx - i64::from(last.x)) as usize;
        let skip_y = (y - dy - i64::from(last.y)) as usize;
        out.mask.clear();
        let rows = last.mask.chunks_exact(last.width as usize);
        for row in rows.skip(skip_y).take(height as usize) {
            out.mask.extend_from_slice(&row[skip_x..skip_x + width as usize]);
        }
        out.area = out.mask.iter().map(|&m| u32::from(m != 0)).sum();
        if out.area == 0 {
            return false;
        }
        let (right, bottom) = ((x + width - 1) as f32, (y + height - 1) as f32);
        out.contour.clear();
        out.contour.extend(last.contour.iter().map(|p| {
            [(p[0] + dx as f32).clamp(x as f32, right), (p[1] + dy as f32).clamp(y as f32, bottom)]
        }));
        out.mean_saliency = last.mean_saliency;
        out.max_saliency = last.max_saliency;
        out.extent = last.extent;
        // Nothing was measured in this frame: what is not predicted is NaN.
        out.valid_fraction = 0.0;
        out.mean_disparity = f32::NAN;
        out.disparity_stddev = f32::NAN;
        out.mean_depth = f32::NAN;
        out.median_depth = f32::NAN;
        out.depth_stddev = f32::NAN;
        out.near_depth = f32::NAN;
        out.far_depth = f32::NAN;
        let kalman = self.kalman.as_ref();
        out.position = kalman.map_or([f64::NAN; 3], Kalman::position);
        out.position_covariance = kalman.map_or([f64::NAN; 9], Kalman::position_covariance);
        out.velocity = self.velocity();
        true
    }
}
