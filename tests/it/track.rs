//! Tracks: identity through crossing, occlusion and jumps in time.

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::{RegionList, Rejections, TrackState};
use salient_stereo::stage::track::{Track, Views};
use salient_stereo::stamp::Stamp;

const SIZE: Size = Size::new(640, 240);
const F: f64 = 400.0;
const BASELINE: f64 = 0.5;

fn rig() -> StereoRig {
    StereoRig::new(
        Camera::pinhole(SIZE, F, 320.0, 120.0, 0.0),
        Camera::pinhole(SIZE, F, 320.0, 120.0, -F * BASELINE),
        0.0,
    )
    .unwrap()
}

/// A box of `size` metres at (x, y, z) metres, as the region former would see it.
#[derive(Clone, Copy)]
struct Thing {
    at: [f64; 3],
    size: [f64; 2],
}

fn see(things: &[Thing]) -> RegionList {
    let mut list = RegionList::default();
    for (i, thing) in things.iter().enumerate() {
        let [x, y, z] = thing.at;
        let (w, h) = (F * thing.size[0] / z, F * thing.size[1] / z);
        let left = (320.0 + F * x / z - w / 2.0).clamp(0.0, 639.0).round();
        let top = (120.0 + F * y / z - h / 2.0).clamp(0.0, 239.0).round();
        let r = list.push_empty();
        r.label = i as u16 + 1;
        (r.x, r.y) = (left as u32, top as u32);
        (r.width, r.height) = ((w as u32).min(640 - r.x).max(1), (h as u32).min(240 - r.y).max(1));
        r.mask.resize((r.width * r.height) as usize, 255);
        r.area = r.width * r.height;
        let (right, bottom) = ((r.x + r.width - 1) as f32, (r.y + r.height - 1) as f32);
        r.contour.extend([
            [r.x as f32, r.y as f32],
            [right, r.y as f32],
            [right, bottom],
            [r.x as f32, bottom],
        ]);
        r.position = thing.at;
        let sigma_z = z * z / (F * BASELINE) * 0.2;
        // Along the line of sight, and a centimetre across.
        let sight = [x / z, y / z, 1.0];
        r.position_covariance = std::array::from_fn(|i| {
            let across = if i % 4 == 0 { 1e-4 } else { 0.0 };
            sigma_z * sigma_z * sight[i / 3] * sight[i % 3] + across
        });
        r.extent = [thing.size[0], thing.size[1], 0.5];
        r.confidence = 0.8;
        r.mean_saliency = 0.7;
        r.median_depth = z as f32;
        r.valid_fraction = 1.0;
    }
    list
}

struct Driver {
    track: Track,
    rig: StereoRig,
    rejections: Rejections,
    /// What is measured; at first something near that hides everything.
    disparity: Image<f32>,
    labels: Image<u16>,
}

impl Driver {
    fn new(config: &Config) -> Self {
        Self {
            track: Track::new(config),
            rig: rig(),
            rejections: Rejections::default(),
            disparity: Image::filled(SIZE, 200.0),
            labels: Image::new(SIZE),
        }
    }

    fn frame(&mut self, seconds: f64, things: &[Thing]) -> RegionList {
        let mut list = see(things);
        self.rejections = Rejections::default();
        let views = Views { disparity: &self.disparity, labels: &self.labels };
        let stamp = Stamp::from_seconds(seconds);
        self.track.run(stamp, &self.rig, views, &mut list, &mut self.rejections);
        list
    }
}

fn person(x: f64, z: f64) -> Thing {
    Thing { at: [x, 0.3, z], size: [0.6, 1.7] }
}

#[test]
fn a_prediction_needs_most_of_its_pixels() {
    // The right part of the view lies farther: so much of a person at 8 m is left.
    for (left, published) in [(0.95, true), (0.65, false), (0.3, false)] {
        let mut driver = Driver::new(&Config::default());
        let mut at = 0..0;
        for frame in 0..5 {
            let list = driver.frame(f64::from(frame) * 0.1, &[person(0.0, 8.0)]);
            at = list[0].x as usize..(list[0].x + list[0].width) as usize;
        }
        let end = at.start + (left * at.len() as f64) as usize;
        for y in 0..SIZE.height {
            for (x, d) in driver.disparity.row_mut(y).iter_mut().enumerate() {
                *d = if x < end { 25.0 } else { 12.0 };
            }
        }
        assert_eq!(driver.frame(0.5, &[]).len(), usize::from(published), "{left}");
    }
}

