//! The demo on bags that other tests have no use for.

use std::fs;
use std::process::Command;

use salient_stereo::image::Size;

use super::recipe::Recipe;
use crate::it::domain::domain;

/// A pinhole calibration as `camera_calibration` writes it.
fn calibration(tx: f64) -> String {
    format!(
        "image_width: 200
image_height: 64
camera_name: eye
camera_matrix: {{rows: 3, cols: 3, data: [400, 0, 100, 0, 400, 32, 0, 0, 1]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}}
rectification_matrix: {{rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}}
projection_matrix: {{rows: 3, cols: 4, data: [400, 0, 100, {tx}, 0, 400, 32, 0, 0, 0, 1, 0]}}
"
    )
}

#[test]
fn calibration_files_stand_in_for_the_camera_infos_that_a_bag_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    Recipe { size: Size::new(200, 64), infos: false, ..Recipe::default() }.write(&path("in.mcap"));
    fs::write(path("left.yaml"), calibration(0.0)).unwrap();
    fs::write(path("right.yaml"), calibration(-200.0)).unwrap();
    let domain = domain(8);
    let run = Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
        .arg("demo")
        .arg(path("in.mcap"))
        .arg("--out")
        .arg(path("out"))
        .args(["left", "right"].map(|side| {
            format!("--set=camera_info.{side}_url={}", path(&format!("{side}.yaml")).display())
        }))
        .env("ROS_DOMAIN_ID", domain.to_string())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&run.stdout);
    assert!(
        text.contains("6 pairs in the bag, 6 processed, 6 region arrays received over DDS"),
        "{text}{}",
        String::from_utf8_lossy(&run.stderr)
    );
    assert_eq!(run.status.code(), Some(0));
}
