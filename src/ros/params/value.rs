//! Parameter values and descriptors on the wire (`rcl_interfaces`).

use serde_json::Value;

use crate::config::{FIELDS, Field, Range};
use crate::ros::message::rcl_interfaces::{
    FloatingPointRange, IntegerRange, ListParametersResult, ParameterDescriptor, ParameterType,
    ParameterValue,
};

/// The wire form of a configuration value.
pub fn to_ros(value: &Value) -> ParameterValue {
    let mut out = ParameterValue::default();
    match value {
        Value::Bool(flag) => {
            out.r#type = ParameterType::PARAMETER_BOOL;
            out.bool_value = *flag;
        }
        Value::Number(number) => {
            if let Some(whole) = number.as_i64() {
                out.r#type = ParameterType::PARAMETER_INTEGER;
                out.integer_value = whole;
            } else if let Some(real) = number.as_f64() {
                out.r#type = ParameterType::PARAMETER_DOUBLE;
                out.double_value = real;
            }
        }
        Value::String(text) => {
            out.r#type = ParameterType::PARAMETER_STRING;
            out.string_value.clone_from(text);
        }
        // No parameter of ours has another type.
        Value::Null | Value::Array(_) | Value::Object(_) => {}
    }
    out
}

/// The configuration value of a wire value.
///
/// # Errors
/// For lists, unset values, numbers that are not finite, and unknown types, in
/// words that fit behind the parameter's name.
pub fn from_ros(value: &ParameterValue) -> Result<Value, String> {
    match value.r#type {
        ParameterType::PARAMETER_BOOL => Ok(Value::Bool(value.bool_value)),
        ParameterType::PARAMETER_INTEGER => Ok(value.integer_value.into()),
        ParameterType::PARAMETER_DOUBLE => serde_json::Number::from_f64(value.double_value)
            .map(Value::Number)
            .ok_or_else(|| format!("{} is no finite number", value.double_value)),
        ParameterType::PARAMETER_STRING => Ok(value.string_value.clone().into()),
        ParameterType::PARAMETER_NOT_SET => Err("it cannot be deleted".into()),
        5..=9 => Err("a single value is wanted, not a list".into()),
        other => Err(format!("{other} is no parameter type")),
    }
}

/// The wire type of a parameter.
pub(super) fn ros_type(field: &Field) -> u8 {
    match field.range {
        Range::Bool => ParameterType::PARAMETER_BOOL,
        Range::Integer(..) | Range::OneOf(_) => ParameterType::PARAMETER_INTEGER,
        Range::Real(..) => ParameterType::PARAMETER_DOUBLE,
        Range::Text | Range::Choice(_) => ParameterType::PARAMETER_STRING,
    }
}

/// Description, range and constraints of a parameter; of an unknown name the
/// empty descriptor, as rclcpp answers with undeclared parameters allowed.
pub fn descriptor(name: &str) -> ParameterDescriptor {
    let mut out = ParameterDescriptor { name: name.to_owned(), ..Default::default() };
    let Some(field) = FIELDS.iter().find(|field| field.name == name) else { return out };
    out.r#type = ros_type(field);
    field.description.clone_into(&mut out.description);
    out.read_only = field.start_only;
    match field.range {
        Range::Integer(from_value, to_value) => {
            out.integer_range.push(IntegerRange { from_value, to_value, step: 1 });
        }
        Range::Real(from_value, to_value) => {
            out.floating_point_range.push(FloatingPointRange { from_value, to_value, step: 0.0 });
        }
        Range::OneOf(_) | Range::Choice(_) => out.additional_constraints = field.range.to_string(),
        Range::Bool | Range::Text => {}
    }
    out
}

/// The answer to `list_parameters`, with the meaning of rclcpp: without
/// prefixes the names of at most `depth` levels (0: all), else the names that
/// equal a prefix or lie at most `depth` levels below it.
pub fn list(prefixes: &[String], depth: u64) -> ListParametersResult {
    let near = |rest: &str| depth == 0 || (rest.matches('.').count() as u64) < depth;
    let mut out = ListParametersResult::default();
    for Field { name, .. } in FIELDS {
        let below = |prefix: &String| {
            name.strip_prefix(prefix.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.strip_prefix('.').is_some_and(near))
        };
        if (prefixes.is_empty() && near(name)) || prefixes.iter().any(below) {
            out.names.push((*name).to_owned());
            if let Some((group, _)) = name.rsplit_once('.')
                && !out.prefixes.iter().any(|known| known == group)
            {
                out.prefixes.push(group.to_owned());
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    #[test]
    fn every_parameter_survives_the_wire_in_its_own_type() {
        for (name, value) in Config::default().flatten() {
            let wire = to_ros(&value);
            let field = FIELDS.iter().find(|f| f.name == name).unwrap();
            assert_eq!(wire.r#type, ros_type(field), "{name}");
            assert_eq!(from_ros(&wire).unwrap(), value, "{name}");
            assert_eq!(descriptor(name).r#type, wire.r#type, "{name}");
        }
    }

    #[test]
    fn lists_follow_prefix_and_depth() {
        assert_eq!(list(&[], 0).names.len(), FIELDS.len());
        assert!(list(&[], 1).names.iter().all(|name| !name.contains('.')));
        let saliency = list(&["saliency".into()], 1);
        assert!(saliency.names.contains(&"saliency.mode".into()));
        assert!(!saliency.names.contains(&"saliency.paper.color".into()));
        assert_eq!(saliency.prefixes, ["saliency"]);
        assert_eq!(list(&["saliency".into()], 0).prefixes, ["saliency", "saliency.paper"]);
        assert_eq!(list(&["depth.min".into()], 1).names, ["depth.min"]);
        assert!(list(&["dep".into()], 0).names.is_empty());
    }

    #[test]
    fn descriptors_carry_ranges_or_words() {
        let threshold = descriptor("saliency.threshold");
        assert_eq!(threshold.floating_point_range[0].to_value, 1.0);
        assert!(!threshold.description.is_empty());
        assert!(descriptor("saliency.mode").additional_constraints.contains("full_frame"));
        assert!(descriptor("threads").read_only);
        assert_eq!(descriptor("nothing").r#type, ParameterType::PARAMETER_NOT_SET);
    }

    #[test]
    fn values_of_no_use_are_refused() {
        let mut value = to_ros(&Value::from(1.0));
        value.double_value = f64::NAN;
        assert!(from_ros(&value).is_err());
        for other in [0, 5, 9, 10, 255] {
            value.r#type = other;
            assert!(from_ros(&value).is_err());
        }
    }
}
