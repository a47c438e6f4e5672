//! The region of interest against plain references, on odd sizes.

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::{Config, SaliencyMode, ThresholdMode};
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::RoiMask;
use salient_stereo::simd;
use salient_stereo::stage::coarse::CoarseDisparity;
use salient_stereo::stage::roi::Roi;
use salient_stereo::stage::roi::bits::BitMask;
use salient_stereo::stage::roi::cells::{Components, count_cells, retain_cells};
use salient_stereo::stage::roi::morphology::Morphology;
use salient_stereo::stage::roi::threshold::otsu;
use salient_stereo::stage::saliency::upsample;

use super::reference::roi::{self as plain, Mask, bits};
use super::reference::{Noise, ODD_SIZES};

/// A mask of blobs and specks.
fn blobs(size: Size, seed: u64) -> Mask {
    let mut noise = Noise(seed);
    let specks = Image::from_fn(size, |_, _| noise.next().is_multiple_of(23));
    let grown = plain::dilate(&specks, 2);
    Image::from_fn(size, |x, y| grown.get(x, y) != noise.next().is_multiple_of(31))
}

fn flags(bits: &BitMask) -> Mask {
    let mut bytes = Image::default();
    bits.write(simd::detect(), &mut bytes);
    for level in simd::available() {
        assert_eq!(bits.count(level), set_pixels(&bytes));
    }
    assert!(bytes.pixels().iter().all(|&v| v == 0 || v == 255));
    of(&bytes)
}

fn set_pixels(bytes: &Image<u8>) -> usize {
    of(bytes).pixels().iter().filter(|&&set| set).count()
}

fn of(bytes: &Image<u8>) -> Mask {
    Image::from_fn(bytes.size(), |x, y| bytes.get(x, y) == 255)
}

fn share(mask: &Mask) -> f32 {
    mask.pixels().iter().filter(|&&set| set).count() as f32 / mask.size().area() as f32
}

#[test]
fn a_mask_of_bits_holds_what_was_put_in() {
    for size in ODD_SIZES {
        let map = Noise(1).map(size);
        let mut bits = BitMask::default();
        for level in simd::available() {
            bits.set_from(level, &map, 0.3);
            assert_eq!(flags(&bits), Image::from_fn(size, |x, y| map.get(x, y) >= 0.3), "{size}");
        }
        let nothing = Image::filled(size, f32::NAN);
        bits.set_from(simd::detect(), &nothing, 0.0);
        assert_eq!(bits.count(simd::detect()), 0, "NaN is not salient");
    }
}

#[test]
fn a_mask_of_cells_is_that_of_their_pixels() {
    let sizes = [1, 2, 61, 64, 67, 72, 131, 331].map(|width| Size::new(width, 23));
    for size in ODD_SIZES.into_iter().chain(sizes) {
        let noise = Noise(1).map(size.divided_by(4));
        // Wide plains, where all pixels of many cells are alike.
        let waves = Image::from_fn(noise.size(), |x, y| {
            let wave = (0.11 * x as f32).sin() * (0.9 * y as f32).cos();
            (0.5 + 2.0 * wave).clamp(0.0, 1.0)
        });
        let (mut map, mut expected, mut bits) =
            (Image::default(), BitMask::default(), BitMask::default());
        for cells in [noise, waves] {
            upsample(simd::detect(), &cells, size, &mut map);
            for threshold in [0.0, 0.3, 0.8, 0.97] {
                expected.set_from(simd::detect(), &map, threshold);
                for level in simd::available() {
                    bits.set_from_cells(level, &cells, size, threshold);
                    assert_eq!(bits, expected, "{size}, {threshold}, {level:?}");
                }
            }
        }
    }
}

#[test]
fn morphology_equals_its_definition() {
    // Rows of more than 512 pixels are worked on in strips of as many.
    let wide = [513, 577, 1090].map(|width| Size::new(width, 9));
    for size in ODD_SIZES.into_iter().chain(wide) {
        let mask = blobs(size, 2);
        for radius in [0, 1, 2, 3, 7, 33, 64, 150] {
            let (dilated, eroded) = (plain::dilate(&mask, radius), plain::erode(&mask, radius));
            let (opened, closed) = (plain::dilate(&eroded, radius), plain::erode(&dilated, radius));
            for level in simd::available() {
                let mut morphology = Morphology::new(level);
                let mut change = |f: &dyn Fn(&mut Morphology, &mut BitMask)| {
                    let mut bits = bits(&mask);
                    f(&mut morphology, &mut bits);
                    flags(&bits)
                };
                let what = format!("{size}, {radius}, {level:?}");
                assert_eq!(change(&|m, b| m.dilate(b, radius)), dilated, "{what}");
                assert_eq!(change(&|m, b| m.erode(b, radius)), eroded, "{what}");
                assert_eq!(change(&|m, b| m.open(b, radius)), opened, "{what}");
                assert_eq!(change(&|m, b| m.close(b, radius)), closed, "{what}");
                let mut out = bits(&Image::filled(Size::new(40, 9), true));
                morphology.dilate_into(&bits(&mask), radius, &mut out);
                assert_eq!(flags(&out), dilated, "{what}");
            }
        }
    }
}

