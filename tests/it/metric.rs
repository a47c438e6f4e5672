//! The metrics against hand-computed cases and brute force.

mod map;
mod video;

use salient_stereo::metric::{
    Calibration, Confusion, DisparityStats, IdSwitches, Overlap, RegionCounts,
};

/// Numbers that look random and are the same everywhere.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[test]
fn nothing_scored_is_none_and_never_nan() {
    assert_eq!(Confusion::default().total(), None);
    assert_eq!(DisparityStats::default().total(), None);
    assert_eq!(RegionCounts::default().total(0.5), None);
    assert_eq!(IdSwitches::default().total(), None);

    // An empty scene left alone: right everywhere, but no precision or recall.
    let mut empty = Confusion::default();
    empty.add([(false, false); 4]);
    let score = empty.total().unwrap();
    assert_eq!((score.accuracy, score.precision, score.recall, score.f1), (1.0, None, None, None));

    let mut unknown = DisparityStats::default();
    unknown.add([(f32::NAN, 3.0), (3.0, f32::NAN), (3.0, f32::INFINITY)]);
    assert_eq!(unknown.total(), None);
}

#[test]
fn equations_7_to_9_by_hand() {
    // 3 found and true, 1 found and false, 2 missed, 4 left alone.
    let mut counts = Confusion::default();
    counts.add([(true, true); 3]);
    counts.add([(true, false); 1]);
    counts.add([(false, true); 2]);
    let mut more = Confusion::default();
    more.add([(false, false); 4]);
    counts.merge(&more);
    let score = counts.total().unwrap();
    assert!((score.accuracy - 0.7).abs() < 1e-12);
    assert!((score.precision.unwrap() - 0.75).abs() < 1e-12);
    assert!((score.recall.unwrap() - 0.6).abs() < 1e-12);
    assert!((score.f1.unwrap() - 2.0 / 3.0).abs() < 1e-12);
}

#[test]
fn equation_10_and_the_benchmark_measures_by_hand() {
    let mut stats = DisparityStats::default();
    // Errors 0.5, 2.5, 3.5 (of 100: within 5 %), 5 (of 40: an outlier); one hole.
    stats.add([(10.5, 10.0), (22.5, 20.0)]);
    let mut more = DisparityStats::default();
    more.add([(103.5, 100.0), (35.0, 40.0), (f32::NAN, 7.0), (1.0, f32::NAN)]);
    stats.merge(&more);
    let score = stats.total().unwrap();
    assert!((score.epe_px - 11.5 / 4.0).abs() < 1e-12);
    assert_eq!((score.bad_1, score.bad_2, score.bad_3, score.bad_4), (0.75, 0.75, 0.5, 0.25));
    assert_eq!((score.d1, score.density, score.pixels), (0.25, 0.8, 4));
}

#[test]
fn iou_of_boxes_by_hand() {
    assert_eq!(Overlap::of_boxes([0, 0, 4, 4], [2, 2, 4, 4]), 4.0 / 28.0);
    assert_eq!(Overlap::of_boxes([0, 0, 4, 4], [4, 0, 4, 4]), 0.0);
    assert_eq!(Overlap::of_boxes([1, 1, 3, 3], [1, 1, 3, 3]), 1.0);
    assert_eq!(Overlap::of_boxes([0, 0, 0, 0], [0, 0, 0, 0]), 0.0);
    let far = [u32::MAX - 1, u32::MAX - 1, 1, 1];
    assert_eq!(Overlap::of_boxes(far, far), 1.0);
}

#[test]
fn a_greedy_choice_that_costs_a_pair_is_undone() {
    // Region 0 overlaps both objects, and the one that region 1 needs the most.
    let iou = [[0.9, 0.6], [0.7, 0.0]];
    let matching = Overlap::from_fn(2, 2, |r, o| iou[r][o]).matching(0.5);
    assert_eq!(matching.pairs, [(1, 0), (0, 1)]);
}

