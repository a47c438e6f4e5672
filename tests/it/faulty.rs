//! Faulty input, as a user of the command line meets it: each fault gets its
//! message and its exit code, and nothing panics.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use salient_stereo::output::bag::{BagWriter, Packing};
use salient_stereo::ros::message::sensor_msgs::{CameraInfo, Image};
use salient_stereo::ros::message::std_msgs;
use salient_stereo::stamp::Stamp;
use serde_json::Value;
use tempfile::TempDir;

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;
const PAIRS: usize = 6;

/// The messages of one instant, to be spoilt by a test.
struct Instant {
    left: Image,
    right: Image,
    left_info: Option<CameraInfo>,
    right_info: Option<CameraInfo>,
}

fn stamp(index: usize) -> Stamp {
    Stamp(1_000_000_000 + 100_000_000 * index as i64)
}

fn image(frame_id: &str, time: Stamp, shift: u32) -> Image {
    // Noise that does not compress, so that most of the bag is messages.
    let pixel = |i: u32| {
        let (x, y) = (i % WIDTH + shift, i / WIDTH);
        let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
        (h >> 24) as u8
    };
    Image {
        header: std_msgs::Header { stamp: time.into(), frame_id: frame_id.into() },
        height: HEIGHT,
        width: WIDTH,
        encoding: "mono8".into(),
        step: WIDTH,
        data: (0..WIDTH * HEIGHT).map(pixel).collect(),
        ..Image::default()
    }
}

fn info(frame_id: &str, time: Stamp, tx: f64) -> CameraInfo {
    CameraInfo {
        header: std_msgs::Header { stamp: time.into(), frame_id: frame_id.into() },
        height: HEIGHT,
        width: WIDTH,
        distortion_model: "plumb_bob".into(),
        d: vec![0.0; 5],
        k: [80.0, 0.0, 48.0, 0.0, 80.0, 32.0, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [80.0, 0.0, 48.0, tx, 0.0, 80.0, 32.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    }
}

/// A bag of six pairs, each changed by `spoil` before it is written.
fn bag(folder: &TempDir, mut spoil: impl FnMut(usize, &mut Instant)) -> PathBuf {
    let path = folder.path().join("in.mcap");
    let mut bag = BagWriter::create_packed(&path, Packing::Zstd).unwrap();
    let left = bag.topic::<Image>("/left/image_rect").unwrap();
    let right = bag.topic::<Image>("/right/image_rect").unwrap();
    let left_info = bag.topic::<CameraInfo>("/left/camera_info").unwrap();
    let right_info = bag.topic::<CameraInfo>("/right/camera_info").unwrap();
    for i in 0..PAIRS {
        let time = stamp(i);
        let mut instant = Instant {
            left: image("left_optical", time, 0),
            right: image("right_optical", time, 5),
            left_info: Some(info("left_optical", time, 0.0)),
            right_info: Some(info("right_optical", time, -8.0)),
        };
        spoil(i, &mut instant);
        // The log time goes on even where a test turns the stamps back.
        if let Some(message) = &instant.left_info {
            bag.write(left_info, time, message).unwrap();
        }
        if let Some(message) = &instant.right_info {
            bag.write(right_info, time, message).unwrap();
        }
        bag.write(left, time, &instant.left).unwrap();
        bag.write(right, time, &instant.right).unwrap();
        bag.flush().unwrap();
    }
    bag.finish().unwrap();
    path
}

fn tool() -> Command {
    Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
}

struct Run {
    code: Option<i32>,
    errors: String,
    json: Value,
}

fn replay(input: &Path, more: &[&str]) -> Run {
    let Output { status, stdout, stderr } =
        tool().arg("replay").arg(input).args(["--json", "-"]).args(more).output().unwrap();
    let errors = String::from_utf8_lossy(&stderr).into_owned();
    assert!(!errors.contains("panicked"), "{errors}");
    Run { code: status.code(), errors, json: serde_json::from_slice(&stdout).unwrap_or_default() }
}

impl Run {
    #[track_caller]
    fn fails_with(&self, code: i32, words: &[&str]) {
        assert_eq!(self.code, Some(code), "{}", self.errors);
        for word in words {
            assert!(self.errors.contains(word), "'{word}' is not in: {}", self.errors);
        }
    }
}

#[test]
fn a_reader_that_goes_away_ends_the_printing_and_not_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("out.mcap");
    let mut child = tool()
        .args(["render", "--scene", "tabletop", "--frames", "2", "-o"])
        .arg(&bag)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(!errors.contains("panicked"), "{errors}");
    assert_eq!(output.status.code(), Some(0), "{errors}");
    assert!(bag.exists());
}

#[test]
fn a_sound_bag_is_done() {
    let folder = tempfile::tempdir().unwrap();
    let run = replay(&bag(&folder, |_, _| {}), &[]);
    assert_eq!(run.code, Some(0), "{}", run.errors);
    assert_eq!(run.json["pairs"], PAIRS);
}

#[test]
fn a_short_payload_is_one_counted_skip() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |i, instant| {
        if i == 2 {
            instant.left.data.truncate(12);
        }
    });
    let run = replay(&input, &[]);
    run.fails_with(3, &["12 bytes", "6144 expected", "96x64"]);
    assert_eq!(run.json["pairs"], PAIRS - 1);
}

