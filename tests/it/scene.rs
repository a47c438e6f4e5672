//! Mode `scene`: the ground and the cues.

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::View;
use salient_stereo::simd;
use salient_stereo::stage::coarse::CoarseDisparity;
use salient_stereo::stage::ground::{Ground, GroundState, cell_centre};
use salient_stereo::stage::saliency::barrier::{Barrier, ycbcr};
use salient_stereo::stage::saliency::lateral::Lateral;
use salient_stereo::stage::saliency::{Previous, Saliency, Scene};
use salient_stereo::stamp::Stamp;

pub(super) const SIZE: Size = Size::new(640, 240);
pub(super) const F: f64 = 400.0;
pub(super) const BASELINE: f64 = 0.5;
pub(super) const HEIGHT: f64 = 1.6;
pub(super) const HORIZON: f64 = 100.0;

pub(super) fn rig() -> StereoRig {
    StereoRig::new(
        Camera::pinhole(SIZE, F, 320.0, HORIZON, 0.0),
        Camera::pinhole(SIZE, F, 320.0, HORIZON, -F * BASELINE),
        0.0,
    )
    .unwrap()
}

/// A street under a camera rolled by `roll` radians, with a wall at 40 m and
/// boxes of (left, right, bottom and top above the ground, distance) in metres.
pub(super) fn street(roll: f64, boxes: &[[f64; 5]]) -> Image<f32> {
    view(roll, boxes, SIZE.divided_by(4), cell_centre)
}

/// The same in cells of another shape.
pub(super) fn view(
    roll: f64,
    boxes: &[[f64; 5]],
    cells: Size,
    centre: impl Fn(usize, usize) -> (f32, f32),
) -> Image<f32> {
    Image::from_fn(cells, |x, y| {
        let (u, v) = centre(x, y);
        let (u, v) = (f64::from(u) - 320.0, f64::from(v) - HORIZON);
        // Down in the world, from the rolled camera.
        let down = v * roll.cos() + u * roll.sin();
        let across = u * roll.cos() - v * roll.sin();
        let mut z = 40.0_f64;
        if down > 0.0 {
            z = z.min(F * HEIGHT / down);
        }
        for [left, right, bottom, top, distance] in boxes {
            let (lateral, height) = (across * distance / F, HEIGHT - down * distance / F);
            if (*left..*right).contains(&lateral) && (*bottom..*top).contains(&height) {
                z = z.min(*distance);
            }
        }
        (F * BASELINE / z) as f32
    })
}

#[test]
fn the_ground_is_found_from_the_first_frame_also_with_roll() {
    for roll in [-0.07, 0.0, 0.07] {
        let mut ground = Ground::default();
        ground.run(&street(roll, &[[-3.0, -1.0, 0.0, 1.5, 9.0]]), &rig());
        let plane = ground.plane().expect("a street has a ground");
        assert_eq!(ground.state(), GroundState::Measured);
        assert!((plane.camera_height_m - HEIGHT as f32).abs() < 0.05, "{roll}: {plane:?}");
        // Height of the box's upper edge.
        let (u, v) = (320.0 - 2.0 / 9.0 * 400.0, HORIZON as f32 + 0.1 / 9.0 * 400.0);
        let turned = (roll.cos() as f32, roll.sin() as f32);
        let (du, dv) = (u - 320.0, v - HORIZON as f32);
        let (u, v) =
            (320.0 + du * turned.0 + dv * turned.1, HORIZON as f32 + dv * turned.0 - du * turned.1);
        let height = plane.height(u, v, (F * BASELINE / 9.0) as f32);
        assert!((height - 1.5).abs() < 0.1, "{roll}: {height}");
    }
}

#[test]
fn a_wall_is_no_ground_and_a_lost_ground_is_held_for_a_while() {
    let rig = rig();
    let wall = Image::filled(SIZE.divided_by(4), 20.0);
    let mut ground = Ground::default();
    ground.run(&wall, &rig);
    assert_eq!(ground.state(), GroundState::None);

    ground.run(&street(0.0, &[]), &rig);
    let nothing = Image::filled(SIZE.divided_by(4), f32::NAN);
    for _ in 0..10 {
        ground.run(&nothing, &rig);
        assert_eq!(ground.state(), GroundState::Held);
        assert!(ground.plane().is_some());
    }
    ground.run(&nothing, &rig);
    assert_eq!((ground.state(), ground.plane()), (GroundState::None, None));
}

