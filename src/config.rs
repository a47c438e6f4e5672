//! Every parameter of the node: names, defaults, ranges and descriptions.
//!
//! [`Config::default`] is the only place where a default lives and [`FIELDS`]
//! the only place where a range lives. The ROS parameters, the YAML files, the
//! command line's `--set` and the parameter services are all derived from the
//! two by flattening (`saliency.paper.color` names `config.saliency.paper.color`).

mod field;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

pub use field::{FIELDS, Field, Range, field};

use crate::error::ConfigError;

macro_rules! choice {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum $name { $($(#[$vdoc])* $variant),+ }
    };
}

choice!(
    /// Where the two views come from.
    Input {
        /// One topic per camera.
        TwoTopics,
        /// One image that holds the left and the right half.
        SideBySide,
    }
);
choice!(
    /// How images travel.
    ImageTransport {
        /// `sensor_msgs/Image`.
        Raw,
        /// `sensor_msgs/CompressedImage` on `<topic>/compressed`.
        Compressed,
    }
);
choice!(
    /// When two stamps make a pair.
    SyncMode {
        /// Exact while stamps coincide, approximate from the first time they do not.
        Auto,
        /// Equal stamps only.
        Exact,
        /// Nearest stamps within the tolerance.
        Approximate,
    }
);
choice!(
    /// Which camera info belongs to an image.
    CameraInfoPolicy {
        /// The latest one received.
        Cached,
        /// The one with the image's own stamp.
        Synced,
    }
);
choice!(
    /// Noise filter before everything else.
    Denoise {
        /// No filter.
        None,
        /// 3x3 median.
        Median3,
        /// 3x3 binomial.
        Gaussian3,
    }
);
choice!(
    /// Illumination normalisation of the gray views.
    Illumination {
        /// Left as it is.
        None,
        /// Contrast-limited adaptive histogram equalisation of both views.
        Clahe,
        /// Mean and contrast of the right view matched to the left one.
        Match,
    }
);
choice!(
    /// How the attention map is made.
    SaliencyMode {
        /// Geometry first: height above ground, lateral contrast, nearness, minimum barrier, motion.
        Scene,
        /// The linear fusion of eq. 4 with its five cues.
        Paper,
        /// Frequency-tuned saliency (Achanta et al. 2009).
        FrequencyTuned,
        /// Spectral residual (Hou and Zhang 2007).
        SpectralResidual,
        /// Everything is of interest: dense stereo, the baseline.
        FullFrame,
    }
);
choice!(
    /// How the attention map is cut.
    ThresholdMode {
        /// At `saliency.threshold`.
        Fixed,
        /// At the value that separates two classes best (Otsu 1979).
        Otsu,
    }
);
choice!(
    /// The matcher.
    Algorithm {
        /// Semi-global matching of census costs.
        SemiGlobal,
        /// Sums of absolute differences over a block.
        Block,
        /// Sums of census distances over a block.
        CensusBlock,
    }
);
choice!(
    /// What becomes of holes in the disparity.
    Fill {
        /// They stay.
        Off,
        /// Those inside the region of interest take a neighbour's disparity, with less confidence.
        Roi,
    }
);

/// Encoding of the published depth image (REP 118).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DepthEncoding {
    /// Metres as floats.
    #[serde(rename = "32FC1")]
    F32,
    /// Millimetres as integers, 0 for unknown.
    #[serde(rename = "16UC1")]
    U16,
}

macro_rules! group {
    ($(#[$doc:meta])* $name:ident { $($field:ident: $type:ty = $default:expr),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        #[allow(missing_docs, reason = "each field's description stands in FIELDS, once")]
        pub struct $name { $(pub $field: $type),+ }
        impl Default for $name {
            fn default() -> Self { Self { $($field: $default),+ } }
        }
    };
}

group!(
    /// All parameters. Descriptions and ranges: [`FIELDS`].
    Config {
        input: Input = Input::TwoTopics,
        image_transport: ImageTransport = ImageTransport::Raw,
        rectify: bool = false,
        queue_size: i64 = 10,
        sync: Sync = Sync::default(),
        approximate_sync_tolerance_seconds: f64 = 0.005,
        camera_info: CameraInfo = CameraInfo::default(),
        input_timeout: f64 = 5.0,
        calibration: Calibration = Calibration::default(),
        preprocess: Preprocess = Preprocess::default(),
        saliency: Saliency = Saliency::default(),
        roi: Roi = Roi::default(),
        stereo: Stereo = Stereo::default(),
        depth: Depth = Depth::default(),
        min_confidence: f64 = 0.0,
        regions: Regions = Regions::default(),
        tracking: Tracking = Tracking::default(),
        lazy: bool = true,
        threads: i64 = 0,
        max_latency: f64 = 0.0,
        use_sim_time: bool = false,
    }
);
group!(
    /// `sync.*`
    Sync { mode: SyncMode = SyncMode::Auto }
);
group!(
    /// `camera_info.*`
    CameraInfo {
        policy: CameraInfoPolicy = CameraInfoPolicy::Cached,
        left_url: String = String::new(),
        right_url: String = String::new(),
    }
);
group!(
    /// `calibration.*`
    Calibration { baseline_override: f64 = 0.0 }
);
group!(
    /// `preprocess.*`
    Preprocess {
        scale: i64 = 1,
        denoise: Denoise = Denoise::None,
        illumination: Illumination = Illumination::None,
    }
);
group!(
    /// `saliency.*`
    Saliency {
        mode: SaliencyMode = SaliencyMode::Scene,
        paper: Paper = Paper::default(),
        threshold: f64 = 0.55,
        threshold_mode: ThresholdMode = ThresholdMode::Fixed,
        temporal_smoothing: f64 = 0.9,
    }
);
group!(
    /// `saliency.paper.*`: α, β, γ, δ, ε of eq. 4.
    Paper {
        intensity: f64 = 0.25,
        color: f64 = 0.20,
        orientation: f64 = 0.15,
        depth: f64 = 0.30,
        motion: f64 = 0.10,
    }
);
group!(
    /// `roi.*`
    Roi { dilation: i64 = 7, max_fraction: f64 = 1.0 }
);
group!(
    /// `stereo.*`
    Stereo {
        algorithm: Algorithm = Algorithm::SemiGlobal,
        paths: i64 = 8,
        min_disparity: i64 = 0,
        disparity_range: i64 = 192,
        p1: i64 = 8,
        p2: i64 = 96,
        uniqueness_ratio: i64 = 16,
        disp12_max_diff: i64 = 2,
        speckle_size: i64 = 150,
        speckle_range: f64 = 1.0,
        fill: Fill = Fill::Off,
        saliency_weight: f64 = 0.0,
    }
);
group!(
    /// `depth.*`
    Depth { min: f64 = 0.1, max: f64 = 80.0, encoding: DepthEncoding = DepthEncoding::F32 }
);
group!(
    /// `regions.*`
    Regions {
        min_area: i64 = 150,
        max_count: i64 = 64,
        publish_masks: bool = true,
        contour_tolerance: f64 = 1.0,
    }
);
group!(
    /// `tracking.*`
    Tracking { enabled: bool = true, min_iou: f64 = 0.3, confirm: i64 = 2, max_age: f64 = 0.5 }
);

impl Config {
    /// Every parameter by its flat name, in the order of [`FIELDS`].
    pub fn flatten(&self) -> Vec<(&'static str, Value)> {
        let tree = self.tree();
        FIELDS
            .iter()
            .filter_map(|field| Some((field.name, lookup(&tree, field.name)?.clone())))
            .collect()
    }

    /// The value of one parameter.
    ///
    /// # Errors
    /// [`ConfigError::UnknownName`] when there is no such parameter.
    pub fn value(&self, name: &str) -> Result<Value, ConfigError> {
        let field = field(name)?;
        lookup(&self.tree(), field.name).cloned().ok_or_else(|| ConfigError::unknown(name))
    }

    /// This configuration with one parameter changed.
    ///
    /// An integer is taken where a real number is wanted (`1` for `1.0`).
    ///
    /// # Errors
    /// Unknown name, wrong type, value out of range, or a value that
    /// contradicts another parameter; the text says which and what is allowed.
    pub fn with(&self, name: &str, value: &Value) -> Result<Self, ConfigError> {
        self.with_all([(name, value.clone())])
    }

    /// This configuration with several parameters changed at once: either all
    /// of them are taken or none, and the cross-checks see the final state.
    ///
    /// # Errors
    /// As [`Config::with`], for the first value that cannot be taken.
    pub fn with_all<'a>(
        &self,
        values: impl IntoIterator<Item = (&'a str, Value)>,
    ) -> Result<Self, ConfigError> {
        let mut tree = self.tree();
        for (name, value) in values {
            let field = field(name)?;
            let value = field.checked(value)?;
            if let Some(slot) = lookup_mut(&mut tree, field.name) {
                *slot = value;
            }
        }
        let config: Self = serde_json::from_value(tree)
            .map_err(|e| ConfigError::Inconsistent { reason: e.to_string() })?;
        config.check_consistency()?;
        Ok(config)
    }

    /// Checks every range and the relations between parameters, for a
    /// configuration that was built field by field.
    ///
    /// # Errors
    /// The first violation, with the name, the value and what is allowed.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.with_all(self.flatten()).map(|_| ())
    }

    fn check_consistency(&self) -> Result<(), ConfigError> {
        let inconsistent = |reason: String| Err(ConfigError::Inconsistent { reason });
        if self.depth.min >= self.depth.max {
            return inconsistent(format!(
                "depth.min ({}) must be less than depth.max ({})",
                self.depth.min, self.depth.max
            ));
        }
        if self.stereo.p1 > self.stereo.p2 {
            return inconsistent(format!(
                "stereo.p1 ({}) must not exceed stereo.p2 ({})",
                self.stereo.p1, self.stereo.p2
            ));
        }
        let paper = &self.saliency.paper;
        if paper.intensity + paper.color + paper.orientation + paper.depth + paper.motion <= 0.0 {
            return inconsistent("the saliency.paper weights are all zero".into());
        }
        Ok(())
    }

    fn tree(&self) -> Value {
        // A struct of numbers, strings, booleans and such structs always has a
        // JSON form; an empty object would fail every look-up that follows.
        serde_json::to_value(self).unwrap_or_else(|_| Value::Object(Map::new()))
    }
}

fn lookup<'a>(tree: &'a Value, name: &str) -> Option<&'a Value> {
    name.split('.').try_fold(tree, |node, key| node.get(key))
}

