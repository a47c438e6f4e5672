//! The renderer: its truth is what the geometry and the pictures say, and the
//! shipped bags are what it makes.

use std::path::{Path, PathBuf};

use salient_stereo::image::{Image, Picture, Size};
use salient_stereo::input::synthetic::{
    SceneKind, SceneOptions, Side, SyntheticError, SyntheticScene, SyntheticSource,
};
use salient_stereo::input::{FrameSource, Truth};
use salient_stereo::output::scene::SceneMessages;
use salient_stereo::ros::cdr;

/// A small scene without sensor noise.
fn small(kind: SceneKind) -> SyntheticScene {
    let size = kind.defaults().size;
    let size = Size::new(size.width / 2, size.height / 2);
    SyntheticScene::new(kind, SceneOptions { size, noise: false, samples: 3, ..kind.defaults() })
        .unwrap()
}

fn maps(truth: Truth) -> (Image<f32>, Image<u16>) {
    (truth.disparity.unwrap(), truth.objects.unwrap())
}

fn luma(picture: &Picture) -> Image<f32> {
    let Picture::Rgb(rgb) = picture else { panic!("scenes are in colour") };
    Image::from_fn(rgb.size(), |x, y| {
        let [r, g, b] = rgb.get(x, y).map(f32::from);
        0.299 * r + 0.587 * g + 0.114 * b
    })
}

/// Linear interpolation along a row.
fn at(row: &[f32], x: f32) -> Option<f32> {
    let left = x.floor();
    if left < 0.0 || left as usize + 1 >= row.len() {
        return None;
    }
    let (a, b) = (row[left as usize], row[left as usize + 1]);
    Some(a + (b - a) * (x - left))
}

/// Pixels away from every jump of disparity, in either view.
fn is_smooth(left: &Image<f32>, right: &Image<f32>, x: usize, y: usize) -> bool {
    let (w, h) = (left.width(), left.height());
    if x < 2 || y < 2 || x + 2 >= w || y + 2 >= h {
        return false;
    }
    let d = left.get(x, y);
    let flat = |image: &Image<f32>, x: usize, y: usize| {
        (y - 1..=y + 1).all(|j| (x - 2..=x + 2).all(|i| (image.get(i, j) - d).abs() < 0.6))
    };
    let partner = (x as f32 - d).round();
    d.is_finite()
        && partner >= 2.0
        && flat(left, x, y)
        && flat(right, (partner as usize).min(w - 3), y)
}

#[test]
fn warping_the_right_picture_by_the_truth_gives_the_left_one() {
    for kind in SceneKind::ALL {
        let scene = small(kind);
        let observation = scene.observation(4);
        let (d, _) = maps(observation.truth.unwrap());
        let (other, _) = maps(scene.truth(4, Side::Right));
        let (left, right) = (luma(&observation.frame.left), luma(&observation.frame.right));
        let error = |shift: f32| {
            let (mut sum, mut count) = (0.0_f64, 0_u32);
            for y in 0..d.height() {
                for x in 0..d.width() {
                    let slope = (left.get_clamped(x as isize + 1, y as isize)
                        - left.get_clamped(x as isize - 1, y as isize))
                    .abs();
                    if slope < 8.0 || !is_smooth(&d, &other, x, y) {
                        continue;
                    }
                    if let Some(value) = at(right.row(y), x as f32 - d.get(x, y) + shift) {
                        sum += f64::from((value - left.get(x, y)).abs());
                        count += 1;
                    }
                }
            }
            assert!(count > 2000, "{kind}: only {count} textured pixels");
            sum / f64::from(count)
        };
        let (exact, before, after) = (error(0.0), error(-0.5), error(0.5));
        // Two interpolated samplings of texture near the pixel size differ by
        // a few gray values; half a pixel of disparity costs far more.
        assert!(exact < 5.0, "{kind}: mean error {exact}");
        assert!(exact < 0.75 * before.min(after), "{kind}: {before} {exact} {after}");
    }
}

#[test]
fn what_the_left_view_sees_the_right_view_sees_or_something_nearer() {
    for kind in SceneKind::ALL {
        let scene = small(kind);
        let (left, _) = maps(scene.truth(7, Side::Left));
        let (right, _) = maps(scene.truth(7, Side::Right));
        let (mut checked, mut same, mut wrong) = (0_u32, 0_u32, 0_u32);
        for y in 0..left.height() {
            for x in 0..left.width() {
                let d = left.get(x, y);
                let partner = x as f32 - d;
                if !d.is_finite() || partner < 0.0 {
                    continue;
                }
                let base = partner.floor() as usize;
                let seen = [base, (base + 1).min(left.width() - 1)].map(|x| right.get(x, y));
                let nearest = seen[0].max(seen[1]);
                checked += 1;
                // Sampling at whole pixels moves silhouettes by up to one pixel
                // and slanted surfaces by their slope.
                let tolerance = 0.3 + 0.02 * d;
                same += u32::from(seen.iter().any(|s| (s - d).abs() < tolerance));
                wrong += u32::from(nearest.is_nan() || nearest <= d - tolerance);
            }
        }
        assert!(f64::from(wrong) < 0.01 * f64::from(checked), "{kind}: {wrong} of {checked}");
        assert!(f64::from(same) > 0.75 * f64::from(checked), "{kind}: {same} of {checked}");
    }
}

