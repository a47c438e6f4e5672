//! The definition of each type that we speak: its text for bags, and its
//! RIHS01 hash.
//!
//! The texts of standard types are in `src/ros/schema/`, worded by us: names,
//! types and order of the fields are what the standard fixes, and the hashes,
//! in which comments do not count, prove that they agree with it. Our own types
//! are read from `msgs/`, the package that ROS builds.

mod hash;
mod parse;

use parse::{Field, Member};

/// All texts by type name, sorted.
#[rustfmt::skip]
const TEXTS: &[(&str, &str)] = &[
    ("builtin_interfaces/msg/Duration", include_str!("schema/builtin_interfaces/msg/Duration.msg")),
    ("builtin_interfaces/msg/Time", include_str!("schema/builtin_interfaces/msg/Time.msg")),
    ("diagnostic_msgs/msg/DiagnosticArray", include_str!("schema/diagnostic_msgs/msg/DiagnosticArray.msg")),
    ("diagnostic_msgs/msg/DiagnosticStatus", include_str!("schema/diagnostic_msgs/msg/DiagnosticStatus.msg")),
    ("diagnostic_msgs/msg/KeyValue", include_str!("schema/diagnostic_msgs/msg/KeyValue.msg")),
    ("foxglove_msgs/msg/CircleAnnotation", include_str!("schema/foxglove_msgs/msg/CircleAnnotation.msg")),
    ("foxglove_msgs/msg/Color", include_str!("schema/foxglove_msgs/msg/Color.msg")),
    ("foxglove_msgs/msg/ImageAnnotations", include_str!("schema/foxglove_msgs/msg/ImageAnnotations.msg")),
    ("foxglove_msgs/msg/Point2", include_str!("schema/foxglove_msgs/msg/Point2.msg")),
    ("foxglove_msgs/msg/PointsAnnotation", include_str!("schema/foxglove_msgs/msg/PointsAnnotation.msg")),
    ("foxglove_msgs/msg/TextAnnotation", include_str!("schema/foxglove_msgs/msg/TextAnnotation.msg")),
    ("geometry_msgs/msg/Point", include_str!("schema/geometry_msgs/msg/Point.msg")),
    ("geometry_msgs/msg/Point32", include_str!("schema/geometry_msgs/msg/Point32.msg")),
    ("geometry_msgs/msg/Polygon", include_str!("schema/geometry_msgs/msg/Polygon.msg")),
    ("geometry_msgs/msg/Pose", include_str!("schema/geometry_msgs/msg/Pose.msg")),
    ("geometry_msgs/msg/PoseWithCovariance", include_str!("schema/geometry_msgs/msg/PoseWithCovariance.msg")),
    ("geometry_msgs/msg/Quaternion", include_str!("schema/geometry_msgs/msg/Quaternion.msg")),
    ("geometry_msgs/msg/Vector3", include_str!("schema/geometry_msgs/msg/Vector3.msg")),
    ("rcl_interfaces/msg/FloatingPointRange", include_str!("schema/rcl_interfaces/msg/FloatingPointRange.msg")),
    ("rcl_interfaces/msg/IntegerRange", include_str!("schema/rcl_interfaces/msg/IntegerRange.msg")),
    ("rcl_interfaces/msg/ListParametersResult", include_str!("schema/rcl_interfaces/msg/ListParametersResult.msg")),
    ("rcl_interfaces/msg/Log", include_str!("schema/rcl_interfaces/msg/Log.msg")),
    ("rcl_interfaces/msg/Parameter", include_str!("schema/rcl_interfaces/msg/Parameter.msg")),
    ("rcl_interfaces/msg/ParameterDescriptor", include_str!("schema/rcl_interfaces/msg/ParameterDescriptor.msg")),
    ("rcl_interfaces/msg/ParameterEvent", include_str!("schema/rcl_interfaces/msg/ParameterEvent.msg")),
    ("rcl_interfaces/msg/ParameterValue", include_str!("schema/rcl_interfaces/msg/ParameterValue.msg")),
    ("rcl_interfaces/msg/SetParametersResult", include_str!("schema/rcl_interfaces/msg/SetParametersResult.msg")),
    ("rcl_interfaces/srv/DescribeParameters", include_str!("schema/rcl_interfaces/srv/DescribeParameters.srv")),
    ("rcl_interfaces/srv/GetParameterTypes", include_str!("schema/rcl_interfaces/srv/GetParameterTypes.srv")),
    ("rcl_interfaces/srv/GetParameters", include_str!("schema/rcl_interfaces/srv/GetParameters.srv")),
    ("rcl_interfaces/srv/ListParameters", include_str!("schema/rcl_interfaces/srv/ListParameters.srv")),
    ("rcl_interfaces/srv/SetParameters", include_str!("schema/rcl_interfaces/srv/SetParameters.srv")),
    ("rcl_interfaces/srv/SetParametersAtomically", include_str!("schema/rcl_interfaces/srv/SetParametersAtomically.srv")),
    ("rosgraph_msgs/msg/Clock", include_str!("schema/rosgraph_msgs/msg/Clock.msg")),
    ("salient_stereo_msgs/msg/SalientRegion", include_str!("../../msgs/msg/SalientRegion.msg")),
    ("salient_stereo_msgs/msg/SalientRegionArray", include_str!("../../msgs/msg/SalientRegionArray.msg")),
    ("sensor_msgs/msg/CameraInfo", include_str!("schema/sensor_msgs/msg/CameraInfo.msg")),
    ("sensor_msgs/msg/CompressedImage", include_str!("schema/sensor_msgs/msg/CompressedImage.msg")),
    ("sensor_msgs/msg/Image", include_str!("schema/sensor_msgs/msg/Image.msg")),
    ("sensor_msgs/msg/PointCloud2", include_str!("schema/sensor_msgs/msg/PointCloud2.msg")),
    ("sensor_msgs/msg/PointField", include_str!("schema/sensor_msgs/msg/PointField.msg")),
    ("sensor_msgs/msg/RegionOfInterest", include_str!("schema/sensor_msgs/msg/RegionOfInterest.msg")),
    ("service_msgs/msg/ServiceEventInfo", include_str!("schema/service_msgs/msg/ServiceEventInfo.msg")),
    ("std_msgs/msg/ColorRGBA", include_str!("schema/std_msgs/msg/ColorRGBA.msg")),
    ("std_msgs/msg/Header", include_str!("schema/std_msgs/msg/Header.msg")),
    ("std_srvs/srv/Trigger", include_str!("schema/std_srvs/srv/Trigger.srv")),
    ("stereo_msgs/msg/DisparityImage", include_str!("schema/stereo_msgs/msg/DisparityImage.msg")),
    ("vision_msgs/msg/BoundingBox2D", include_str!("schema/vision_msgs/msg/BoundingBox2D.msg")),
    ("vision_msgs/msg/BoundingBox3D", include_str!("schema/vision_msgs/msg/BoundingBox3D.msg")),
    ("vision_msgs/msg/Detection2D", include_str!("schema/vision_msgs/msg/Detection2D.msg")),
    ("vision_msgs/msg/Detection2DArray", include_str!("schema/vision_msgs/msg/Detection2DArray.msg")),
    ("vision_msgs/msg/Detection3D", include_str!("schema/vision_msgs/msg/Detection3D.msg")),
    ("vision_msgs/msg/Detection3DArray", include_str!("schema/vision_msgs/msg/Detection3DArray.msg")),
    ("vision_msgs/msg/ObjectHypothesis", include_str!("schema/vision_msgs/msg/ObjectHypothesis.msg")),
    ("vision_msgs/msg/ObjectHypothesisWithPose", include_str!("schema/vision_msgs/msg/ObjectHypothesisWithPose.msg")),
    ("vision_msgs/msg/Point2D", include_str!("schema/vision_msgs/msg/Point2D.msg")),
    ("vision_msgs/msg/Pose2D", include_str!("schema/vision_msgs/msg/Pose2D.msg")),
    ("visualization_msgs/msg/Marker", include_str!("schema/visualization_msgs/msg/Marker.msg")),
    ("visualization_msgs/msg/MarkerArray", include_str!("schema/visualization_msgs/msg/MarkerArray.msg")),
    ("visualization_msgs/msg/MeshFile", include_str!("schema/visualization_msgs/msg/MeshFile.msg")),
    ("visualization_msgs/msg/UVCoordinate", include_str!("schema/visualization_msgs/msg/UVCoordinate.msg")),
];

