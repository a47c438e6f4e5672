//! A plane that is looked down upon: how it is found, what stands off it, and
//! its regions.

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::{RegionList, Rejections, View};
use salient_stereo::simd;
use salient_stereo::stage::coarse::CoarseDisparity;
use salient_stereo::stage::ground::{GroundState, Plane, cell_centre};
use salient_stereo::stage::regions::{RegionSource, Regions};
use salient_stereo::stage::roi::Masks;
use salient_stereo::stage::saliency::{Previous, Saliency, Scene};
use salient_stereo::stage::table::Table;
use salient_stereo::stamp::Stamp;

use super::reference::Noise;
use super::reference::roi::bits;

const SIZE: Size = Size::new(640, 480);
const F: f64 = 700.0;
const BASELINE: f64 = 0.12;
const HEIGHT: f64 = 0.8;

fn rig() -> StereoRig {
    StereoRig::new(
        Camera::pinhole(SIZE, F, 320.0, 240.0, 0.0),
        Camera::pinhole(SIZE, F, 320.0, 240.0, -F * BASELINE),
        0.0,
    )
    .unwrap()
}

/// The table under a camera that looks `pitch` degrees down, turned by `roll`
/// degrees about its axis.
fn plane(pitch: f64, roll: f64) -> Plane {
    let (pitch, roll) = (pitch.to_radians(), roll.to_radians());
    // The normal is that of a floor, seen from the camera.
    let n = [pitch.cos() * roll.sin(), pitch.cos() * roll.cos(), pitch.sin()];
    let scale = BASELINE / HEIGHT;
    let [b, a] = [n[0] * scale, n[1] * scale];
    let c = n[2] * F * scale - 240.0 * a - 320.0 * b;
    Plane::new(a as f32, b as f32, c as f32, &rig()).unwrap()
}

/// That table with 0.8 px of noise; of its cells a share is bare and matches by
/// chance, and `relief` (pixels) stands on it.
fn table(plane: &Plane, bare: f32, relief: impl Fn(usize, usize) -> f32) -> Image<f32> {
    let mut noise = Noise(5);
    Image::from_fn(SIZE.divided_by(4), |x, y| {
        let (u, v) = cell_centre(x, y);
        // The sum of three has a variance of a quarter.
        let spread = 1.6 * (noise.unit() + noise.unit() + noise.unit() - 1.5);
        let by_chance = noise.unit() < bare && relief(x, y) == 0.0;
        if by_chance { 130.0 * noise.unit() } else { plane.disparity(u, v) + relief(x, y) + spread }
    })
}

fn found(disparity: &Image<f32>) -> Table {
    let mut table = Table::default();
    table.run(disparity, &rig());
    table
}

#[test]
fn a_table_is_found_from_above_whatever_is_on_it_and_however_bare_it_is() {
    for (pitch, roll) in [(90.0, 0.0), (75.0, 0.0), (62.0, 0.0), (75.0, 25.0), (70.0, -90.0)] {
        for bare in [0.0, 0.3] {
            let plane = plane(pitch, roll);
            let box_of = |x: usize, y: usize| (30..70).contains(&x) && (20..60).contains(&y);
            let seen = table(&plane, bare, |x, y| if box_of(x, y) { 12.0 } else { 0.0 });
            let table = found(&seen);
            let now = table.plane().unwrap_or_else(|| panic!("{pitch}, {roll}, {bare}"));
            assert_eq!(table.state(), GroundState::Table);
            for (u, v) in [(0.0, 0.0), (639.0, 0.0), (320.0, 240.0), (0.0, 479.0), (639.0, 479.0)] {
                let error = now.disparity(u, v) - plane.disparity(u, v);
                assert!(error.abs() < 0.5, "{pitch}, {roll}, {bare}: {error} at {u}, {v}");
            }
            assert!((now.camera_height_m - HEIGHT as f32).abs() < 0.01, "{now:?}");
        }
    }
}

