//! Poles, matched as whole lines.

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::{RegionList, Rejections, RoiMask, View};
use salient_stereo::simd;
use salient_stereo::stage::coarse::CoarseDisparity;
use salient_stereo::stage::ground::Plane;
use salient_stereo::stage::pole::{Pole, Poles};
use salient_stereo::stage::regions::{RegionSource, Regions};
use salient_stereo::stage::roi::{Masks, Roi};

use super::reference::roi::bits;

const SIZE: Size = Size { width: 320, height: 160 };
/// Disparities of a wall and of what stands before it, pixels.
const WALL: usize = 6;
const BEFORE: f32 = 14.0;

/// Half a metre between two cameras of 200 px.
fn rig() -> StereoRig {
    rig_with(0)
}

/// The same with the right camera's principal point so many pixels to the left.
fn rig_with(offset: usize) -> StereoRig {
    let camera = |cx, tx| Camera::pinhole(SIZE, 200.0, cx, 80.0, tx);
    StereoRig::new(camera(160.0, 0.0), camera(160.0 - offset as f64, -100.0), 0.0).unwrap()
}

/// A ground whose disparity is 0 in row 60 and grows by 0.2 px per row.
fn plane(rig: &StereoRig) -> Plane {
    Plane::new(0.2, 0.0, -12.0, rig).expect("a plane before the camera")
}

/// Texture of the wall at a column of the left view.
fn wall(x: usize, y: usize) -> u8 {
    let cell = (x / 3 * 2_654_435_761).wrapping_add(y / 12 * 40_503) >> 4;
    90 + (cell % 80) as u8
}

/// Both views of a stripe of `width` columns from `x` on, in `rows`, at `disparity`.
fn views(x: usize, width: usize, rows: std::ops::Range<usize>, disparity: usize) -> [View; 2] {
    [0, 1].map(|side| {
        let shift = |d: usize| if side == 0 { 0 } else { d };
        let gray = Image::from_fn(SIZE, |u, v| {
            let stripe = (x..x + width).contains(&(u + shift(disparity))) && rows.contains(&v);
            if stripe { 30 } else { wall(u + shift(WALL), v) }
        });
        View { gray, is_gray: true, ..View::default() }
    })
}

/// What is found at every level, which is the same.
fn found(views: &[View; 2]) -> Vec<Pole> {
    found_with(views, &Config::default(), &rig())
}

fn found_with([left, right]: &[View; 2], config: &Config, rig: &StereoRig) -> Vec<Pole> {
    let plane = plane(rig);
    let mut all = simd::available().into_iter().map(|level| {
        let mut poles = Poles::new(config, level);
        poles.find(left, right, rig, Some(&plane));
        poles.list().to_vec()
    });
    let first = all.next().expect("there is always a level");
    for other in all {
        assert_eq!(other, first);
    }
    first
}

/// A post that reaches from the upper edge to the ground.
fn post() -> [View; 2] {
    views(150, 4, 0..130, BEFORE as usize)
}

#[test]
fn a_post_before_a_wall_is_found_from_its_top_to_its_foot() {
    let poles = found(&post());
    let [pole] = &poles[..] else { panic!("{poles:?}") };
    assert!((pole.disparity - BEFORE).abs() < 0.3, "{pole:?}");
    // The ground has its disparity in row 130.
    assert!(pole.rows.start == 0 && (126..=130).contains(&pole.rows.end), "{pole:?}");
    for y in [4, 60, 120] {
        let columns = pole.columns(y, SIZE.width);
        assert!(columns.start.abs_diff(150) <= 1 && columns.end.abs_diff(154) <= 1, "{pole:?}");
    }
}

#[test]
fn a_stripe_on_the_wall_is_none() {
    assert_eq!(found(&views(150, 4, 0..130, WALL)), []);
}

