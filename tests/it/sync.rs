//! Pairing by stamp: what may never happen, on arbitrary streams, and what each
//! mode promises.

use proptest::prelude::*;
use salient_stereo::config::{CameraInfoPolicy, SyncMode};
use salient_stereo::stamp::Stamp;
use salient_stereo::sync::{Pair, Settings, Side, Synchronizer};

const MS: i64 = 1_000_000;

type Pairs = Vec<Pair<usize, u32>>;

fn settings(mode: SyncMode, tolerance_ms: i64) -> Settings {
    Settings {
        mode,
        tolerance_ns: tolerance_ms * MS,
        queue_size: 10,
        camera_info: CameraInfoPolicy::Cached,
        side_by_side: false,
    }
}

fn with_infos(settings: Settings) -> Synchronizer<usize, u32> {
    let mut sync = Synchronizer::new(settings);
    sync.fix_info(Side::Left, 1);
    sync.fix_info(Side::Right, 2);
    sync
}

/// Feeds `(side, stamp in ms)` in order; payloads are positions in `messages`.
fn feed(sync: &mut Synchronizer<usize, u32>, messages: &[(Side, i64)]) -> Pairs {
    let mut pairs = Vec::new();
    for (i, &(side, ms)) in messages.iter().enumerate() {
        sync.push(side, Stamp(ms * MS), i);
        pairs.extend(std::iter::from_fn(|| sync.pop()));
    }
    pairs
}

fn feed_to_end(sync: &mut Synchronizer<usize, u32>, messages: &[(Side, i64)]) -> Pairs {
    let mut pairs = feed(sync, messages);
    sync.finish();
    pairs.extend(std::iter::from_fn(|| sync.pop()));
    sync.close();
    pairs
}

fn stamps(pairs: &Pairs) -> Vec<(i64, i64)> {
    pairs.iter().map(|p| (p.stamp.0 / MS, p.right_stamp.0 / MS)).collect()
}

/// Both streams in the order of their stamps, left first on equal ones.
fn merged(left: &[i64], right: &[i64]) -> Vec<(Side, i64)> {
    let mut all: Vec<_> = left.iter().map(|&t| (Side::Left, t)).collect();
    all.extend(right.iter().map(|&t| (Side::Right, t)));
    all.sort_by_key(|&(side, t)| (t, side as u8));
    all
}

fn increasing(step: std::ops::RangeInclusive<i64>) -> impl Strategy<Value = Vec<i64>> {
    prop::collection::vec(step, 0..60).prop_map(|steps| {
        steps
            .iter()
            .scan(0, |t, step| {
                *t += step;
                Some(*t)
            })
            .collect()
    })
}

fn any_mode() -> impl Strategy<Value = SyncMode> {
    prop_oneof![Just(SyncMode::Auto), Just(SyncMode::Exact), Just(SyncMode::Approximate)]
}