#[test]
fn what_is_no_table_is_none() {
    let rig = rig();
    let cells = SIZE.divided_by(4);
    // Matches by chance, leaves at all depths, and nothing at all.
    let mut noise = Noise(7);
    let chance = Image::from_fn(cells, |_, _| 130.0 * noise.unit());
    let depths: Vec<f32> = (0..1000).map(|_| 40.0 + 60.0 * noise.unit()).collect();
    let leaves = Image::from_fn(cells, |x, y| depths[y / 12 * 25 + x / 12]);
    let nothing = Image::filled(cells, f32::NAN);
    // A street, a wall that one walks along, a ceiling, and a wall so far away that a
    // thing before it has no relief.
    let street = table(&plane(10.0, 0.0), 0.0, |_, _| 0.0).pixels().to_vec();
    let street = Image::from_vec(cells, street.iter().map(|d| d.max(0.0)).collect()).unwrap();
    let along = table(&plane(15.0, 90.0), 0.0, |_, _| 0.0);
    let ceiling = table(&plane(130.0, 0.0), 0.0, |_, _| 0.0);
    let far = Image::from_fn(cells, |_, y| 6.0 + 0.02 * y as f32);
    for (name, seen) in [
        ("chance", chance),
        ("leaves", leaves),
        ("nothing", nothing),
        ("street", street),
        ("along", along),
        ("ceiling", ceiling),
        ("far", far),
    ] {
        let mut table = Table::default();
        table.run(&seen, &rig);
        assert_eq!((table.state(), table.plane()), (GroundState::None, None), "{name}");
    }
}

#[test]
fn a_hand_over_the_table_does_not_end_it_and_ten_frames_of_nothing_do() {
    let rig = rig();
    let plane = plane(75.0, 0.0);
    let mut table = found(&self::table(&plane, 0.2, |_, _| 0.0));
    // Two thirds of the view: too much to begin with, not to go on.
    let hand = self::table(&plane, 0.2, |x, _| if x < 100 { 25.0 } else { 0.0 });
    assert!(found(&hand).plane().is_none_or(|p| p.camera_height_m < 0.75));
    table.run(&hand, &rig);
    assert_eq!(table.state(), GroundState::Table);
    assert!((table.plane().unwrap().camera_height_m - HEIGHT as f32).abs() < 0.01);
    let nothing = Image::filled(SIZE.divided_by(4), f32::NAN);
    for _ in 0..10 {
        table.run(&nothing, &rig);
        assert_eq!(table.state(), GroundState::TableHeld);
    }
    table.run(&nothing, &rig);
    assert_eq!((table.state(), table.plane()), (GroundState::None, None));
}

/// The attention stage on a gray view, frame after frame.
struct Watch {
    stage: Saliency,
    previous: Previous,
    left: View,
}

impl Watch {
    fn new() -> Self {
        let gray = Image::filled(SIZE, 120);
        let rgb = Image::filled(SIZE, [120; 3]);
        Self {
            stage: Saliency::new(&Config::default(), SIZE, simd::detect()),
            previous: Previous::default(),
            left: View { gray, rgb, ..View::default() },
        }
    }

    fn look(&mut self, disparity: Image<f32>) -> (GroundState, Image<f32>) {
        let coarse = CoarseDisparity { checked: disparity.clone(), filled: disparity };
        let scene = Scene { stamp: Stamp(0), left: &self.left, coarse: &coarse, rig: &rig() };
        let mut cells = Image::default();
        self.stage.run(&scene, &mut self.previous, &mut cells);
        (self.stage.footing().unwrap().state, cells)
    }
}

#[test]
fn what_stands_off_the_table_is_salient_in_the_tables_own_colour() {
    let plane = plane(75.0, 0.0);
    // A box 10 px high, a card within the noise, and a chance match of one row.
    let relief = |x: usize, y: usize| match (x, y) {
        (40..60, 30..50) => 10.0,
        (100..120, 30..50) => 0.8,
        (90..130, 80) => 60.0,
        _ => 0.0,
    };
    let (state, map) = Watch::new().look(table(&plane, 0.3, relief));
    assert_eq!(state, GroundState::Table);
    for y in 0..map.height() {
        for x in 0..map.width() {
            // A median takes the corners off.
            let inside = (42..58).contains(&x) && (32..48).contains(&y);
            let outside = !(37..63).contains(&x) || !(27..53).contains(&y);
            let s = map.get(x, y);
            assert!(!inside || s >= 0.55, "{s} on the box at {x}, {y}");
            assert!(!outside || s < 0.3, "{s} beside the box at {x}, {y}");
        }
    }
}