const SEPARATOR: &str =
    "================================================================================";

/// The definition of a type as it stands in a bag (`ros2msg`): its own text and
/// those of all types in it, each after a line of 80 `=` and one `MSG: pkg/Type`.
///
/// `None` for types that we do not speak and for services, which have no
/// definition of this form.
pub fn definition(type_name: &str) -> Option<String> {
    let mut out = text(type_name)?.trim_end().to_owned();
    out.push('\n');
    let mut seen = vec![type_name.to_owned()];
    append_dependencies(type_name, &mut seen, &mut out)?;
    Some(out)
}

/// The RIHS01 hash of a message, a service, or a service's `_Request`,
/// `_Response` or `_Event` (REP 2016), as `RIHS01_` and 64 hexadecimal digits.
///
/// `None` for types that we do not speak.
pub fn type_hash(type_name: &str) -> Option<String> {
    hash::rihs01(type_name)
}

fn append_dependencies(type_name: &str, seen: &mut Vec<String>, out: &mut String) -> Option<()> {
    for field in fields(type_name)? {
        let Member::Nested(nested) = field.member else { continue };
        if seen.contains(&nested) {
            continue;
        }
        out.push_str(SEPARATOR);
        out.push_str("\nMSG: ");
        out.push_str(&nested.replace("/msg/", "/"));
        out.push('\n');
        out.push_str(text(&nested)?.trim_end());
        out.push('\n');
        seen.push(nested.clone());
        append_dependencies(&nested, seen, out)?;
    }
    Some(())
}