fn any_side() -> impl Strategy<Value = Side> {
    prop_oneof![Just(Side::Left), Just(Side::Right)]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever comes, also jumps back and duplicates: each image is in at most
    /// one pair, and those in none are counted.
    #[test]
    fn nothing_is_paired_twice_or_lost_uncounted(
        messages in prop::collection::vec((any_side(), 0_i64..40), 0..200),
        mode in any_mode(),
        tolerance in 0_i64..8,
        queue_size in 1_usize..6,
    ) {
        let settings = Settings { queue_size, ..settings(mode, tolerance) };
        let mut sync = with_infos(settings);
        let pairs = feed_to_end(&mut sync, &messages);
        let mut used: Vec<usize> =
            pairs.iter().flat_map(|p| [Some(p.left), p.right]).flatten().collect();
        used.sort_unstable();
        used.dedup();
        prop_assert_eq!(used.len(), 2 * pairs.len());
        let counts = *sync.counts();
        prop_assert_eq!(counts.pairs, pairs.len() as u64);
        for side in [Side::Left, Side::Right] {
            let sent = messages.iter().filter(|(s, _)| *s == side).count() as u64;
            let side = counts.side(side);
            prop_assert_eq!(side.received, sent);
            prop_assert_eq!(sent, counts.pairs + counts.without_info + side.lost());
        }
    }

    /// Between jumps, pairs leave in the order of both stamps and within the tolerance.
    #[test]
    fn pairs_leave_in_order(
        messages in prop::collection::vec((any_side(), 0_i64..60), 0..200),
        mode in any_mode(),
        tolerance in 0_i64..8,
    ) {
        let pairs = feed_to_end(&mut with_infos(settings(mode, tolerance)), &messages);
        for pair in &pairs {
            let gap = (pair.stamp.0 - pair.right_stamp.0).abs();
            let allowed = if mode == SyncMode::Exact { 0 } else { tolerance * MS };
            prop_assert!(gap <= allowed);
        }
        for two in pairs.windows(2).filter(|two| !two[1].after_jump) {
            prop_assert!(two[0].stamp < two[1].stamp && two[0].right_stamp < two[1].right_stamp);
        }
    }

    /// Left and right are treated alike.
    #[test]
    fn swapped_streams_give_swapped_pairs(
        messages in prop::collection::vec((any_side(), 0_i64..60), 0..200),
        mode in any_mode(),
        tolerance in 0_i64..8,
    ) {
        let swapped: Vec<_> = messages
            .iter()
            .map(|&(side, t)| (if side == Side::Left { Side::Right } else { Side::Left }, t))
            .collect();
        let mut ways = [&messages, &swapped].map(|messages| {
            let mut sync = with_infos(settings(mode, tolerance));
            let pairs = feed_to_end(&mut sync, messages);
            (stamps(&pairs), *sync.counts())
        });
        for (l, r) in &mut ways[1].0 {
            std::mem::swap(l, r);
        }
        prop_assert_eq!(&ways[0].0, &ways[1].0);
        prop_assert_eq!(ways[0].1.left, ways[1].1.right);
        prop_assert_eq!(ways[0].1.gaps, ways[1].1.gaps);
    }

    /// No image without partner is nearer to an image of a pair than its partner is
    /// (unless it lies beyond another pair),
    /// and two images without partner within the tolerance of each other had
    /// their eyes on an image that found a nearer one.
    #[test]
    fn the_nearest_are_paired(
        mode in prop_oneof![Just(SyncMode::Auto), Just(SyncMode::Approximate)],
        // No interval is shorter than half of another one, as the shortcut presumes.
        left in increasing(6..=11),
        right in increasing(6..=11),
        tolerance in 0_i64..12,
    ) {
        let mut sync = with_infos(Settings { queue_size: 100, ..settings(mode, tolerance) });
        let pairs = stamps(&feed_to_end(&mut sync, &merged(&left, &right)));
        let free = |all: &[i64], taken: Vec<i64>| -> Vec<i64> {
            all.iter().copied().filter(|t| !taken.contains(t)).collect()
        };
        let free_left = free(&left, pairs.iter().map(|p| p.0).collect());
        let free_right = free(&right, pairs.iter().map(|p| p.1).collect());
        for &(l, r) in &pairs {
            // Pairs never cross, so an image beyond another pair is out of reach.
            let crosses = |l: i64, r: i64| {
                pairs.iter().any(|&(pl, pr)| (l - pl).signum() * (r - pr).signum() < 0)
            };
            let gap = (l - r).abs();
            prop_assert!(free_left.iter().all(|&t| (t - r).abs() >= gap || crosses(t, r)));
            prop_assert!(free_right.iter().all(|&t| (t - l).abs() >= gap || crosses(l, t)));
        }
        for &l in &free_left {
            for &r in &free_right {
                let contested = pairs.iter().any(|&(pl, pr)| {
                    (l - pr).abs() <= tolerance || (r - pl).abs() <= tolerance
                });
                let out_of_reach = pairs.iter().any(|&(pl, pr)| (l - pl) * (r - pr) < 0);
                prop_assert!((l - r).abs() > tolerance || contested || out_of_reach);
            }
        }
    }

    /// Cameras with a jitter, an offset and lost images: every mode that may,
    /// pairs each frame that both cameras have, with and without the shortcut.
    #[test]
    fn jittering_cameras_pair_frame_by_frame(
        frames in prop::collection::vec((any::<bool>(), any::<bool>(), -2_i64..=2, -2_i64..=2), 3..60),
        offset in 0_i64..4,
        mode in prop_oneof![Just(SyncMode::Auto), Just(SyncMode::Approximate)],
    ) {
        let mut left = Vec::new();
        let mut right = Vec::new();
        let mut both = Vec::new();
        for (i, &(has_left, has_right, jitter_left, jitter_right)) in frames.iter().enumerate() {
            let t = 1000 + 33 * i as i64;
            let (l, r) = (t + jitter_left, t + offset + jitter_right);
            if has_left { left.push(l); }
            if has_right { right.push(r); }
            if has_left && has_right { both.push((l, r)); }
        }
        let pairs = feed_to_end(&mut with_infos(settings(mode, 8)), &merged(&left, &right));
        prop_assert_eq!(stamps(&pairs), both);
    }

    /// Exact pairs are the stamps that both cameras have.
    #[test]
    fn exact_pairs_the_intersection(left in increasing(1..=4), right in increasing(1..=4)) {
        let pairs = feed_to_end(&mut with_infos(settings(SyncMode::Exact, 5)), &merged(&left, &right));
        let both: Vec<_> = left.iter().filter(|t| right.contains(t)).map(|&t| (t, t)).collect();
        prop_assert_eq!(stamps(&pairs), both);
    }
}

