//! The doctor: every fault is named with its fix, in bags and on the live graph.

mod live;

use std::path::Path;
use std::process::Command;

use salient_stereo::camera::Camera;
use salient_stereo::command::doctor::{Finding, Severity, examine_bag};
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Size};
use salient_stereo::input::bag::BagOptions;
use salient_stereo::input::synthetic::noise::noise2;
use salient_stereo::output::bag::{BagWriter, Packing};
use salient_stereo::ros::convert;
use salient_stereo::ros::message::sensor_msgs::{self, CameraInfo};
use salient_stereo::ros::message::std_msgs::Header;
use salient_stereo::stamp::Stamp;
use serde_json::json;

const SIZE: Size = Size::new(240, 120);
const FRAMES: usize = 6;

/// One pair on its way into a bag: left and right.
pub struct Sent {
    pub images: [sensor_msgs::Image; 2],
    pub infos: [CameraInfo; 2],
}

impl Sent {
    fn right_stamp(&mut self, later_ns: i64) {
        let stamp = Stamp(Stamp::from(self.images[0].header.stamp).0 + later_ns);
        self.images[1].header.stamp = stamp.into();
    }
}

/// A wall of noise, seen by the right camera `shift` pixels farther left and
/// `lower` pixels lower.
pub fn sent(number: usize, shift: f64, lower: f64) -> Sent {
    let header = Header {
        stamp: Stamp(1_000_000_000 + number as i64 * 100_000_000).into(),
        frame_id: "left_optical".into(),
    };
    let view = |shift: f64, lower: f64| {
        let image = Image::from_fn(SIZE, |x, y| {
            let (u, v) = (x as f64 + shift, y as f64 - lower);
            [(130.0 + 100.0 * noise2(1, u / 5.0, v / 5.0)) as u8; 3]
        });
        convert::rgb_image(&image, header.clone())
    };
    let info =
        |tx| convert::camera_info(&Camera::pinhole(SIZE, 300.0, 120.0, 60.0, tx), header.clone());
    Sent { images: [view(0.0, 0.0), view(shift, lower)], infos: [info(0.0), info(-60.0)] }
}

/// A bag of pairs, each changed by `spoil`; finished unless `cut`.
fn write(path: &Path, cut: bool, spoil: impl Fn(usize, &mut Sent)) {
    let mut bag = BagWriter::create_packed(path, Packing::Zstd).unwrap();
    let images = ["/left/image_rect", "/right/image_rect"].map(|t| bag.topic(t).unwrap());
    let infos = ["/left/camera_info", "/right/camera_info"].map(|t| bag.topic(t).unwrap());
    for number in 0..FRAMES {
        let mut pair = sent(number, 12.0, 0.0);
        spoil(number, &mut pair);
        for side in 0..2 {
            let stamp = pair.images[side].header.stamp.into();
            bag.write(infos[side], stamp, &pair.infos[side]).unwrap();
            bag.write(images[side], stamp, &pair.images[side]).unwrap();
        }
        bag.flush().unwrap();
    }
    if cut {
        // As a killed recorder: dropping would finish the file.
        std::mem::forget(bag);
    } else {
        bag.finish().unwrap();
    }
}

fn examine(config: &Config, spoil: impl Fn(usize, &mut Sent)) -> Vec<Finding> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    write(&path, false, spoil);
    examine_bag(&path, config, BagOptions::default())
}

/// The finding that says `what`, of this severity.
pub fn expect<'a>(findings: &'a [Finding], severity: Severity, what: &str) -> &'a Finding {
    let found = findings.iter().find(|f| f.severity == severity && f.what.contains(what));
    found.unwrap_or_else(|| panic!("no {severity:?} '{what}' in {findings:#?}"))
}

#[test]
fn a_healthy_bag_has_no_fault() {
    let findings = examine(&Config::default(), |_, _| ());
    assert!(findings.iter().all(|f| f.severity == Severity::Well), "{findings:#?}");
    expect(
        &findings,
        Severity::Well,
        "6 usable pairs: 240x120 pixels, f = 300.00 px, B = 0.2000 m",
    );
    expect(&findings, Severity::Well, "aligned");
}

#[test]
fn stamps_apart_are_named_in_milliseconds() {
    let findings = examine(&Config::default(), |_, pair| pair.right_stamp(20_000_000));
    let finding = expect(&findings, Severity::Fault, "20.000 ms");
    assert!(finding.what.contains("approximate_sync_tolerance_seconds"), "{finding}");
}

#[test]
fn a_baseline_of_no_use_is_named_with_its_cause() {
    let with = |tx: f64| examine(&Config::default(), move |_, pair| pair.infos[1].p[3] = tx);
    let zero = with(0.0);
    assert!(expect(&zero, Severity::Fault, "baseline is zero").fix.contains("baseline_override"));
    let negative = with(60.0);
    assert!(expect(&negative, Severity::Fault, "baseline is negative").fix.contains("exchange"));
    // 200 mm, and f = 300 px.
    let millimetres = with(-60_000.0);
    let finding = expect(&millimetres, Severity::Fault, "millimetres");
    assert!(finding.fix.contains("baseline_override to 0.2"), "{finding}");
    let kilometres = with(-0.06);
    expect(&kilometres, Severity::Fault, "0.000200 m");
}

