//! Stage times over many frames.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::EvenSample;
use crate::perception::{Stage, StageTimes};

/// Frames up to which percentiles are exact; beyond, an even sample is kept,
/// so that a run of any length fits into about 30 MB.
const EXACT_FRAMES: usize = 1 << 18;

/// Three percentiles in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
}

impl Percentiles {
    /// The percentiles of `values` by nearest rank: the smallest value that at
    /// least p percent of all values do not exceed. `None` without values;
    /// `values` are sorted on the way.
    pub fn of(values: &mut [f64]) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let rank = |percent: usize| {
            let index = (values.len() * percent).div_ceil(100).saturating_sub(1);
            values.get(index).copied()
        };
        Some(Self { p50: rank(50)?, p95: rank(95)?, p99: rank(99)? })
    }
}

/// Collects the stage times of all frames.
#[derive(Clone, Debug)]
pub struct StageStats {
    times: EvenSample<StageTimes>,
}

impl Default for StageStats {
    fn default() -> Self {
        Self { times: EvenSample::new(EXACT_FRAMES) }
    }
}

impl StageStats {
    /// Takes the times of one more frame.
    pub fn add(&mut self, times: &StageTimes) {
        self.times.offer(*times);
    }

    /// Number of frames taken.
    pub const fn frames(&self) -> u64 {
        self.times.seen()
    }

    /// The times that are kept: of every frame, or in a very long run of one
    /// frame in [`StageStats::stride`].
    pub fn samples(&self) -> &[StageTimes] {
        self.times.items()
    }

    /// One frame in how many is kept.
    pub const fn stride(&self) -> u64 {
        self.times.stride()
    }

    /// The percentiles so far; `None` before the first frame.
    pub fn summary(&self) -> Option<StageSummary> {
        let mut buffer = Vec::with_capacity(self.times.items().len());
        let mut percentiles = |value: &dyn Fn(&StageTimes) -> f64| {
            buffer.clear();
            buffer.extend(self.times.items().iter().map(value));
            Percentiles::of(&mut buffer)
        };
        let mut stages = [Percentiles::default(); Stage::ALL.len()];
        for (stage, slot) in Stage::ALL.into_iter().zip(&mut stages) {
            *slot = percentiles(&|times| times.get(stage))?;
        }
        Some(StageSummary {
            frames: self.frames(),
            stages,
            matching_ms: percentiles(&StageTimes::matching)?,
            total_ms: percentiles(&StageTimes::total)?,
        })
    }
}

/// Percentiles per stage, of matching and of the whole frame, in milliseconds.
///
/// As JSON: `{"frames": n, "stages": {"preprocess": {"p50": …, "p95": …, "p99": …}, …},
/// "matching_ms": {…}, "total_ms": {…}}`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StageSummary {
    /// Frames measured.
    pub frames: u64,
    /// One entry per stage, in the order of [`Stage::ALL`].
    #[serde(serialize_with = "by_name")]
    pub stages: [Percentiles; Stage::ALL.len()],
    /// Coarse pass, cost, aggregation, winner and post-processing.
    pub matching_ms: Percentiles,
    /// All stages.
    pub total_ms: Percentiles,
}

impl StageSummary {
    /// Percentiles of one stage.
    pub const fn get(&self, stage: Stage) -> Percentiles {
        self.stages[stage as usize]
    }
}

fn by_name<S: Serializer>(
    stages: &[Percentiles; Stage::ALL.len()],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(stages.len()))?;
    for (stage, percentiles) in Stage::ALL.iter().zip(stages) {
        map.serialize_entry(stage.name(), percentiles)?;
    }
    map.end()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        assert_eq!(Percentiles::of(&mut []), None);
        let one = Percentiles::of(&mut [7.0]).unwrap();
        assert_eq!((one.p50, one.p95, one.p99), (7.0, 7.0, 7.0));
        // The classic example: 15 20 35 40 50 has the 50th percentile 35.
        let five = Percentiles::of(&mut [50.0, 15.0, 40.0, 20.0, 35.0]).unwrap();
        assert_eq!((five.p50, five.p95, five.p99), (35.0, 50.0, 50.0));
        let mut hundred: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let all = Percentiles::of(&mut hundred).unwrap();
        assert_eq!((all.p50, all.p95, all.p99), (50.0, 95.0, 99.0));
    }

    #[test]
    fn the_summary_names_every_stage_and_adds_up_matching() {
        let mut stats = StageStats::default();
        assert_eq!(stats.summary(), None);
        let mut times = StageTimes::default();
        for (i, stage) in Stage::ALL.into_iter().enumerate() {
            times.set(stage, (i + 1) as f64);
        }
        stats.add(&times);
        let summary = stats.summary().unwrap();
        assert_eq!(summary.total_ms.p50, 45.0);
        // coarse 2, stereo 5, refine 6
        assert_eq!(summary.matching_ms.p99, 13.0);
        let json = serde_json::to_value(summary).unwrap();
        assert_eq!(json["stages"]["refine"]["p95"], 6.0);
        assert_eq!(json["stages"].as_object().unwrap().len(), Stage::ALL.len());
        assert_eq!(json["frames"], 1);
    }
}
