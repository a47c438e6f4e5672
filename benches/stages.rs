//! Time of the attention and matching stages on a rendered street, on one thread.
//!
//! ```text
//! cargo bench --bench stages
//! ```
//!
//! What is timed is checked against the truth of the scene first.

use divan::Bencher;
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::input::synthetic::{SceneKind, SceneOptions, SyntheticScene};
use salient_stereo::input::{Observation, Truth};
use salient_stereo::perception::{Perception, RoiMask, View};
use salient_stereo::simd;
use salient_stereo::stage::coarse::{Coarse, CoarseDisparity};
use salient_stereo::stage::preprocess::Preprocess;
use salient_stereo::stage::refine::Refine;
use salient_stereo::stage::roi::Roi;
use salient_stereo::stage::saliency::{Previous, Saliency, Scene as SaliencyScene, upsample};
use salient_stereo::stage::stereo::{Matches, Stereo};

const SIZE: Size = Size::new(1242, 375);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    divan::main();
    Ok(())
}

/// A rectified pair, and what the stages make of it.
struct Scene {
    config: Config,
    perception: Perception,
    right: View,
    truth: Truth,
    roi: RoiMask,
    /// One value per cell.
    attention: Image<f32>,
    coarse: CoarseDisparity,
    matches: Matches,
}

impl Scene {
    /// The street with a centred rectangle of `fraction` of the image to match,
    /// after all stages.
    fn new(fraction: f64) -> Self {
        let config = Config::default();
        let options = SceneOptions { size: SIZE, frames: 1, ..SceneKind::Street.defaults() };
        let scene = SyntheticScene::new(SceneKind::Street, options).unwrap();
        let Observation { frame, truth } = scene.observation(0);
        let mut perception = Perception::new(SIZE, frame.rig.clone());
        let mut right = View::default();
        Preprocess::new(&config, SIZE, simd::detect()).run(&frame, &mut perception, &mut right);
        let inside = |at: usize, length: usize| {
            2.0 * (at as f64 + 0.5 - length as f64 / 2.0).abs() <= length as f64 * fraction.sqrt()
        };
        let mask = Image::from_fn(SIZE, |x, y| {
            if inside(x, SIZE.width) && inside(y, SIZE.height) { 255 } else { 0 }
        });
        let mut scene = Self {
            config,
            perception,
            right,
            truth: truth.unwrap(),
            roi: RoiMask { salient: mask.clone(), matched: mask, fraction: fraction as f32 },
            attention: Image::filled(SIZE.divided_by(4), 1.0),
            coarse: CoarseDisparity::default(),
            matches: Matches::default(),
        };
        drop(scene.coarse());
        drop(scene.stereo());
        drop(scene.refine());
        scene.check();
        scene
    }

    fn coarse(&mut self) -> impl FnMut() + '_ {
        let mut stage = Coarse::new(&self.config, SIZE, simd::detect());
        let mut run = move || stage.run(&self.perception.left, &self.right, &mut self.coarse);
        run();
        run
    }

    fn stereo(&mut self) -> impl FnMut() + '_ {
        let mut stage = Stereo::new(&self.config, SIZE, simd::detect());
        let mut run = move || {
            stage.run(
                &self.perception.left,
                &self.right,
                &self.roi,
                &self.attention,
                &self.coarse,
                &mut self.matches,
            );
        };
        run();
        run
    }

    fn refine(&mut self) -> impl FnMut() + '_ {
        let mut stage = Refine::new(&self.config, SIZE);
        let mut run = move || {
            let Perception { left, rig, disparity, confidence, .. } = &mut self.perception;
            stage.run(&self.matches, &left.gray, &self.roi, rig, disparity, confidence);
        };
        run();
        run
    }

    /// The second of two frames of a camera that stands still.
    fn attention(&mut self) -> impl FnMut() + '_ {
        let mut stage = Saliency::new(&self.config, SIZE, simd::detect());
        let mut previous = Previous::default();
        let Self { perception, coarse, attention, .. } = self;
        let mut run = move || {
            let Perception { stamp, left, rig, .. } = &*perception;
            let scene = SaliencyScene { stamp: *stamp, left, coarse, rig };
            stage.run(&scene, &mut previous, attention);
        };
        run();
        run
    }

    fn region_of_interest(&mut self) -> impl FnMut() + '_ {
        drop(self.attention());
        self.check_attention();
        let mut stage = Roi::new(&self.config, SIZE, simd::detect());
        let Self { perception, coarse, attention, roi, .. } = self;
        move || stage.run(attention, coarse, &perception.rig, roi)
    }

    /// True objects are more salient than the rest by far.
    fn check_attention(&self) {
        let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
        let objects = self.truth.objects.as_ref().unwrap();
        let mut saliency = Image::default();
        upsample(simd::detect(), &self.attention, SIZE, &mut saliency);
        for (&s, &id) in saliency.pixels().iter().zip(objects.pixels()) {
            sums[usize::from(id != 0)] += f64::from(s);
            counts[usize::from(id != 0)] += 1.0;
        }
        let [rest, objects] = [0, 1].map(|i| sums[i] / counts[i]);
        assert!(objects > 2.0 * rest, "objects have {objects:.2}, the rest {rest:.2}");
    }

    /// Most of the region has a disparity, and hardly any is wrong.
    fn check(&self) {
        let truth = self.truth.disparity.as_ref().unwrap();
        let found = &self.perception.disparity;
        let (mut all, mut valid, mut wrong) = (0, 0, 0);
        for ((&d, &t), &inside) in
            found.pixels().iter().zip(truth.pixels()).zip(self.roi.matched.pixels())
        {
            if inside != 0 && !t.is_nan() {
                all += 1;
                valid += usize::from(!d.is_nan());
                wrong += usize::from((d - t).abs() > 3.0);
            }
        }
        assert!(10 * valid > 7 * all, "{valid} of {all} pixels have a disparity");
        assert!(20 * wrong < valid, "{wrong} of {valid} disparities are wrong");
    }
}

#[divan::bench]
fn coarse(bencher: Bencher<'_, '_>) {
    let mut scene = Scene::new(1.0);
    bencher.bench_local(scene.coarse());
}

#[divan::bench]
fn attention(bencher: Bencher<'_, '_>) {
    let mut scene = Scene::new(1.0);
    bencher.bench_local(scene.attention());
}

#[divan::bench]
fn region_of_interest(bencher: Bencher<'_, '_>) {
    let mut scene = Scene::new(1.0);
    bencher.bench_local(scene.region_of_interest());
}

#[divan::bench(args = [0.25, 1.0])]
fn stereo(bencher: Bencher<'_, '_>, fraction: f64) {
    let mut scene = Scene::new(fraction);
    bencher.bench_local(scene.stereo());
}

#[divan::bench(args = [0.25, 1.0])]
fn refine(bencher: Bencher<'_, '_>, fraction: f64) {
    let mut scene = Scene::new(fraction);
    bencher.bench_local(scene.refine());
}
