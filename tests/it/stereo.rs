//! The matcher against its plain reference, at every instruction set.

use std::ops::Range;

use proptest::prelude::*;
use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::{Config, Fill};
use salient_stereo::image::{Image, Size};
use salient_stereo::perception::{RoiMask, View};
use salient_stereo::simd::{self, Level};
use salient_stereo::stage::coarse::{CELL, Coarse, CoarseDisparity, shrink};
use salient_stereo::stage::refine::Refine;
use salient_stereo::stage::stereo::block::Measure;
use salient_stereo::stage::stereo::cost::{Edges, Penalties};
use salient_stereo::stage::stereo::engine::{Engine, Method, Settings, Views};
use salient_stereo::stage::stereo::plan::{LEAST, Plan};
use salient_stereo::stage::stereo::{Matches, NO_MATCH, Stereo};

use super::reference::{Noise, ODD_SIZES, stereo as plain};

const METHODS: [Method; 5] = [
    Method::EightPaths,
    Method::FivePaths,
    Method::FourPaths,
    Method::Block(Measure::Census),
    Method::Block(Measure::Absolute),
];

/// A textured pair: the right view is the left one moved by a disparity that
/// changes from patch to patch.
fn pair(size: Size, seed: u64) -> (Image<u8>, Image<u8>) {
    let mut noise = Noise(seed);
    let left = Image::from_fn(size, |_, _| (noise.next() >> 56) as u8);
    let patches: Vec<usize> = (0..64).map(|_| (noise.next() % 12) as usize).collect();
    let right = Image::from_fn(size, |x, y| {
        let d = patches[(x / 9 + 7 * (y / 11)) % 64];
        left.get((x + d).min(size.width - 1), y)
    });
    (left, right)
}

fn coarse_of(size: Size, seed: u64) -> Image<f32> {
    let mut noise = Noise(seed);
    Image::from_fn(size.divided_by(CELL), |_, _| {
        if noise.next().is_multiple_of(4) { f32::NAN } else { (noise.next() % 14) as f32 }
    })
}

fn settings(method: Method, search: Range<usize>) -> Settings {
    Settings {
        penalties: Penalties { p1: 7, p2: 40, edges: Edges::Sharp },
        method,
        context: 3,
        search,
    }
}

fn assert_same(found: &Matches, expected: &Matches, what: &str) {
    for y in 0..expected.left.height() {
        assert_eq!(found.left.row(y), expected.left.row(y), "left row {y}: {what}");
        assert_eq!(found.right.row(y), expected.right.row(y), "right row {y}: {what}");
        assert_eq!(found.evidence.row(y), expected.evidence.row(y), "evidence row {y}: {what}");
    }
}

fn compare(views: &Views<'_>, plan: &Plan, settings: &Settings, levels: &[Level]) {
    let expected = plain::matches(views, plan, settings);
    for &level in levels {
        let mut found = Matches::default();
        Engine::new(settings.clone(), level).run(views, plan, &mut found);
        assert_same(&found, &expected, &format!("{level:?} {settings:?}"));
    }
}

#[test]
fn every_method_equals_its_reference_at_every_level_and_odd_size() {
    let levels = simd::available();
    for (i, size) in ODD_SIZES.into_iter().enumerate() {
        let (left, right) = pair(size, i as u64);
        let coarse = coarse_of(size, 99 + i as u64);
        let mut noise = Noise(5);
        let weight = Image::from_fn(size, |_, _| 100 + (noise.next() % 156) as u8);
        for method in METHODS {
            let settings = settings(method, 2..18);
            let mut plan = Plan::default();
            plan.whole(size, &settings.search);
            let views =
                Views { left: &left, right: &right, mask: None, coarse: None, weight: None };
            compare(&views, &plan, &settings, &levels);
            let views = Views { coarse: Some(&coarse), weight: Some(&weight), ..views };
            compare(&views, &plan, &settings, &levels);
        }
    }
}

