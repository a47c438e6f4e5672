//! Messages against the bytes, fields and type hashes of a real ROS 2.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use salient_stereo::ros::cdr::{CdrError, decode, encode};
use salient_stereo::ros::message::{
    Message, builtin_interfaces, diagnostic_msgs, geometry_msgs, rcl_interfaces, rosgraph_msgs,
    salient_stereo_msgs, sensor_msgs, std_msgs, std_srvs, stereo_msgs, vision_msgs,
    visualization_msgs,
};
use serde_json::Value;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/vectors")
}

fn bytes(name: &str) -> Vec<u8> {
    fs::read(folder().join(format!("{name}.cdr"))).expect(name)
}

/// The fields of decoded bytes, and the bytes encoded again.
type RoundTrip = (Value, Vec<u8>);

/// What one type has to show.
struct Row {
    type_name: &'static str,
    round_trip: fn(&[u8]) -> Result<RoundTrip, CdrError>,
    default: fn() -> Vec<u8>,
}

fn row<T: Message + Default>() -> Row {
    Row {
        type_name: T::TYPE_NAME,
        round_trip: |bytes| {
            let message: T = decode(bytes)?;
            let fields = serde_json::to_value(&message).expect(T::TYPE_NAME);
            Ok((fields, encode(&message)))
        },
        default: || encode(&T::default()),
    }
}

fn rows() -> Vec<Row> {
    vec![
        row::<builtin_interfaces::Duration>(),
        row::<builtin_interfaces::Time>(),
        row::<diagnostic_msgs::DiagnosticArray>(),
        row::<geometry_msgs::Point>(),
        row::<geometry_msgs::Polygon>(),
        row::<geometry_msgs::Vector3>(),
        row::<rcl_interfaces::DescribeParametersRequest>(),
        row::<rcl_interfaces::DescribeParametersResponse>(),
        row::<rcl_interfaces::GetParameterTypesRequest>(),
        row::<rcl_interfaces::GetParameterTypesResponse>(),
        row::<rcl_interfaces::GetParametersRequest>(),
        row::<rcl_interfaces::GetParametersResponse>(),
        row::<rcl_interfaces::ListParametersRequest>(),
        row::<rcl_interfaces::ListParametersResponse>(),
        row::<rcl_interfaces::Log>(),
        row::<rcl_interfaces::ParameterDescriptor>(),
        row::<rcl_interfaces::ParameterEvent>(),
        row::<rcl_interfaces::SetParametersAtomicallyRequest>(),
        row::<rcl_interfaces::SetParametersAtomicallyResponse>(),
        row::<rcl_interfaces::SetParametersRequest>(),
        row::<rcl_interfaces::SetParametersResponse>(),
        row::<rcl_interfaces::SetParametersResult>(),
        row::<rosgraph_msgs::Clock>(),
        row::<salient_stereo_msgs::SalientRegion>(),
        row::<salient_stereo_msgs::SalientRegionArray>(),
        row::<sensor_msgs::CameraInfo>(),
        row::<sensor_msgs::CompressedImage>(),
        row::<sensor_msgs::Image>(),
        row::<sensor_msgs::PointCloud2>(),
        row::<sensor_msgs::RegionOfInterest>(),
        row::<std_msgs::Header>(),
        row::<std_srvs::TriggerRequest>(),
        row::<std_srvs::TriggerResponse>(),
        row::<stereo_msgs::DisparityImage>(),
        row::<vision_msgs::Detection2DArray>(),
        row::<vision_msgs::Detection3DArray>(),
        row::<visualization_msgs::MarkerArray>(),
    ]
}

/// `sensor_msgs/msg/Image` as it stands in a file name: `sensor_msgs__Image`.
fn file_stem(type_name: &str) -> String {
    let (package, kind_and_name) = type_name.split_once('/').expect(type_name);
    let (_, name) = kind_and_name.split_once('/').expect(type_name);
    format!("{package}__{name}")
}

/// Equal, where our bytes are numbers and rclpy's are one-character strings,
/// and where rclpy hides the one byte of an empty structure.
fn assert_same(ours: &Value, theirs: &Value, path: &str) {
    match (ours, theirs) {
        (Value::Object(ours), Value::Object(theirs)) => {
            let visible: Vec<_> =
                ours.keys().filter(|k| *k != "structure_needs_at_least_one_member").collect();
            assert_eq!(visible, theirs.keys().collect::<Vec<_>>(), "{path}");
            for (key, theirs) in theirs {
                assert_same(&ours[key], theirs, &format!("{path}.{key}"));
            }
        }
        (Value::Array(ours), Value::Array(theirs)) => {
            assert_eq!(ours.len(), theirs.len(), "{path}");
            for (i, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
                assert_same(ours, theirs, &format!("{path}[{i}]"));
            }
        }
        (Value::Number(ours), Value::String(theirs)) => {
            let codes: Vec<_> = theirs.chars().map(|c| u64::from(u32::from(c))).collect();
            assert_eq!(codes, [ours.as_u64().expect(path)], "{path}");
        }
        (Value::Number(a), Value::Number(b)) => assert_eq!(a.as_f64(), b.as_f64(), "{path}"),
        _ => assert_eq!(ours, theirs, "{path}"),
    }
}

#[test]
fn every_vector_decodes_to_its_fields_and_encodes_back_byte_for_byte() {
    for row in rows() {
        for variant in ["default", "filled"] {
            let name = format!("{}__{variant}", file_stem(row.type_name));
            let bytes = bytes(&name);
            let (fields, again) = (row.round_trip)(&bytes).expect(&name);
            let json = fs::read(folder().join(format!("{name}.json"))).expect(&name);
            assert_same(&fields, &serde_json::from_slice(&json).expect(&name), &name);
            assert!(again == bytes, "{name}: encoded bytes differ");
        }
    }
}

#[test]
fn our_defaults_are_those_of_ros() {
    for row in rows() {
        let name = format!("{}__default", file_stem(row.type_name));
        assert!((row.default)() == bytes(&name), "{name}");
    }
}

#[test]
fn no_vector_is_left_out() {
    let mut in_folder = BTreeSet::new();
    for entry in fs::read_dir(folder()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if let Some(stem) = name.strip_suffix(".cdr") {
            in_folder.insert(stem.to_owned());
        }
    }
    let in_rows: BTreeSet<_> = rows()
        .iter()
        .flat_map(|row| ["default", "filled"].map(|v| format!("{}__{v}", file_stem(row.type_name))))
        .collect();
    assert_eq!(in_folder, in_rows);
}

/// Garbage in the length of any sequence or text ends in a message or in an
/// error, and at once: had the elements been counted down to the four billion
/// that they claim, this would take hours.
#[test]
fn damaged_vectors_never_panic() {
    for row in rows() {
        let bytes = bytes(&format!("{}__filled", file_stem(row.type_name)));
        for at in (4..bytes.len().saturating_sub(3)).step_by(4) {
            for garbage in [u32::MAX, 0x7fff_ffff, bytes.len() as u32] {
                let mut damaged = bytes.clone();
                damaged[at..at + 4].copy_from_slice(&garbage.to_le_bytes());
                let _ = (row.round_trip)(&damaged);
            }
        }
        for len in 0..bytes.len() {
            let _ = (row.round_trip)(&bytes[..len]);
        }
    }
}