#[test]
fn ground_and_table_do_not_take_turns() {
    // A camera that nods about the angle where one becomes the other.
    let mut watch = Watch::new();
    let mut states = Vec::new();
    for frame in 0..24 {
        let pitch = if frame % 2 == 0 { 63.5 } else { 64.5 };
        states.push(watch.look(table(&plane(pitch, 0.0), 0.0, |_, _| 0.0)).0);
    }
    let changes = states.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(changes <= 1, "{states:?}");
    assert!(states.iter().all(|state| *state != GroundState::None), "{states:?}");
    // What is certainly the one or the other is named so, once the ground is given up.
    let mut settled = |pitch| {
        let mut looks = (0..12).map(|_| watch.look(table(&plane(pitch, 0.0), 0.0, |_, _| 0.0)).0);
        looks.by_ref().nth(11)
    };
    assert_eq!(settled(80.0), Some(GroundState::Table));
    assert_eq!(settled(40.0), Some(GroundState::Measured));
    assert_eq!(settled(80.0), Some(GroundState::Table));
}

/// Regions on `plane` where all is salient, and how many candidates were refused.
fn regions_on(plane: &Plane, disparity: &Image<f32>) -> (RegionList, Rejections) {
    let rig = rig();
    let salient = bits(&Image::filled(SIZE, true));
    let config = Config::default();
    let source = RegionSource {
        left: &View::default(),
        attention: &Image::filled(SIZE.divided_by(4), 0.8),
        roi: &Masks { matched: salient.clone(), salient },
        disparity,
        coarse: &CoarseDisparity::default(),
        confidence: &Image::filled(SIZE, 0.9),
        rig: &rig,
        plane: None,
        poles: &[],
        table: Some(plane),
    };
    let mut out = (RegionList::default(), Rejections::default());
    let mut labels = Image::default();
    Regions::new(&config, SIZE, simd::detect()).run(&source, &mut labels, &mut out.0, &mut out.1);
    out
}

#[test]
fn regions_are_what_stands_off_the_plane_with_its_holes() {
    let plane = plane(80.0, 0.0);
    let inside = |x: usize, y: usize, left: usize, top: usize, side: usize| {
        (left..left + side).contains(&x) && (top..top + side).contains(&y)
    };
    // A cup whose coffee is not measured, a flat box, a card of 1 px, a thing that was
    // hardly measured, and a bare part of the table beside the box.
    let disparity = Image::from_fn(SIZE, |x, y| {
        let at = plane.disparity(x as f32, y as f32);
        match (x, y) {
            _ if inside(x, y, 110, 110, 40) => f32::NAN,
            _ if inside(x, y, 100, 100, 60) => at + 25.0,
            _ if inside(x, y, 300, 100, 60) => at + 3.0,
            _ if inside(x, y, 100, 300, 60) => at + 1.0,
            _ if inside(x, y, 300, 300, 15) => at + 9.0,
            (360..640, 100..160) | (290..350, 290..350) => f32::NAN,
            _ => at,
        }
    });
    let (regions, refused) = regions_on(&plane, &disparity);
    let mut found: Vec<_> = regions.iter().map(|r| (r.x, r.y, r.width, r.height)).collect();
    found.sort_unstable();
    // What was not measured beside the box is taken 20 px far.
    assert_eq!(found, [(100, 100, 60, 60), (300, 100, 80, 60)]);
    let cup = regions.iter().find(|r| r.x == 100).unwrap();
    assert_eq!(cup.area, 3600);
    assert_eq!(refused.small_area, 1);
}

#[test]
fn a_rim_belongs_to_its_cup_and_a_cable_parts_what_it_connects() {
    let plane = plane(80.0, 0.0);
    let disparity = Image::from_fn(SIZE, |x, y| {
        let at = plane.disparity(x as f32, y as f32);
        match (x, y) {
            // The neck of a bottle is much nearer than the rest of it.
            (100..160, 100..115) => at + 60.0,
            // The bottle, and two boxes of one height on a cable.
            (100..160, 115..160) | (300..340 | 400..440, 100..140) | (340..400, 117..123) => {
                at + 25.0
            }
            _ => at,
        }
    });
    let (regions, refused) = regions_on(&plane, &disparity);
    let mut found: Vec<_> = regions.iter().map(|r| (r.x, r.y, r.height, r.area)).collect();
    found.sort_unstable();
    assert_eq!(found.len(), 3, "{found:?}");
    assert_eq!(found[0], (100, 100, 60, 3600));
    let [left, right] = [found[1], found[2]];
    assert!(left.0 == 300 && (341..=400).contains(&right.0), "{found:?}");
    assert_eq!((left.2, right.2), (40, 40), "{found:?}");
    assert_eq!(left.3 + right.3, 2 * 1600 + 360);
    assert!(left.3 >= 1600 && right.3 >= 1600, "{found:?}");
    assert_eq!(refused, Rejections::default());
}