#[test]
fn two_of_three_frames_make_a_track_active() {
    let mut driver = Driver::new(&Config::default());
    let first = driver.frame(0.0, &[person(0.0, 8.0)]);
    assert_eq!((first[0].track_id, first[0].track_state), (1, TrackState::New));
    assert!(first[0].velocity[0].is_nan() && first[0].track_age == 0.0);
    assert!(driver.frame(0.1, &[]).is_empty(), "what was seen once does not coast");
    let third = driver.frame(0.2, &[person(0.02, 8.0)]);
    assert_eq!((third[0].track_id, third[0].track_state), (1, TrackState::Active));
    assert!((third[0].track_age - 0.2).abs() < 1e-6 && third[0].velocity[0].is_finite());
}

#[test]
fn three_of_three_and_one_of_three_are_honoured() {
    for (confirm, active_at) in [(1, 2), (2, 2), (3, 3)] {
        let mut config = Config::default();
        config.tracking.confirm = confirm;
        let mut driver = Driver::new(&config);
        for frame in 1..=4 {
            let list = driver.frame(f64::from(frame) * 0.1, &[person(0.0, 8.0)]);
            let expected = if frame < active_at { TrackState::New } else { TrackState::Active };
            assert_eq!(list[0].track_state, expected, "confirm {confirm}, frame {frame}");
        }
    }
}

#[test]
fn a_flicker_is_counted_as_unstable() {
    let mut driver = Driver::new(&Config::default());
    driver.frame(0.0, &[person(0.0, 8.0)]);
    driver.frame(0.1, &[]);
    assert_eq!(driver.rejections.unstable, 0);
    driver.frame(0.2, &[]);
    assert_eq!(driver.rejections.unstable, 1);
    let again = driver.frame(0.3, &[person(0.0, 8.0)]);
    assert_eq!((again[0].track_id, again[0].track_state), (1, TrackState::New));
    for frame in 4..10 {
        driver.frame(f64::from(frame) * 0.1, &[]);
    }
    assert_eq!(driver.frame(1.0, &[person(0.0, 8.0)])[0].track_id, 2, "forgotten");
}

#[test]
fn what_was_seen_once_is_expected_to_do_what_most_things_do() {
    // The camera drives at 8 m/s past people who stand there; a bollard beside the
    // road is seen, not seen, and seen again where it went through the image, and
    // so is another one that nobody has seen before.
    let mut driver = Driver::new(&Config::default());
    let bollard = |x: f64, z: f64| Thing { at: [x, 1.2, z], size: [0.2, 0.6] };
    let mut ids = Vec::new();
    for frame in 0..10 {
        let t = f64::from(frame) * 0.1;
        let at = |z: f64| z - 8.0 * t;
        let mut things = vec![person(-3.0, at(22.0)), person(2.0, at(26.0)), person(4.0, at(30.0))];
        match frame {
            7 => things.push(bollard(-2.5, at(14.0))),
            9 => things.extend([bollard(-2.5, at(14.0)), bollard(2.5, at(14.0))]),
            _ => {}
        }
        let list = driver.frame(t, &things);
        ids = list.iter().map(|r| r.track_id).collect();
    }
    assert_eq!(ids, [1, 2, 3, 4, 5]);
}

#[test]
fn what_keeps_its_place_before_a_fast_camera_is_followed() {
    // At 15 m/s people beside the road go by; a car ahead is as fast. It comes into
    // view when frames have become rare.
    let mut driver = Driver::new(&Config::default());
    let car = Thing { at: [0.0, 0.4, 15.0], size: [1.8, 1.5] };
    let mut first = None;
    let times =
        (0..20).map(|n| 0.05 * f64::from(n)).chain((1..3).map(|n| 0.95 + 0.4 * f64::from(n)));
    for t in times {
        let at = |z: f64| z - 15.0 * t;
        let mut things = vec![person(-4.0, at(34.0)), person(3.0, at(36.0)), person(5.0, at(38.0))];
        things.extend((t > 1.0).then_some(car));
        let list = driver.frame(t, &things);
        if let Some(car) = list.iter().find(|r| r.extent[0] == 1.8) {
            let state = if first.is_none() { TrackState::New } else { TrackState::Active };
            let id = *first.get_or_insert(car.track_id);
            assert_eq!((car.track_id, car.track_state), (id, state), "at {t} s");
        }
    }
    assert!(first.is_some());
}