#[test]
fn an_unknown_encoding_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, instant| instant.right.encoding = "mono7".into());
    replay(&input, &[]).fails_with(1, &["mono7", "no usable stereo pair"]);
}

#[test]
fn views_of_different_size_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, instant| {
        instant.right.height = HEIGHT / 2;
        instant.right.data.truncate((WIDTH * HEIGHT / 2) as usize);
    });
    replay(&input, &[]).fails_with(1, &["96x64", "96x32"]);
}

#[test]
fn missing_camera_infos_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, instant| instant.right_info = None);
    replay(&input, &[]).fails_with(1, &["camera info", "/right/camera_info"]);
}

#[test]
fn a_calibration_file_stands_in_for_a_missing_camera_info() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, instant| instant.right_info = None);
    let file = folder.path().join("right.yaml");
    let text = "image_width: 96\nimage_height: 64\ncamera_name: right\n\
        camera_matrix: {rows: 3, cols: 3, data: [80, 0, 48, 0, 80, 32, 0, 0, 1]}\n\
        distortion_model: plumb_bob\n\
        distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n\
        rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n\
        projection_matrix: {rows: 3, cols: 4, data: [80, 0, 48, -8, 0, 80, 32, 0, 0, 0, 1, 0]}\n";
    std::fs::write(&file, text).unwrap();
    let set = format!("camera_info.right_url=file://{}", file.display());
    let run = replay(&input, &["--set", &set]);
    assert_eq!(run.json["pairs"], PAIRS, "{}", run.errors);
    let missing = format!("camera_info.right_url=file://{}.gone", file.display());
    replay(&input, &["--set", &missing]).fails_with(2, &["right.yaml.gone"]);
}

#[test]
fn an_uncalibrated_camera_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, instant| {
        if let Some(info) = &mut instant.left_info {
            info.k = [0.0; 9];
        }
    });
    replay(&input, &[]).fails_with(1, &["uncalibrated", "left"]);
}

#[test]
fn a_zero_baseline_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, instant| {
        if let Some(info) = &mut instant.right_info {
            info.p[3] = 0.0;
        }
    });
    replay(&input, &[]).fails_with(1, &["baseline is zero", "calibration.baseline_override"]);
    let run = replay(&input, &["--set", "calibration.baseline_override=0.1"]);
    assert_eq!(run.json["pairs"], PAIRS, "{}", run.errors);
}

#[test]
fn swapped_cameras_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, instant| {
        if let Some(info) = &mut instant.right_info {
            info.p[3] = 8.0;
        }
    });
    replay(&input, &[]).fails_with(1, &["negative", "swapped"]);
}

#[test]
fn stamps_that_never_match_are_named_with_their_distance() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |i, instant| {
        instant.right.header.stamp = Stamp(stamp(i).0 + 30_000_000).into();
    });
    let run = replay(&input, &[]);
    run.fails_with(
        1,
        &["without a partner: 6 left and 6 right", "30", "approximate_sync_tolerance_seconds"],
    );
    let run = replay(&input, &["--set", "approximate_sync_tolerance_seconds=0.04"]);
    assert_eq!(run.json["pairs"], PAIRS, "{}", run.errors);
}

