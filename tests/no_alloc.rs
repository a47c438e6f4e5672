//! `Pipeline::process` allocates nothing once its buffers are warm, in every
//! saliency mode and with every matcher. A test binary of its own: the counting
//! allocator sees the whole process, so nothing else may run beside it.

use std::alloc::System;
use std::sync::Arc;

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::Config;
use salient_stereo::drive::worker_pool;
use salient_stereo::image::{Image, Picture, Size};
use salient_stereo::perception::{Perception, StereoFrame};
use salient_stereo::pipeline::Pipeline;
use salient_stereo::simd;
use salient_stereo::stage::ground::GroundState;
use salient_stereo::stamp::Stamp;
use serde_json::json;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static GLOBAL: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

const SIZE: Size = Size::new(320, 160);
/// Rounds through all frames within which every buffer must have grown.
const MOST_ROUNDS: usize = 12;
/// Rounds without any allocation that end the test.
const QUIET_ROUNDS: usize = 4;

/// Noise that depends on the place alone, so that both views can show it.
fn texture(x: usize, y: usize, seed: u32) -> u8 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77) ^ seed;
    h ^= h >> 15;
    h = h.wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 12;
    (h >> 24) as u8
}

/// Row of the horizon of a road.
const HORIZON: usize = 60;

/// First column and disparity of a post on the road, four pixels wide.
const POST: (usize, usize) = (208, 14);

/// A far, dull background and three bright boxes that move and come nearer; on a `road`
/// they and a post stand on it.
fn frame(index: usize, road: bool, rig: &Arc<StereoRig>) -> StereoFrame {
    let view = |is_right: bool| {
        Image::from_fn(SIZE, |x, y| {
            for (k, (x0, y0)) in [(40, 40), (130, 60), (230, 50)].into_iter().enumerate() {
                let disparity = 12 + 6 * k + index % 4;
                let shift = if is_right { disparity } else { 0 };
                let y0 = if road { HORIZON + 5 * disparity - 40 } else { y0 + index };
                let (bx, by) = (x0 + 2 * index, y0);
                if (bx..bx + 40).contains(&(x + shift)) && (by..by + 40).contains(&y) {
                    let v = texture(x + shift - bx, y - by, k as u32);
                    return [200_u8.saturating_add(v / 5), v / 2, 30 * k as u8];
                }
            }
            let at = x + if is_right { POST.1 } else { 0 };
            if road && (POST.0..POST.0 + 4).contains(&at) && y < HORIZON + 5 * POST.1 {
                return [20, 20, 20];
            }
            let far = if road { y.saturating_sub(HORIZON) / 5 } else { 3 };
            let shift = if is_right { far } else { 0 };
            let v = 60 + texture(x + shift, y, 99) / 8;
            [v, v, v]
        })
    };
    StereoFrame {
        stamp: Stamp(1_000_000_000 + 100_000_000 * index as i64),
        right_stamp: Stamp(1_000_000_000 + 100_000_000 * index as i64),
        frame_id: Arc::from("left_optical"),
        left: Picture::Rgb(view(false)),
        right: Picture::Rgb(view(true)),
        rig: Arc::clone(rig),
    }
}

#[test]
fn a_warm_pipeline_allocates_nothing() {
    let rig = Arc::new(
        StereoRig::new(
            Camera::pinhole(SIZE, 300.0, 160.0, 80.0, 0.0),
            Camera::pinhole(SIZE, 300.0, 160.0, 80.0, -60.0),
            0.0,
        )
        .unwrap(),
    );
    let frames =
        [false, true].map(|road| (0..12).map(|i| frame(i, road, &rig)).collect::<Vec<_>>());

    let modes = ["scene", "paper", "frequency_tuned", "spectral_residual", "full_frame"];
    let mut variants: Vec<_> = modes.iter().map(|m| vec![("saliency.mode", json!(m))]).collect();
    for algorithm in ["block", "census_block"] {
        variants.push(vec![("stereo.algorithm", json!(algorithm))]);
    }
    variants.push(vec![
        ("preprocess.scale", json!(2)),
        ("preprocess.denoise", json!("median3")),
        ("preprocess.illumination", json!("clahe")),
        ("saliency.threshold_mode", json!("otsu")),
        ("roi.max_fraction", json!(0.5)),
    ]);
    variants.push(vec![("rectify", json!(true)), ("stereo.saliency_weight", json!(1.0))]);

    let mut regions_seen = [0, 0];
    let runs = variants.into_iter().map(|variant| (0, variant));
    for (road, variant) in runs.chain([(1, vec![("saliency.mode", json!("scene"))])]) {
        let frames = &frames[road];
        let config = Config::default()
            .with_all([("saliency.threshold", json!(0.3)), ("stereo.disparity_range", json!(64))])
            .and_then(|c| c.with_all(variant.clone()))
            .unwrap();
        let pool = worker_pool(2).unwrap();
        let mut pipeline = Pipeline::new(&config, SIZE, simd::detect());
        let mut perception = Perception::new(pipeline.output_size(), Arc::clone(&rig));
        let rounds = pool.install(|| {
            // Buffers wander between regions: it takes some rounds until each
            // has met the largest region it will hold.
            let mut quiet_rounds = 0;
            let mut allocated = 0;
            for round in 0..MOST_ROUNDS {
                pipeline.reset();
                let before = Region::new(GLOBAL);
                for frame in frames {
                    pipeline.process(frame, &mut perception);
                }
                let change = before.change();
                allocated = change.allocations + change.reallocations;
                quiet_rounds = if allocated == 0 { quiet_rounds + 1 } else { 0 };
                if round == 0 {
                    regions_seen[road] += perception.regions.len();
                }
                if quiet_rounds == QUIET_ROUNDS {
                    break;
                }
            }
            (quiet_rounds, allocated)
        });
        let (quiet_rounds, allocated) = rounds;
        assert_eq!(
            quiet_rounds,
            QUIET_ROUNDS,
            "{allocated} allocations in the last {} frames with {variant:?}",
            frames.len()
        );
        let ground = perception.ground == GroundState::Measured;
        assert_eq!(ground, road == 1, "{variant:?}");
        let post = perception.disparity.get(POST.0 + 2, 20);
        assert_eq!((post - POST.1 as f32).abs() < 0.5, road == 1, "a post at {post} px");
    }
    assert!(regions_seen.iter().all(|n| *n > 0), "the scenes have regions to allocate for");
}
