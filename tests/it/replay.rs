//! Replaying bags through the command line: determinism, completeness, interruption.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use salient_stereo::ros::cdr;
use salient_stereo::ros::message::salient_stereo_msgs::SalientRegionArray;
use salient_stereo::ros::message::stereo_msgs::DisparityImage;

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bags").join(name)
}

fn replay(input: &Path, output: &Path, more: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
        .arg("replay")
        .arg(input)
        .arg("-o")
        .arg(output)
        .args(more)
        .output()
        .unwrap()
}

/// Messages by topic, in their order.
fn messages(bag: &Path) -> BTreeMap<String, Vec<Vec<u8>>> {
    let bytes = std::fs::read(bag).unwrap();
    assert!(mcap::Summary::read(&bytes).unwrap().is_some(), "the bag has no summary");
    let mut topics = BTreeMap::<String, Vec<Vec<u8>>>::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        topics.entry(message.channel.topic.clone()).or_default().push(message.data.to_vec());
    }
    topics
}

#[test]
fn a_replay_gives_the_same_bytes_again_and_with_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["street.mcap", "tabletop.mcap"] {
        let outputs = [("1a", "1"), ("1b", "1"), ("2", "2")].map(|(file, threads)| {
            let output = folder.path().join(format!("{file}.mcap"));
            let run = replay(&shipped(name), &output, &["--threads", threads]);
            assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
            std::fs::read(output).unwrap()
        });
        assert!(outputs[0] == outputs[1], "{name}: two runs differ");
        assert!(outputs[0] == outputs[2], "{name}: one and two threads differ");
    }
}

#[test]
fn every_pair_gives_one_region_array_and_one_sane_disparity() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.mcap");
    let run = replay(&shipped("street.mcap"), &output, &["--json", "-"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let json: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let pairs = json["pairs"].as_u64().unwrap() as usize;
    assert!(pairs >= 50);

    let topics = messages(&output);
    assert_eq!(topics["/regions"].len(), pairs);
    assert_eq!(topics["/disparity"].len(), pairs);

    let mut with_regions = 0;
    for bytes in &topics["/regions"] {
        assert!(bytes.len() < 58_000, "a region array of {} bytes", bytes.len());
        let array: SalientRegionArray = cdr::decode(bytes).unwrap();
        assert_eq!(array.header.frame_id, "left_optical");
        with_regions += usize::from(!array.regions.is_empty());
        for region in &array.regions {
            assert!(region.roi.x_offset + region.roi.width <= array.width);
            assert!(region.roi.y_offset + region.roi.height <= array.height);
            assert!((0.0..=1.0).contains(&region.confidence));
            assert!(region.track_id > 0);
            if region.mean_depth.is_finite() {
                assert!(region.near_depth <= region.median_depth);
                assert!(region.median_depth <= region.far_depth);
            }
        }
    }
    assert!(with_regions * 10 >= pairs * 9, "regions in {with_regions} of {pairs} frames");

    for bytes in &topics["/disparity"] {
        let message: DisparityImage = cdr::decode(bytes).unwrap();
        assert!(message.f > 0.0 && message.t > 0.0 && message.delta_d > 0.0);
        assert!(message.max_disparity > message.min_disparity);
        assert_eq!(message.image.encoding, "32FC1");
        let window = &message.valid_window;
        assert!(window.x_offset + window.width <= message.image.width);
        assert!(window.y_offset + window.height <= message.image.height);
        let sentinel = message.min_disparity - 1.0;
        let mut valid = 0;
        for pixel in message.image.data.chunks_exact(4) {
            let d = f32::from_le_bytes(pixel.try_into().unwrap());
            assert!(d == sentinel || (message.min_disparity..=message.max_disparity).contains(&d));
            valid += usize::from(d != sentinel);
        }
        assert!(valid > 0);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_replay_leaves_a_complete_bag() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.mcap");
    let child = Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
        .arg("replay")
        .arg(shipped("street.mcap"))
        .arg("-o")
        .arg(&output)
        .args(["--threads", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // As soon as something has been written, the run is in its middle.
    let mut waited = Duration::ZERO;
    while std::fs::metadata(&output).map_or(0, |m| m.len()) < 100_000 {
        std::thread::sleep(Duration::from_millis(5));
        waited += Duration::from_millis(5);
        assert!(waited < Duration::from_secs(60), "nothing was written");
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let run = child.wait_with_output().unwrap();
    let errors = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{errors}");
    let regions = messages(&output)["/regions"].len();
    assert!(regions > 0, "{errors}");
}