#[test]
fn the_latest_of_many_lost_tracks_are_remembered() {
    const MOST: u32 = 64;
    let mut driver = Driver::new(&Config::default());
    let crowd = |from: u32| -> Vec<Thing> {
        let place = |i| Thing {
            at: [f64::from(i % 20) * 0.8 - 7.6, f64::from(i / 20) - 2.0, 20.0],
            size: [0.3, 0.4],
        };
        (from..80).map(place).collect()
    };
    // The first ten are seen a little less long.
    for frame in 0..6 {
        driver.frame(f64::from(frame) * 0.1, &crowd(if frame < 5 { 0 } else { 10 }));
    }
    for frame in 6..16 {
        driver.frame(f64::from(frame) * 0.1, &[]);
    }
    let ids: Vec<u32> = driver.frame(1.6, &crowd(0)).iter().map(|r| r.track_id).collect();
    assert_eq!(ids.iter().filter(|id| **id <= 80).count() as u32, MOST);
    assert!(ids[..10].iter().all(|id| *id > 80), "{ids:?}");
}

#[test]
fn an_id_comes_back_to_what_is_the_same_thing_only() {
    let car = Thing { at: [0.0, 0.4, 8.0], size: [3.8, 1.5] };
    for (frames, thing, same) in [
        (12, person(0.0, 8.0), true),
        (12, person(3.5, 8.0), false),
        (12, person(0.0, 14.0), false),
        (12, car, false),
        (17, person(0.0, 8.0), false),
    ] {
        let mut driver = Driver::new(&Config::default());
        for frame in 0..10 {
            driver.frame(f64::from(frame) * 0.1, &[person(0.0, 8.0)]);
        }
        let back = 9 + frames;
        for frame in 10..back {
            let list = driver.frame(f64::from(frame) * 0.1, &[]);
            assert_eq!(list.len(), usize::from(frame <= 14), "frame {frame}");
        }
        let list = driver.frame(f64::from(back) * 0.1, &[thing]);
        assert_eq!(list[0].track_id == 1, same, "{frames} frames, {:?}", thing.at);
        // It is active at once, but predictions have to be earned anew.
        let state = if same { TrackState::Active } else { TrackState::New };
        assert_eq!(list[0].track_state, state);
        assert!(driver.frame(f64::from(back + 1) * 0.1, &[]).is_empty());
    }
}

#[test]
fn a_far_thing_keeps_its_id_as_far_as_its_depth_is_known() {
    // Seen once or often, then on the line of sight to where it was, or beside it.
    let id = |sightings: u32, [x, z]: [f64; 2], along: f64, aside: f64| {
        let mut driver = Driver::new(&Config::default());
        for k in 0..sightings {
            driver.frame(f64::from(k) * 0.1, &[person(x, z)]);
        }
        let stretch = 1.0 + along / z;
        let now = person(x * stretch + aside, z * stretch);
        driver.frame(
            f64::from(sightings) * 0.1,
            &[Thing { at: [now.at[0], 0.3 * stretch, now.at[2]], ..now }],
        )[0]
        .track_id
    };
    // At 45 m one standard deviation is 2 m, ahead and at the edge of the view.
    for place in [[1.0, 45.0], [25.0, 45.0]] {
        assert_eq!(id(5, place, 4.0, 0.4), 1);
        assert_ne!(id(5, place, 20.0, 0.0), 1);
        // After one sighting all of this is within what is not known, but a step aside of
        // more than its size is another one.
        assert_eq!(id(1, place, 4.0, 0.4), 1);
        assert_ne!(id(1, place, 0.0, 2.2), 1);
    }
}

#[test]
fn a_track_that_is_followed_comes_before_one_that_was_given_up() {
    let mut driver = Driver::new(&Config::default());
    // One walks towards the place where another one was seen last, and is there
    // with a leap.
    let (walker, other) = (|t: f64| person(-2.0 + 1.6 * t, 8.0), person(0.15, 8.0));
    for frame in 0..12 {
        let t = f64::from(frame) * 0.1;
        let both = [walker(t), other];
        driver.frame(t, &both[..if frame < 4 { 2 } else { 1 }]);
    }
    assert_eq!(driver.frame(1.2, &[other])[0].track_id, 1);
}

#[test]
fn of_what_stands_more_or_less_may_be_seen() {
    // The top of a post, and the whole of it as far to the left as it is wide;
    // a wall is no post.
    for (x, size, same) in [(-0.3, [0.3, 2.6], true), (-1.0, [1.4, 1.0], false)] {
        let mut driver = Driver::new(&Config::default());
        for frame in 0..3 {
            let t = f64::from(frame) * 0.1;
            driver.frame(t, &[Thing { at: [0.0, -0.5, 8.0], size: [0.3, 1.0] }]);
        }
        let list = driver.frame(0.3, &[Thing { at: [x, 0.3, 8.0], size }]);
        assert_eq!(list[0].track_id == 1, same, "{size:?}");
    }
}