/// Height of the camera over a plane from three pixels on it: 1/Z is linear
/// in the picture, `d = B/h * (n . (u, v, f))`, and n has length 1.
fn height_over_plane(scene: &SyntheticScene, d: &Image<f32>, pixels: [(usize, usize); 3]) -> f64 {
    let rig = scene.rig();
    let (cx, cy) = rig.principal_point();
    let rows = pixels.map(|(x, y)| [x as f64 - cx, y as f64 - cy, rig.focal_px()]);
    let matrix = nalgebra::Matrix3::from_fn(|i, j| rows[i][j]);
    let values = nalgebra::Vector3::from_fn(|i, _| f64::from(d.get(pixels[i].0, pixels[i].1)));
    let n = matrix.try_inverse().unwrap() * values;
    rig.baseline_m / n.norm()
}

#[test]
fn disparity_of_the_ground_is_that_of_its_plane() {
    let scene = small(SceneKind::Street);
    let (d, ids) = maps(scene.truth(0, Side::Left));
    // Road in front of the bumper.
    let height = height_over_plane(&scene, &d, [(80, 117), (200, 117), (150, 95)]);
    assert!((height - 1.55).abs() < 0.03, "camera {height} m over the road");
    // Every other pixel of the road ahead lies on the plane of these three.
    let (a, b, c) = (d.get(120, 117), d.get(180, 117), d.get(150, 95));
    let slope_x = (b - a) / 60.0;
    let slope_y = (c - (a + slope_x * 30.0)) / -22.0;
    for (x, y) in [(140, 90), (130, 100), (160, 110), (170, 85)] {
        assert_eq!(ids.get(x, y), 0);
        let plane = a + slope_x * (x as f32 - 120.0) + slope_y * (y as f32 - 117.0);
        assert!((d.get(x, y) - plane).abs() < 2e-3, "at {x}, {y}: {} {plane}", d.get(x, y));
    }

    let scene = small(SceneKind::Tabletop);
    let (d, _) = maps(scene.truth(0, Side::Left));
    let height = height_over_plane(&scene, &d, [(120, 172), (232, 172), (180, 92)]);
    assert!((height - 0.46).abs() < 0.01, "camera {height} m over the table");
}

#[test]
fn ids_name_the_same_thing_in_every_frame() {
    let scene = small(SceneKind::Tabletop);
    let mean = |index: usize, id: u16| {
        let (d, ids) = maps(scene.truth(index, Side::Left));
        let values: Vec<f32> = d
            .pixels()
            .iter()
            .zip(ids.pixels())
            .filter_map(|(d, i)| (*i == id).then_some(*d))
            .collect();
        assert!(values.len() > 50, "object {id} has {} pixels", values.len());
        values.iter().sum::<f32>() / values.len() as f32
    };
    for id in 1..=6 {
        let (first, last) = (mean(0, id), mean(29, id));
        // The camera drifts by centimetres.
        assert!((first - last).abs() < 0.12 * first, "object {id}: {first} {last}");
    }

    let scene = small(SceneKind::Street);
    let (_, ids) = maps(scene.truth(20, Side::Left));
    let mut areas = [0_u32; 256];
    ids.pixels().iter().for_each(|id| areas[usize::from(*id)] += 1);
    let large = areas[1..].iter().filter(|area| **area > 60).count();
    assert!(large >= 10, "{large} objects of more than 60 pixels");
    assert!(areas[0] > areas[1..].iter().sum::<u32>(), "most of the street is background");
    // The sky is unknown, and only the sky.
    let (d, _) = maps(scene.truth(20, Side::Left));
    let unknown = d.pixels().iter().filter(|d| d.is_nan()).count();
    assert!((500..8000).contains(&unknown), "{unknown} pixels of sky");
    assert!(d.get(160, 4).is_nan() && d.row(119).iter().all(|d| d.is_finite()));
}

#[test]
fn the_number_of_threads_changes_nothing() {
    for kind in SceneKind::ALL {
        let size = Size::new(161, 83);
        let scene = SyntheticScene::new(kind, SceneOptions { size, ..kind.defaults() }).unwrap();
        let [one, two] = [1, 2].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| SceneMessages::render(&scene, 11).unwrap())
        });
        assert!(one == two, "{kind}");
    }
}

