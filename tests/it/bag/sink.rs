//! Bags of results.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use salient_stereo::config::Config;
use salient_stereo::drive::{Engine, drive};
use salient_stereo::image::Size;
use salient_stereo::input::bag::{BagOptions, BagSource};
use salient_stereo::output::bag::{BagSink, BagTopicsOut};
use salient_stereo::ros::cdr;
use salient_stereo::ros::message::salient_stereo_msgs::SalientRegionArray;
use salient_stereo::ros::message::stereo_msgs::DisparityImage;
use salient_stereo::ros::schema;

use super::recipe::Recipe;

fn replay(from: &Path, to: &Path, threads: i64) {
    let config = Config { threads, ..Config::default() };
    let mut source = BagSource::open(from, &config, BagOptions::default()).unwrap();
    let mut sink = BagSink::create(to, &config, BagTopicsOut::default()).unwrap();
    let mut engine = Engine::new(config);
    let stop = AtomicBool::new(false);
    drive(&mut source, &mut engine, &mut [&mut sink], &stop, |_, _, _| {}).unwrap();
}

#[test]
fn a_replay_gives_the_same_bytes_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("in.mcap");
    let recipe = Recipe { size: Size::new(200, 64), ..Recipe::default() };
    recipe.write(&input);
    let outputs = [1, 1, 2].map(|threads| {
        let output = folder.path().join(format!("out{threads}.mcap"));
        replay(&input, &output, threads);
        fs::read(&output).unwrap()
    });
    assert!(outputs[0] == outputs[1] && outputs[0] == outputs[2]);

    let mut counts = BTreeMap::new();
    for message in mcap::MessageStream::new(&outputs[0]).unwrap() {
        let message = message.unwrap();
        let channel = &message.channel;
        *counts.entry(channel.topic.clone()).or_insert(0) += 1;
        assert_eq!(channel.message_encoding, "cdr");
        let type_name = &channel.schema.as_ref().unwrap().name;
        assert_eq!(channel.metadata.get("topic_type_hash"), schema::type_hash(type_name).as_ref());
        assert!(channel.metadata["offered_qos_profiles"].contains("reliability: reliable"));
        assert!(recipe.stamp(0).0 as u64 <= message.log_time);
        match channel.topic.as_str() {
            "/regions" => {
                let array: SalientRegionArray = cdr::decode(&message.data).unwrap();
                assert_eq!(array.header.frame_id, "left_optical");
                assert_eq!((array.width, array.height), (200, 64));
            }
            "/disparity" => {
                let image: DisparityImage = cdr::decode(&message.data).unwrap();
                assert_eq!((image.f, image.t), (400.0, 0.5));
                assert!(image.delta_d > 0.0);
            }
            _ => {}
        }
    }
    let topics = [
        "/confidence/image_rect",
        "/depth/camera_info",
        "/depth/image_rect",
        "/detections_2d",
        "/detections_3d",
        "/disparity",
        "/markers",
        "/overlay/image/compressed",
        "/regions",
        "/regions/annotations",
        "/regions/label_image",
        "/saliency/image_rect",
    ];
    let expected: BTreeMap<_, _> = topics.map(|topic| (topic.to_owned(), recipe.frames)).into();
    assert_eq!(counts, expected);
}

/// Opt-in, as it needs Python with `rosbags`, `mcap-ros2-support` and `numpy`:
/// `SALIENT_STEREO_INTEROP=1`, and `SALIENT_STEREO_PYTHON` for another interpreter
/// than `python3`.
#[test]
fn other_readers_agree() {
    if std::env::var_os("SALIENT_STEREO_INTEROP").is_none() {
        println!("SALIENT_STEREO_INTEROP is not set: other readers are not asked");
        return;
    }
    let python = std::env::var_os("SALIENT_STEREO_PYTHON").unwrap_or_else(|| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/read_bag.py");
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("in.mcap");
    Recipe { size: Size::new(200, 64), ..Recipe::default() }.write(&input);
    for name in ["out.mcap", "folder"] {
        let output = folder.path().join(name);
        replay(&input, &output, 2);
        let run = std::process::Command::new(&python)
            .arg(&script)
            .args([&output, &input])
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&run.stdout);
        assert!(run.status.success(), "{text}{}", String::from_utf8_lossy(&run.stderr));
        assert!(text.contains("6 region arrays"), "{text}");
    }
}