fn lookup_mut<'a>(tree: &'a mut Value, name: &str) -> Option<&'a mut Value> {
    name.split('.').try_fold(tree, |node, key| node.get_mut(key))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn every_leaf_of_the_struct_is_a_field_and_the_other_way_round() {
        fn leaves(prefix: &str, node: &Value, out: &mut Vec<String>) {
            match node {
                Value::Object(map) => {
                    for (key, child) in map {
                        let name =
                            if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
                        leaves(&name, child, out);
                    }
                }
                _ => out.push(prefix.to_owned()),
            }
        }
        let mut in_struct = Vec::new();
        leaves("", &Config::default().tree(), &mut in_struct);
        let mut in_table: Vec<_> = FIELDS.iter().map(|f| f.name.to_owned()).collect();
        in_struct.sort();
        in_table.sort();
        assert_eq!(in_struct, in_table);
    }

    #[test]
    fn the_defaults_are_valid() {
        Config::default().validate().unwrap();
    }

    #[test]
    fn a_value_out_of_range_is_refused_with_the_range() {
        let error = Config::default().with("saliency.threshold", &json!(1.5)).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("saliency.threshold") && text.contains("1.5") && text.contains("[0, 1]"),
            "{text}"
        );
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_nearest_one() {
        let error = Config::default().with("saliency.treshold", &json!(0.5)).unwrap_err();
        assert!(error.to_string().contains("saliency.threshold"), "{error}");
    }

    #[test]
    fn a_wrong_type_or_choice_is_refused() {
        assert!(Config::default().with("rectify", &json!(1)).is_err());
        assert!(Config::default().with("queue_size", &json!(2.5)).is_err());
        let error = Config::default().with("saliency.mode", &json!("papper")).unwrap_err();
        assert!(error.to_string().contains("spectral_residual"), "{error}");
    }

    #[test]
    fn related_parameters_change_together_or_not_at_all() {
        let config = Config::default();
        assert!(config.with("depth.min", &json!(100.0)).is_err());
        let both = config.with_all([("depth.min", json!(100)), ("depth.max", json!(200))]).unwrap();
        assert_eq!((both.depth.min, both.depth.max), (100.0, 200.0));
    }
}
