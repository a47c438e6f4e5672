//! Where the time of a frame goes.

/// A monotonic clock in nanoseconds. The core has none of its own: whoever
/// drives the pipeline passes one in, or [`Clock::none`].
#[derive(Clone, Copy, Debug)]
pub struct Clock(pub fn() -> u64);

impl Clock {
    /// A clock that stands still: all stage times are zero.
    pub const fn none() -> Self {
        Self(|| 0)
    }

    /// The time now in nanoseconds.
    pub fn now(self) -> u64 {
        (self.0)()
    }
}

/// The stages of the pipeline, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Stage {
    /// Resize, rectify, denoise, normalise, gray, gradient.
    Preprocess,
    /// Quarter-size full-frame disparity.
    Coarse,
    /// Cues and fusion.
    Saliency,
    /// Threshold, morphology, dilation.
    Roi,
    /// Cost, aggregation, winner.
    Stereo,
    /// Left-right check, median, speckles, confidence.
    Refine,
    /// Z = fB/d.
    Depth,
    /// Components and their measures.
    Regions,
    /// Identity over frames.
    Track,
}

impl Stage {
    /// All stages in their order.
    pub const ALL: [Self; 9] = [
        Self::Preprocess,
        Self::Coarse,
        Self::Saliency,
        Self::Roi,
        Self::Stereo,
        Self::Refine,
        Self::Depth,
        Self::Regions,
        Self::Track,
    ];

    /// Name in tables and diagnostics.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Preprocess => "preprocess",
            Self::Coarse => "coarse",
            Self::Saliency => "saliency",
            Self::Roi => "roi",
            Self::Stereo => "stereo",
            Self::Refine => "refine",
            Self::Depth => "depth",
            Self::Regions => "regions",
            Self::Track => "track",
        }
    }

    /// True for the stages that make up matching: coarse pass, cost,
    /// aggregation, winner and post-processing.
    pub const fn is_matching(self) -> bool {
        matches!(self, Self::Coarse | Self::Stereo | Self::Refine)
    }
}

/// Milliseconds per stage of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    ms: [f64; Stage::ALL.len()],
}

impl StageTimes {
    /// Milliseconds of one stage.
    pub const fn get(&self, stage: Stage) -> f64 {
        self.ms[stage as usize]
    }

    /// Sets the milliseconds of one stage.
    pub const fn set(&mut self, stage: Stage, ms: f64) {
        self.ms[stage as usize] = ms;
    }

    /// Milliseconds of all stages.
    pub fn total(&self) -> f64 {
        self.ms.iter().sum()
    }

    /// Milliseconds of coarse pass, cost, aggregation, winner and post-processing.
    pub fn matching(&self) -> f64 {
        Stage::ALL.into_iter().filter(|s| s.is_matching()).map(|s| self.get(s)).sum()
    }
}
