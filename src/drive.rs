//! Driving: a source of frames through the pipeline into sinks.

use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};
use thiserror::Error;

use crate::config::Config;
use crate::image::{Image, Size};
use crate::input::{FrameSource, Observation};
use crate::output::AnySink;
use crate::perception::{Clock, Perception, StereoFrame};
use crate::pipeline::Pipeline;
use crate::simd::{self, Level};
use crate::stage::ground::Footing;
use crate::stamp::Stamp;

/// What ends a drive early.
#[derive(Debug, Error)]
pub enum DriveError {
    /// The worker threads could not be started.
    #[error("cannot start {threads} worker threads: {source}")]
    Threads {
        /// How many were wanted (0: one per processor).
        threads: usize,
        /// What the system said.
        source: rayon::ThreadPoolBuildError,
    },
    /// The source failed.
    #[error("{0}")]
    Source(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// A sink failed.
    #[error("{0}")]
    Sink(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// The monotonic clock of the process.
pub fn monotonic_clock() -> Clock {
    static START: OnceLock<Instant> = OnceLock::new();
    Clock(|| START.get_or_init(Instant::now).elapsed().as_nanos() as u64)
}

/// The worker threads of the pipeline; `threads` = 0 takes all processors.
///
/// Run the frame loop inside [`ThreadPool::install`]: then a frame needs no
/// hand-over to the pool and allocates nothing.
///
/// # Errors
/// When the system refuses the threads.
pub fn worker_pool(threads: i64) -> Result<ThreadPool, DriveError> {
    let threads = usize::try_from(threads).unwrap_or(0);
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("stereo-{i}"))
        .build()
        .map_err(|source| DriveError::Threads { threads, source })
}

/// The pipeline with its outputs, built anew when pictures change their size
/// or the parameters change, and reset when time jumps back.
pub struct Engine {
    config: Config,
    level: Level,
    clock: Clock,
    centred_roi: Option<f32>,
    running: Option<Running>,
    /// The parameters have changed since `running` was built.
    stale: bool,
    last_stamp: Option<Stamp>,
    jumps_back: u64,
}

struct Running {
    size: Size,
    pipeline: Pipeline,
    perception: Perception,
}

impl Engine {
    /// An engine for a valid configuration.
    pub fn new(config: Config) -> Self {
        Self {
            config,
            level: simd::detect(),
            clock: monotonic_clock(),
            centred_roi: None,
            running: None,
            stale: false,
            last_stamp: None,
            jumps_back: 0,
        }
    }

    /// Matches a centred rectangle of this share of the image instead of what is salient.
    #[must_use]
    pub fn with_centred_roi(mut self, fraction: Option<f32>) -> Self {
        self.centred_roi = fraction;
        self
    }

    /// The parameters in force.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Changes the parameters from the next frame on. Tracks live on.
    pub fn set_config(&mut self, config: Config) {
        if config != self.config {
            self.config = config;
            self.stale = true;
        }
    }

    /// Forgets the previous frame and all tracks.
    pub fn reset(&mut self) {
        self.last_stamp = None;
        if let Some(running) = &mut self.running {
            running.pipeline.reset();
        }
    }

    /// How often a stamp jumped back and reset the state.
    pub fn jumps_back(&self) -> u64 {
        self.jumps_back
    }

    /// One frame. The result is valid until the next call.
    pub fn process(&mut self, frame: &StereoFrame) -> &Perception {
        if self.last_stamp.is_some_and(|last| frame.stamp < last) {
            tracing::warn!(stamp = %frame.stamp, "time jumped back: previous frame and tracks are forgotten");
            self.jumps_back += 1;
            self.reset();
        }
        self.last_stamp = Some(frame.stamp);

        let size = frame.left.size();
        let running = match self.running.take() {
            Some(running) if running.size == size && !self.stale => running,
            old => self.start(size, frame, old.map(|old| old.pipeline)),
        };
        self.stale = false;
        let running = self.running.insert(running);
        running.pipeline.process(frame, &mut running.perception);
        &running.perception
    }

    /// The gray views of the last frame, left and right, as they were matched.
    pub fn gray_views(&self) -> Option<[&Image<u8>; 2]> {
        let Running { pipeline, perception, .. } = self.running.as_ref()?;
        Some([&perception.left.gray, &pipeline.right().gray])
    }

    /// The plane that things stand on in the last frame; `None` in modes that look for none.
    pub fn footing(&self) -> Option<Footing> {
        self.running.as_ref()?.pipeline.footing()
    }

    /// Takes the result of the last frame out, so that it can be published
    /// while the next one is made; `spare` lends its buffers to the next frame.
    /// `None` when no frame was processed since the engine was built anew.
    pub fn exchange(&mut self, spare: Option<Perception>) -> Option<Perception> {
        let running = self.running.as_mut()?;
        let size = running.pipeline.output_size();
        let next = spare
            .filter(|spare| spare.left.gray.size() == size)
            .unwrap_or_else(|| Perception::new(size, Arc::clone(&running.perception.rig)));
        Some(std::mem::replace(&mut running.perception, next))
    }

    fn start(&self, size: Size, frame: &StereoFrame, old: Option<Pipeline>) -> Running {
        let mut pipeline = match old {
            Some(old) => old.reconfigured(&self.config, size, self.level),
            None => Pipeline::new(&self.config, size, self.level).with_clock(self.clock),
        };
        if let Some(fraction) = self.centred_roi {
            pipeline = pipeline.with_centred_roi(fraction);
        }
        let perception = Perception::new(pipeline.output_size(), Arc::clone(&frame.rig));
        Running { size, pipeline, perception }
    }
}

/// Whether a drive came to the end of its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The source had no more frames.
    Complete,
    /// The caller asked to stop.
    Interrupted,
}

/// Drives all frames of `source` through `engine` into `sinks` until the source
/// ends or `stop` is set. The sinks are finished in any case, so that what was
/// written is whole.
///
/// # Errors
/// The first failure of source or sink.
pub fn drive<S: FrameSource + Send>(
    source: &mut S,
    engine: &mut Engine,
    sinks: &mut [&mut (dyn AnySink + Send)],
    stop: &AtomicBool,
    mut watch: impl FnMut(&Observation, &Perception, &S) + Send,
) -> Result<Ending, DriveError> {
    let pool = worker_pool(engine.config().threads)?;
    let outcome = pool.install(|| {
        while !stop.load(Ordering::Relaxed) {
            let Some(observation) =
                source.next_observation().map_err(|e| DriveError::Source(Box::new(e)))?
            else {
                return Ok(Ending::Complete);
            };
            let perception = engine.process(&observation.frame);
            for sink in sinks.iter_mut() {
                sink.write_any(&observation, perception).map_err(DriveError::Sink)?;
            }
            watch(&observation, perception, source);
        }
        Ok(Ending::Interrupted)
    });
    let mut finished = Ok(());
    for sink in sinks.iter_mut() {
        sink.note_tally_any(source.tally());
        finished = finished.and(sink.finish_any().map_err(DriveError::Sink));
    }
    let ending = outcome?;
    finished.map(|()| ending)
}