#[test]
fn ranges_beyond_a_byte_equal_the_reference() {
    let size = Size::new(40, 6);
    let (left, right) = pair(size, 3);
    let views = Views { left: &left, right: &right, mask: None, coarse: None, weight: None };
    for search in [0..300, 511..1023] {
        let settings = settings(Method::EightPaths, search);
        let mut plan = Plan::default();
        plan.whole(size, &settings.search);
        compare(&views, &plan, &settings, &[simd::detect()]);
    }
}

#[test]
fn degenerate_regions_equal_the_reference() {
    type Inside = fn(usize, usize) -> bool;

    let size = Size::new(131, 77);
    let (left, right) = pair(size, 8);
    let coarse = coarse_of(size, 4);
    let regions: [(&str, Inside); 6] = [
        ("empty", |_, _| false),
        ("one pixel", |x, y| (x, y) == (60, 40)),
        ("last pixel", |x, y| (x, y) == (130, 76)),
        ("one row", |_, y| y == 33),
        ("one column", |x, _| x == 130),
        ("two far apart", |x, y| y > 20 && y < 30 && !(10..110).contains(&x)),
    ];
    for (name, inside) in regions {
        let mask = Image::from_fn(size, |x, y| if inside(x, y) { 255 } else { 0 });
        for method in METHODS {
            let settings = settings(method, 0..16);
            let mut plan = Plan::default();
            plan.of_mask(&mask, 0.1, Some(&coarse), &settings.search);
            let views = Views {
                left: &left,
                right: &right,
                mask: Some(&mask),
                coarse: Some(&coarse),
                weight: None,
            };
            compare(&views, &plan, &settings, &simd::available());
            let mut found = Matches::default();
            Engine::new(settings, simd::detect()).run(&views, &plan, &mut found);
            for (d, m) in found.left.pixels().iter().zip(mask.pixels()) {
                assert!(*m != 0 || *d == NO_MATCH, "{name}: a match outside the region");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn random_masks_equal_the_reference(
        width in 1_usize..150,
        height in 1_usize..80,
        seed: u64,
        rarity in 1_u64..400,
        p1 in 0_u8..=100,
        more in 0_u8..=100,
        blurred: bool,
        context in 0_usize..10,
    ) {
        let size = Size::new(width, height);
        let (left, right) = pair(size, seed);
        let coarse = coarse_of(size, seed ^ 1);
        let mut noise = Noise(seed ^ 2);
        let mask = Image::from_fn(size, |_, _| if noise.next().is_multiple_of(rarity) { 255 } else { 0 });
        let edges = if blurred { Edges::Blurred } else { Edges::Sharp };
        let settings = Settings {
            penalties: Penalties { p1, p2: p1.saturating_add(more).min(100), edges },
            context,
            ..settings(Method::EightPaths, 0..24)
        };
        let mut plan = Plan::default();
        plan.of_mask(&mask, 0.1, Some(&coarse), &settings.search);
        let views = Views {
            left: &left,
            right: &right,
            mask: Some(&mask),
            coarse: Some(&coarse),
            weight: None,
        };
        compare(&views, &plan, &settings, &[simd::detect()]);
    }

    #[test]
    fn a_plan_covers_the_mask_once_and_searches_inside_the_range(
        width in 1_usize..150,
        height in 1_usize..80,
        seed: u64,
        rarity in 1_u64..400,
        lo in 0_usize..64,
        range in 16_usize..100,
        fraction in 0.0_f32..1.0,
    ) {
        let size = Size::new(width, height);
        let search = lo..lo + range;
        let mut noise = Noise(seed);
        let mask = Image::from_fn(size, |_, _| u8::from(noise.next().is_multiple_of(rarity)));
        // Far outside the range as well.
        let coarse = Image::from_fn(size.divided_by(CELL), |_, _| {
            if noise.next().is_multiple_of(3) { f32::NAN } else { (noise.next() % 200) as f32 }
        });
        let mut plan = Plan::default();
        plan.of_mask(&mask, fraction, Some(&coarse), &search);
        let mut covered = Image::<u8>::new(size);
        for band in &plan.bands {
            for run in &plan.runs[band.runs.clone()] {
                for (k, tile) in plan.tiles[run.tiles.clone()].iter().enumerate() {
                    prop_assert!(tile.lo >= search.start && tile.lo + tile.n <= search.end);
                    prop_assert!(tile.lo >= run.lo && tile.lo + tile.n <= run.hi);
                    prop_assert!(run.lo >= band.lo && run.hi <= band.hi);
                    prop_assert!(tile.n >= LEAST, "{tile:?}");
                    let x0 = run.x0 + 32 * k;
                    for y in band.y0..band.y1 {
                        for x in x0..(x0 + 32).min(width) {
                            covered.set(x, y, covered.get(x, y) + 1);
                        }
                    }
                }
            }
        }
        for (&times, &wanted) in covered.pixels().iter().zip(mask.pixels()) {
            prop_assert!(times <= 1 && times >= wanted, "{times} tiles, {wanted} wanted");
        }
    }

    #[test]
    fn nothing_is_left_of_an_earlier_frame(seed: u64, first in 1_u64..300, second in 1_u64..300) {
        let size = Size::new(110, 70);
        let (left, right) = pair(size, seed);
        let coarse = coarse_of(size, seed ^ 1);
        // What is found by chance is kept, so that there is something to be left.
        let mut config = Config::default();
        (config.stereo.speckle_size, config.stereo.uniqueness_ratio) = (0, 0);
        let settings = settings(Method::EightPaths, 0..24);
        let mut noise = Noise(seed ^ 2);
        let mut masks = [first, second].map(|rarity| {
            Image::from_fn(size, |_, _| if noise.next().is_multiple_of(rarity) { 255 } else { 0 })
        });
        // Now and then the last one is empty but for a corner, or for a part of a first
        // one that is full.
        if seed.is_multiple_of(3) {
            masks[1] = Image::from_fn(size, |x, y| if x > 90 && y > 60 { 255 } else { 0 });
        } else if seed % 3 == 1 {
            let inside = |x: usize, y: usize| (30..80).contains(&x) && (20..50).contains(&y);
            masks[0].fill(255);
            masks[1] = Image::from_fn(size, |x, y| if inside(x, y) { 255 } else { 0 });
        }
        let frame = |engine: &mut Engine, refine: &mut Refine, mask: &Image<u8>| {
            let mut plan = Plan::default();
            plan.of_mask(mask, 0.1, Some(&coarse), &settings.search);
            let views = Views {
                left: &left,
                right: &right,
                mask: Some(mask),
                coarse: Some(&coarse),
                weight: None,
            };
            let mut matches = Matches::default();
            engine.run(&views, &plan, &mut matches);
            let roi = RoiMask { salient: mask.clone(), matched: mask.clone(), fraction: 0.1 };
            let (mut disparity, mut confidence) = (Image::default(), Image::default());
            refine.run(&matches, &left, &roi, &rig(size), &mut disparity, &mut confidence);
            let disparity: Vec<_> = disparity.pixels().iter().map(|d| d.to_bits()).collect();
            (matches, disparity, confidence)
        };
        let new = || {
            let engine = Engine::new(settings.clone(), simd::detect());
            (engine, Refine::new(&config, size))
        };
        let (mut engine, mut refine) = new();
        let (_, before, _) = frame(&mut engine, &mut refine, &masks[0]);
        let known = before.iter().any(|d| !f32::from_bits(*d).is_nan());
        prop_assert!(known || masks[0].pixels().contains(&0), "nothing was found at first");
        let (matches, disparity, confidence) = frame(&mut engine, &mut refine, &masks[1]);
        let (mut engine, mut refine) = new();
        let (expected, fresh, trusted) = frame(&mut engine, &mut refine, &masks[1]);
        assert_same(&matches, &expected, "after another frame");
        prop_assert_eq!(disparity, fresh);
        prop_assert_eq!(confidence.pixels(), trusted.pixels());
    }

    #[test]
    fn refinement_equals_its_reference(
        width in 1_usize..90,
        height in 1_usize..50,
        seed: u64,
        speckle_size in 0_i64..40,
        max_difference in -1_i64..3,
        uniqueness_ratio in 0_i64..60,
        fill: bool,
    ) {
        let size = Size::new(width, height);
        let matches = random_matches(size, seed);
        let mut noise = Noise(seed ^ 7);
        let (x0, y0) = (noise.next() as usize % width, noise.next() as usize % height);
        let matched = Image::from_fn(size, |x, y| {
            if x >= x0 && y >= y0 && x % 31 != 7 { 255 } else { 0 }
        });
        let mut matches = matches;
        for (d, &m) in matches.left.pixels_mut().iter_mut().zip(matched.pixels()) {
            if m == 0 {
                *d = NO_MATCH;
            }
        }
        // Flat, with steps of all sizes.
        let gray = Image::from_fn(size, |_, _| 100 + [0, 3, 20, 80][noise.next() as usize % 4]);
        let mut config = Config::default();
        config.stereo.speckle_size = speckle_size;
        config.stereo.disp12_max_diff = max_difference;
        config.stereo.uniqueness_ratio = uniqueness_ratio;
        if fill {
            config.stereo.fill = Fill::Roi;
        } else {
            config.min_confidence = 0.9;
        }
        let (expected, trusted) = plain::refined(&matches, &gray, &matched, &config);
        for level in simd::available() {
            let mut refine = Refine::with_level(&config, size, level);
            let roi = RoiMask { salient: matched.clone(), matched: matched.clone(), fraction: 0.5 };
            let (mut disparity, mut confidence) = (Image::default(), Image::default());
            refine.run(&matches, &gray, &roi, &rig(size), &mut disparity, &mut confidence);
            prop_assert_eq!(confidence.pixels(), trusted.pixels());
            for (d, e) in disparity.pixels().iter().zip(expected.pixels()) {
                // The rig's principal points are 2 px apart.
                prop_assert!(*d == *e - 2.0 || (d.is_nan() && e.is_nan()), "{d} {e}");
            }
        }
    }
}

fn random_matches(size: Size, seed: u64) -> Matches {
    let mut noise = Noise(seed);
    let mut image = || {
        let mut last = 100;
        Image::from_fn(size, |_, _| {
            match noise.next() % 9 {
                0 => return NO_MATCH,
                1 => last = (noise.next() % 400) as i16,
                _ => last += (noise.next() % 21) as i16 - 10,
            }
            last
        })
    };
    let (left, right) = (image(), image());
    let evidence = Image::from_fn(size, |_, _| match noise.next() % 16 {
        0 | 1 => 0,
        _ => (noise.next() >> 56) as u8,
    });
    Matches { left, right, evidence }
}

fn rig(size: Size) -> StereoRig {
    StereoRig::new(
        Camera::pinhole(size, 400.0, 52.0, 20.0, 0.0),
        Camera::pinhole(size, 400.0, 50.0, 20.0, -200.0),
        0.0,
    )
    .unwrap()
}

/// A plane before a background, with its true disparities 40 and 12.
fn scene(size: Size) -> (View, View, Image<f32>) {
    let mut noise = Noise(11);
    let texture =
        Image::from_fn(Size::new(size.width + 80, size.height), |_, _| (noise.next() >> 56) as u8);
    // 3x3 means leave detail that survives the quarter size.
    let smooth = Image::from_fn(texture.size(), |x, y| {
        let mut sum = 0_u32;
        for (dx, dy) in (-2..=2).flat_map(|dx| (-2..=2).map(move |dy| (dx, dy))) {
            sum += u32::from(texture.get_clamped(x as isize + dx, y as isize + dy));
        }
        (((sum / 25) as i32 - 127) * 3 + 127).clamp(0, 255) as u8
    });
    let near = |x: usize, y: usize| {
        (size.width / 3..size.width / 2 + 40).contains(&x)
            && (size.height / 4..3 * size.height / 4).contains(&y)
    };
    let truth = Image::from_fn(size, |x, y| if near(x, y) { 40.0 } else { 12.0 });
    let left = Image::from_fn(size, |x, y| {
        if near(x, y) { smooth.get(x, size.height - 1 - y) } else { smooth.get(x, y) }
    });
    let right = Image::from_fn(size, |x, y| {
        if near(x + 40, y) {
            smooth.get(x + 40, size.height - 1 - y)
        } else {
            smooth.get(x + 12, y)
        }
    });
    let view = |gray| View { gray, ..View::default() };
    (view(left), view(right), truth)
}

#[test]
fn a_plane_before_a_background_is_found_to_a_fraction_of_a_pixel() {
    let size = Size::new(360, 150);
    let (left, right, truth) = scene(size);
    for algorithm in ["semi_global", "block", "census_block"] {
        let config = Config::default().with("stereo.algorithm", &algorithm.into()).unwrap();
        let level = simd::detect();
        let mut coarse = CoarseDisparity::default();
        Coarse::new(&config, size, level).run(&left, &right, &mut coarse);
        assert!(coarse.filled.pixels().iter().all(|d| !d.is_nan()));
        let everything = Image::filled(size, 255);
        let roi = RoiMask { salient: everything.clone(), matched: everything, fraction: 1.0 };
        let mut matches = Matches::default();
        let attention = Image::filled(size.divided_by(4), 1.0);
        Stereo::new(&config, size, level).run(
            &left,
            &right,
            &roi,
            &attention,
            &coarse,
            &mut matches,
        );
        let (mut disparity, mut confidence) = (Image::default(), Image::default());
        Refine::new(&config, size).run(
            &matches,
            &left.gray,
            &roi,
            &rig(size),
            &mut disparity,
            &mut confidence,
        );
        let (mut valid, mut wrong) = (0, 0);
        for y in 8..size.height - 8 {
            for x in 60..size.width - 8 {
                let d = disparity.get(x, y) + 2.0;
                if !d.is_nan() {
                    valid += 1;
                    wrong += usize::from((d - truth.get(x, y)).abs() > 1.0);
                }
            }
        }
        let all = (size.height - 16) * (size.width - 68);
        assert!(10 * valid > 8 * all, "{algorithm}: {valid} of {all} valid");
        assert!(50 * wrong < valid, "{algorithm}: {wrong} of {valid} wrong");
    }
}

#[test]
fn one_and_two_threads_give_the_same_matches() {
    let size = Size::new(300, 170);
    let (left, right, _) = scene(size);
    let config = Config::default();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut coarse = CoarseDisparity::default();
            Coarse::new(&config, size, simd::detect()).run(&left, &right, &mut coarse);
            let matched =
                Image::from_fn(size, |x, y| if (x / 50 + y / 50) % 2 == 0 { 255 } else { 0 });
            let roi = RoiMask { salient: matched.clone(), matched, fraction: 0.5 };
            let mut matches = Matches::default();
            let attention = Image::filled(size.divided_by(4), 1.0);
            Stereo::new(&config, size, simd::detect()).run(
                &left,
                &right,
                &roi,
                &attention,
                &coarse,
                &mut matches,
            );
            (coarse.filled, matches)
        })
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one.0, two.0);
    assert_same(&two.1, &one.1, "two threads");
}

#[test]
fn cells_are_means_and_repeat_the_border() {
    let levels = simd::available();
    let cases =
        ODD_SIZES.into_iter().flat_map(|size| levels.iter().map(move |&level| (size, level)));
    for (i, (size, level)) in cases.enumerate() {
        let (image, _) = pair(size, i as u64);
        let mut cells = Image::default();
        shrink(level, &image, &mut cells);
        assert_eq!(cells.size(), size.divided_by(CELL));
        for y in 0..cells.height() {
            for x in 0..cells.width() {
                let mut sum = 0;
                for k in 0..CELL * CELL {
                    let (px, py) = (x * CELL + k % CELL, y * CELL + k / CELL);
                    sum += u32::from(image.get_clamped(px as isize, py as isize));
                }
                assert_eq!(u32::from(cells.get(x, y)), (sum + 8) / 16, "{size} {x} {y}");
            }
        }
    }
}