#[test]
fn images_that_are_not_rectified_are_found_by_their_rows() {
    let with = |lower: f64| {
        examine(&Config::default(), move |number, pair| {
            pair.images = sent(number, 12.0, lower).images;
        })
    };
    let raw = with(7.0);
    let finding = expect(&raw, Severity::Fault, "not rectified");
    assert!(finding.what.contains("+7.") || finding.what.contains("+6.9"), "{finding}");
    assert!(finding.fix.contains("rectify:=true"), "{finding}");
    expect(&with(-1.6), Severity::Warning, "badly aligned");
}

#[test]
fn swapped_images_are_named() {
    let findings = examine(&Config::default(), |_, pair| {
        let [left, right] = &mut pair.images;
        std::mem::swap(&mut left.data, &mut right.data);
    });
    assert!(expect(&findings, Severity::Fault, "swapped").fix.contains("exchange"));
}

#[test]
fn images_that_cannot_be_read_are_counted_by_reason() {
    let unknown = examine(&Config::default(), |_, pair| pair.images[0].encoding = "rgb7".into());
    let finding = expect(&unknown, Severity::Fault, "6 times: left image: unknown image encoding");
    assert!(finding.fix.contains("image_proc"), "{finding}");
    let cut = examine(&Config::default(), |number, pair| {
        if number == 2 {
            pair.images[1].data.truncate(100);
        }
    });
    let finding = expect(&cut, Severity::Warning, "1 times: right image: image payload is 100");
    assert!(finding.fix.contains("inconsistent"), "{finding}");
    let sizes = examine(&Config::default(), |_, pair| pair.images[1].height = 100);
    let finding = expect(&sizes, Severity::Fault, "left image is 240x120, right image is 240x100");
    assert!(finding.fix.contains("same resolution"), "{finding}");
    let other = examine(&Config::default(), |_, pair| pair.infos[0].width = 480);
    let finding = expect(&other, Severity::Fault, "its camera info describes 480x120");
    assert!(finding.fix.contains("calibrate at the resolution"), "{finding}");
}

#[test]
fn a_bag_without_an_index_is_read_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    write(&path, true, |_, _| ());
    let findings = examine_bag(&path, &Config::default(), BagOptions::default());
    let finding = expect(&findings, Severity::Warning, "has no index");
    assert!(finding.fix.contains("mcap recover"), "{finding}");
    expect(&findings, Severity::Well, "usable pairs");
}

#[test]
fn a_bag_of_raw_images_gets_the_hint_to_rectify() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("raw.mcap");
    let mut bag = BagWriter::create_packed(&path, Packing::Zstd).unwrap();
    let topic = bag.topic("/left/image_raw").unwrap();
    bag.write(topic, Stamp(1), &sent(0, 12.0, 0.0).images[0]).unwrap();
    bag.finish().unwrap();
    let findings = examine_bag(&path, &Config::default(), BagOptions::default());
    let finding = expect(&findings, Severity::Fault, "has no stereo images");
    assert!(finding.fix.contains("rectify=true"), "{finding}");
}

#[test]
fn a_parameter_may_mend_what_the_bag_has_wrong() {
    let config = Config::default().with("calibration.baseline_override", &json!(0.2)).unwrap();
    let findings = examine(&config, |_, pair| pair.infos[1].p[3] = 0.0);
    assert!(findings.iter().all(|f| f.severity == Severity::Well), "{findings:#?}");
}

#[test]
fn the_exit_code_tells_health_warnings_and_faults_apart() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, spoil: fn(usize, &mut Sent)| {
        let path = folder.path().join(name);
        write(&path, false, spoil);
        let output = Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
            .arg("doctor")
            .arg(&path)
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    let (code, text) = run("well.mcap", |_, _| ());
    assert_eq!(code, Some(0), "{text}");
    let (code, text) = run("warning.mcap", |number, pair| {
        if number == 3 {
            pair.images[0].step = 1;
        }
    });
    assert_eq!(code, Some(3), "{text}");
    assert!(text.contains("warning  1 times: left image: image step is 1 bytes"), "{text}");
    assert!(text.contains("fix: the messages are inconsistent"), "{text}");
    let (code, text) = run("fault.mcap", |_, pair| pair.infos[1].p[3] = 0.0);
    assert_eq!(code, Some(1), "{text}");
    let missing = Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
        .args(["doctor", "no such.mcap"])
        .output()
        .unwrap();
    assert_eq!(missing.status.code(), Some(1));
    let unknown = Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
        .args(["doctor", "--seconds", "-1"])
        .output()
        .unwrap();
    assert_eq!(unknown.status.code(), Some(2));
}
