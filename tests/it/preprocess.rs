//! Preprocessing against plain references, on odd sizes.

use std::sync::Arc;

use nalgebra::{Rotation3, Vector2};
use salient_stereo::camera::{Camera, Distortion, StereoRig};
use salient_stereo::config::{Config, Denoise, Illumination};
use salient_stereo::image::{Image, Picture, Size};
use salient_stereo::perception::{Perception, StereoFrame, View};
use salient_stereo::simd::{self, Level};
use salient_stereo::stage::preprocess::Preprocess;
use salient_stereo::stage::preprocess::denoise::{gaussian3, median3};
use salient_stereo::stage::preprocess::gradient::gradient;
use salient_stereo::stage::preprocess::illumination::{Clahe, match_contrast};
use salient_stereo::stage::preprocess::luma::luma;
use salient_stereo::stage::preprocess::rectify::RectifyMap;
use salient_stereo::stage::preprocess::resize::box_mean;
use salient_stereo::stamp::Stamp;

use super::reference::preprocess as plain;
use super::reference::{Noise, ODD_SIZES};

fn lens(size: Size) -> Camera {
    let (w, h) = (size.width as f64, size.height as f64);
    let f = 0.8 * w.max(h);
    let mut camera = Camera::pinhole(size, f, 0.52 * w - 0.3, 0.47 * h, 0.0);
    camera.k[(0, 0)] *= 0.93;
    camera.k[(1, 1)] *= 0.95;
    camera.distortion = Distortion::Polynomial([
        -0.28, 0.07, 0.001, -0.0007, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    ]);
    camera.r = *Rotation3::from_euler_angles(0.01, -0.02, 0.015).matrix();
    camera
}

fn rig(size: Size) -> Arc<StereoRig> {
    let left = lens(size);
    let mut right = lens(size);
    right.distortion = Distortion::Polynomial([
        -0.25, 0.05, -0.0005, 0.0003, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    ]);
    right.p[(0, 3)] = -0.12 * left.p[(0, 0)];
    Arc::new(StereoRig::new(left, right, 0.0).unwrap())
}

fn frame(left: Picture, right: Picture, rig: &Arc<StereoRig>) -> StereoFrame {
    StereoFrame {
        stamp: Stamp::default(),
        right_stamp: Stamp::default(),
        frame_id: Arc::from("left"),
        left,
        right,
        rig: Arc::clone(rig),
    }
}

/// Every size at every SIMD level.
fn cases() -> impl Iterator<Item = (Size, Level)> {
    let sizes = ODD_SIZES.into_iter().chain([Size::new(519, 9), Size::new(256, 4)]);
    sizes.flat_map(|size| simd::available().into_iter().map(move |level| (size, level)))
}

#[test]
fn luma_is_the_weighted_sum_of_bt_601() {
    let rgb = Noise(1).rgb(Size::new(33, 17));
    let mut gray = Image::default();
    luma(simd::detect(), &rgb, &mut gray);
    for (&[r, g, b], &y) in rgb.pixels().iter().zip(gray.pixels()) {
        let exact = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
        assert!((f64::from(y) - exact).abs() <= 0.9, "{r} {g} {b}: {y}, not {exact}");
    }
    for value in [0, 1, 128, 255] {
        luma(simd::detect(), &Image::filled(Size::new(3, 1), [value; 3]), &mut gray);
        assert_eq!(gray.pixels(), [value; 3]);
    }
}

#[test]
fn gradient_equals_its_definition() {
    for (size, level) in cases() {
        let gray = Noise(2).gray(size);
        let mut out = Image::default();
        gradient(level, &gray, &mut out);
        assert_eq!(out, plain::gradient(&gray), "{size}");
    }
}

#[test]
fn noise_filters_equal_their_definitions() {
    for (size, level) in cases() {
        let (gray, rgb) = (Noise(3).gray(size), Noise(4).rgb(size));
        let mut out = Image::new(size);
        median3::<1>(level, gray.pixels(), size.width, out.pixels_mut());
        assert_eq!(out, plain::median3(&gray), "median, {size}");
        gaussian3::<1>(level, gray.pixels(), size.width, out.pixels_mut());
        assert_eq!(out, plain::gaussian3(&gray), "gaussian, {size}");
        let mut colors = Image::new(size);
        let (bytes, width) = (rgb.pixels().as_flattened(), size.width);
        median3::<3>(level, bytes, width, colors.pixels_mut().as_flattened_mut());
        for c in 0..3 {
            let expected = plain::median3(&plain::channel(&rgb, c));
            assert_eq!(plain::channel(&colors, c), expected, "median of {c}, {size}");
        }
        gaussian3::<3>(level, bytes, width, colors.pixels_mut().as_flattened_mut());
        for c in 0..3 {
            let expected = plain::gaussian3(&plain::channel(&rgb, c));
            assert_eq!(plain::channel(&colors, c), expected, "gaussian of {c}, {size}");
        }
    }
}