#[test]
fn crossing_objects_keep_their_ids() {
    let mut driver = Driver::new(&Config::default());
    let at = |t: f64| [person(-2.0 + 2.0 * t, 6.0), person(2.0 - 2.0 * t, 9.0)];
    for frame in 0..=20 {
        let t = f64::from(frame) * 0.1;
        let list = driver.frame(t, &at(t));
        assert_eq!(list.iter().map(|r| r.track_id).collect::<Vec<_>>(), [1, 2], "frame {frame}");
    }
}

#[test]
fn crossing_objects_keep_their_ids_when_the_far_one_is_hidden() {
    let mut driver = Driver::new(&Config::default());
    let (mut last, mut coasted) = (Vec::new(), 0);
    for frame in 0..=24 {
        let t = f64::from(frame) * 0.1;
        let (near, far) = (person(-2.0 + 1.6 * t, 6.0), person(2.0 - 1.6 * t, 9.0));
        let apart = (near.at[0] / near.at[2] - far.at[0] / far.at[2]).abs();
        let both = [near, far];
        let list = driver.frame(t, &both[..if apart < 0.07 { 1 } else { 2 }]);
        coasted += list.iter().filter(|r| r.track_state == TrackState::Coasted).count();
        last = list.iter().map(|r| r.track_id).collect();
        assert_eq!(last, [1, 2], "frame {frame}");
    }
    assert!(coasted > 0 && last == [1, 2]);
}

#[test]
fn a_short_occlusion_coasts_and_a_long_one_ends() {
    let mut driver = Driver::new(&Config::default());
    let at = |t: f64| person(-1.5 + 1.5 * t, 8.0);
    for frame in 0..10 {
        driver.frame(f64::from(frame) * 0.1, &[at(f64::from(frame) * 0.1)]);
    }
    for frame in 10..15 {
        let t = f64::from(frame) * 0.1;
        let other = person(3.0, 5.0);
        let list = driver.frame(t, &[other]);
        let r = &list[1];
        assert_eq!((r.track_id, r.track_state, r.label), (1, TrackState::Coasted, 2));
        assert!((r.position[0] - at(t).at[0]).abs() < 0.15, "{} {}", r.position[0], at(t).at[0]);
        let centre = f64::from(r.x) + f64::from(r.width) / 2.0;
        assert!((centre - (320.0 + F * at(t).at[0] / 8.0)).abs() < 8.0, "frame {frame}: {centre}");
        assert_eq!(r.mask.len() as u32, r.width * r.height);
        assert!(r.mean_depth.is_nan() && r.valid_fraction == 0.0);
        assert!((r.velocity[0] - 1.5).abs() < 0.3 && r.confidence < 0.8);
    }
    let back = driver.frame(1.5, &[at(1.5), person(3.0, 5.0)]);
    assert_eq!(back[0].track_id, 1);
    for frame in 16..21 {
        driver.frame(f64::from(frame) * 0.1, &[]);
    }
    let gone = driver.frame(2.15, &[]);
    assert!(gone.is_empty(), "older than tracking.max_age");
}

#[test]
fn a_region_that_leaves_the_image_is_cut_and_then_ends() {
    let mut config = Config::default();
    config.tracking.max_age = 3.0;
    let mut driver = Driver::new(&config);
    for frame in 0..6 {
        let t = f64::from(frame) * 0.1;
        driver.frame(t, &[person(2.0 + 4.0 * t, 6.0)]);
    }
    let mut widths = Vec::new();
    for frame in 6..14 {
        let list = driver.frame(f64::from(frame) * 0.1, &[]);
        for r in list.iter() {
            assert!(r.x + r.width <= 640 && r.mask.len() as u32 == r.width * r.height);
            assert!(r.contour.iter().all(|p| p[0] >= r.x as f32 && p[0] < (r.x + r.width) as f32));
            widths.push(r.width);
        }
    }
    assert!(!widths.is_empty() && widths.len() < 8 && widths.windows(2).all(|w| w[1] <= w[0]));
}