#[test]
fn auto_never_pairs_across_a_lost_image() {
    // 4 ms apart at a tolerance of 5 ms: the right image at 4 is lost.
    let messages = [
        (Side::Left, 0),
        (Side::Right, 0),
        (Side::Left, 4),
        (Side::Right, 8),
        (Side::Left, 8),
        (Side::Left, 12),
        (Side::Right, 12),
    ];
    let mut sync = with_infos(settings(SyncMode::Auto, 5));
    assert_eq!(stamps(&feed(&mut sync, &messages)), [(0, 0), (8, 8), (12, 12)]);
    assert!(!sync.stamps_differ());
    assert_eq!(sync.counts().left.unpaired, 1);
}

#[test]
fn auto_turns_approximate_and_then_pairs_without_delay() {
    let mut sync = with_infos(settings(SyncMode::Auto, 5));
    let first = feed(&mut sync, &[(Side::Left, 0), (Side::Right, 3)]);
    assert!(first.is_empty(), "the next left image could be nearer");
    let second = feed(&mut sync, &[(Side::Left, 33)]);
    assert_eq!(stamps(&second), [(0, 3)]);
    assert!(sync.stamps_differ());
    let third = feed(&mut sync, &[(Side::Right, 36)]);
    assert_eq!(stamps(&third), [(33, 36)], "intervals are known now");
    assert_eq!(sync.counts().offset.largest_ns, 3_000_000);
}

#[test]
fn stamps_that_never_match_are_explained() {
    let mut sync = with_infos(settings(SyncMode::Auto, 5));
    for i in 0..20 {
        feed(&mut sync, &[(Side::Left, 100 * i), (Side::Right, 100 * i + 20)]);
    }
    sync.close();
    let text = sync.counts().explain(sync.settings(), [true, true]).unwrap();
    assert!(text.contains("20.000 ms or more apart"), "{text}");
    assert!(text.contains("5.000 ms allowed"), "{text}");
    assert_eq!(sync.counts().pairs, 0);
}

