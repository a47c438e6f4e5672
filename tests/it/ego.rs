//! Motion beside the camera's own.

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::View;
use salient_stereo::simd;
use salient_stereo::stage::coarse::CoarseDisparity;
use salient_stereo::stage::saliency::AttentionScene;
use salient_stereo::stage::saliency::ego::EgoMotion;
use salient_stereo::stage::saliency::flow::{BlockShift, Flow};
use salient_stereo::stamp::Stamp;

const CELLS: Size = Size::new(160, 96);
/// Of the full-size view.
const F: f64 = 500.0;

/// A texture without repetition over a few hundred cells.
fn texture(x: f64, y: f64) -> f64 {
    let wave = |a: f64, b: f64, c: f64| (a * x + b * y + c * (0.03 * (x - y)).sin()).sin();
    128.0
        + 40.0 * wave(0.31, 0.17, 2.0)
        + 35.0 * wave(-0.13, 0.37, 3.0)
        + 30.0 * wave(0.7, -0.5, 1.0)
}

/// A frame in which the place of each cell in the frame before is `(x, y) + shift`.
fn frame(shift: impl Fn(f64, f64) -> (f64, f64)) -> Image<u8> {
    Image::from_fn(CELLS, |x, y| {
        let (x, y) = (x as f64, y as f64);
        let (dx, dy) = shift(x, y);
        texture(x + dx, y + dy) as u8
    })
}

/// One frame after another; false where the flow tells nothing.
fn run(
    ego: &mut EgoMotion,
    before: &Image<u8>,
    now: &Image<u8>,
    disparity: Option<&Image<f32>>,
) -> bool {
    let size = now.size();
    let full = Size::new(4 * size.width, 4 * size.height);
    let (cx, cy) = (full.width as f64 / 2.0, full.height as f64 / 2.0);
    let camera = |shift| Camera::pinhole(full, F, cx, cy, shift);
    let rig = StereoRig::new(camera(0.0), camera(-0.5 * F), 0.0).unwrap();
    let filled = disparity.cloned().unwrap_or_else(|| Image::new(size));
    let coarse = CoarseDisparity { checked: filled.clone(), filled };
    let cells = View { gray: now.clone(), ..View::default() };
    let mut flow = Flow::new(simd::detect());
    flow.run(before, now);
    flow.sharpen();
    let scene = AttentionScene {
        stamp: Stamp::default(),
        left: &cells,
        cells: &cells,
        coarse: &coarse,
        rig: &rig,
        previous: None,
        flow: Some(&flow),
    };
    ego.run(&flow, &scene, disparity.is_some())
}

/// Motion per cell, and that of the movers; `None` where the flow tells nothing.
fn motion(
    before: &Image<u8>,
    now: &Image<u8>,
    disparity: Option<&Image<f32>>,
) -> Option<(Image<f32>, f32)> {
    let mut found: Vec<_> = simd::available()
        .into_iter()
        .map(|level| {
            let mut ego = EgoMotion::new(level);
            let known = run(&mut ego, before, now, disparity);
            known.then(|| (ego.motion.clone(), ego.most))
        })
        .collect();
    assert!(found.windows(2).all(|pair| pair[0] == pair[1]), "every level finds the same");
    found.swap_remove(0)
}

#[test]
fn what_moves_at_the_edge_is_seen_where_blocks_are_cut() {
    // The last blocks of 158 x 90 cells have their middles beyond the view.
    let cells = Size::new(158, 90);
    let frame = |thing: f64, camera: f64| {
        Image::from_fn(cells, |x, y| {
            let (x, y) = (x as f64, y as f64);
            let dx = if x >= 126.0 && y >= 58.0 { thing } else { camera };
            texture(x + dx, y) as u8
        })
    };
    let seen = |now: &Image<u8>| {
        let (motion, _) = motion(&frame(0.0, 0.0), now, None).unwrap();
        [motion.get(156, 74), motion.get(142, 88)]
    };
    // The camera rests, and the thing in the corner does not.
    let [right, below] = seen(&frame(-3.0, 0.0));
    assert!(right > 0.4 && below > 0.4, "{right} {below}");
    // The camera pans, and what comes into view at the right was not seen before.
    let [right, _] = seen(&frame(6.0, 6.0));
    assert_eq!(right, 0.0);
}

#[test]
fn what_movers_moved_is_remembered_a_while() {
    let thing = |x: f64, y: f64| (60.0..92.0).contains(&x) && (36.0..64.0).contains(&y);
    let before = frame(|_, _| (0.0, 0.0));
    let moved = frame(|x, y| if thing(x, y) { (3.0, 1.0) } else { (0.0, 0.0) });
    let mut ego = EgoMotion::new(simd::detect());
    let mut most = |now: &Image<u8>| run(&mut ego, &before, now, None).then_some(ego.most);
    let moving = most(&moved).unwrap();
    assert!(moving > 0.5, "{moving}");
    let [first, second] = [most(&before).unwrap(), most(&before).unwrap()];
    assert!(first > 0.7 * moving && first < moving, "{moving}, then {first}");
    assert!(second < first, "{first}, then {second}");
    // Another scene: nothing is known, and nothing remembered.
    let flat = Image::filled(CELLS, 90);
    assert_eq!(most(&flat), None);
    let rest = most(&before).unwrap();
    assert!(rest < 0.5 * second, "{second}, then {rest}");
}