#[test]
fn every_seed_is_a_street_of_its_own() {
    let street = |seed| {
        let size = Size::new(160, 60);
        let options = SceneOptions { size, seed, ..SceneKind::Street.defaults() };
        let truth = SyntheticScene::new(SceneKind::Street, options).unwrap().truth(20, Side::Left);
        maps(truth).1.pixels().to_vec()
    };
    let streets = [0, 1, 2, u32::MAX].map(street);
    for (i, one) in streets.iter().enumerate() {
        for other in &streets[..i] {
            let differ = one.iter().zip(other).filter(|(a, b)| a != b).count();
            assert!(differ > 160, "{differ} pixels");
        }
        // As many things, all of them named alike.
        assert!(one.iter().all(|id| *id <= 46));
        assert!((5..46).filter(|id| one.contains(id)).count() > 15);
    }
    assert_eq!(street(1), streets[1]);
    let options = SceneOptions { seed: 1, ..SceneKind::Tabletop.defaults() };
    let error = SyntheticScene::new(SceneKind::Tabletop, options).unwrap_err();
    assert_eq!(error.to_string(), "seed of the tabletop is 1, allowed is 0: there is only one");
}

#[test]
fn a_source_delivers_every_frame_once_and_in_order() {
    let options = SceneOptions {
        size: Size::new(96, 64),
        frames: 3,
        samples: 1,
        ..SceneKind::Tabletop.defaults()
    };
    let scene = SyntheticScene::new(SceneKind::Tabletop, options).unwrap();
    let mut source = SyntheticSource::new(scene.clone());
    for index in 0..3 {
        let observation = source.next_observation().unwrap().unwrap();
        assert_eq!(observation.frame.stamp, scene.stamp(index));
        assert_eq!(observation.frame.left.size(), options.size);
    }
    assert!(source.next_observation().unwrap().is_none());
    assert_eq!((source.tally().pairs, source.progress()), (3, Some(1.0)));
    assert!((scene.stamp(2).seconds_since(scene.stamp(0)) - 0.2).abs() < 1e-9);
}

#[test]
fn impossible_scenes_are_refused_with_the_numbers() {
    let options = SceneKind::Street.defaults();
    let text = |options| SyntheticScene::new(SceneKind::Street, options).unwrap_err().to_string();
    assert!(text(SceneOptions { size: Size::new(8, 8), ..options }).contains("8x8"));
    assert!(text(SceneOptions { frames: 0, ..options }).contains("number of frames is 0"));
    assert!(text(SceneOptions { rate_hz: f64::NAN, ..options }).contains("NaN"));
    assert!(text(SceneOptions { samples: 0, ..options }).contains("samples"));
    let unknown = "moon".parse::<SceneKind>().unwrap_err();
    assert_eq!(unknown, SyntheticError::UnknownScene { name: "moon".into() });
}

fn shipped(kind: SceneKind) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bags").join(format!("{kind}.mcap"))
}

#[test]
fn the_shipped_bags_are_what_the_renderer_makes() {
    for kind in SceneKind::ALL {
        let bytes = std::fs::read(shipped(kind)).unwrap();
        assert!(bytes.len() <= 8 << 20, "{kind}: {} bytes", bytes.len());
        let mut messages: Vec<(String, u64, Vec<u8>)> = mcap::MessageStream::new(&bytes)
            .unwrap()
            .map(|message| {
                let message = message.unwrap();
                (message.channel.topic.clone(), message.log_time, message.data.into_owned())
            })
            .collect();
        let options = kind.defaults();
        assert_eq!(messages.len(), 6 * options.frames, "{kind}");
        messages.truncate(18);
        let scene = SyntheticScene::new(kind, options).unwrap();
        for (index, shipped) in messages.chunks(6).enumerate() {
            let made = SceneMessages::render(&scene, index).unwrap();
            let expected = [
                ("/left/camera_info", cdr::encode(&made.infos[0])),
                ("/right/camera_info", cdr::encode(&made.infos[1])),
                ("/left/image_rect/compressed", cdr::encode(&made.images[0])),
                ("/right/image_rect/compressed", cdr::encode(&made.images[1])),
                ("/truth/disparity/compressed", cdr::encode(&made.disparity)),
                ("/truth/objects/compressed", cdr::encode(&made.objects)),
            ];
            for ((topic, time, data), (name, message)) in shipped.iter().zip(&expected) {
                assert_eq!(topic, name);
                assert_eq!(*time, made.stamp.0 as u64);
                assert!(data == message, "{kind}: frame {index} of {topic} differs");
            }
        }
    }
}
