//! What the pipeline thread and the output thread do.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::Observer;
use super::align::Sampler;
use crate::drive::Engine;
use crate::input::Observation;
use crate::input::live::{ArrivedPair, FrameBuilder, FrameError, Topic};
use crate::mailbox::{Mailbox, Taken};
use crate::output::live::LiveOutput;
use crate::perception::Perception;
use crate::ros::diagnostics::{NodeStatus, Reporter, Surroundings};
use crate::ros::echo::EchoCaller;
use crate::ros::node::Graph;
use crate::ros::params::ParameterStore;
use crate::ros::time::NodeClock;

/// A frame and what was made of it, on the way to the output thread.
pub(super) struct Outcome {
    observation: Observation,
    perception: Perception,
    arrived: Instant,
}

/// Emptied results whose buffers are used again.
pub(super) type Spares = Arc<Mutex<Vec<Perception>>>;

/// The pipeline thread.
pub(super) struct Worker {
    pub store: Arc<ParameterStore>,
    pub status: Arc<NodeStatus>,
    pub resets: Arc<AtomicU64>,
    pub pairs: Arc<Mailbox<ArrivedPair>>,
    pub results: Arc<Mailbox<Outcome>>,
    pub spares: Spares,
    pub grays: Sampler,
}

impl Worker {
    /// Until no pair will come any more.
    pub fn run(mut self) {
        let mut config = self.store.config();
        let mut generation = self.store.generation();
        let mut resets = self.resets.load(Ordering::Acquire);
        let mut engine = Engine::new((*config).clone());
        let mut frames = FrameBuilder::default();
        loop {
            let ArrivedPair { pair, at: arrived } = match self.pairs.take(Duration::from_secs(1)) {
                Taken::Item(arrived) => arrived,
                Taken::Nothing => continue,
                Taken::Closed => break,
            };
            // The frame boundary: here, and only here, things change.
            if self.store.generation() != generation {
                generation = self.store.generation();
                config = self.store.config();
                engine.set_config((*config).clone());
            }
            let asked = self.resets.load(Ordering::Acquire);
            if asked != resets || pair.after_jump {
                if pair.after_jump {
                    tracing::warn!("stamps jumped back to {}: tracks start anew", pair.stamp);
                }
                resets = asked;
                engine.reset();
            }
            let frame = match frames.frame(&pair, config.calibration.baseline_override) {
                Ok(frame) => frame,
                Err(error) => {
                    self.refuse(&error);
                    continue;
                }
            };
            drop(pair);
            self.note_rig(&frame);
            // A fault in a kernel costs one frame, not the node.
            let processed = catch_unwind(AssertUnwindSafe(|| {
                let perception = engine.process(&frame);
                self.status.note_processed(
                    &perception.times,
                    perception.roi.fraction,
                    perception.regions.len(),
                    &perception.rejections,
                );
            }));
            if processed.is_err() {
                tracing::error!("internal fault while processing the frame at {}", frame.stamp);
                self.status.drop_frame("internal fault while processing".into());
                engine = Engine::new((*config).clone());
                continue;
            }
            self.grays.take(&engine, &config);
            self.status.note_ground(engine.footing());
            let spare = self.spares.lock().unwrap_or_else(PoisonError::into_inner).pop();
            let Some(perception) = engine.exchange(spare) else { continue };
            let observation = Observation { frame, truth: None };
            if let Some(old) = self.results.put(Outcome { observation, perception, arrived }) {
                self.status.count_output_displaced();
                give_back(&self.spares, old.perception);
            }
        }
        self.results.close();
    }

    fn refuse(&self, error: &FrameError) {
        let text = error.to_string();
        let is_calibration = matches!(error, FrameError::Calibration(_));
        let news = if is_calibration {
            self.status.set_calibration(Err(text.clone()))
        } else {
            // The first of its kind.
            !self.status.totals().dropped.contains_key(&text)
        };
        if news {
            tracing::warn!("frames are dropped: {text}");
        }
        self.status.drop_frame(text);
    }

    fn note_rig(&self, frame: &crate::perception::StereoFrame) {
        let rig = &frame.rig;
        let text = format!(
            "{} pixels, f = {:.2} px, B = {:.4} m",
            frame.left.size(),
            rig.focal_px(),
            rig.baseline_m
        );
        if self.status.set_calibration(Ok(text.clone())) {
            tracing::info!("calibration: {text}");
        }
    }
}

fn give_back(spares: &Spares, perception: Perception) {
    let mut spares = spares.lock().unwrap_or_else(PoisonError::into_inner);
    // One in the engine, one on the way, one being published.
    if spares.len() < 3 {
        spares.push(perception);
    }
}

/// The output thread.
pub(super) struct OutputThread {
    pub output: LiveOutput,
    pub echo: Option<EchoCaller>,
    pub observer: Option<Observer>,
    pub store: Arc<ParameterStore>,
    pub status: Arc<NodeStatus>,
    pub clock: Arc<NodeClock>,
    pub graph: Graph,
    pub topics: Vec<Topic>,
    pub receive_buffer_bytes: Option<usize>,
    pub node: String,
    pub results: Arc<Mailbox<Outcome>>,
    pub spares: Spares,
}

impl OutputThread {
    /// Until no result will come any more.
    pub fn run(mut self) {
        const PERIOD: Duration = Duration::from_secs(1);
        let mut reporter = Reporter::new(&self.node);
        let mut due = Instant::now() + PERIOD;
        loop {
            match self.results.take(due.saturating_duration_since(Instant::now())) {
                Taken::Item(Outcome { observation, perception, arrived }) => {
                    self.output.publish(&perception, &self.store.config());
                    let latency_ms = arrived.elapsed().as_secs_f64() * 1e3;
                    self.status.note_latency(latency_ms, perception.times.total());
                    if let Some(observer) = &mut self.observer {
                        observer(&observation, &perception);
                    }
                    give_back(&self.spares, perception);
                }
                Taken::Nothing => {}
                Taken::Closed => break,
            }
            if Instant::now() >= due {
                due = Instant::now() + PERIOD;
                let message = reporter.report(
                    self.clock.now(),
                    &self.status,
                    &self.store.config(),
                    &self.surroundings(),
                );
                self.output.publish_diagnostics(message);
                if let Some(echo) = &self.echo {
                    echo.call();
                }
            }
        }
    }

    fn surroundings(&self) -> Surroundings {
        Surroundings {
            receive_buffer_bytes: self.receive_buffer_bytes,
            receive_buffer_errors: std::fs::read_to_string("/proc/net/snmp")
                .ok()
                .and_then(|text| Surroundings::receive_buffer_errors_in(&text)),
            inputs: self
                .topics
                .iter()
                .map(|Topic { name, type_name }| {
                    let (publishers, others) = self.graph.publishers(name, type_name);
                    (name.clone(), *type_name, publishers, others)
                })
                .collect(),
        }
    }
}