#[test]
fn land_that_falls_away_beside_a_road_does_not_hide_the_road() {
    // To the right of the road there is nothing up to a forest 25 m away.
    let road = street(0.0, &[]);
    let disparity =
        Image::from_fn(
            road.size(),
            |x, y| {
                if x > 96 { road.get(x, y).min(8.0) } else { road.get(x, y) }
            },
        );
    let mut ground = Ground::default();
    ground.run(&disparity, &rig());
    let plane = ground.plane().expect("a road");
    assert!((plane.camera_height_m - HEIGHT as f32).abs() < 0.05, "{plane:?}");
}

#[test]
fn a_corridor_has_a_floor() {
    let half_width = 1.3;
    for roll in [-0.08_f64, 0.0, 0.08] {
        let disparity = Image::from_fn(SIZE.divided_by(4), |x, y| {
            let (u, v) = cell_centre(x, y);
            let (u, v) = ((f64::from(u) - 320.0) / F, (f64::from(v) - HORIZON) / F);
            let down = v * roll.cos() + u * roll.sin();
            let across = u * roll.cos() - v * roll.sin();
            // Floor, ceiling, two walls and the end.
            let floor = if down > 0.0 { HEIGHT / down } else { 1.0 / -down.min(-1e-9) };
            let wall = half_width / across.abs().max(1e-9);
            (F * BASELINE / floor.min(wall).min(20.0)) as f32
        });
        let mut ground = Ground::default();
        ground.run(&disparity, &rig());
        let plane = ground.plane().expect("a floor");
        assert!((plane.camera_height_m - HEIGHT as f32).abs() < 0.1, "{roll}: {plane:?}");
    }
}

#[test]
fn a_table_is_a_ground_from_any_angle_and_a_cloth_before_the_camera_is_none() {
    for pitch in [20.0_f64, 35.0, 50.0, 62.0] {
        for roll in [-0.07_f64, 0.0, 0.07] {
            let (pitch, height) = (pitch.to_radians(), 0.5);
            let disparity = Image::from_fn(SIZE.divided_by(4), |x, y| {
                let (u, v) = cell_centre(x, y);
                let (u, v) = ((f64::from(u) - 320.0) / F, (f64::from(v) - HORIZON) / F);
                let down = v * roll.cos() + u * roll.sin();
                let d = F * BASELINE * (down * pitch.cos() + pitch.sin()) / height;
                // A box stands on it.
                let boxed = (60..80).contains(&x) && (20..40).contains(&y);
                (if boxed { 1.25 * d } else { d }).max(0.0) as f32
            });
            let mut ground = Ground::default();
            ground.run(&disparity, &rig());
            let plane = ground.plane().unwrap_or_else(|| panic!("a table at {pitch}, {roll}"));
            assert!((plane.camera_height_m - height as f32).abs() < 0.02, "{pitch}: {plane:?}");
        }
    }
    // 10 px of disparity, 4 % more at the bottom: that is noise, not a tilt.
    let cloth = Image::from_fn(SIZE.divided_by(4), |_, y| 10.0 + 0.4 * y as f32 / 60.0);
    let mut ground = Ground::default();
    ground.run(&cloth, &rig());
    assert_eq!(ground.state(), GroundState::None);
}

/// The barrier of one channel over three raster scans, one value at a time.
fn plain_barrier(values: &[u8], width: usize, height: usize) -> Vec<u8> {
    let border = |x: usize, y: usize| x == 0 || y == 0 || x + 1 == width || y + 1 == height;
    let mut high = values.to_vec();
    let mut low = values.to_vec();
    let mut best: Vec<u8> =
        (0..values.len()).map(|i| if border(i % width, i / width) { 0 } else { 255 }).collect();
    for pass in 0..3 {
        let forward = pass % 2 == 0;
        for k in 0..values.len() {
            let i = if forward { k } else { values.len() - 1 - k };
            if border(i % width, i / width) {
                continue;
            }
            let neighbours = if forward { [i - width, i - 1] } else { [i + width, i + 1] };
            for j in neighbours {
                let (h, l) = (high[j].max(values[i]), low[j].min(values[i]));
                if h - l < best[i] {
                    (best[i], high[i], low[i]) = (h - l, h, l);
                }
            }
        }
    }
    best
}