#[test]
fn cells_are_counted_and_removed() {
    for size in ODD_SIZES {
        let mask = blobs(size, 3);
        let mut counts = Image::default();
        count_cells(&bits(&mask), &mut counts);
        assert_eq!(counts, plain::counts(&mask), "{size}");
        let kept = |x: usize, y: usize| (x * 7 + y * 3) % 5 < 3;
        let mut left = bits(&mask);
        retain_cells(&mut left, kept);
        let expected = Image::from_fn(size, |x, y| mask.get(x, y) && kept(x / 4, y / 4));
        assert_eq!(flags(&left), expected, "{size}");
    }
}

#[test]
fn small_components_go_and_large_ones_stay() {
    let mut stage = Components::default();
    for (size, seed) in ODD_SIZES.into_iter().zip(0..) {
        let noise = blobs(size, seed);
        // Sparse enough to fall apart into components.
        let mask = Image::from_fn(size, |x, y| noise.get(x, y) && x / 4 % 3 != y / 8 % 3);
        for least in [1, 2, 9, 40, 1000] {
            let mut left = bits(&mask);
            stage.remove_small(&mut left, least);
            assert_eq!(flags(&left), plain::without_small(&mask, least), "{size}, {least}");
        }
    }
}

#[test]
fn otsu_finds_the_best_of_all_cuts() {
    for seed in 0..20 {
        let mut noise = Noise(seed);
        let bright = noise.unit();
        let map = Image::from_fn(Size::new(37, 11), |x, y| {
            let base = if x > 20 && y > 4 { bright } else { 0.2 };
            0.7 * base + 0.29 * noise.unit()
        });
        let (found, best) = (plain::cut_variance(&map, otsu(&map)), plain::best_cut(&map));
        assert!((found - best).abs() <= 1e-9 * best, "{found}, not {best}");
    }
    assert_eq!(otsu(&Image::filled(Size::new(9, 4), 0.0)), f32::INFINITY);
    assert_eq!(otsu(&Image::filled(Size::new(9, 4), 1.0)), f32::INFINITY);
}

const SIZE: Size = Size::new(131, 77);

fn rig(cx_right: f64) -> StereoRig {
    StereoRig::new(
        Camera::pinhole(SIZE, 100.0, 60.0, 40.0, 0.0),
        Camera::pinhole(SIZE, 100.0, cx_right, 40.0, -50.0),
        0.0,
    )
    .unwrap()
}

fn unknown() -> CoarseDisparity {
    let cells = SIZE.divided_by(4);
    CoarseDisparity { checked: Image::filled(cells, f32::NAN), filled: Image::new(cells) }
}

/// Cells with two salient blobs, the right one stronger.
fn attention() -> Image<f32> {
    Image::from_fn(SIZE.divided_by(4), |x, y| match (x, y) {
        (4..=9, 5..=12) => 0.7,
        (20..=27, 4..=10) => 0.95,
        (15, 16) => 0.9,
        _ => 0.1,
    })
}

fn run(config: &Config, coarse: &CoarseDisparity, rig: &StereoRig) -> RoiMask {
    let mut out = RoiMask::default();
    Roi::new(config, SIZE, simd::detect()).run(&attention(), coarse, rig, &mut out);
    assert_eq!((out.salient.size(), out.matched.size()), (SIZE, SIZE));
    assert!((out.fraction - share(&of(&out.matched))).abs() < 1e-6);
    out
}

#[test]
fn the_region_is_the_composition_of_its_steps() {
    let mut config = Config::default();
    for (mode, dilation) in [(ThresholdMode::Fixed, 7), (ThresholdMode::Otsu, 5)] {
        config.saliency.threshold_mode = mode;
        config.roi.dilation = dilation;
        let mut saliency = Image::default();
        upsample(simd::detect(), &attention(), SIZE, &mut saliency);
        let threshold = match mode {
            ThresholdMode::Fixed => 0.55,
            ThresholdMode::Otsu => otsu(&attention()),
        };
        let cut = Image::from_fn(SIZE, |x, y| saliency.get(x, y) >= threshold);
        let opened = plain::dilate(&plain::erode(&cut, 1), 1);
        let closed = plain::erode(&plain::dilate(&opened, 2), 2);
        let salient = plain::without_small(&closed, 150);
        let out = run(&config, &unknown(), &rig(60.0));
        assert_eq!(of(&out.salient), salient);
        assert_eq!(of(&out.matched), plain::dilate(&salient, dilation as usize));
        assert!(out.salient.get(95, 30) == 255 && out.salient.get(62, 66) == 0);
    }
}

