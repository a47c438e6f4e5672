//! Parameters in the forms that ROS 2 knows: YAML files, and (in `value`) the
//! values and descriptors of the parameter services.

mod store;
mod value;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::Value;
use thiserror::Error;

pub use store::ParameterStore;
pub use value::{descriptor, from_ros, list, to_ros};

use crate::config::{Config, FIELDS, Field, Range};
use crate::error::ConfigError;
use crate::ros::names::node_matches;
use crate::ros::yaml::Yaml;

/// Largest parameter file that is read; ours has less than 20 KB.
const MAX_FILE_BYTES: u64 = 1 << 20;

/// A parameter source that cannot be taken.
#[derive(Debug, Error)]
pub enum ParamsError {
    /// The file cannot be read.
    #[error("cannot read parameter file '{}': {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is too large to be a parameter file.
    #[error("parameter file '{}' has {bytes} bytes; at most {MAX_FILE_BYTES} are read", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// Its size.
        bytes: u64,
    },
    /// No YAML, or YAML of another shape.
    #[error("{origin}: {reason}")]
    Shape {
        /// File or argument.
        origin: String,
        /// What is wrong.
        reason: String,
    },
    /// A parameter that cannot be taken.
    #[error("{origin}: {source}")]
    Parameter {
        /// File or argument.
        origin: String,
        /// Which parameter, and what is allowed.
        source: ConfigError,
    },
}

/// One parameter value and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    /// File or argument, for messages.
    pub origin: String,
    /// Which nodes it is for, as in a parameter file; `/**` is all.
    pub node: String,
    /// Flat name.
    pub name: String,
    /// Value in its YAML type.
    pub value: Value,
    /// True when it is meant for this node alone, so that a name that is
    /// unknown must be a mistake; false when it may be another node's.
    pub strict: bool,
}

/// The assignments of a parameter file, in its order.
///
/// Taken is the ROS 2 form (`node: ros__parameters: …`, several nodes, nested
/// namespaces) and, for plain configuration files, the bare parameters, which
/// are then for every node.
///
/// # Errors
/// When the file cannot be read or is no such YAML.
pub fn read_file(file: &Path) -> Result<Vec<Assignment>, ParamsError> {
    let read = |source| ParamsError::Read { file: file.to_owned(), source };
    let bytes = std::fs::metadata(file).map_err(read)?.len();
    if bytes > MAX_FILE_BYTES {
        return Err(ParamsError::TooLarge { file: file.to_owned(), bytes });
    }
    let text = std::fs::read_to_string(file).map_err(read)?;
    parse(&text, &file.display().to_string())
}

/// As [`read_file`], for a text whose origin is named in messages.
///
/// # Errors
/// When it is no such YAML.
pub fn parse(text: &str, origin: &str) -> Result<Vec<Assignment>, ParamsError> {
    let shape = |reason: String| ParamsError::Shape { origin: origin.to_owned(), reason };
    let mut out = Vec::new();
    match Yaml::parse(text).map_err(shape)? {
        Yaml::Scalar(Value::Null) => {}
        Yaml::Map(entries) if has_ros_parameters(&entries) => {
            nodes("", entries, origin, &mut out)?;
        }
        Yaml::Map(entries) => {
            flatten("/**", "", entries, origin, &mut out);
            for assignment in &mut out {
                assignment.strict = true;
            }
        }
        _ => return Err(shape("a mapping of parameters is wanted at the top".into())),
    }
    Ok(out)
}

const ROS_PARAMETERS: &str = "ros__parameters";

fn has_ros_parameters(entries: &[(String, Yaml)]) -> bool {
    entries.iter().any(|(key, child)| {
        key == ROS_PARAMETERS || matches!(child, Yaml::Map(inner) if has_ros_parameters(inner))
    })
}