#[test]
fn the_packed_barrier_equals_one_channel_at_a_time() {
    let mut seed = 7_u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 24) as u8
    };
    for (width, height) in [(1, 1), (2, 5), (3, 3), (9, 8), (17, 9), (40, 23), (5, 40)] {
        let size = Size::new(width, height);
        let rgb = Image::from_fn(size, |_, _| [random(), random(), random()]);
        let fourth = Image::from_fn(size, |_, _| random());
        let mut levels = simd::available().into_iter().map(|level| {
            let (mut color, mut extra) = (Image::default(), Image::default());
            Barrier::new(level).run(&rgb, &fourth, &mut color, &mut extra);
            (color, extra)
        });
        let (color, extra) = levels.next().unwrap();
        assert!(levels.all(|other| other == (color.clone(), extra.clone())), "{size}");
        let channel = |c: usize| rgb.pixels().iter().map(|&p| ycbcr(p)[c]).collect::<Vec<_>>();
        let plain: Vec<_> = (0..3).map(|c| plain_barrier(&channel(c), width, height)).collect();
        let fourth = plain_barrier(fourth.pixels(), width, height);
        for i in 0..size.area() {
            let sum: u16 = plain.iter().map(|p| u16::from(p[i])).sum();
            assert_eq!(color.pixels()[i], f32::from(sum), "{size} pixel {i}");
            assert_eq!(extra.pixels()[i], f32::from(fourth[i]), "{size} pixel {i}");
        }
    }
}

#[test]
fn a_pole_stands_out_on_both_sides_and_a_wall_on_none() {
    let size = Size::new(120, 4);
    let disparity =
        Image::from_fn(size, |x, y| if y < 2 && (50..53).contains(&x) { 20.0 } else { 5.0 });
    let mut out = Image::default();
    Lateral::new(simd::detect()).run(&disparity, 2.0, 1.0, &mut out);
    assert_eq!(out.get(51, 0), 1.0);
    assert_eq!((out.get(51, 3), out.get(20, 0)), (0.0, 0.0));
    // One side only counts half: (15 / 2) / (0.35 * 20) is still full, a small step
    // less 0.15 px of noise is not.
    let step = Image::from_fn(size, |x, _| if x < 60 { 20.0 } else { 18.0 });
    Lateral::new(simd::detect()).run(&step, 2.0, 1.0, &mut out);
    assert!((out.get(58, 0) - 0.925 / 7.0).abs() < 1e-5, "{}", out.get(58, 0));
}

#[test]
fn a_pale_thing_in_a_still_is_of_interest_and_an_empty_still_is_not() {
    let size = Size::new(320, 240);
    let threshold = Config::default().saliency.threshold as f32;
    // A square a little brighter than what is around it, seen by one camera only.
    let look = |contrast: u8, frames: usize| {
        let inside = |x: usize, y: usize| (130..190).contains(&x) && (90..150).contains(&y);
        let gray = Image::from_fn(size, |x, y| 120 + if inside(x, y) { contrast } else { 0 });
        let rgb = Image::from_fn(size, |x, y| [gray.get(x, y); 3]);
        let left = View { gray, rgb, ..View::default() };
        let cells = size.divided_by(4);
        let coarse = CoarseDisparity {
            checked: Image::filled(cells, f32::NAN),
            filled: Image::filled(cells, 0.0),
        };
        let mut stage = Saliency::new(&Config::default(), size, simd::detect());
        let (mut previous, rig) = (Previous::default(), rig());
        let mut map = Image::default();
        for frame in 0..frames {
            let stamp = Stamp(100_000_000 * frame as i64);
            let scene = Scene { stamp, left: &left, coarse: &coarse, rig: &rig };
            stage.run(&scene, &mut previous, &mut map);
        }
        map
    };
    let most = |map: &Image<f32>| map.pixels().iter().copied().fold(0.0, f32::max);
    let pale = look(18, 1);
    assert!(pale.get(40, 30) >= threshold && pale.get(5, 5) < 0.3, "{}", pale.get(40, 30));
    assert!(most(&look(0, 1)) < 0.3);
    // What raised the still is not handed on to the frame after it.
    let next = look(18, 2);
    assert!(next.get(40, 30) < threshold, "{}", next.get(40, 30));
}
