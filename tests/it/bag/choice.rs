//! Which topics are read, and what is said when none fits.

use std::collections::BTreeMap;
use std::path::Path;

use mcap::records::MessageHeader;
use salient_stereo::config::{Config, ImageTransport, Input};
use salient_stereo::input::FrameSource;
use salient_stereo::input::bag::{BagOptions, BagSource, BagTopics};
use salient_stereo::ros::message::std_msgs::Header;

use super::recipe::{Recipe, failure, observe};

fn written(recipe: &Recipe) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    recipe.write(&path);
    (folder, path)
}

fn open(path: &Path, topics: BagTopics) -> BagSource {
    let options = BagOptions { topics, ..BagOptions::default() };
    BagSource::open(path, &Config::default(), options).unwrap()
}

/// A bag with one message on each topic, of any type and encoding.
fn foreign(path: &Path, topics: &[(&str, &str, &str)]) {
    let mut bag = mcap::Writer::new(std::fs::File::create(path).unwrap()).unwrap();
    for (topic, type_name, encoding) in topics {
        let schema = bag.add_schema(type_name, "ros2msg", b"").unwrap();
        let channel_id = bag.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
        bag.write_to_known_channel(&header, b"{}").unwrap();
    }
    bag.finish().unwrap();
}

#[test]
fn any_namespace_is_found() {
    let (_folder, path) = written(&Recipe { namespace: "/robot/stereo", ..Recipe::default() });
    let source = open(&path, BagTopics::default());
    assert_eq!(source.selection().left.name, "/robot/stereo/left/image_rect");
    assert_eq!(source.selection().infos[1].as_deref(), Some("/robot/stereo/right/camera_info"));
    assert_eq!(observe(&path, &Config::default()).0.len(), 6);
}

#[test]
fn unrectified_images_are_read_with_rectify_and_named_without() {
    let (_folder, path) = written(&Recipe { image: "image_raw", ..Recipe::default() });
    let text = failure(&path, &Config::default());
    assert!(text.contains("set rectify to true"), "{text}");
    let config = Config { rectify: true, ..Config::default() };
    assert_eq!(observe(&path, &config).0.len(), 6);
}

#[test]
fn two_stereo_cameras_have_to_be_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    for (i, namespace) in ["/front", "/rear"].into_iter().enumerate() {
        let path = folder.path().join(format!("ride_{i}.mcap"));
        Recipe { namespace, ..Recipe::default() }.write(&path);
    }
    let text = failure(folder.path(), &Config::default());
    assert!(text.contains("/front, /rear"), "{text}");
    let topics = BagTopics { left: Some("rear/left/image_rect".into()), ..BagTopics::default() };
    let mut source = open(folder.path(), topics);
    assert_eq!(source.selection().right.as_ref().unwrap().name, "/rear/right/image_rect");
    assert!(source.next_observation().unwrap().is_some());
}

#[test]
fn the_parameter_decides_between_raw_and_compressed() {
    let folder = tempfile::tempdir().unwrap();
    for (i, compressed) in [false, true].into_iter().enumerate() {
        let path = folder.path().join(format!("ride_{i}.mcap"));
        Recipe { compressed, infos: !compressed, ..Recipe::default() }.write(&path);
    }
    for (image_transport, name) in [
        (ImageTransport::Raw, "/left/image_rect"),
        (ImageTransport::Compressed, "/left/image_rect/compressed"),
    ] {
        let config = Config { image_transport, ..Config::default() };
        let source = BagSource::open(folder.path(), &config, BagOptions::default()).unwrap();
        assert_eq!(source.selection().left.name, name);
        assert_eq!(observe(folder.path(), &config).0.len(), 6);
    }
}

#[test]
fn a_bag_without_images_lists_its_topics() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    foreign(&path, &[("/chatter", "std_msgs/msg/String", "cdr")]);
    let text = failure(&path, &Config::default());
    assert!(
        text.contains("no stereo images") && text.contains("/chatter (std_msgs/msg/String, 1"),
        "{text}"
    );
    let config = Config { input: Input::SideBySide, ..Config::default() };
    let text = failure(&path, &config);
    assert!(text.contains("both views"), "{text}");
}

#[test]
fn half_a_stereo_camera_is_named() {
    let (_folder, path) = written(&Recipe { right: false, ..Recipe::default() });
    let text = failure(&path, &Config::default());
    assert!(text.contains("the right images are missing"), "{text}");
}

#[test]
fn a_topic_of_the_wrong_type_is_named_with_both_types() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    foreign(
        &path,
        &[
            ("/left/image_rect", "sensor_msgs/msg/PointCloud2", "cdr"),
            ("/right/image_rect", "sensor_msgs/msg/Image", "cdr"),
        ],
    );
    let text = failure(&path, &Config::default());
    assert!(
        text.contains("/left/image_rect")
            && text.contains("PointCloud2, not sensor_msgs/msg/Image"),
        "{text}"
    );
}

#[test]
fn another_message_encoding_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    foreign(
        &path,
        &[
            ("/left/image_rect", "sensor_msgs/msg/Image", "json"),
            ("/right/image_rect", "sensor_msgs/msg/Image", "json"),
        ],
    );
    let text = failure(&path, &Config::default());
    assert!(text.contains("encoded as json"), "{text}");
}

#[test]
fn a_topic_asked_for_must_be_there() {
    let (_folder, path) = written(&Recipe::default());
    let topics = BagTopics { left: Some("/cam/left".into()), ..BagTopics::default() };
    let options = BagOptions { topics, ..BagOptions::default() };
    let error = BagSource::open(&path, &Config::default(), options).err().unwrap().to_string();
    assert!(error.contains("no topic /cam/left") && error.contains("/left/image_rect"), "{error}");
}

#[test]
fn missing_camera_infos_are_named_and_can_be_given() {
    let (_folder, path) = written(&Recipe { infos: false, ..Recipe::default() });
    let text = failure(&path, &Config::default());
    assert!(text.contains("no camera info topic /left/camera_info"), "{text}");

    let (_other, with) = written(&Recipe::default());
    let frame = &observe(&with, &Config::default()).0[0].frame;
    let info = |camera| salient_stereo::ros::convert::camera_info(camera, Header::default());
    let camera_infos = [Some(info(&frame.rig.left)), Some(info(&frame.rig.right))];
    let options = BagOptions { camera_infos, ..BagOptions::default() };
    let mut source = BagSource::open(&path, &Config::default(), options).unwrap();
    let observed = source.next_observation().unwrap().unwrap();
    assert_eq!(observed.frame.rig, frame.rig);
}