#[test]
fn area_resize_equals_the_mean_of_its_pixels() {
    for (size, level) in cases() {
        let rgb = Noise(5).rgb(size);
        let up = size.divided_by(4);
        let down = Size::new((size.width / 2).max(1), (size.height / 2).max(1));
        let (mut quarter, mut half) = (Image::new(up), Image::new(down));
        let bytes = rgb.pixels().as_flattened();
        let out: &mut Image<[u8; 3]> = &mut quarter;
        box_mean::<3, 4>(level, bytes, size.width, out.pixels_mut().as_flattened_mut(), up.width);
        for c in 0..3 {
            let expected = plain::box_mean(&plain::channel(&rgb, c), 4, up);
            assert_eq!(plain::channel(&quarter, c), expected, "{c}, {size}");
        }
        let gray = plain::channel(&rgb, 1);
        let mut quarter = Image::new(up);
        box_mean::<1, 4>(level, gray.pixels(), size.width, quarter.pixels_mut(), up.width);
        assert_eq!(quarter, plain::box_mean(&gray, 4, up), "gray, {size}");
        box_mean::<1, 2>(level, gray.pixels(), size.width, half.pixels_mut(), down.width);
        assert_eq!(half, plain::box_mean(&gray, 2, down), "{size}");
    }
}

#[test]
fn rectification_samples_where_the_camera_model_points() {
    for size in ODD_SIZES {
        let camera = lens(size);
        let map = RectifyMap::new(&camera);
        let raw = Noise(6).gray(size);
        let mut out = Image::filled(size, 77);
        map.apply::<1>(raw.pixels(), out.pixels_mut());
        for (at, &value) in plain::raw_positions(&camera).into_iter().zip(out.pixels()) {
            // The map has steps of 1/32 px; on such a place the value is exact.
            let step = Vector2::new((at.x * 32.0).round() / 32.0, (at.y * 32.0).round() / 32.0);
            let expected = plain::bilinear(&raw, step).map_or(0.0, |v| (v + 0.5).floor());
            assert_eq!(f64::from(value), expected, "{size}: raw pixel {at}");
        }
    }
}

#[test]
fn rectification_of_a_smooth_image_is_exact_to_a_gray_level() {
    let size = Size::new(131, 45);
    let camera = lens(size);
    let raw = Image::from_fn(size, |x, y| (20 + x + 2 * y) as u8);
    let colors = Image::from_fn(size, |x, y| [raw.get(x, y), 9, 255 - raw.get(x, y)]);
    let map = RectifyMap::new(&camera);
    let mut out = Image::filled(size, [1_u8; 3]);
    map.apply::<3>(colors.pixels().as_flattened(), out.pixels_mut().as_flattened_mut());
    let mut seen = 0;
    for (at, &[r, g, b]) in plain::raw_positions(&camera).into_iter().zip(out.pixels()) {
        // Within half a step of the edge either answer is right.
        let Some(exact) = plain::bilinear(&raw, at).filter(|_| g != 0) else { continue };
        seen += 1;
        assert!((f64::from(r) - exact).abs() <= 0.6, "{at}: {r}, not {exact}");
        assert!((255.0 - f64::from(b) - exact).abs() <= 0.6 && g == 9);
    }
    assert!(seen > size.area() / 2, "only {seen} pixels inside");
}

#[test]
fn an_ideal_camera_rectifies_to_the_same_image() {
    for size in ODD_SIZES {
        let raw = Noise(7).gray(size);
        let mut out = Image::new(size);
        RectifyMap::new(&Camera::pinhole(size, 50.0, 3.0, 2.0, 0.0))
            .apply::<1>(raw.pixels(), out.pixels_mut());
        assert_eq!(out, raw, "{size}");
    }
}

#[test]
fn a_camera_that_looks_backwards_shows_nothing() {
    let size = Size::new(9, 5);
    let mut camera = Camera::pinhole(size, 50.0, 4.0, 2.0, 0.0);
    camera.r = *Rotation3::from_euler_angles(0.0, std::f64::consts::PI, 0.0).matrix();
    let mut out = Image::filled(size, 5);
    RectifyMap::new(&camera).apply::<1>(&[200; 45], out.pixels_mut());
    assert_eq!(out, Image::filled(size, 0));
}