#[test]
fn depth_outside_the_limits_is_not_of_interest() {
    // f B = 50: the left blob at 5 px is 10 m away, the right one at 25 px 2 m.
    let coarse = CoarseDisparity {
        checked: Image::from_fn(SIZE.divided_by(4), |x, _| if x < 12 { 5.0 } else { 25.0 }),
        ..unknown()
    };
    let sees = |min: f64, max: f64, cx_right: f64| {
        let mut config = Config::default();
        (config.depth.min, config.depth.max) = (min, max);
        let out = run(&config, &coarse, &rig(cx_right));
        (out.salient.get(27, 34) == 255, out.salient.get(95, 30) == 255)
    };
    assert_eq!(sees(0.1, 80.0, 60.0), (true, true));
    assert_eq!(sees(0.1, 4.0, 60.0), (false, true));
    assert_eq!(sees(4.0, 80.0, 60.0), (true, false));
    // Principal points 4 px apart: 1 px is 50 m, 21 px is 2.4 m.
    assert_eq!(sees(0.1, 15.0, 56.0), (false, true));
    assert_eq!(sees(0.1, 80.0, 56.0), (true, true));
}

#[test]
fn the_budget_keeps_the_most_salient_tiles() {
    let mut config = Config::default();
    let whole = run(&config, &unknown(), &rig(60.0));
    for limit in [0.02, 0.1, 0.2] {
        config.roi.max_fraction = limit;
        let out = run(&config, &unknown(), &rig(60.0));
        assert!(out.fraction <= limit as f32, "{} of {limit}", out.fraction);
        let wanted = whole.fraction.min(limit as f32);
        assert!(wanted - out.fraction <= 256.0 / SIZE.area() as f32, "room for one more tile");
        // What is kept is unchanged, and tiles are kept or dropped as a whole.
        let mut kept = Vec::new();
        let mut dropped = Vec::new();
        for ty in 0..SIZE.height.div_ceil(16) {
            for tx in 0..SIZE.width.div_ceil(16) {
                let mut tile = (0, 0, 0.0);
                for y in 16 * ty..(16 * ty + 16).min(SIZE.height) {
                    for x in 16 * tx..(16 * tx + 16).min(SIZE.width) {
                        let set = whole.matched.get(x, y) == 255;
                        tile.0 += usize::from(set);
                        tile.1 += usize::from(out.matched.get(x, y) == 255);
                        tile.2 += f32::from(u8::from(set)) * attention().get(x / 4, y / 4);
                        assert!(out.matched.get(x, y) <= whole.matched.get(x, y));
                        assert!(out.salient.get(x, y) <= out.matched.get(x, y));
                    }
                }
                let (area, left, sum) = tile;
                assert!(left == 0 || left == area, "a tile was cut");
                if area > 0 {
                    let mean = sum / area as f32;
                    if left > 0 { &mut kept } else { &mut dropped }.push((mean, area));
                }
            }
        }
        // A dropped tile is no better than any kept one, or did not fit.
        let spare = (limit * SIZE.area() as f64) as usize - set_pixels(&out.matched);
        let worst = kept.iter().map(|t| t.0).fold(f32::INFINITY, f32::min);
        for (mean, area) in dropped {
            assert!(mean <= worst + 1.0 / 256.0 || area > spare, "{mean} was dropped for {worst}");
        }
    }
}

#[test]
fn full_frame_is_everything() {
    let mut config = Config::default();
    config.saliency.mode = SaliencyMode::FullFrame;
    config.roi.max_fraction = 0.1;
    let out = run(&config, &unknown(), &rig(60.0));
    assert!(out.salient.pixels().iter().chain(out.matched.pixels()).all(|&v| v == 255));
    assert_eq!(out.fraction, 1.0);
}

#[test]
fn a_centred_rectangle_has_its_share_and_the_aspect_of_the_image() {
    for fraction in [0.0, 0.25, 0.5, 1.0] {
        let mut roi = Roi::new(&Config::default(), SIZE, simd::detect());
        roi.set_centred_rectangle(fraction);
        let mut out = RoiMask::default();
        roi.run(&attention(), &unknown(), &rig(60.0), &mut out);
        let salient = of(&out.salient);
        assert!((share(&salient) - fraction).abs() < 0.01, "{} of {fraction}", share(&salient));
        assert_eq!(of(&out.matched), plain::dilate(&salient, 7));
        let columns = (0..SIZE.width).filter(|&x| salient.get(x, SIZE.height / 2)).count();
        let rows = (0..SIZE.height).filter(|&y| salient.get(SIZE.width / 2, y)).count();
        if fraction > 0.0 {
            let aspect = columns as f64 / rows as f64 / (131.0 / 77.0);
            assert!((aspect - 1.0).abs() < 0.03, "{columns}x{rows}");
        }
    }
}

#[test]
fn a_single_pixel_is_a_frame_too() {
    let size = Size::new(1, 1);
    let cell = Image::filled(size, 1.0);
    let coarse = CoarseDisparity { checked: cell.clone(), filled: cell.clone() };
    let mut config = Config::default();
    config.regions.min_area = 1;
    let mut out = RoiMask::default();
    Roi::new(&config, size, simd::detect()).run(&cell, &coarse, &rig(60.0), &mut out);
    assert_eq!((out.salient.pixels(), out.fraction), (&[255][..], 1.0));
}
