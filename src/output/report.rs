//! The report: one HTML file that shows a run, works offline and needs nothing
//! beside it.
//!
//! Memory and file are bounded whatever the length of the run: frames, plots
//! and times are evenly thinned out.

#![allow(
    clippy::format_push_string,
    clippy::format_collect,
    reason = "a page is put together once per run: that it can be read counts, not an allocation"
)]

mod frames;
mod keep;
mod layer;
mod page;
mod scores;
mod timing;

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::Sink;
use super::picture::PictureError;
use super::score::ScoreSink;
use crate::config::Config;
use crate::image::Size;
use crate::input::{Observation, Tally};
use crate::metric::{EvenSample, StageStats};
use crate::perception::{Perception, Rejections};
use crate::stamp::Stamp;
use keep::Kept;

/// Most frames that a report shows.
const MAX_FRAMES: usize = 60;

/// Most bytes of pictures in a report; in the file they are a third larger.
const MAX_PICTURE_BYTES: usize = 15 << 20;

/// Most points of a plot.
const MAX_POINTS: usize = 2000;

/// Why a report could not be written.
#[derive(Debug, Error)]
pub enum ReportError {
    /// The file could not be created.
    #[error("cannot create the report {path}: {source}")]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file could not be written.
    #[error("cannot write the report {path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A camera image could not be compressed.
    #[error("frame {frame} of the report: {source}")]
    Picture {
        /// Number of the frame, from 0.
        frame: u64,
        /// What the encoder said.
        source: PictureError,
    },
    /// A map could not be compressed.
    #[error("frame {frame} of the report: a map cannot be written as PNG: {source}")]
    Layer {
        /// Number of the frame, from 0.
        frame: u64,
        /// What the encoder said.
        source: png::EncodingError,
    },
}

/// What a report says about its run at the top.
#[derive(Clone, Debug)]
pub struct RunFacts {
    /// What was run: `replay`, `demo`.
    pub command: String,
    /// Where the frames came from, for people: a path or a topic name.
    pub source: String,
    /// The parameters of the run.
    pub config: Config,
}

/// Numbers of one frame for the plots.
#[derive(Clone, Debug)]
struct Row {
    index: u64,
    f1: Option<f64>,
    epe: Option<f64>,
    /// Track id and distance in metres.
    distances: Vec<(u32, f32)>,
}

/// Sums over all frames.
#[derive(Clone, Debug, Default)]
struct Totals {
    frames: u64,
    regions: u64,
    roi_fraction: f64,
    rejections: [u64; Rejections::KINDS],
    size: Option<Size>,
    first: Stamp,
    last: Stamp,
    frame_id: String,
}

impl Totals {
    fn add(&mut self, perception: &Perception) {
        if self.frames == 0 {
            self.first = perception.stamp;
            self.frame_id = perception.frame_id.to_string();
        }
        self.frames += 1;
        self.last = perception.stamp;
        self.size = Some(perception.left.gray.size());
        self.regions += perception.regions.len() as u64;
        self.roi_fraction += f64::from(perception.roi.fraction);
        for (sum, count) in self.rejections.iter_mut().zip(perception.rejections.counts()) {
            *sum += u64::from(count);
        }
    }
}

/// Writes the report of a run when it is finished.
#[derive(Debug)]
pub struct ReportSink {
    path: PathBuf,
    file: Option<File>,
    facts: RunFacts,
    totals: Totals,
    tally: Option<Tally>,
    counters: Vec<(String, u64)>,
    stats: StageStats,
    scores: ScoreSink,
    rows: EvenSample<Row>,
    kept: EvenSample<Kept>,
    budget: usize,
}

impl ReportSink {
    /// A report at `path`, whose folders are created. The file is created at
    /// once, so that a place that cannot be written to is known before the run.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(path: &Path, facts: RunFacts) -> Result<Self, ReportError> {
        let failed = |source| ReportError::Create { path: path.to_owned(), source };
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(failed)?;
        }
        let file = File::create(path).map_err(failed)?;
        let min_area = u32::try_from(facts.config.regions.min_area).unwrap_or(0);
        Ok(Self {
            path: path.to_owned(),
            file: Some(file),
            facts,
            totals: Totals::default(),
            tally: None,
            counters: Vec::new(),
            stats: StageStats::default(),
            scores: ScoreSink::new(min_area),
            rows: EvenSample::new(MAX_POINTS),
            kept: EvenSample::new(MAX_FRAMES),
            budget: MAX_PICTURE_BYTES,
        })
    }

    /// Keeps at most `bytes` of pictures instead of 15 MiB, but one frame at least.
    #[must_use]
    pub fn with_picture_budget(mut self, bytes: usize) -> Self {
        self.budget = bytes;
        self
    }

    /// Shows a count of the caller's beside those of the source.
    pub fn add_counter(&mut self, name: impl Into<String>, count: u64) {
        self.counters.push((name.into(), count));
    }

    fn keep(&mut self, perception: &Perception) -> Result<(), ReportError> {
        let index = self.kept.seen();
        let time = format!("{:.2} s", perception.stamp.seconds_since(self.totals.first));
        self.kept.try_offer(|| Kept::encode(perception, index, time))?;
        let too_heavy = |kept: &EvenSample<Kept>, budget| {
            kept.items().iter().map(Kept::weight).sum::<usize>() > budget
        };
        while self.kept.items().len() > 1 && too_heavy(&self.kept, self.budget) {
            self.kept.thin();
        }
        Ok(())
    }
}

impl Sink for ReportSink {
    type Error = ReportError;

    fn write(
        &mut self,
        observation: &Observation,
        perception: &Perception,
    ) -> Result<(), ReportError> {
        let index = self.totals.frames;
        self.totals.add(perception);
        self.stats.add(&perception.times);
        let score = self.scores.score(observation, perception);
        let distances = perception.regions.iter().filter(|r| r.median_depth.is_finite());
        self.rows.offer(Row {
            index,
            f1: score.as_ref().and_then(|s| s.regions).map(|r| r.f1),
            epe: score.as_ref().and_then(|s| s.disparity).map(|d| d.epe_px),
            distances: distances.map(|r| (r.track_id, r.median_depth)).collect(),
        });
        self.keep(perception)
    }

    fn note_tally(&mut self, tally: &Tally) {
        self.tally = Some(tally.clone());
    }

    fn finish(&mut self) -> Result<(), ReportError> {
        let Some(file) = self.file.take() else { return Ok(()) };
        let mut out = BufWriter::new(file);
        let written = page::write(self, &mut out).and_then(|()| out.flush());
        written.map_err(|source| ReportError::Write { path: self.path.clone(), source })
    }
}
