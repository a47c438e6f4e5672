//! The table of parameters: name, description, range, and when it may change.

use serde_json::Value;

use crate::error::ConfigError;

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// True or false.
    Bool,
    /// Any text.
    Text,
    /// Whole numbers, both ends included.
    Integer(i64, i64),
    /// One of these whole numbers.
    OneOf(&'static [i64]),
    /// Finite numbers, both ends included.
    Real(f64, f64),
    /// One of these words.
    Choice(&'static [&'static str]),
}

/// One parameter as users see it.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Flat name, as in `ros2 param get`.
    pub name: &'static str,
    /// What it does, with its unit.
    pub description: &'static str,
    /// What it may be.
    pub range: Range,
    /// True when it is read once at start and refused afterwards.
    pub start_only: bool,
}

const fn live(name: &'static str, range: Range, description: &'static str) -> Field {
    Field { name, description, range, start_only: false }
}

const fn start(name: &'static str, range: Range, description: &'static str) -> Field {
    Field { name, description, range, start_only: true }
}

use Range::{Bool, Choice, Integer, OneOf, Real, Text};

/// Every parameter, in the order in which files and listings show them.
pub const FIELDS: &[Field] = &[
    start(
        "input",
        Choice(&["two_topics", "side_by_side"]),
        "Two image topics, or one image_raw that holds both views side by side, split in the middle.",
    ),
    start(
        "image_transport",
        Choice(&["raw", "compressed"]),
        "raw: sensor_msgs/Image. compressed: sensor_msgs/CompressedImage on <topic>/compressed.",
    ),
    start(
        "rectify",
        Bool,
        "Subscribe to image_raw instead of image_rect and rectify with K, D, R and P of the camera infos.",
    ),
    live("queue_size", Integer(1, 100), "Messages kept per input while waiting for their partner."),
    live(
        "sync.mode",
        Choice(&["auto", "exact", "approximate"]),
        "exact: equal stamps only. approximate: nearest stamps within the tolerance. auto: exact until stamps differ.",
    ),
    live(
        "approximate_sync_tolerance_seconds",
        Real(0.0, 1.0),
        "Largest difference of left and right stamp in a pair, in seconds.",
    ),
    live(
        "camera_info.policy",
        Choice(&["cached", "synced"]),
        "cached: the latest camera info serves every image. synced: only the one with the image's stamp.",
    ),
    start(
        "camera_info.left_url",
        Text,
        "Calibration YAML of the left camera (camera_calibration format), used instead of its topic.",
    ),
    start(
        "camera_info.right_url",
        Text,
        "Calibration YAML of the right camera (camera_calibration format), used instead of its topic.",
    ),
    live(
        "input_timeout",
        Real(0.1, 3600.0),
        "Seconds without a pair after which diagnostics report an error.",
    ),
    live(
        "calibration.baseline_override",
        Real(0.0, 100.0),
        "Baseline in metres that replaces the one of the camera infos; 0 switches it off.",
    ),
    live(
        "preprocess.scale",
        OneOf(&[1, 2, 4]),
        "Images are made smaller by this factor before everything else; all outputs have the smaller size.",
    ),
    live(
        "preprocess.denoise",
        Choice(&["none", "median3", "gaussian3"]),
        "Noise filter of both views.",
    ),
    live(
        "preprocess.illumination",
        Choice(&["none", "clahe", "match"]),
        "Illumination normalisation of both gray views.",
    ),
    live(
        "saliency.mode",
        Choice(&["scene", "paper", "frequency_tuned", "spectral_residual", "full_frame"]),
        "How the attention map is made; full_frame matches every pixel.",
    ),
    live(
        "saliency.paper.intensity",
        Real(0.0, 1.0),
        "Weight alpha of the intensity cue in mode paper.",
    ),
    live("saliency.paper.color", Real(0.0, 1.0), "Weight beta of the colour cue in mode paper."),
    live(
        "saliency.paper.orientation",
        Real(0.0, 1.0),
        "Weight gamma of the orientation cue in mode paper.",
    ),
    live("saliency.paper.depth", Real(0.0, 1.0), "Weight delta of the depth cue in mode paper."),
    live(
        "saliency.paper.motion",
        Real(0.0, 1.0),
        "Weight epsilon of the motion cue in mode paper.",
    ),
    live(
        "saliency.threshold",
        Real(0.0, 1.0),
        "Saliency from which a pixel is of interest, with threshold_mode fixed.",
    ),
    live(
        "saliency.threshold_mode",
        Choice(&["fixed", "otsu"]),
        "fixed: saliency.threshold. otsu: chosen from each map's histogram.",
    ),
    live(
        "saliency.temporal_smoothing",
        Real(0.0, 1.0),
        "Share of the previous frame's map in this frame's where they are alike, half of it where they differ much; 0 switches it off.",
    ),
    live(
        "roi.dilation",
        Integer(0, 64),
        "Border around salient pixels that is matched too, in pixels; 5 to 9 recommended.",
    ),
    live(
        "roi.max_fraction",
        Real(0.01, 1.0),
        "Largest share of the image that is matched; the most salient tiles are kept.",
    ),
    live("stereo.algorithm", Choice(&["semi_global", "block", "census_block"]), "The matcher."),
    live(
        "stereo.paths",
        OneOf(&[4, 5, 8]),
        "Paths of the semi-global matcher: 8 are the most accurate; 5 leave out those from below, 4 the diagonals: faster, and less accurate where holes are filled.",
    ),
    live("stereo.min_disparity", Integer(0, 511), "Smallest disparity searched, in pixels."),
    live("stereo.disparity_range", Integer(16, 512), "Number of disparities searched, in pixels."),
    live(
        "stereo.p1",
        Integer(0, 100),
        "Penalty of a disparity step of one pixel, in units of the matching cost.",
    ),
    live(
        "stereo.p2",
        Integer(0, 100),
        "Penalty of a larger disparity step between pixels of equal brightness, in units of the matching cost; it falls by twice their difference. At quarter size it is five sixths of it.",
    ),
    live(
        "stereo.uniqueness_ratio",
        Integer(0, 100),
        "Percentage by which the best cost must beat the second best, in the mean over the matched ones of the 9x9 pixels around.",
    ),
    live(
        "stereo.disp12_max_diff",
        Integer(-1, 64),
        "Largest difference of left and right disparity in pixels; -1 switches the check off.",
    ),
    live(
        "stereo.speckle_size",
        Integer(0, 10_000),
        "Smaller connected patches of disparity are removed, in pixels; 0 switches it off.",
    ),
    live(
        "stereo.speckle_range",
        Real(0.0, 64.0),
        "Largest disparity step inside one patch, in pixels.",
    ),
    live(
        "stereo.fill",
        Choice(&["off", "roi"]),
        "Whether holes inside the region of interest take a neighbour's disparity, with confidence 0.5.",
    ),
    live(
        "stereo.saliency_weight",
        Real(0.0, 4.0),
        "Lambda of eq. 6: how much more the matching cost counts where saliency is high; 0 switches it off.",
    ),
    live(
        "depth.min",
        Real(0.0, 1000.0),
        "Smallest depth reported in metres; nearer is -Inf (REP 117).",
    ),
    live(
        "depth.max",
        Real(0.01, 10_000.0),
        "Largest depth reported in metres; farther is +Inf (REP 117).",
    ),
    live(
        "depth.encoding",
        Choice(&["32FC1", "16UC1"]),
        "Depth image in metres (32FC1) or millimetres (16UC1).",
    ),
    live("min_confidence", Real(0.0, 1.0), "Disparities of lower confidence are invalid."),
    live(
        "regions.min_area",
        Integer(1, 10_000_000),
        "Smallest region in pixels. On a ground or table regions of a confidence below 0.45 are refused as well: small ones with few disparities.",
    ),
    live(
        "regions.max_count",
        Integer(1, 1000),
        "Most regions per frame; the first by priority are kept.",
    ),
    live("regions.publish_masks", Bool, "Fill the mask field of each region (PNG)."),
    live(
        "regions.contour_tolerance",
        Real(0.0, 100.0),
        "Largest distance of the published contour from the true boundary, in pixels.",
    ),
    live("tracking.enabled", Bool, "Follow regions over frames and give them ids."),
    live("tracking.min_iou", Real(0.0, 1.0), "Least overlap of boxes that continues a track."),
    live(
        "tracking.confirm",
        Integer(1, 3),
        "Of the last three frames, those in which a track must be seen before it is active.",
    ),
    live(
        "tracking.max_age",
        Real(0.0, 60.0),
        "Seconds for which a track that is not seen is published as coasted at most; its id is remembered three times as long.",
    ),
    live(
        "lazy",
        Bool,
        "Compute and publish a topic only while it has subscribers (regions and diagnostics always).",
    ),
    start("threads", Integer(0, 1024), "Worker threads; 0 takes all processors."),
    live(
        "max_latency",
        Real(0.0, 60.0),
        "Time budget per frame in seconds, kept by matching fewer tiles; 0 switches it off.",
    ),
    live("use_sim_time", Bool, "Take the node's time from /clock."),
];