/// The text of a message, a service, or the half of a service.
fn text(type_name: &str) -> Option<&'static str> {
    let find = |name: &str| {
        let at = TEXTS.binary_search_by_key(&name, |(name, _)| name).ok()?;
        Some(TEXTS[at].1)
    };
    if let Some(service) = type_name.strip_suffix("_Request") {
        return find(service)?.split_once("---").map(|(request, _)| request);
    }
    if let Some(service) = type_name.strip_suffix("_Response") {
        return find(service)?.split_once("---").map(|(_, response)| response);
    }
    find(type_name)
}

/// The fields of a message, a service, or one of a service's three messages.
fn fields(type_name: &str) -> Option<Vec<Field>> {
    if type_name.contains("/srv/") {
        if let Some(service) = type_name.strip_suffix("_Event") {
            text(service)?;
            return Some(vec![
                Field::nested("info", "service_msgs/msg/ServiceEventInfo".into()),
                Field::nested("request", format!("{service}_Request")).at_most_one(),
                Field::nested("response", format!("{service}_Response")).at_most_one(),
            ]);
        }
        if !type_name.ends_with("_Request") && !type_name.ends_with("_Response") {
            text(type_name)?;
            return Some(vec![
                Field::nested("request_message", format!("{type_name}_Request")),
                Field::nested("response_message", format!("{type_name}_Response")),
                Field::nested("event_message", format!("{type_name}_Event")),
            ]);
        }
    }
    let (package, _) = type_name.split_once('/')?;
    let mut fields = parse::fields(package, text(type_name)?)?;
    if fields.is_empty() {
        // IDL knows no empty structure.
        fields.push(Field::new("structure_needs_at_least_one_member", Member::Plain("uint8")));
    }
    Some(fields)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::ros::message::{Message, salient_stereo_msgs, sensor_msgs, std_msgs};

    fn hashes() -> BTreeMap<String, String> {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/vectors/type_hashes.json");
        serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
    }

    #[test]
    fn every_hash_is_that_of_a_real_ros() {
        let hashes = hashes();
        assert_eq!(hashes.len(), 76);
        for (type_name, expected) in &hashes {
            assert_eq!(type_hash(type_name).as_ref(), Some(expected), "{type_name}");
        }
    }

    #[test]
    fn every_text_is_checked_by_a_hash_and_found() {
        let hashes = hashes();
        for (type_name, _) in TEXTS {
            // No part of a plain ROS installation, and never on the wire.
            let elsewhere = type_name.starts_with("foxglove_msgs/");
            assert!(elsewhere || hashes.contains_key(*type_name), "{type_name}");
            assert!(text(type_name).is_some(), "TEXTS is not sorted at {type_name}");
            assert!(definition(type_name).is_some() || type_name.contains("/srv/"), "{type_name}");
        }
    }

    #[test]
    fn a_definition_holds_each_dependency_once() {
        let text = definition(salient_stereo_msgs::SalientRegionArray::TYPE_NAME).unwrap();
        let mut parts = text.split(SEPARATOR);
        let own = parts.next().unwrap();
        assert!(own.contains("\nSalientRegion[] regions\n"), "{own}");
        let names: Vec<_> = parts.map(|part| part.lines().nth(1).unwrap()).collect();
        assert_eq!(
            names,
            [
                "MSG: std_msgs/Header",
                "MSG: builtin_interfaces/Time",
                "MSG: salient_stereo_msgs/SalientRegion",
                "MSG: sensor_msgs/RegionOfInterest",
                "MSG: geometry_msgs/Polygon",
                "MSG: geometry_msgs/Point32",
                "MSG: sensor_msgs/CompressedImage",
                "MSG: geometry_msgs/Point",
                "MSG: geometry_msgs/Vector3",
            ]
        );
        assert_eq!(SEPARATOR.len(), 80);
    }

    #[test]
    fn a_definition_without_dependencies_is_its_text() {
        let text = definition("geometry_msgs/msg/Point").unwrap();
        assert!(text.ends_with("float64 z\n") && !text.contains("MSG:"), "{text}");
    }

    #[test]
    fn what_we_do_not_speak_has_no_definition() {
        for name in ["nav_msgs/msg/Path", "nonsense", "", "std_srvs/srv/Empty_Event"] {
            assert_eq!((definition(name), type_hash(name)), (None, None), "{name}");
        }
    }

    #[test]
    fn the_types_and_the_texts_name_the_same_fields() {
        fn check<T: Message + Default>() {
            let value = serde_json::to_value(T::default()).unwrap();
            let mut in_type: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
            let mut in_text: Vec<_> =
                fields(T::TYPE_NAME).unwrap().into_iter().map(|f| f.name).collect();
            in_type.sort();
            in_text.sort();
            assert_eq!(in_type, in_text, "{}", T::TYPE_NAME);
        }
        check::<std_msgs::Header>();
        check::<sensor_msgs::CameraInfo>();
        check::<salient_stereo_msgs::SalientRegion>();
    }

    #[test]
    fn the_ros_package_builds_every_message_text() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/msgs");
        let cmake = std::fs::read_to_string(format!("{folder}/CMakeLists.txt")).unwrap();
        let mut count = 0;
        for entry in std::fs::read_dir(format!("{folder}/msg")).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            assert!(cmake.contains(&format!("\"msg/{name}\"")), "{name} is not in CMakeLists.txt");
            let type_name = format!("salient_stereo_msgs/msg/{}", name.trim_end_matches(".msg"));
            assert!(text(&type_name).is_some(), "{type_name} is not in TEXTS");
            count += 1;
        }
        assert_eq!(cmake.matches(".msg\"").count(), count);
    }
}