#[test]
fn stamps_that_jump_back_reset_and_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |i, instant| {
        let looped = stamp(i % 3);
        instant.left.header.stamp = looped.into();
        instant.right.header.stamp = looped.into();
    });
    let run = replay(&input, &[]);
    assert_eq!(run.json["pairs"], PAIRS, "{}", run.errors);
    assert_eq!(run.json["jumps_back"], 1);
}

#[test]
fn a_bag_cut_in_the_middle_gives_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, _| {});
    let bytes = std::fs::read(&input).unwrap();
    std::fs::write(&input, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let run = replay(&input, &[]);
    let pairs = run.json["pairs"].as_u64().unwrap_or(0);
    assert!((1..PAIRS as u64).contains(&pairs), "{pairs} pairs: {}", run.errors);
    assert_eq!(run.code, Some(3), "{}", run.errors);
}

#[test]
fn a_bag_without_images_lists_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.mcap");
    let mut bag = BagWriter::create_packed(&path, Packing::Zstd).unwrap();
    let topic = bag.topic::<CameraInfo>("/left/camera_info").unwrap();
    bag.write(topic, stamp(0), &info("left_optical", stamp(0), 0.0)).unwrap();
    bag.finish().unwrap();
    replay(&path, &[]).fails_with(1, &["image", "/left/camera_info"]);
}

#[test]
fn a_topic_of_the_wrong_type_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.mcap");
    let mut bag = BagWriter::create_packed(&path, Packing::Zstd).unwrap();
    let left = bag.topic::<CameraInfo>("/left/image_rect").unwrap();
    let right = bag.topic::<CameraInfo>("/right/image_rect").unwrap();
    bag.write(left, stamp(0), &info("left_optical", stamp(0), 0.0)).unwrap();
    bag.write(right, stamp(0), &info("right_optical", stamp(0), 0.0)).unwrap();
    bag.finish().unwrap();
    replay(&path, &[]).fails_with(1, &["/left/image_rect", "sensor_msgs/msg/CameraInfo"]);
}

#[test]
fn files_that_are_no_bags_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.mcap");
    replay(&missing, &[]).fails_with(1, &["missing.mcap"]);
    let text = folder.path().join("text.mcap");
    std::fs::write(&text, "this is no bag, but a text that is long enough to be one").unwrap();
    replay(&text, &[]).fails_with(1, &["text.mcap", "MCAP"]);
    let empty = folder.path().join("empty.mcap");
    std::fs::write(&empty, "").unwrap();
    replay(&empty, &[]).fails_with(1, &["empty.mcap"]);
}

#[test]
fn wrong_parameters_are_usage_errors() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, _| {});
    replay(&input, &["--set", "saliency.treshold=0.5"]).fails_with(2, &["saliency.threshold"]);
    replay(&input, &["--set", "saliency.threshold=1.5"]).fails_with(2, &["1.5", "[0, 1]"]);
    replay(&input, &["--set", "saliency.threshold"]).fails_with(2, &["saliency.threshold"]);

    let file = folder.path().join("params.yaml");
    std::fs::write(&file, "/**:\n  ros__parameters:\n    stereo:\n      algoritm: block\n")
        .unwrap();
    let file = file.to_str().unwrap();
    replay(&input, &["--config", file]).fails_with(2, &["stereo.algorithm", "params.yaml"]);
    std::fs::write(file, "/**:\n  ros__parameters:\n    stereo: {disparity_range: 4096}\n")
        .unwrap();
    replay(&input, &["--config", file]).fails_with(2, &["4096", "[16, 512]"]);
}

#[test]
fn an_output_over_the_input_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let input = bag(&folder, |_, _| {});
    let before = std::fs::read(&input).unwrap();
    replay(&input, &["-o", input.to_str().unwrap()]).fails_with(2, &["overwrite the input"]);
    assert!(std::fs::read(&input).unwrap() == before);
}
