//! The shipped parameter files agree with the code.

use std::path::{Path, PathBuf};

use salient_stereo::config::Config;
use salient_stereo::ros::params::{self, apply, read_file};

fn config_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("config")
}

/// `SALIENT_STEREO_UPDATE=1 cargo test --test it params::` writes the file anew.
#[test]
fn the_shipped_file_is_the_default_configuration() {
    let file = config_dir().join("salient_stereo.yaml");
    let wanted = params::to_yaml(&Config::default());
    if std::env::var_os("SALIENT_STEREO_UPDATE").is_some() {
        std::fs::write(&file, &wanted).unwrap();
    }
    let found = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        found == wanted,
        "config/salient_stereo.yaml differs from Config::default(); SALIENT_STEREO_UPDATE=1 cargo test --test it params:: writes it anew"
    );
    let all = read_file(&file).unwrap();
    let (config, warnings) = apply(&Config::default(), &all, "/salient_stereo").unwrap();
    assert_eq!(config, Config::default());
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn every_overlay_loads_and_holds_only_what_differs() {
    let default = Config::default();
    for name in ["road", "indoor", "low_power"] {
        let all = read_file(&config_dir().join(format!("{name}.yaml"))).unwrap();
        assert!(!all.is_empty());
        let (config, warnings) = apply(&default, &all, "/salient_stereo").unwrap();
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
        for assignment in &all {
            assert_ne!(
                config.value(&assignment.name).unwrap(),
                default.value(&assignment.name).unwrap(),
                "{name}: {} has its default",
                assignment.name
            );
        }
    }
}

/// `ros2 param dump` names the node in full, so that every parameter must be known.
#[test]
fn a_dump_of_a_running_node_loads_back() {
    let config = Config::default()
        .with_all([
            ("saliency.threshold", serde_json::json!(0.25)),
            ("depth.encoding", serde_json::json!("16UC1")),
            ("camera_info.left_url", serde_json::json!("file:///a b/left.yaml")),
        ])
        .unwrap();
    let dump = params::to_yaml(&config).replace("/**:", "/robot/eye:");
    let all = params::parse(&dump, "dump.yaml").unwrap();
    assert!(all.iter().all(|assignment| assignment.strict));
    let (loaded, warnings) = apply(&Config::default(), &all, "/robot/eye").unwrap();
    assert_eq!(loaded, config);
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn the_page_of_promises_names_tests_that_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/interface.md")).unwrap();
    let (promises, _) = page.split_once("## Not kept").unwrap();
    let mut sources = String::new();
    let mut folders = vec![root.join("src"), root.join("tests")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                sources.push_str(&std::fs::read_to_string(path).unwrap());
            }
        }
    }
    let rows = promises.lines().filter(|line| line.starts_with("| ") && line.contains('`'));
    let mut named = 0;
    for row in rows {
        let tests = row.trim_end_matches(['|', ' ']).rsplit("| ").next().unwrap();
        let names: Vec<_> = tests.split('`').skip(1).step_by(2).collect();
        assert!(!names.is_empty(), "no test: {row}");
        for name in names {
            assert!(sources.contains(&format!("fn {name}(")), "{name} is no test");
            named += 1;
        }
    }
    assert!(named > 80, "{named}");
}
