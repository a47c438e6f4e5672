//! All methods over the frames of one scene, frame by frame in turn, so that
//! all of them meet the same machine.

use std::collections::BTreeMap;

use thiserror::Error;

use super::maps::{MapError, MapFolder};
use super::method::{Method, Prior, Work};
use super::motion::Motion;
use super::part::{Part, Run};
use super::shots::{Shots, Verdict};
use super::store::Picture;
use super::truth::ViewTruth;
use crate::config::Config;
use crate::drive::Engine;
use crate::image::Image;
use crate::input::Observation;
use crate::metric::{Confusion, EvenSample, boundary_f, continuity, fill};
use crate::output::picture::PictureError;
use crate::output::score::ScoreSink;
use crate::perception::{Perception, Stage};

/// Most frames whose times are kept of one scene.
const MOST_TIMES: usize = 4096;

/// Why a scene cannot be measured.
#[derive(Debug, Error)]
pub enum MeasureError {
    /// A map cannot be written.
    #[error(transparent)]
    Map(#[from] MapError),
    /// A picture cannot be encoded.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

/// What is measured on.
#[derive(Clone, Debug, Default)]
pub struct Subject {
    /// Kind and folder of the data set.
    pub dataset: String,
    /// Name of the scene.
    pub scene: String,
    /// There is one camera only.
    pub monocular: bool,
    /// The frames have nothing to do with each other.
    pub stills: bool,
}

/// The measurement of one scene.
pub struct Measure<'a> {
    subject: Subject,
    trials: Vec<Trial>,
    motion: Motion,
    truth: ViewTruth,
    maps: Option<&'a MapFolder>,
}

/// One method at work on the scene.
struct Trial {
    method: &'static Method,
    part: Part,
    engine: Engine,
    scores: ScoreSink,
    times: EvenSample<[f64; Stage::ALL.len()]>,
    shots: Shots,
    map: Image<u8>,
    mask_before: Image<u8>,
}

impl<'a> Measure<'a> {
    /// A measurement of `subject` by methods with their parameters.
    pub fn new(
        subject: Subject,
        methods: &[(&'static Method, Config)],
        run: &Run,
        threads: usize,
        maps: Option<&'a MapFolder>,
    ) -> Self {
        let trials = methods.iter().map(|(method, config)| Trial {
            method,
            part: Part {
                dataset: subject.dataset.clone(),
                scene: subject.scene.clone(),
                method: method.name.to_owned(),
                run: run.with_config(config, threads),
                monocular: subject.monocular,
                ..Part::default()
            },
            engine: Engine::new(config.clone()),
            scores: ScoreSink::new(config.regions.min_area as u32),
            times: EvenSample::new(MOST_TIMES),
            shots: Shots::default(),
            map: Image::default(),
            mask_before: Image::default(),
        });
        Self {
            trials: trials.collect(),
            subject,
            motion: Motion::default(),
            truth: ViewTruth::default(),
            maps,
        }
    }

    /// One frame through all methods; `name` is that of its image.
    ///
    /// # Errors
    /// When a map or a picture cannot be written.
    pub fn frame(&mut self, observation: &Observation, name: &str) -> Result<(), MeasureError> {
        let first = self.trials.iter().all(|trial| trial.part.frames == 0);
        if self.subject.stills {
            self.motion.clear();
        }
        self.motion.run(&observation.frame.left);
        self.truth.advance();
        for trial in &mut self.trials {
            match trial.method.work {
                Work::Pipeline => {
                    trial.pipeline(
                        observation,
                        &self.subject,
                        first,
                        &mut self.truth,
                        &self.motion,
                    )?;
                }
                Work::Prior(prior) => trial.prior(prior, observation, &mut self.truth),
            }
            if let Some(maps) = self.maps {
                let Subject { dataset, scene, stills, .. } = &self.subject;
                let scene = (!stills).then_some(scene.as_str());
                maps.write(dataset, trial.method.name, scene, name, &trial.map)?;
            }
        }
        Ok(())
    }

    /// The parts with their pictures; `skipped` is what could not be used.
    pub fn finish(self, skipped: &BTreeMap<String, u64>) -> Vec<(Part, Vec<Picture>)> {
        let finished = self.trials.into_iter().map(|trial| {
            let mut part = trial.part;
            part.skipped.clone_from(skipped);
            part.times = trial.times.items().to_vec();
            part.scores = trial.scores.scores().clone();
            let (gallery, pictures) = trial.shots.finish();
            part.gallery = gallery;
            (part, pictures)
        });
        finished.collect()
    }
}

impl Trial {
    fn pipeline(
        &mut self,
        observation: &Observation,
        subject: &Subject,
        first: bool,
        truth: &mut ViewTruth,
        motion: &Motion,
    ) -> Result<(), MeasureError> {
        let frame = &observation.frame;
        if first || subject.stills {
            // Buffers are filled for the first time, which is not the work of a frame.
            self.engine.reset();
            self.engine.process(frame);
            self.engine.reset();
        }
        let perception = self.engine.process(frame);
        let part = &mut self.part;
        if first {
            let size = frame.left.size();
            part.size = [size.width, size.height];
        }
        part.frames += 1;
        self.times.offer(Stage::ALL.map(|stage| perception.times.get(stage)));
        part.matched.add(f64::from(perception.roi.fraction));

        let saliency = perception.saliency();
        self.map.resize(saliency.size());
        for (byte, s) in self.map.pixels_mut().iter_mut().zip(saliency.pixels()) {
            *byte = (s.clamp(0.0, 1.0) * 255.0).round() as u8;
        }
        truth.fit(observation.truth.as_ref(), perception.labels.size());
        let mut verdict = None;
        if let Some(mask) = truth.mask() {
            verdict = Some(score_mask(part, &self.map, perception, mask));
            if !subject.stills {
                part.video.add_frame(&perception.roi.salient, mask);
                let now = &perception.roi.salient;
                if let Some(flow) = motion.flow(now.size())
                    && let Some(true_before) = truth.mask_before()
                    && self.mask_before.size() == now.size()
                {
                    part.video.add_stability(&self.mask_before, now, &flow);
                    part.video.add_true_stability(true_before, mask, &flow);
                }
            }
        }
        self.mask_before.copy_from(&perception.roi.salient);
        if !subject.monocular {
            let score = self.scores.score(observation, perception);
            score_disparity(part, perception, truth);
            if let Some(mask) = truth.mask() {
                part.boundary.add(boundary_f(&regions_mask(perception), mask));
                let f1 = score.as_ref().and_then(|score| score.regions).map(|regions| regions.f1);
                verdict = f1.map(|value| Verdict {
                    measure: "region F1 at IoU 0.5",
                    value,
                    more_is_better: true,
                });
            } else if let Some(score) = score.and_then(|score| score.disparity) {
                verdict = Some(Verdict {
                    measure: "D1 in the region of interest",
                    value: score.d1,
                    more_is_better: false,
                });
            }
        }
        if let Some(verdict) = verdict.filter(|_| self.method.is_shown) {
            self.shots.offer(part.frames - 1, verdict, perception, truth.mask())?;
        }
        Ok(())
    }

    fn prior(&mut self, prior: Prior, observation: &Observation, truth: &mut ViewTruth) {
        let full = observation.frame.left.size();
        // Other methods have already brought the truth to the size of the views.
        truth.fit(observation.truth.as_ref(), full);
        let size = truth.size();
        if self.map.size() != size {
            self.map = prior.map(size);
        }
        self.part.size = [full.width, full.height];
        self.part.frames += 1;
        if let Some(mask) = truth.mask() {
            score_map(&mut self.part, &self.map, mask);
        }
    }
}

fn score_map(part: &mut Part, map: &Image<u8>, mask: &Image<u8>) {
    // A mask without a salient pixel has no precision: it is left out of both.
    part.map.add(map, mask);
    part.stretched_map.add_stretched(map, mask);
}

/// The attention map and the salient mask against the true mask; the mask's F1
/// is the verdict on a frame.
fn score_mask(
    part: &mut Part,
    map: &Image<u8>,
    perception: &Perception,
    mask: &Image<u8>,
) -> Verdict {
    score_map(part, map, mask);
    let mut pixels = Confusion::default();
    let salient = perception.roi.salient.pixels().iter();
    pixels.add(salient.zip(mask.pixels()).map(|(salient, truth)| (*salient != 0, *truth != 0)));
    part.salient.merge(&pixels);
    Verdict {
        measure: "F1 of the salient mask",
        value: pixels.f1().unwrap_or(1.0),
        more_is_better: true,
    }
}

/// Disparity against truth, beyond what [`ScoreSink`] counts.
fn score_disparity(part: &mut Part, perception: &Perception, truth: &ViewTruth) {
    let (Some(true_disparity), Some(all)) = (truth.disparity(), truth.all_disparity()) else {
        return;
    };
    let found = &perception.disparity;
    let matched = || perception.roi.matched.pixels().iter().map(|inside| *inside != 0);
    let pairs = |found: &Image<f32>, truth: &Image<f32>| {
        let pairs = found.pixels().iter().copied().zip(truth.pixels().iter().copied());
        pairs.collect::<Vec<(f32, f32)>>()
    };
    let visible = pairs(found, true_disparity);
    part.frame.add(visible.iter().copied());
    part.errors.add(inside(&visible, matched()));

    let mut filled = found.clone();
    fill(&mut filled);
    let filled = pairs(&filled, all);
    part.filled_frame.add(filled.iter().copied());
    part.filled_roi.add(inside(&filled, matched()));

    let confident = visible.iter().zip(perception.confidence.pixels()).zip(matched());
    let mut errors: Vec<(f32, f32)> = confident
        .filter(|((pair, confidence), inside)| {
            *inside && **confidence > 0.0 && pair.0.is_finite() && pair.1.is_finite()
        })
        .map(|((pair, confidence), _)| (*confidence, (pair.0 - pair.1).abs()))
        .collect();
    part.sparsification.add(&mut errors);

    part.continuity.merge(&continuity(found, &perception.labels));
    part.true_continuity.merge(&continuity(true_disparity, &perception.labels));
}

/// 255 on every region.
fn regions_mask(perception: &Perception) -> Image<u8> {
    let labels = &perception.labels;
    Image::from_fn(labels.size(), |x, y| if labels.get(x, y) == 0 { 0 } else { 255 })
}

/// The pairs inside a mask.
fn inside(
    pairs: &[(f32, f32)],
    mask: impl Iterator<Item = bool>,
) -> impl Iterator<Item = (f32, f32)> {
    pairs.iter().copied().zip(mask).filter(|(_, inside)| *inside).map(|(pair, _)| pair)
}