fn nodes(
    node: &str,
    entries: Vec<(String, Yaml)>,
    origin: &str,
    out: &mut Vec<Assignment>,
) -> Result<(), ParamsError> {
    for (key, child) in entries {
        match child {
            Yaml::Map(parameters) if key == ROS_PARAMETERS => {
                flatten(node, "", parameters, origin, out);
            }
            // An empty section: `ros__parameters:` with every line commented out.
            Yaml::Scalar(Value::Null) => {}
            Yaml::Map(inner) => {
                nodes(&format!("{node}/{}", key.trim_matches('/')), inner, origin, out)?;
            }
            _ => {
                return Err(ParamsError::Shape {
                    origin: origin.to_owned(),
                    reason: format!(
                        "'{key}' must hold 'ros__parameters' or a node name, not a value"
                    ),
                });
            }
        }
    }
    Ok(())
}

fn flatten(
    node: &str,
    prefix: &str,
    entries: Vec<(String, Yaml)>,
    origin: &str,
    out: &mut Vec<Assignment>,
) {
    for (key, child) in entries {
        let name = if prefix.is_empty() { key } else { format!("{prefix}.{key}") };
        let value = match child {
            Yaml::Map(inner) => {
                flatten(node, &name, inner, origin, out);
                continue;
            }
            Yaml::Scalar(value) => value,
            Yaml::Sequence(items) => list_value(items),
        };
        let node = if node.is_empty() { "/**" } else { node };
        out.push(Assignment {
            origin: origin.to_owned(),
            node: node.to_owned(),
            name,
            value,
            strict: !node.contains('*'),
        });
    }
}

fn list_value(items: Vec<Yaml>) -> Value {
    Value::Array(
        items
            .into_iter()
            .map(|item| match item {
                Yaml::Scalar(value) => value,
                Yaml::Sequence(items) => list_value(items),
                Yaml::Map(_) => Value::Null,
            })
            .collect(),
    )
}

/// `base` with every assignment that is for the node `full_name`, in order: a
/// later one wins, and cross-checks see the final state.
///
/// A name that is unknown is an error when the assignment is strict, else it is
/// left out and a warning returned: under `/**` it may be another node's.
///
/// # Errors
/// With origin, name and what is allowed.
pub fn apply(
    base: &Config,
    assignments: &[Assignment],
    full_name: &str,
) -> Result<(Config, Vec<String>), ParamsError> {
    let mut warnings = Vec::new();
    let mut taken: Vec<&Assignment> = Vec::new();
    for assignment in assignments.iter().filter(|a| node_matches(&a.node, full_name)) {
        let fault = |source| ParamsError::Parameter { origin: assignment.origin.clone(), source };
        // These are read when the topics are made.
        if assignment.name.starts_with(crate::ros::qos::PREFIX) {
            continue;
        }
        match crate::config::field(&assignment.name) {
            Ok(_) => {}
            Err(error) if !assignment.strict => {
                warnings.push(format!("{}: left out: {error}", assignment.origin));
                continue;
            }
            Err(error) => return Err(fault(error)),
        }
        // Each value alone first, so that the message can name its origin.
        match base.with(&assignment.name, &assignment.value) {
            Ok(_) | Err(ConfigError::Inconsistent { .. }) => {}
            Err(error) => return Err(fault(error)),
        }
        taken.retain(|earlier| earlier.name != assignment.name);
        taken.push(assignment);
    }
    let config = base.with_all(taken.iter().map(|a| (a.name.as_str(), a.value.clone()))).map_err(
        |source| {
            let mut origins: Vec<&str> = taken.iter().map(|a| a.origin.as_str()).collect();
            origins.dedup();
            ParamsError::Parameter { origin: origins.join(", "), source }
        },
    )?;
    Ok((config, warnings))
}

/// `base` with a configuration file for this program alone: every name in it
/// must be known. Sections for other nodes are passed over.
///
/// # Errors
/// With file, name and what is allowed.
pub fn config_from_file(base: &Config, file: &Path) -> Result<Config, ParamsError> {
    let full_name = format!("/{}", crate::ros::NODE_NAME);
    let mut assignments = read_file(file)?;
    assignments.retain(|a| node_matches(&a.node, &full_name));
    for assignment in &mut assignments {
        assignment.strict = true;
    }
    apply(base, &assignments, &full_name).map(|(config, _)| config)
}