#[test]
fn what_hangs_is_none_unless_something_nearer_hides_the_rest() {
    let cut = views(150, 4, 0..64, BEFORE as usize);
    assert_eq!(found(&cut), []);
    // A parked car before its lower half, of 24 px.
    let hidden = [0, 1].map(|side| {
        let car = |x: usize| (120..200).contains(&(x + if side == 0 { 0 } else { 24 }));
        let post: &View = &post()[side];
        let gray = Image::from_fn(SIZE, |x, y| match y {
            64.. if car(x) => wall(x + if side == 0 { 0 } else { 24 }, y + 999),
            _ => post.gray.get(x, y),
        });
        View { gray, ..View::default() }
    });
    let poles = found(&hidden);
    assert_eq!(poles.len(), 1, "{poles:?}");
    assert!((56..=72).contains(&poles[0].rows.end), "{poles:?}");
}

#[test]
fn what_stands_below_the_horizon_alone_is_none() {
    assert_eq!(found(&views(150, 4, 90..130, BEFORE as usize)), []);
}

#[test]
fn what_is_lower_than_a_pole_is_none() {
    // The same seen by a camera whose height is a fifth: 0.9 m instead of 4.6 m.
    let [left, right] = post();
    let near = |baseline: f64| {
        let camera = |tx| Camera::pinhole(SIZE, 200.0, 160.0, 80.0, tx);
        let rig = StereoRig::new(camera(0.0), camera(-200.0 * baseline), 0.0).unwrap();
        let mut poles = Poles::new(&Config::default(), simd::detect());
        poles.find(&left, &right, &rig, Some(&plane(&rig)));
        poles.list().len()
    };
    assert_eq!([near(0.5), near(0.2), near(0.1)], [1, 1, 0]);
}

#[test]
fn the_principal_points_change_nothing() {
    let plain = found(&post());
    for offset in [0, 40, 80] {
        // The right view shifted as that camera sees it.
        let [left, right] = post();
        let gray = Image::from_fn(SIZE, |x, y| {
            if x + offset < SIZE.width { right.gray.get(x + offset, y) } else { 0 }
        });
        let views = [left, View { gray, ..View::default() }];
        let poles = found_with(&views, &Config::default(), &rig_with(offset));
        assert_eq!(poles.len(), 1, "offset {offset}");
        assert_eq!(poles[0].disparity, plain[0].disparity);
    }
}

#[test]
fn limits_of_disparity_depth_and_confidence_hold() {
    let count = |name: &str, value: serde_json::Value| {
        let config = Config::default().with(name, &value).unwrap();
        found_with(&post(), &config, &rig()).len()
    };
    assert_eq!(count("stereo.min_disparity", 13.into()), 1);
    assert_eq!(count("stereo.min_disparity", 14.into()), 0);
    assert_eq!(count("stereo.disparity_range", 16.into()), 1);
    // It is 7.1 m away.
    assert_eq!(count("depth.max", 7.5.into()), 1);
    assert_eq!(count("depth.max", 7.0.into()), 0);
    assert_eq!(count("depth.min", 7.5.into()), 0);
    assert_eq!(count("min_confidence", 0.9.into()), 1);
    assert_eq!(count("min_confidence", 0.95.into()), 0);
}

#[test]
fn without_a_plane_there_is_none() {
    let [left, right] = post();
    let rig = rig();
    let mut poles = Poles::new(&Config::default(), simd::detect());
    poles.find(&left, &right, &rig, Some(&plane(&rig)));
    assert_eq!(poles.list().len(), 1);
    poles.find(&left, &right, &rig, None);
    assert_eq!(poles.list(), []);
}

#[test]
fn its_pixels_get_its_disparity_where_they_are_matched_and_nothing_is_nearer() {
    let [left, right] = post();
    let rig = rig();
    let mut poles = Poles::new(&Config::default(), simd::detect());
    poles.find(&left, &right, &rig, Some(&plane(&rig)));
    let matched = Image::from_fn(SIZE, |_, y| if y < 100 { 255 } else { 0 });
    let mut disparity = Image::from_fn(SIZE, |_, y| match y {
        ..20 => f32::NAN,
        20..40 => WALL as f32,
        _ => 30.0,
    });
    let mut confidence = Image::filled(SIZE, 0.1);
    poles.paint(&matched, &mut disparity, &mut confidence);
    let own = poles.list()[0].disparity;
    for (y, expected) in [(10, own), (30, own), (60, 30.0), (110, 30.0)] {
        assert_eq!(disparity.get(151, y), expected, "row {y}");
        let certain = confidence.get(151, y) == poles.list()[0].confidence;
        assert_eq!(certain, expected == own);
    }
    assert_eq!(disparity.get(160, 30), WALL as f32);

    let mut attention = Image::filled(SIZE.divided_by(4), 0.1);
    poles.raise(&mut attention, SIZE.width);
    assert!(attention.get(150 / 4, 10) > 0.3);
    assert_eq!(attention.get(160 / 4, 10), 0.1);
}