#[test]
fn equalisation_equals_its_definition() {
    for size in ODD_SIZES {
        let gray = Image::from_fn(size, |x, y| (90 + (x * 7 + y * y) % 40) as u8);
        let mut out = gray.clone();
        Clahe::default().run(&mut out);
        for (&a, &b) in out.pixels().iter().zip(plain::clahe(&gray).pixels()) {
            // Interpolation weights are in 1/256.
            assert!(a.abs_diff(b) <= 1, "{size}: {a}, not {b}");
        }
    }
}

#[test]
fn matching_gives_the_right_view_mean_and_contrast_of_the_left() {
    let left = Image::from_fn(Size::new(64, 48), |x, y| (60 + (x * 5 + y * 11) % 100) as u8);
    let darker = Image::from_fn(left.size(), |x, y| (f32::from(left.get(x, y)) * 0.7) as u8);
    let mut right = darker.clone();
    match_contrast(&left, &mut right);
    for (&a, &b) in left.pixels().iter().zip(right.pixels()) {
        assert!(a.abs_diff(b) <= 2, "{a} and {b}");
    }
    let mut flat = Image::filled(left.size(), 10);
    match_contrast(&left, &mut flat);
    assert!(flat.pixels().iter().all(|&v| v.abs_diff(109) <= 2), "{}", flat.get(0, 0));
}

#[test]
fn both_views_take_the_same_way() {
    let size = Size::new(67, 41);
    let rgb = Noise(8).rgb(size);
    let camera = lens(size);
    let mut other = camera.clone();
    other.p[(0, 3)] = -0.1 * camera.p[(0, 0)];
    let rig = Arc::new(StereoRig::new(camera, other, 0.0).unwrap());
    for rectify in [false, true] {
        for scale in [1, 2, 4] {
            for denoise in [Denoise::None, Denoise::Median3, Denoise::Gaussian3] {
                for illumination in [Illumination::None, Illumination::Clahe, Illumination::Match] {
                    let mut config = Config { rectify, ..Config::default() };
                    config.preprocess.scale = scale;
                    config.preprocess.denoise = denoise;
                    config.preprocess.illumination = illumination;
                    let mut stage = Preprocess::new(&config, size, simd::detect());
                    let wanted = Size::new(67 / scale as usize, 41 / scale as usize);
                    assert_eq!(stage.output_size(), wanted);
                    let mut out = Perception::new(wanted, Arc::clone(&rig));
                    let mut right = View::default();
                    let picture = Picture::Rgb(rgb.clone());
                    stage.run(&frame(picture.clone(), picture, &rig), &mut out, &mut right);
                    assert_eq!(out.left.gray, right.gray, "{config:?}");
                    assert_eq!(out.left.gradient, plain::gradient(&out.left.gray));
                    assert_eq!(right.gradient, out.left.gradient);
                    assert_eq!(out.left.rgb.size(), wanted);
                    assert_eq!(out.left.gray.size(), wanted);
                    assert_eq!(right.rgb.size(), Size::default());
                }
            }
        }
    }
}

#[test]
fn a_gray_picture_gives_equal_channels() {
    let size = Size::new(33, 17);
    let gray = Noise(9).gray(size);
    let rig = rig(size);
    let mut stage = Preprocess::new(&Config::default(), size, simd::detect());
    let mut out = Perception::new(size, Arc::clone(&rig));
    let mut right = View::default();
    let picture = Picture::Gray(gray.clone());
    stage.run(&frame(picture.clone(), picture, &rig), &mut out, &mut right);
    assert_eq!(out.left.gray, gray);
    assert_eq!(out.left.rgb, Image::from_fn(size, |x, y| [gray.get(x, y); 3]));
    assert!(Arc::ptr_eq(&out.rig, &rig));
}

#[test]
fn the_scaled_rig_is_made_once_per_calibration() {
    let size = Size::new(64, 32);
    let mut config = Config { rectify: true, ..Config::default() };
    config.preprocess.scale = 2;
    let mut stage = Preprocess::new(&config, size, simd::detect());
    let first = rig(size);
    let mut out = Perception::new(stage.output_size(), Arc::clone(&first));
    let mut right = View::default();
    let picture = Picture::Gray(Noise(10).gray(size));
    let mut run = |rig: &Arc<StereoRig>| {
        stage.run(&frame(picture.clone(), picture.clone(), rig), &mut out, &mut right);
        (Arc::clone(&out.rig), out.left.gray.clone())
    };
    let (scaled, before) = run(&first);
    assert_eq!(*scaled, first.divided_by(2));
    let (same, _) = run(&Arc::new(StereoRig::clone(&first)));
    assert!(Arc::ptr_eq(&scaled, &same), "an equal calibration made a new rig");
    let mut moved = StereoRig::clone(&first);
    moved.left.k[(0, 2)] += 3.0;
    let (other, after) = run(&Arc::new(moved));
    assert!(*other != *scaled && before != after, "a new calibration was not noticed");
}
