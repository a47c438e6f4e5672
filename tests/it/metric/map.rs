//! Attention maps against masks, by hand.

use salient_stereo::image::{Image, Size};
use salient_stereo::metric::{MapScore, MapStats};

fn score(map: &Image<u8>, mask: &Image<u8>) -> MapScore {
    let mut stats = MapStats::default();
    assert!(stats.add(map, mask));
    stats.total().unwrap()
}

fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-12, "{a} is not {b}");
}

/// A square of 4x4 in 10x10 pixels.
fn square() -> Image<u8> {
    Image::from_fn(Size::new(10, 10), |x, y| {
        255 * u8::from((3..7).contains(&x) && (2..6).contains(&y))
    })
}

#[test]
fn a_perfect_map_is_perfect() {
    let mask = square();
    let score = score(&mask, &mask);
    for value in [score.max_f, score.adaptive_f, score.weighted_f, score.s_measure] {
        assert!((value - 1.0).abs() < 1e-9, "{score:?}");
    }
    // Divided by one pixel less, as the authors of the measure do.
    near(score.max_e, 100.0 / 99.0);
    near(score.adaptive_e, 100.0 / 99.0);
    // At threshold 0 everything is taken: precision 0.16, recall 1.
    near(score.mean_f, (255.0 + 1.3 * 0.16 / (0.3 * 0.16 + 1.0)) / 256.0);
    assert_eq!((score.images, score.mae, score.roi_90, score.roi_95), (1, 0.0, 0.16, 0.16));
    assert_eq!((score.precision[0], score.precision[1], score.precision[255]), (0.16, 1.0, 1.0));
    assert_eq!((score.area[0], score.area[255]), (1.0, 0.16));
    assert!(score.recall.iter().all(|recall| *recall == 1.0));
}

#[test]
fn an_inverted_map_is_wrong_everywhere() {
    let mask = square();
    let map = Image::from_fn(mask.size(), |x, y| 255 - mask.get(x, y));
    let score = score(&map, &mask);
    assert_eq!((score.mae, score.adaptive_f), (1.0, 0.0));
    assert!(score.s_measure < 0.05 && score.weighted_f < 0.01, "{score:?}");
    assert_eq!((score.roi_90, score.recall[255], score.precision[255]), (1.0, 0.0, 0.0));
    // Only threshold 0, which takes everything, finds the object.
    near(score.max_f, 1.3 * 0.16 / (0.3 * 0.16 + 1.0));
}

#[test]
fn half_an_overlap_by_hand() {
    // Eight pixels taken, eight salient, four in common, of 32.
    let size = Size::new(8, 4);
    let map = Image::from_fn(size, |x, y| 255 * u8::from(y == 1 || (y == 9 && x == 0)));
    let mask = Image::from_fn(size, |x, y| u8::from((y == 1 || y == 2) && x < 4));
    let score = score(&map, &mask);
    assert_eq!((score.precision[255], score.recall[255], score.area[255]), (0.5, 0.5, 0.25));
    near(score.max_f, 0.5);
    near(score.mae, 8.0 / 32.0);
    // Means 1/4 and 1/4: agreeing pixels score 1, the others (1 - 0.6)² / 4.
    near(score.adaptive_e, (24.0 + 8.0 * 0.04) / 31.0);
    assert_eq!((score.roi_90, score.roi_95), (1.0, 1.0));
}

#[test]
fn stretching_makes_a_weak_map_strong_and_leaves_a_flat_one() {
    let mask = square();
    let weak = Image::from_fn(mask.size(), |x, y| 10 + mask.get(x, y) / 51);
    let mut stretched = MapStats::default();
    assert!(stretched.add_stretched(&weak, &mask));
    assert_eq!(stretched.total(), Some(score(&mask, &mask)));
    assert!(score(&weak, &mask).mae > 0.1);

    let flat = Image::filled(mask.size(), 51);
    let mut stretched = MapStats::default();
    assert!(stretched.add_stretched(&flat, &mask));
    assert_eq!(stretched.total(), Some(score(&flat, &mask)));
    near(score(&flat, &mask).mae, 0.2 * 0.84 + 0.8 * 0.16);
}

#[test]
fn the_smallest_area_is_that_of_the_highest_threshold_that_holds_enough() {
    // Twenty salient pixels at levels 1..=20, and two others above them all.
    let size = Size::new(25, 1);
    let map = Image::from_fn(size, |x, _| if x < 22 { x as u8 + 1 } else { 0 });
    let mask = Image::from_fn(size, |x, _| u8::from(x < 20));
    let score = score(&map, &mask);
    near(score.roi_90, 20.0 / 25.0);
    near(score.roi_95, 21.0 / 25.0);
}

#[test]
fn what_cannot_be_scored_is_left_out() {
    let mut stats = MapStats::default();
    assert_eq!(stats.total(), None);
    let mask = square();
    assert!(!stats.add(&mask, &Image::new(mask.size())));
    assert!(!stats.add(&mask, &Image::filled(Size::new(3, 3), 1)));
    assert!(!stats.add(&Image::default(), &Image::default()));
    stats.merge(&MapStats::default());
    assert_eq!(stats.total(), None);
    // One pixel is an image as well.
    let one = Image::filled(Size::new(1, 1), 255);
    let score = score(&one, &one);
    assert_eq!((score.max_f, score.s_measure, score.adaptive_e), (1.0, 1.0, 1.0));
}

#[test]
fn merging_is_adding_and_parts_survive_being_written() {
    let (a, b) = (square(), Image::from_fn(Size::new(7, 5), |x, y| (x * 30 + y) as u8));
    let (mut one, mut other, mut both) = <(MapStats, MapStats, MapStats)>::default();
    for stats in [&mut one, &mut both] {
        stats.add(&a, &a);
    }
    for stats in [&mut other, &mut both] {
        stats.add(&b, &Image::from_fn(b.size(), |x, _| u8::from(x > 4)));
    }
    one.merge(&other);
    assert_eq!(one.total(), both.total());
    // As text a number may lose its last bit.
    let text = serde_json::to_string(&both).unwrap();
    let back: MapStats = serde_json::from_str(&text).unwrap();
    let (back, both) = (back.total().unwrap(), both.total().unwrap());
    near(back.max_e, both.max_e);
    near(back.s_measure, both.s_measure);
    assert!(back.area.iter().zip(&both.area).all(|(a, b)| (a - b).abs() < 1e-12));
}
