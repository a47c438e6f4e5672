//! All stages together: what the whole promises, whichever stage keeps it.

use salient_stereo::config::{Config, SaliencyMode};
use salient_stereo::image::{Image, Picture, Size};
use salient_stereo::input::synthetic::{SceneKind, SceneOptions, SyntheticScene};
use salient_stereo::perception::{Perception, StereoFrame};
use salient_stereo::pipeline::Pipeline;
use salient_stereo::simd;

const SIZE: Size = Size::new(320, 120);

/// The last of a few frames of the rendered street.
fn last_of(config: &Config, frames: usize) -> Perception {
    let options = SceneOptions { size: SIZE, frames, ..SceneKind::Street.defaults() };
    let scene = SyntheticScene::new(SceneKind::Street, options).unwrap();
    let mut pipeline = Pipeline::new(config, SIZE, simd::detect());
    let mut out = Perception::new(SIZE, scene.observation(0).frame.rig.clone());
    for n in 0..frames {
        pipeline.process(&scene.observation(n).frame, &mut out);
    }
    out
}

fn matched(map: &Image<f32>) -> usize {
    map.pixels().iter().filter(|d| !d.is_nan()).count()
}

#[test]
fn what_the_budget_leaves_out_is_said_to_be_unmatched() {
    let whole = last_of(&Config::default(), 3);
    let mut fractions = vec![whole.roi.fraction];
    for share in [0.15, 0.05, 0.01] {
        let config = Config::default().with("roi.max_fraction", &share.into()).unwrap();
        let out = last_of(&config, 3);
        fractions.push(out.roi.fraction);
        assert!(f64::from(out.roi.fraction) <= share, "{} of {share}", out.roi.fraction);
        let matched_or_not = out.roi.matched.pixels().iter().enumerate();
        for (i, _) in matched_or_not.filter(|(_, matched)| **matched == 0) {
            assert!(out.disparity.pixels()[i].is_nan() && out.depth.pixels()[i].is_nan());
            assert_eq!(out.confidence.pixels()[i], 0.0);
        }
        // Nor is anything made up about how far things are: a region measures
        // what was matched in it.
        for region in out.regions.iter().filter(|region| region.valid_fraction == 0.0) {
            assert!(region.mean_depth.is_nan(), "{region:?}");
        }
        assert!(matched(&out.disparity) <= matched(&whole.disparity));
        // Attention is paid everywhere.
        let saliency = out.saliency();
        assert_eq!(saliency.size(), SIZE);
        assert!(saliency.pixels().iter().any(|&s| s > 0.55));
    }
    assert!(fractions.is_sorted_by(|a, b| a >= b), "{fractions:?}");
    assert!(fractions[0] > 0.15 && fractions[2] > 0.0, "{fractions:?}");
}

#[test]
fn full_frame_looks_everywhere_and_the_others_at_what_stands_out() {
    let with = |mode: SaliencyMode| {
        let mut config = Config::default();
        config.saliency.mode = mode;
        last_of(&config, 2)
    };
    let whole = with(SaliencyMode::FullFrame);
    assert_eq!(whole.roi.fraction, 1.0);
    let scene = with(SaliencyMode::Scene);
    assert!(scene.roi.fraction < 0.7, "{}", scene.roi.fraction);
    // Where both matched, they found much the same.
    let both = whole.disparity.pixels().iter().zip(scene.disparity.pixels());
    let (mut n, mut same) = (0, 0);
    for (a, b) in both.filter(|(a, b)| !a.is_nan() && !b.is_nan()) {
        n += 1;
        same += usize::from((a - b).abs() <= 1.0);
    }
    assert!(n > 1000 && same as f64 > 0.97 * f64::from(n), "{same} of {n}");
}

/// What a gray camera sends, in its own form or in three equal channels, is the
/// same scene: the shorter way for gray pictures changes nothing.
#[test]
fn a_gray_picture_and_equal_channels_are_seen_alike() {
    const FRAMES: usize = 3;
    let options = SceneOptions { size: SIZE, frames: FRAMES, ..SceneKind::Street.defaults() };
    let scene = SyntheticScene::new(SceneKind::Street, options).unwrap();
    let gray = |picture: &Picture| match picture {
        Picture::Gray(gray) => gray.clone(),
        Picture::Rgb(rgb) => {
            Image::from_vec(rgb.size(), rgb.pixels().iter().map(|p| p[1]).collect()).unwrap()
        }
    };
    let equal = |gray: &Image<u8>| {
        Picture::Rgb(
            Image::from_vec(gray.size(), gray.pixels().iter().map(|&g| [g; 3]).collect()).unwrap(),
        )
    };
    for illumination in ["none", "clahe"] {
        let config =
            Config::default().with("preprocess.illumination", &illumination.into()).unwrap();
        let rig = scene.observation(0).frame.rig.clone();
        let mut outs = [(); 2].map(|()| Perception::new(SIZE, rig.clone()));
        let mut pipelines = [(); 2].map(|()| Pipeline::new(&config, SIZE, simd::detect()));
        for n in 0..FRAMES {
            let frame = scene.observation(n).frame;
            let (left, right) = (gray(&frame.left), gray(&frame.right));
            let alike = StereoFrame { left: equal(&left), right: equal(&right), ..frame.clone() };
            let own =
                StereoFrame { left: Picture::Gray(left), right: Picture::Gray(right), ..frame };
            for ((pipeline, out), frame) in pipelines.iter_mut().zip(&mut outs).zip([own, alike]) {
                pipeline.process(&frame, out);
            }
        }
        let [own, alike] = &outs;
        assert_eq!(own.left.is_gray, illumination == "none");
        assert!(!alike.left.is_gray);
        assert!(own.left.rgb.pixels() == alike.left.rgb.pixels());
        assert!(own.attention.pixels() == alike.attention.pixels(), "{illumination}: attention");
        assert!(own.roi.matched.pixels() == alike.roi.matched.pixels(), "{illumination}: ROI");
        assert!(own.labels.pixels() == alike.labels.pixels(), "{illumination}: regions");
        assert!(!own.regions.is_empty());
    }
}