fn mean(map: &Image<f32>, inside: impl Fn(usize, usize) -> bool) -> f32 {
    let mut values = Vec::new();
    for y in 8..CELLS.height - 8 {
        for x in 12..CELLS.width - 12 {
            values.extend(inside(x, y).then(|| map.get(x, y)));
        }
    }
    values.iter().sum::<f32>() / values.len() as f32
}

#[test]
fn shifts_are_known_to_parts_of_a_cell() {
    for (dx, dy) in [(0.0, 0.0), (2.4, -1.3), (-3.75, 0.5)] {
        let (before, now) = (frame(|_, _| (0.0, 0.0)), frame(|_, _| (dx, dy)));
        let mut all = Vec::new();
        for level in simd::available() {
            let mut flow = Flow::new(level);
            flow.run(&before, &now);
            flow.sharpen();
            let mut sum = 0.0;
            for y in 4..20 {
                for x in 6..34 {
                    let BlockShift { shift: [u, v], firmness } = flow.blocks.get(x, y);
                    let off = (f64::from(u) - dx).hypot(f64::from(v) - dy);
                    assert!(off < 1.0, "({x}, {y}): {u}, {v}, not {dx}, {dy}");
                    assert!(firmness > 0.9, "({x}, {y}): {firmness}");
                    sum += off / (16.0 * 28.0);
                }
            }
            // Whole cells would be off by a half and more.
            assert!(sum < 0.4, "{sum}");
            all.push(flow.blocks);
        }
        assert!(all.windows(2).all(|pair| pair[0] == pair[1]));
    }
    // Nothing holds a flat wall.
    let flat = Image::filled(CELLS, 90);
    let mut flow = Flow::new(simd::detect());
    flow.run(&flat, &flat);
    flow.sharpen();
    assert!(flow.blocks.pixels().iter().all(|block| block.firmness == 0.0));
}

#[test]
fn what_moves_by_itself_is_found_under_a_pan_and_a_zoom() {
    let thing = |x: usize, y: usize| (60..92).contains(&x) && (36..64).contains(&y);
    let camera = |x: f64, y: f64| (2.0 + 0.03 * (x - 80.0), -1.0 + 0.03 * (y - 48.0));
    let before = frame(|_, _| (0.0, 0.0));
    let still = frame(camera);
    let moved = frame(|x, y| {
        let (dx, dy) = camera(x, y);
        if thing(x as usize, y as usize) { (dx + 2.5, dy + 1.0) } else { (dx, dy) }
    });
    let core = |x: usize, y: usize| (66..86).contains(&x) && (42..58).contains(&y);
    let around = |x: usize, y: usize| !(48..104).contains(&x) || !(24..76).contains(&y);
    let (map, most) = motion(&before, &still, None).unwrap();
    assert!(mean(&map, core) < 0.2, "{}", mean(&map, core));
    assert!((0.0..1.0).contains(&most), "{most}");
    let (map, _) = motion(&before, &moved, None).unwrap();
    let [core, around] = [mean(&map, core), mean(&map, around)];
    assert!(core > 0.4 && core > 2.5 * around, "{core}, around it {around}");
}

#[test]
fn parallax_of_what_rests_is_the_cameras() {
    // A wide near thing before a wall, and a camera that goes sideways.
    let near = |x: usize, y: usize| (50..110).contains(&x) && (30..80).contains(&y);
    let disparity = Image::from_fn(CELLS, |x, y| if near(x, y) { 30.0_f32 } else { 6.0 });
    let before = frame(|_, _| (0.0, 0.0));
    let now = frame(|x, y| (if near(x as usize, y as usize) { 5.0 } else { 1.0 }, 0.0));
    let core = |x: usize, y: usize| (58..102).contains(&x) && (38..72).contains(&y);
    let (map, _) = motion(&before, &now, Some(&disparity)).unwrap();
    assert!(mean(&map, core) < 0.15, "{}", mean(&map, core));
    let (map, _) = motion(&before, &now, None).unwrap();
    assert!(mean(&map, core) > 0.3, "{}", mean(&map, core));
}

#[test]
fn another_scene_tells_no_motion() {
    let before = frame(|_, _| (0.0, 0.0));
    let other = Image::from_fn(CELLS, |x, y| if (x / 6 + y / 5) % 2 == 0 { 250 } else { 3 });
    assert!(motion(&before, &other, None).is_none());
    let flat = Image::filled(CELLS, 128);
    assert!(motion(&flat, &flat, None).is_none());
}