/// `base` with one `name=value` (or `name:=value`) of a command line.
///
/// # Errors
/// When it has no such form, or the parameter cannot be taken.
pub fn config_from_set(base: &Config, set: &str) -> Result<Config, ParamsError> {
    let shape = |reason: String| ParamsError::Shape { origin: format!("--set {set}"), reason };
    let (name, text) = set
        .split_once(":=")
        .or_else(|| set.split_once('='))
        .ok_or_else(|| shape("NAME=VALUE is wanted".into()))?;
    let value = scalar(text).map_err(shape)?;
    base.with(name.trim(), &value)
        .map_err(|source| ParamsError::Parameter { origin: format!("--set {set}"), source })
}

/// A value of a command line in its YAML type.
pub(crate) fn scalar(text: &str) -> Result<Value, String> {
    match Yaml::parse(text)? {
        // An empty value is an empty text.
        Yaml::Scalar(Value::Null) => Ok(Value::String(String::new())),
        Yaml::Scalar(value) => Ok(value),
        Yaml::Sequence(items) => Ok(list_value(items)),
        Yaml::Map(_) => Err("a value is wanted, not a mapping".into()),
    }
}

/// `config` as a ROS 2 parameter file with the descriptions as comments.
pub fn to_yaml(config: &Config) -> String {
    let mut out = String::from(
        "# Every parameter of salient_stereo with its default. Generated: change a default in\n\
         # src/config.rs, a description in src/config/field.rs.\n\
         /**:\n  ros__parameters:\n",
    );
    let mut open: Vec<&str> = Vec::new();
    for (name, value) in config.flatten() {
        let mut groups: Vec<&str> = name.split('.').collect();
        let key = groups.pop().unwrap_or_default();
        let shared = open.iter().zip(&groups).take_while(|(a, b)| a == b).count();
        open.truncate(shared);
        for group in &groups[shared..] {
            let _ = writeln!(out, "{}{group}:", indent(open.len()));
            open.push(group);
        }
        let indent = indent(open.len());
        if let Some(field) = FIELDS.iter().find(|field| field.name == name) {
            let _ = writeln!(out, "{indent}# {}", field.description);
            let _ = writeln!(out, "{indent}# {}", constraint(field));
        }
        let _ = writeln!(out, "{indent}{key}: {}", yaml_scalar(&value));
    }
    out
}

fn indent(depth: usize) -> String {
    " ".repeat(4 + 2 * depth)
}

/// What a parameter may be and when, in words.
fn constraint(field: &Field) -> String {
    let allowed = match field.range {
        Range::Bool => "true or false".to_owned(),
        Range::Text => "Text".to_owned(),
        Range::Integer(min, max) => format!("Integer {min} to {max}"),
        Range::Real(min, max) => format!("{min} to {max}"),
        Range::OneOf(numbers) => {
            numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" | ")
        }
        Range::Choice(words) => words.join(" | "),
    };
    if field.start_only { format!("{allowed}; read at start") } else { allowed }
}

