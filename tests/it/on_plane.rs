//! The cues over a ground plane against plain references, at every SIMD level.

use salient_stereo::image::{Image, Size};
use salient_stereo::simd;
use salient_stereo::stage::ground::Plane;
use salient_stereo::stage::saliency::beside::Beside;
use salient_stereo::stage::saliency::columns::Columns;
use salient_stereo::stage::saliency::lateral::Lateral;
use salient_stereo::stage::saliency::structure::Structure;

use super::reference::scene as plain;
use super::reference::{Noise, ODD_SIZES};

/// The plane of a camera 1.6 m above a road, with a little roll.
fn plane(size: Size) -> Plane {
    let horizon = 0.3 * 4.0 * size.height as f32;
    let (a, b) = (0.3, 0.01);
    Plane { a, b, c: -a * horizon, camera_height_m: 1.6, distance_m: 9.0 }
}

/// A road with things of all heights, walls and holes, and noise.
fn disparity(size: Size, seed: u64) -> Image<f32> {
    let mut noise = Noise(seed);
    let plane = plane(size);
    let things: Vec<[f32; 5]> = (0..12).map(|_| std::array::from_fn(|_| noise.unit())).collect();
    Image::from_fn(size, |x, y| {
        let ground = plane.disparity(4.0 * x as f32 + 1.5, 4.0 * y as f32 + 1.5);
        let (u, v) = (x as f32 / size.width as f32, y as f32 / size.height as f32);
        let mut d = ground.max(0.0);
        for [left, width, top, near, tall] in &things {
            let top = if *tall > 0.7 { 0.0 } else { *top };
            if u >= *left && u < left + 0.3 * width && v >= top {
                d = d.max(3.0 + 30.0 * near);
            }
        }
        let wrong = noise.unit() < 0.03;
        if wrong { 40.0 * noise.unit() } else { (d + noise.unit() - 0.5).max(0.0) }
    })
}

fn sizes() -> impl Iterator<Item = Size> {
    ODD_SIZES.into_iter().chain([Size::new(150, 94)])
}

#[test]
fn structure_goes_on_above_every_thing() {
    for size in sizes() {
        let disparity = disparity(size, 31);
        let expected = plain::structure(&disparity, &plane(size));
        for level in simd::available() {
            let mut out = Image::default();
            Structure::new(level).run(&disparity, &plane(size), &mut out);
            assert_eq!(out, expected, "{size}, {level:?}");
        }
    }
}

#[test]
fn surfaces_have_one_disparity_and_are_even_down_to_the_ground() {
    for size in sizes() {
        let disparity = disparity(size, 32);
        let (surfaces, smooth) = plain::surfaces(&disparity, &plane(size));
        let cue = Noise(33).map(size);
        let gated = Image::from_fn(size, |x, y| 0.5 * cue.get(x, y));
        let mut expected = gated.clone();
        plain::even_out(&surfaces, &smooth, &plane(size), &cue, &mut expected);
        for level in simd::available() {
            let mut columns = Columns::new(level);
            let (mut found, mut out) = (disparity.clone(), gated.clone());
            columns.find(&mut found, &plane(size));
            assert_eq!(found, smooth, "{size}, {level:?}");
            columns.even_out(&found, &plane(size), &cue, &mut out);
            assert_eq!(out, expected, "{size}, {level:?}");
        }
    }
}

#[test]
fn what_ends_below_something_farther_gains_and_a_wall_does_not() {
    let size = Size::new(120, 60);
    let plane = plane(size);
    // A wall at the left up to the upper edge, and a hedge of the same depth at the right.
    let mut disparity = Image::from_fn(size, |x, y| {
        let ground = plane.disparity(4.0 * x as f32 + 1.5, 4.0 * y as f32 + 1.5);
        let stands = if x < 60 || y >= 22 { 14.0_f32 } else { 2.0 };
        ground.max(stands)
    });
    let mut columns = Columns::new(simd::detect());
    columns.find(&mut disparity, &plane);
    let cue = Image::filled(size, 0.4);
    let mut out = Image::new(size);
    columns.even_out(&disparity, &plane, &cue, &mut out);
    let (wall, hedge): (f32, f32) = (out.get(30, 26), out.get(90, 26));
    assert!((wall - 0.4).abs() < 1e-5 && (hedge - 0.6).abs() < 1e-5, "{wall} {hedge}");
}

#[test]
fn only_what_is_as_deep_is_averaged() {
    for size in sizes() {
        let disparity = disparity(size, 34);
        let map = Noise(35).map(size);
        let expected = plain::beside(&disparity, &map);
        let mut first: Option<Image<f32>> = None;
        for level in simd::available() {
            let mut out = map.clone();
            Beside::new(level).run(&disparity, &mut out);
            for (a, b) in out.pixels().iter().zip(expected.pixels()) {
                assert!((f64::from(*a) - b).abs() < 1e-6, "{size}, {level:?}: {a}, not {b}");
            }
            assert_eq!(first.get_or_insert_with(|| out.clone()), &out, "{size}, {level:?}");
        }
    }
}

#[test]
fn lateral_contrast_is_the_drop_to_both_sides() {
    for size in sizes() {
        let disparity = disparity(size, 36);
        let expected = plain::lateral(&disparity, 2.0, 0.9);
        let mut first: Option<Image<f32>> = None;
        for level in simd::available() {
            let mut out = Image::default();
            Lateral::new(level).run(&disparity, 2.0, 0.9, &mut out);
            for (a, b) in out.pixels().iter().zip(expected.pixels()) {
                assert!((f64::from(*a) - b).abs() < 1e-5, "{size}, {level:?}: {a}, not {b}");
            }
            assert_eq!(first.get_or_insert_with(|| out.clone()), &out, "{size}, {level:?}");
        }
    }
}

#[test]
fn a_house_is_structure_and_a_car_before_it_is_not() {
    let size = Size::new(120, 60);
    let plane = plane(size);
    let disparity = Image::from_fn(size, |x, y| {
        let ground = plane.disparity(4.0 * x as f32 + 1.5, 4.0 * y as f32 + 1.5);
        let house = if x < 80 { 12.0 } else { 0.0 };
        let car = if (30..50).contains(&x) && y >= 22 { 20.0 } else { 0.0_f32 };
        ground.max(house).max(car)
    });
    let mut out = Image::default();
    Structure::new(simd::detect()).run(&disparity, &plane, &mut out);
    assert_eq!((out.get(15, 24), out.get(40, 10)), (1.0, 1.0));
    assert_eq!((out.get(40, 24), out.get(15, 55)), (0.0, 0.0));
}