#[test]
fn velocity_comes_out_of_the_filter() {
    let mut driver = Driver::new(&Config::default());
    let mut last = [0.0; 3];
    for frame in 0..30 {
        let t = f64::from(frame) * 0.1;
        last = driver.frame(t, &[person(-1.0 + 0.8 * t, 14.0 - 2.0 * t)])[0].velocity;
    }
    assert!((last[0] - 0.8).abs() < 0.05 && (last[2] + 2.0).abs() < 0.1, "{last:?}");
}

#[test]
fn jumps_in_time_reset() {
    for jump in [-0.05, 60.0] {
        let mut driver = Driver::new(&Config::default());
        for frame in 0..3 {
            driver.frame(10.0 + f64::from(frame) * 0.1, &[person(0.0, 8.0), person(2.0, 8.0)]);
        }
        let list = driver.frame(10.2 + jump, &[person(2.0, 8.0)]);
        assert_eq!((list.len(), list[0].track_id, list[0].track_state), (1, 1, TrackState::New));
    }
}

#[test]
fn the_same_stamp_twice_changes_no_identity() {
    let mut driver = Driver::new(&Config::default());
    driver.frame(1.0, &[person(0.0, 8.0)]);
    let list = driver.frame(1.0, &[person(0.0, 8.0)]);
    assert_eq!(list[0].track_id, 1);
    assert!(list[0].velocity.iter().all(|v| v.is_finite()));
}

#[test]
fn regions_without_depth_are_followed_by_their_boxes() {
    let mut track = Track::new(&Config::default());
    let rig = rig();
    let (disparity, labels) = (Image::filled(SIZE, f32::NAN), Image::new(SIZE));
    let views = Views { disparity: &disparity, labels: &labels };
    for frame in 0..5 {
        let mut list = see(&[person(-1.0 + 0.2 * f64::from(frame), 8.0), person(2.0, 8.0)]);
        for r in list.iter_mut() {
            r.position = [f64::NAN; 3];
            r.position_covariance = [f64::NAN; 9];
            r.extent = [f64::NAN; 3];
        }
        let stamp = Stamp::from_seconds(f64::from(frame) * 0.1);
        track.run(stamp, &rig, views, &mut list, &mut Rejections::default());
        assert_eq!(list.iter().map(|r| r.track_id).collect::<Vec<_>>(), [1, 2]);
        assert!(list[0].velocity[0].is_nan());
    }
}

#[test]
fn a_thing_seen_in_part_keeps_its_id() {
    // A person of whom only the legs are seen for a frame, a person whose region takes
    // in the wall beside it, and one who is somewhere else.
    for (at, size, same) in [
        ([0.0, 0.9, 8.0], [0.6, 0.5], true),
        ([0.9, 0.3, 8.0], [2.4, 1.7], true),
        ([0.9, 0.9, 8.0], [0.6, 0.5], false),
    ] {
        let mut driver = Driver::new(&Config::default());
        for frame in 0..5 {
            driver.frame(f64::from(frame) * 0.1, &[person(0.0, 8.0)]);
        }
        let list = driver.frame(0.5, &[Thing { at, size }]);
        assert_eq!(list[0].track_id == 1, same, "{at:?}");
        let list = driver.frame(0.6, &[person(0.0, 8.0)]);
        assert_eq!(list[0].track_id, 1);
    }
}

#[test]
fn switched_off_it_gives_no_ids() {
    let mut config = Config::default();
    config.tracking.enabled = false;
    let mut driver = Driver::new(&config);
    for frame in 0..3 {
        let list = driver.frame(f64::from(frame) * 0.1, &[person(0.0, 8.0)]);
        assert_eq!((list[0].track_id, list[0].track_state), (0, TrackState::None));
    }
}

#[test]
fn a_prediction_is_published_where_what_is_measured_speaks_for_it() {
    // 25 px at 8 m.
    for (disparity, labelled, published) in [
        (f32::NAN, false, false),
        (60.0, true, true),
        (25.0, false, true),
        (12.0, false, false),
        (25.0, true, false),
    ] {
        let mut driver = Driver::new(&Config::default());
        for frame in 0..5 {
            driver.frame(f64::from(frame) * 0.1, &[person(0.0, 8.0)]);
        }
        driver.disparity.fill(disparity);
        driver.labels.fill(u16::from(labelled));
        let list = driver.frame(0.5, &[]);
        assert_eq!(list.len(), usize::from(published), "{disparity} {labelled}");
        // It is the same thing when it is seen again.
        let list = driver.frame(0.6, &[person(0.0, 8.0)]);
        assert_eq!(list[0].track_id, 1);
    }
}