fn yaml_scalar(value: &Value) -> String {
    match value {
        Value::String(text) => {
            let plain = text.starts_with(|c: char| c.is_ascii_lowercase())
                && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
                && Yaml::parse(text) == Ok(Yaml::Scalar(value.clone()));
            // A JSON text is a valid double-quoted YAML scalar.
            if plain { text.clone() } else { value.to_string() }
        }
        Value::Number(number) if number.is_f64() => {
            number.as_f64().map_or_else(|| value.to_string(), |real| format!("{real:?}"))
        }
        _ => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn taken(text: &str) -> Result<(Config, Vec<String>), ParamsError> {
        apply(&Config::default(), &parse(text, "test.yaml")?, "/ns/salient_stereo")
    }

    #[test]
    fn nested_maps_flatten_and_the_node_sections_are_chosen() {
        let (config, warnings) = taken(
            "/**:\n  ros__parameters:\n    depth:\n      max: 40\n    stereo.p1: 5\n\
             /ns/salient_stereo:\n  ros__parameters:\n    depth: {min: 0.5}\n\
             ns:\n  salient_stereo:\n    ros__parameters: {tracking.max_age: 2.0}\n\
             other:\n  ros__parameters:\n    depth: {max: 1.0}\n",
        )
        .unwrap();
        assert_eq!((config.depth.min, config.depth.max), (0.5, 40.0));
        assert_eq!((config.stereo.p1, config.tracking.max_age), (5, 2.0));
        assert!(warnings.is_empty(), "{warnings:?}");
    }

    #[test]
    fn a_later_assignment_wins_and_only_the_final_state_must_be_consistent() {
        let (config, _) = taken(
            "/**: {ros__parameters: {depth.min: 90.0, depth.max: 100.0}}\n\
             /ns/*: {ros__parameters: {depth.max: 200.0}}\n",
        )
        .unwrap();
        assert_eq!((config.depth.min, config.depth.max), (90.0, 200.0));
    }

    #[test]
    fn errors_name_the_file_the_key_and_what_is_allowed() {
        let text = taken("/ns/salient_stereo: {ros__parameters: {saliency.treshold: 0.5}}")
            .unwrap_err()
            .to_string();
        assert!(text.contains("test.yaml") && text.contains("saliency.threshold"), "{text}");
        let text =
            taken("/**: {ros__parameters: {saliency: {threshold: 1.5}}}").unwrap_err().to_string();
        assert!(text.contains("test.yaml") && text.contains("[0, 1]"), "{text}");
        let text = taken("/**: {ros__parameters: {queue_size: [1, 2]}}").unwrap_err().to_string();
        assert!(text.contains("queue_size") && text.contains("whole number"), "{text}");
        assert!(taken("/**: {ros__parameters: {depth: {min: 90.0, max: 10.0}}}").is_err());
        assert!(taken("/**:\n  depth: 3\n  ros__parameters: {}\n").is_err());
        assert!(taken("/**: [").is_err());
        assert!(taken("just text").is_err());
    }

    #[test]
    fn an_unknown_name_for_all_nodes_is_a_warning() {
        let (config, warnings) =
            taken("/**: {ros__parameters: {robot_description: x, use_sim_time: true}}").unwrap();
        assert!(config.use_sim_time);
        assert!(warnings.len() == 1 && warnings[0].contains("robot_description"), "{warnings:?}");
    }

    #[test]
    fn a_plain_tree_is_a_configuration_too() {
        let (config, _) = taken("saliency:\n  mode: full_frame\n").unwrap();
        assert_eq!(config.value("saliency.mode").unwrap(), json!("full_frame"));
    }

    #[test]
    fn a_set_is_name_and_value() {
        let config = config_from_set(&Config::default(), "stereo.p1=7").unwrap();
        assert_eq!(config.stereo.p1, 7);
        let config = config_from_set(&config, "camera_info.left_url:=").unwrap();
        assert_eq!(config.camera_info.left_url, "");
        assert!(config_from_set(&config, "stereo.p1").is_err());
        assert!(config_from_set(&config, "stereo.p1=x").is_err());
    }

    #[test]
    fn the_written_file_reads_back_as_the_same_configuration() {
        let config = Config::default()
            .with_all([
                ("depth.max", json!(123.25)),
                ("input", json!("side_by_side")),
                ("camera_info.left_url", json!("file:///a b/\"c\": d.yaml")),
                ("stereo.speckle_range", json!(1e-7)),
            ])
            .unwrap();
        let (back, warnings) =
            apply(&Config::default(), &parse(&to_yaml(&config), "written").unwrap(), "/n").unwrap();
        assert_eq!(back, config);
        assert!(warnings.is_empty());
    }
}