#[test]
fn a_silent_camera_is_named() {
    let mut sync = with_infos(settings(SyncMode::Auto, 5));
    let left: Vec<_> = (0..30).map(|i| (Side::Left, 33 * i)).collect();
    assert!(feed(&mut sync, &left).is_empty());
    assert_eq!(sync.counts().left.overflow, 20);
    let text = sync.counts().explain(sync.settings(), [true, true]).unwrap();
    assert!(text.contains("no right image"), "{text}");
}

#[test]
fn a_loop_clears_once_and_marks_the_next_pair() {
    // The last right image of the first lap arrives after the jump.
    let messages = [
        (Side::Left, 1000),
        (Side::Right, 1000),
        (Side::Left, 1033),
        (Side::Left, 0),
        (Side::Right, 1033),
        (Side::Right, 0),
        (Side::Left, 33),
        (Side::Right, 33),
    ];
    let mut sync = with_infos(settings(SyncMode::Auto, 5));
    let pairs = feed(&mut sync, &messages);
    assert_eq!(stamps(&pairs), [(1000, 1000), (0, 0), (33, 33)]);
    assert_eq!(pairs.iter().map(|p| p.after_jump).collect::<Vec<_>>(), [false, true, false]);
    let counts = sync.counts();
    assert_eq!((counts.jumps, counts.left.cleared, counts.right.cleared), (1, 1, 1));
}

#[test]
fn pairs_wait_for_the_first_camera_infos() {
    let mut sync = Synchronizer::<usize, u32>::new(settings(SyncMode::Auto, 5));
    assert!(feed(&mut sync, &[(Side::Left, 0), (Side::Right, 0)]).is_empty());
    sync.push_info(Side::Left, Stamp(0), 7);
    assert!(sync.pop().is_none());
    sync.push_info(Side::Right, Stamp(5), 8);
    let pair = sync.pop().unwrap();
    assert_eq!((pair.left_info, pair.right_info), (7, 8));
}

#[test]
fn missing_camera_infos_are_counted_and_named() {
    let mut sync = Synchronizer::<usize, u32>::new(settings(SyncMode::Auto, 5));
    sync.push_info(Side::Left, Stamp(0), 7);
    let messages: Vec<_> = (0..15).flat_map(|i| [(Side::Left, i), (Side::Right, i)]).collect();
    assert!(feed_to_end(&mut sync, &messages).is_empty());
    assert_eq!(sync.counts().without_info, 15);
    let has = [sync.has_info(Side::Left), sync.has_info(Side::Right)];
    let text = sync.counts().explain(sync.settings(), has).unwrap();
    assert!(text.contains("15 pairs were dropped: no right camera info came"), "{text}");
}

#[test]
fn synced_camera_infos_carry_the_stamp_of_their_image() {
    let settings =
        Settings { camera_info: CameraInfoPolicy::Synced, ..settings(SyncMode::Auto, 5) };
    let mut sync = Synchronizer::<usize, u32>::new(settings);
    let mut pairs = Vec::new();
    for i in 0..6 {
        let stamp = Stamp(i64::from(i) * 33 * MS);
        sync.push(Side::Left, stamp, 0);
        sync.push(Side::Right, stamp, 0);
        // The left info of frame 2 is lost.
        if i != 2 {
            sync.push_info(Side::Left, stamp, i);
        }
        sync.push_info(Side::Right, stamp, 10 + i);
        pairs.extend(std::iter::from_fn(|| sync.pop()));
    }
    let infos: Vec<_> = pairs.iter().map(|p| (p.left_info, p.right_info)).collect();
    assert_eq!(infos, [(0, 10), (1, 11), (3, 13), (4, 14), (5, 15)]);
    assert_eq!(sync.counts().without_info, 1);
}

#[test]
fn one_image_with_both_views_needs_no_partner() {
    let settings = Settings { side_by_side: true, ..settings(SyncMode::Auto, 5) };
    let pairs = feed(&mut with_infos(settings), &[(Side::Left, 0), (Side::Left, 33)]);
    assert_eq!(stamps(&pairs), [(0, 0), (33, 33)]);
    assert!(pairs.iter().all(|p| p.right.is_none()));
}