#[test]
fn the_region_of_interest_takes_them_in_as_far_as_it_has_room() {
    let poles = found(&views(150, 5, 0..130, BEFORE as usize));
    let attention = Image::filled(SIZE.divided_by(4), 0.1);
    let nothing = Image::filled(SIZE.divided_by(4), f32::NAN);
    let coarse = CoarseDisparity { checked: nothing.clone(), filled: nothing };
    for (share, expected) in [(1.0, true), (0.01, false)] {
        let config = Config::default().with("roi.max_fraction", &share.into()).unwrap();
        let mut roi = Roi::new(&config, SIZE, simd::detect());
        let mut out = RoiMask::default();
        roi.run(&attention, &coarse, &rig(), &mut out);
        assert_eq!(out.fraction, 0.0);
        assert_eq!(roi.include(&poles, &mut out), usize::from(expected));
        for mask in [&out.salient, &out.matched] {
            assert_eq!(mask.get(151, 60) != 0, expected);
            assert_eq!(mask.get(160, 60), 0);
        }
        assert_eq!(roi.masks().salient.row(60).iter().any(|word| *word != 0), expected);
        let area = out.matched.pixels().iter().filter(|value| **value != 0).count();
        assert_eq!(out.fraction, area as f32 / SIZE.area() as f32);
    }
}

#[test]
fn a_pole_that_no_thing_contains_is_a_region() {
    let rig = rig();
    let plane = plane(&rig);
    let [left, right] = views(151, 3, 0..130, BEFORE as usize);
    let poles = found(&[left.clone(), right]);
    let nothing = Image::filled(SIZE.divided_by(4), f32::NAN);
    let coarse = CoarseDisparity { checked: nothing.clone(), filled: nothing };
    let own = |x: usize, y: usize| {
        poles.iter().any(|pole| pole.rows.contains(&y) && pole.columns(y, SIZE.width).contains(&x))
    };
    let all = bits(&Image::from_fn(SIZE, |_, _| true));
    // Alone, and as a part of something of the same distance that is found without it.
    for (alone, with_poles, expected) in
        [(true, false, 0), (true, true, 1), (false, false, 1), (false, true, 1)]
    {
        let disparity = Image::from_fn(SIZE, |x, y| {
            let thing = !alone && (130..180).contains(&x) && (70..130).contains(&y);
            // The wall and the ground, where there is a thing before them.
            let behind = (WALL as f32).max(0.2 * y as f32 - 12.0);
            match own(x, y) || thing {
                true => BEFORE,
                false if alone => f32::NAN,
                false => behind,
            }
        });
        let source = RegionSource {
            left: &left,
            attention: &Image::filled(SIZE.divided_by(4), 0.8),
            roi: &Masks { matched: all.clone(), salient: all.clone() },
            disparity: &disparity,
            coarse: &coarse,
            confidence: &Image::filled(SIZE, 0.9),
            rig: &rig,
            plane: Some(&plane),
            poles: if with_poles { &poles } else { &[] },
            table: None,
        };
        let mut out = (Image::default(), RegionList::default(), Rejections::default());
        Regions::new(&Config::default(), SIZE, simd::detect())
            .run(&source, &mut out.0, &mut out.1, &mut out.2);
        assert_eq!(out.1.len(), expected, "alone {alone}, poles {with_poles}");
        if alone && with_poles {
            let labelled = |x, y| out.0.get(x, y) != 0;
            let same = Image::from_fn(SIZE, |x, y| labelled(x, y) == own(x, y));
            assert!(same.pixels().iter().all(|same| *same));
            assert!((out.1[0].median_depth - 100.0 / 14.0).abs() < 0.1);
        }
    }
}
