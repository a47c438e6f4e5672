//! The ament overlay: what is where, and that it agrees with the project.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use salient_stereo::config::Config;
use salient_stereo::ros::params::{apply, read_file};
use salient_stereo::ros::yaml::Yaml;

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn install(prefix: &Path) -> (Option<i32>, String) {
    let run = Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
        .arg("install-ament")
        .arg("--prefix")
        .arg(prefix)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&run.stdout).into_owned();
    (run.status.code(), text + &String::from_utf8_lossy(&run.stderr))
}

/// All files below a folder, relative to it.
fn files(folder: &Path) -> BTreeSet<String> {
    fn walk(folder: &Path, prefix: &str, out: &mut BTreeSet<String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{prefix}{}", entry.file_name().to_str().unwrap());
            if entry.file_type().unwrap().is_dir() {
                walk(&entry.path(), &format!("{name}/"), out);
            } else {
                out.insert(name);
            }
        }
    }
    let mut out = BTreeSet::new();
    walk(folder, "", &mut out);
    out
}

#[test]
fn the_overlay_has_what_ros2_looks_for() {
    let folder = tempfile::tempdir().unwrap();
    let prefix = folder.path().join("overlay");
    let (code, text) = install(&prefix);
    assert_eq!(code, Some(0), "{text}");
    let found = files(&prefix);
    for name in [
        "share/ament_index/resource_index/packages/salient_stereo",
        "share/salient_stereo/package.xml",
        "share/salient_stereo/launch/salient_stereo.launch.py",
        "share/salient_stereo/launch/salient_stereo.launch.xml",
        "share/salient_stereo/launch/salient_stereo.launch.yaml",
        "share/salient_stereo/rviz/salient_stereo.rviz",
        "share/salient_stereo/foxglove/salient_stereo.json",
        "lib/salient_stereo/salient_stereo",
        "setup.bash",
    ] {
        assert!(found.contains(name), "{name} is missing in {found:?}");
    }
    // Every file of config/ is installed.
    for name in files(&project("config")) {
        let kind = name.split('/').next().unwrap();
        let there = match kind {
            "launch" | "rviz" | "foxglove" => format!("share/salient_stereo/{name}"),
            _ => format!("share/salient_stereo/config/{name}"),
        };
        assert!(found.contains(&there), "config/{name} is not installed as {there}");
    }
    let node = prefix.join("lib/salient_stereo/salient_stereo_node");
    let help = Command::new(node).arg("--help").output().unwrap();
    assert!(help.status.success() && String::from_utf8_lossy(&help.stdout).contains("--ros-args"));
    // The installed parameters load.
    let all = read_file(&prefix.join("share/salient_stereo/config/salient_stereo.yaml")).unwrap();
    assert_eq!(apply(&Config::default(), &all, "/salient_stereo").unwrap().0, Config::default());

    let shell = Command::new("bash")
        .args(["-c", "export AMENT_PREFIX_PATH=/opt/ros/jazzy; . \"$1/setup.bash\" && . \"$1/setup.bash\" && printf %s \"$AMENT_PREFIX_PATH\"", "-"])
        .arg(&prefix)
        .output()
        .unwrap();
    let path = String::from_utf8(shell.stdout).unwrap();
    let real = fs::canonicalize(&prefix).unwrap();
    assert_eq!(path, format!("{}:/opt/ros/jazzy", real.display()), "twice is once");
}

#[test]
fn a_second_installation_replaces_ours_and_leaves_what_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let prefix = folder.path();
    fs::write(prefix.join("setup.bash"), "# of colcon\n").unwrap();
    let (code, text) = install(prefix);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("setup.bash belongs to somebody else"), "{text}");
    fs::write(prefix.join("share/salient_stereo/package.xml"), "old").unwrap();
    assert_eq!(install(prefix).0, Some(0));
    assert_eq!(fs::read_to_string(prefix.join("setup.bash")).unwrap(), "# of colcon\n");
    let package = fs::read_to_string(prefix.join("share/salient_stereo/package.xml")).unwrap();
    assert!(package.contains(&format!("<version>{}</version>", env!("CARGO_PKG_VERSION"))));
    assert!(package.contains("<build_type>ament_cargo</build_type>"));
}

#[test]
fn a_prefix_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let (code, text) = install(&file);
    assert_eq!(code, Some(1));
    assert!(text.contains("cannot write") && text.contains("file/lib"), "{text}");
}

/// The three launch files offer the same arguments and remaps, and name
/// parameters that exist; the layouts of `RViz` and Foxglove show topics that exist.
#[test]
fn launch_files_and_layouts_agree_with_the_node() {
    let text = |name: &str| fs::read_to_string(project("config").join(name)).unwrap();
    let launch =
        ["py", "xml", "yaml"].map(|kind| text(&format!("launch/salient_stereo.launch.{kind}")));
    for name in [
        "namespace",
        "overlay",
        "left",
        "right",
        "left_info",
        "right_info",
        "image_transport",
        "use_sim_time",
    ] {
        let declared = [
            format!("    \"{name}\": ("),
            format!("<arg name=\"{name}\""),
            format!("- arg: {{name: {name},"),
        ];
        for (launch, declared) in launch.iter().zip(declared) {
            assert!(launch.contains(&declared), "{declared} is not in\n{launch}");
        }
    }
    for topic in ["left/image_rect", "right/image_rect", "left/camera_info", "right/camera_info"] {
        assert!(launch[0].contains(&format!("(\"{topic}\", value[")), "{topic}");
        assert!(launch[1].contains(&format!("<remap from=\"{topic}\"")), "{topic}");
        assert!(launch[2].contains(&format!("{{from: {topic}, to:")), "{topic}");
    }
    Config::default().value("image_transport").unwrap();
    Config::default().value("use_sim_time").unwrap();
    assert!(matches!(Yaml::parse(&launch[2]), Ok(Yaml::Map(_))));

    let rviz = text("rviz/salient_stereo.rviz");
    assert!(matches!(Yaml::parse(&rviz), Ok(Yaml::Map(_))));
    let layout: serde_json::Value =
        serde_json::from_str(&text("foxglove/salient_stereo.json")).unwrap();
    let panels: BTreeSet<&str> =
        layout["configById"].as_object().unwrap().keys().map(String::as_str).collect();
    let placed = layout["layout"].to_string();
    assert!(panels.iter().all(|panel| placed.contains(&format!("\"{panel}\""))), "{panels:?}");
    let readme = fs::read_to_string(project("README.md")).unwrap();
    for topic in ["overlay/image", "disparity/image_color", "markers", "points2"] {
        assert!(rviz.contains(&format!("Value: {topic}\n")), "{topic}");
        assert!(readme.contains(&format!("`{topic}`")), "{topic}");
    }
}

/// Opt-in, as it needs Python: the launch file compiles, and the examples do
/// what they say with messages made here in place of rclpy's.
#[test]
fn the_python_files_do_what_they_say() {
    if std::env::var_os("SALIENT_STEREO_INTEROP").is_none() {
        println!("skipped: set SALIENT_STEREO_INTEROP=1 to run the Python files");
        return;
    }
    let python = std::env::var_os("SALIENT_STEREO_PYTHON").unwrap_or_else(|| "python3".into());
    let run = Command::new(python)
        .arg(project("tests/interop/examples.py"))
        .arg(project(""))
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}