/// The parameter called `name`.
///
/// # Errors
/// [`ConfigError::UnknownName`], with the most similar name.
pub fn field(name: &str) -> Result<&'static Field, ConfigError> {
    FIELDS.iter().find(|f| f.name == name).ok_or_else(|| ConfigError::unknown(name))
}

impl Field {
    /// `value` in this parameter's own type, if it is allowed.
    pub(super) fn checked(&self, value: Value) -> Result<Value, ConfigError> {
        let wrong_type = |wanted: &'static str, value: &Value| ConfigError::WrongType {
            name: self.name,
            wanted,
            value: value.to_string(),
        };
        let inside = match (self.range, &value) {
            (Bool, Value::Bool(_)) | (Text, Value::String(_)) => true,
            (Integer(min, max), _) => {
                let number = value.as_i64().ok_or_else(|| wrong_type("a whole number", &value))?;
                (min..=max).contains(&number)
            }
            (OneOf(allowed), _) => {
                let number = value.as_i64().ok_or_else(|| wrong_type("a whole number", &value))?;
                allowed.contains(&number)
            }
            (Real(min, max), _) => {
                let number = value.as_f64().ok_or_else(|| wrong_type("a number", &value))?;
                if !(min..=max).contains(&number) {
                    return Err(self.out_of_range(&value));
                }
                return Ok(Value::from(number));
            }
            (Choice(allowed), _) => {
                let word = value.as_str().ok_or_else(|| wrong_type("a word", &value))?;
                allowed.contains(&word)
            }
            (Bool, _) => return Err(wrong_type("true or false", &value)),
            (Text, _) => return Err(wrong_type("a text", &value)),
        };
        if inside { Ok(value) } else { Err(self.out_of_range(&value)) }
    }

    fn out_of_range(&self, value: &Value) -> ConfigError {
        ConfigError::OutOfRange {
            name: self.name,
            value: value.to_string(),
            allowed: self.range.to_string(),
        }
    }
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Bool => f.write_str("true or false"),
            Text => f.write_str("any text"),
            Integer(min, max) => write!(f, "[{min}, {max}]"),
            Real(min, max) => write!(f, "[{min}, {max}]"),
            OneOf(allowed) => write!(f, "one of {allowed:?}"),
            Choice(allowed) => write!(f, "one of {}", allowed.join(", ")),
        }
    }
}
