//! The methods that are compared: rows of the tables.

use serde_json::{Value, json};

use crate::config::Config;
use crate::error::ConfigError;
use crate::image::{Image, Size};

/// Largest `depth.max`, metres.
const FARTHEST_M: f64 = 10_000.0;

/// What a method does with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// The whole pipeline, with these parameters changed.
    Pipeline,
    /// An attention map that never looks: what the place in the picture alone
    /// is worth.
    Prior(Prior),
}

/// An attention map that is the same for every picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prior {
    /// A Gaussian at the centre, σ a quarter of each side.
    Centre,
    /// A horizontal band, Gaussian with σ = 0.15 of the height, at half height.
    Rows,
}

impl Prior {
    /// The map, 0..=255.
    pub fn map(self, size: Size) -> Image<u8> {
        let at = |i: usize, n: usize| (i as f32 + 0.5) / n as f32 - 0.5;
        Image::from_fn(size, |x, y| {
            let (u, v) = (at(x, size.width), at(y, size.height));
            let squares = match self {
                Self::Centre => (u / 0.25).powi(2) + (v / 0.25).powi(2),
                Self::Rows => (v / 0.15).powi(2),
            };
            (255.0 * (-0.5 * squares).exp()).round() as u8
        })
    }
}

/// One row of the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// What it is called in tables.
    pub label: &'static str,
    /// What it does.
    pub work: Work,
    /// True when the picture of its best and worst frame is kept.
    pub is_shown: bool,
    settings: &'static [(&'static str, Setting)],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Setting {
    Word(&'static str),
    Number(f64),
}

const fn pipeline(
    name: &'static str,
    label: &'static str,
    settings: &'static [(&'static str, Setting)],
) -> Method {
    Method { name, label, work: Work::Pipeline, is_shown: false, settings }
}

const fn shown(method: Method) -> Method {
    Method { is_shown: true, ..method }
}

const fn prior(name: &'static str, label: &'static str, prior: Prior) -> Method {
    Method { name, label, work: Work::Prior(prior), is_shown: false, settings: &[] }
}

use Setting::{Number, Word};

const COLOR: &str = "saliency.paper.color";
const ORIENTATION: &str = "saliency.paper.orientation";
const DEPTH: &str = "saliency.paper.depth";
const MOTION: &str = "saliency.paper.motion";
const MODE: &str = "saliency.mode";
const SMOOTHING: &str = "saliency.temporal_smoothing";

/// Every method, in the order of the tables: the baseline, attention by
/// spectral residual (Hou and Zhang 2007), by frequency tuning (Achanta et al.
/// 2009), by eq. 4 and by geometry; attention that never looks; the ablation of
/// eq. 4, whose last step has an area budget of 40 %.
pub const METHODS: &[Method] = &[
    pipeline("full_frame", "full-frame SGM", &[(MODE, Word("full_frame"))]),
    pipeline("spectral_residual", "spectral residual", &[(MODE, Word("spectral_residual"))]),
    pipeline("frequency_tuned", "frequency-tuned", &[(MODE, Word("frequency_tuned"))]),
    shown(pipeline("paper", "paper's fusion", &[(MODE, Word("paper"))])),
    shown(pipeline("scene", "scene (ours)", &[(MODE, Word("scene"))])),
    prior("centre", "baseline: centre", Prior::Centre),
    prior("rows", "baseline: rows", Prior::Rows),
    pipeline(
        "c1",
        "c1: intensity",
        &[
            (MODE, Word("paper")),
            (SMOOTHING, Number(0.0)),
            (COLOR, Number(0.0)),
            (ORIENTATION, Number(0.0)),
            (DEPTH, Number(0.0)),
            (MOTION, Number(0.0)),
        ],
    ),
    pipeline(
        "c2",
        "c2: + colour",
        &[
            (MODE, Word("paper")),
            (SMOOTHING, Number(0.0)),
            (ORIENTATION, Number(0.0)),
            (DEPTH, Number(0.0)),
            (MOTION, Number(0.0)),
        ],
    ),
    pipeline(
        "c3",
        "c3: + orientation",
        &[
            (MODE, Word("paper")),
            (SMOOTHING, Number(0.0)),
            (DEPTH, Number(0.0)),
            (MOTION, Number(0.0)),
        ],
    ),
    pipeline(
        "c4",
        "c4: + depth and motion (the paper's fusion)",
        &[(MODE, Word("paper")), (SMOOTHING, Number(0.0))],
    ),
    pipeline(
        "c5",
        "c5: + temporal smoothing and area budget",
        &[(MODE, Word("paper")), ("roi.max_fraction", Number(0.4))],
    ),
];

/// The method that all time is saved against.
pub const FULL_FRAME: &str = "full_frame";

/// The method that is ours.
pub const OURS: &str = "scene";

/// The methods of the cue ablation.
pub const ABLATION: [&str; 5] = ["c1", "c2", "c3", "c4", "c5"];

/// The method of that name.
pub fn method(name: &str) -> Option<&'static Method> {
    METHODS.iter().find(|method| method.name == name)
}

impl Method {
    /// `base` with the settings of this method. With one camera there is no
    /// disparity to search and no depth to gate by: the range of disparity is
    /// the smallest there is, and that of depth the largest.
    ///
    /// # Errors
    /// When the settings contradict those of `base`.
    pub fn config(&self, base: &Config, monocular: bool) -> Result<Config, ConfigError> {
        let settings = self.settings.iter().map(|(name, value)| match value {
            Word(word) => (*name, json!(word)),
            Number(number) => (*name, json!(number)),
        });
        let flat =
            [("stereo.disparity_range", Value::from(16)), ("depth.max", Value::from(FARTHEST_M))];
        base.with_all(settings.chain(flat.into_iter().filter(|_| monocular)))
    }

    /// True when there is something to compare on such data: a full frame of
    /// interest says nothing without disparity, a prior nothing without masks.
    pub const fn applies(&self, monocular: bool, has_masks: bool) -> bool {
        match self.work {
            Work::Prior(_) => has_masks,
            Work::Pipeline => !(monocular && matches!(self.name.as_bytes(), b"full_frame")),
        }
    }
}