#[test]
fn no_other_matching_has_more_pairs() {
    fn most(iou: &[Vec<f64>], threshold: f64, region: usize, used: &mut Vec<bool>) -> usize {
        if region == iou.len() {
            return 0;
        }
        let mut best = most(iou, threshold, region + 1, used);
        for object in 0..used.len() {
            if !used[object] && iou[region][object] >= threshold {
                used[object] = true;
                best = best.max(1 + most(iou, threshold, region + 1, used));
                used[object] = false;
            }
        }
        best
    }

    let mut noise = Noise(7);
    for round in 0..400 {
        let (regions, objects) = (noise.next() as usize % 6, noise.next() as usize % 6);
        let iou: Vec<Vec<f64>> =
            (0..regions).map(|_| (0..objects).map(|_| noise.unit()).collect()).collect();
        let overlap = Overlap::from_fn(regions, objects, |r, o| iou[r][o]);
        let threshold = 0.3 + 0.1 * f64::from(round % 6);
        let matching = overlap.matching(threshold);
        assert_eq!(
            matching.pairs.len(),
            most(&iou, threshold, 0, &mut vec![false; objects]),
            "round {round}"
        );
        let mut seen_regions: Vec<_> = matching.pairs.iter().map(|p| p.0).collect();
        seen_regions.sort_unstable();
        seen_regions.dedup();
        assert_eq!(seen_regions.len(), matching.pairs.len(), "one region, one object");
        assert!(matching.pairs.iter().all(|&(r, o)| iou[r][o] >= threshold));
        assert_eq!(matching, overlap.matching(threshold), "the same again");
    }
}

#[test]
fn regions_are_counted_one_to_one_and_small_objects_not_at_all() {
    let mut counts = RegionCounts::default();
    let everything = |_| true;
    // Two of three regions meet two of four objects.
    let iou = [[0.8, 0.0, 0.0, 0.0], [0.0, 0.6, 0.0, 0.0], [0.0, 0.4, 0.0, 0.0]];
    let matching = Overlap::from_fn(3, 4, |r, o| iou[r][o]).matching(0.5);
    counts.add(&matching, everything, everything);
    let score = counts.total(0.5).unwrap();
    assert_eq!((score.true_positives, score.false_positives, score.false_negatives), (2, 1, 2));
    assert_eq!((score.precision, score.recall), (Some(2.0 / 3.0), Some(0.5)));
    assert!((score.f1 - 4.0 / 7.0).abs() < 1e-12);

    // Objects 0 (found) and 3 (missed) are too small to be asked for.
    let mut counts = RegionCounts::default();
    counts.add(&matching, everything, |o| o != 0 && o != 3);
    let score = counts.total(0.5).unwrap();
    assert_eq!((score.true_positives, score.false_positives, score.false_negatives), (1, 1, 1));

    // A frame with nothing in it only dilutes the false positives.
    counts.add(&Overlap::from_fn(0, 0, |_, _| 0.0).matching(0.5), everything, everything);
    assert_eq!(counts.total(0.5).unwrap().false_positives_per_frame, 0.5);
}

#[test]
fn identity_switches_by_hand() {
    let mut switches = IdSwitches::default();
    switches.add([(1, 10), (2, 20)]);
    switches.add([(1, 10)]);
    switches.add([(1, 10), (2, 21)]); // after a gap: a switch all the same
    switches.add([(1, 20), (2, 21)]); // object 1 takes over a track: a switch
    switches.add([(3, 0)]); // tracking off
    assert_eq!((switches.total(), switches.objects()), (Some(2), 2));
}

#[test]
fn calibration_is_the_mean_distance_from_what_came_true() {
    assert_eq!(Calibration::default().total(), None);
    let mut halves = Calibration::default();
    for i in 0..10 {
        halves.add(0.85, i < 6);
    }
    let mut other = Calibration::default();
    for i in 0..30 {
        other.add(0.15, i < 3);
    }
    // 1 belongs to the last bin; what is no probability is left out.
    other.add(1.0, true);
    other.add(f64::NAN, true);
    other.add(1.5, false);
    halves.merge(&other);
    let score = halves.total().unwrap();
    assert_eq!(score.rows.iter().map(|r| r.count).collect::<Vec<_>>(), [30, 10, 1]);
    assert!((score.rows[1].right - 0.6).abs() < 1e-12);
    let expected = (30.0 * 0.05 + 10.0 * 0.25) / 41.0;
    assert!((score.error - expected).abs() < 1e-12, "{}", score.error);
}
