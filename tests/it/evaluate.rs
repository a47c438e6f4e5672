//! The command `evaluate`, as a user meets it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use salient_stereo::image::{Image, Size};
use salient_stereo::output::picture::{png, png_gray};
use serde_json::Value;
use tempfile::TempDir;

const IMAGES: usize = 4;

/// A folder of stills with a bright square on a dark ground, and their masks.
fn stills(folder: &Path) {
    let (images, masks) = (folder.join("Toy-Image"), folder.join("Toy-Mask"));
    fs::create_dir_all(&images).unwrap();
    fs::create_dir_all(&masks).unwrap();
    for i in 0..IMAGES {
        let size = Size::new(96 + 8 * i, 80);
        let inside =
            |x: usize, y: usize| (30 + 4 * i..62 + 4 * i).contains(&x) && (24..56).contains(&y);
        let picture = Image::from_fn(size, |x, y| {
            let shade = ((x * 7 + y * 13) % 17) as u8;
            if inside(x, y) { [210 + shade, 60 + shade, 40] } else { [50 + shade, 90, 60 + shade] }
        });
        let mask = Image::from_fn(size, |x, y| if inside(x, y) { 255 } else { 0 });
        fs::write(images.join(format!("thing_{i}.png")), png(&picture).unwrap()).unwrap();
        fs::write(masks.join(format!("thing_{i}.png")), png_gray(&mask).unwrap()).unwrap();
    }
}

fn evaluate(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
        .current_dir(folder)
        .arg("evaluate")
        .args(arguments)
        .output()
        .unwrap()
}

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = evaluate(folder, arguments);
    let (out, err) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(output.status.code(), Some(0), "{out}\n{err}");
    out
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The figures of one method of a JSON output.
fn figures<'a>(document: &'a Value, method: &str) -> &'a Value {
    let results = document["results"].as_array().unwrap();
    &results.iter().find(|result| result["method"] == method).unwrap()["figures"]
}

/// All files below a folder, with their contents.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push((path.clone(), fs::read(&path).unwrap()));
        }
    }
    found.sort();
    found
}

#[test]
fn a_thing_that_stands_out_is_found_and_the_maps_are_written_under_the_images_names() {
    let folder = TempDir::new().unwrap();
    stills(&folder.path().join("toy"));
    let table = done(
        folder.path(),
        &[
            "--dataset",
            "saliency",
            "toy",
            "--maps",
            "maps",
            "--json",
            "out.json",
            "--markdown",
            "-",
        ],
    );
    assert!(table.contains("scene (ours)") && table.contains("centre"), "{table}");
    let document = json(&folder.path().join("out.json"));
    let scene = figures(&document, "scene");
    let centre = figures(&document, "centre");
    let max_f = |figures: &Value| figures["map"]["max_f"].as_f64().unwrap();
    assert!(max_f(scene) > 0.9, "{scene}");
    assert!(max_f(scene) > max_f(centre), "{scene} {centre}");
    // With one camera nothing is said about disparity.
    assert!(scene["frame"].is_null() && scene["filled_frame"].is_null(), "{scene}");
    for method in ["paper", "scene", "rows"] {
        for i in 0..IMAGES {
            let map = folder.path().join(format!("maps/saliency/{method}/thing_{i}.png"));
            assert_eq!(&fs::read(&map).unwrap()[1..4], b"PNG", "{}", map.display());
        }
    }
}

#[test]
fn what_is_finished_is_not_measured_again() {
    let folder = TempDir::new().unwrap();
    stills(&folder.path().join("toy"));
    let arguments = ["--dataset", "saliency", "toy", "--method", "paper", "--json", "a.json"];
    done(folder.path(), &arguments);
    let parts = folder.path().join("out/evaluation");
    let before = files(&parts);
    assert!(!before.is_empty());
    // Times differ from run to run: equal bytes mean that nothing was run.
    done(folder.path(), &arguments);
    assert_eq!(files(&parts), before);
    // Other parameters are another measurement.
    let mut other = arguments.to_vec();
    other.extend(["--set", "saliency.threshold=0.3"]);
    done(folder.path(), &other);
    assert_ne!(files(&parts), before);
}

#[test]
fn shards_measured_apart_add_up_to_the_whole() {
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    for name in ["one", "two", "three"] {
        stills(&folder.join(name));
    }
    let data = ["--dataset", "saliency", "one", "two", "three", "--method", "scene"];
    let with = |more: &[&'static str]| {
        let mut all = data.to_vec();
        all.extend(more);
        done(folder, &all)
    };
    with(&["--work", "whole", "--json", "whole.json"]);
    with(&["--work", "a", "--shard", "1/2"]);
    with(&["--work", "b", "--shard", "2/2"]);
    done(folder, &["--merge", "a", "--merge", "b", "--json", "merged.json"]);
    let (whole, merged) = (json(&folder.join("whole.json")), json(&folder.join("merged.json")));
    let results = |document: &Value| document["results"].as_array().unwrap().len();
    assert_eq!(results(&whole), results(&merged));
    for (whole, merged) in
        whole["results"].as_array().unwrap().iter().zip(merged["results"].as_array().unwrap())
    {
        for key in ["dataset", "method", "frames"] {
            assert_eq!(whole[key], merged[key]);
        }
        for key in ["map", "stretched_map", "salient"] {
            assert_eq!(whole["figures"][key], merged["figures"][key], "{key}");
        }
    }
}

#[test]
fn an_image_that_cannot_be_read_is_counted_and_named() {
    let folder = TempDir::new().unwrap();
    stills(&folder.path().join("toy"));
    fs::write(folder.path().join("toy/Toy-Image/thing_2.png"), b"no picture").unwrap();
    let output = evaluate(folder.path(), &["--dataset", "saliency", "toy", "--method", "scene"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{errors}");
    assert!(errors.contains("thing_2.png"), "{errors}");
}

#[test]
fn a_bag_with_truth_is_scored() {
    let folder = TempDir::new().unwrap();
    let bag = folder.path().join("small.mcap");
    let rendered = Command::new(env!("CARGO_BIN_EXE_salient_stereo"))
        .args(["render", "--scene", "tabletop", "--frames", "4", "-o"])
        .arg(&bag)
        .output()
        .unwrap();
    assert!(rendered.status.success(), "{}", String::from_utf8_lossy(&rendered.stderr));
    done(
        folder.path(),
        &[
            "--dataset",
            "bag",
            "small.mcap",
            "--method",
            "scene",
            "--method",
            "full_frame",
            "--json",
            "out.json",
            "--report",
            "out.html",
            "--csv",
            "out.csv",
        ],
    );
    let document = json(&folder.path().join("out.json"));
    let (scene, full) = (figures(&document, "scene"), figures(&document, "full_frame"));
    assert_eq!(full["matched"], 1.0);
    assert!(scene["matched"].as_f64().unwrap() < 1.0, "{scene}");
    assert!(scene["saved_total"].is_number(), "{scene}");
    assert!(full["frame"]["density"].as_f64().unwrap() > 0.7, "{full}");
    assert!(scene["scores"]["regions_by_mask"][1]["f1"].as_f64().unwrap() > 0.3, "{scene}");
    assert!(fs::read_to_string(folder.path().join("out.html")).unwrap().contains("bag small"));
    assert!(fs::read_to_string(folder.path().join("out.csv")).unwrap().contains("# bag small"));
}

#[test]
fn wrong_usage_says_what_is_right() {
    let folder = TempDir::new().unwrap();
    stills(&folder.path().join("toy"));
    let cases: [(&[&str], i32, &str); 8] = [
        (&["--dataset", "kitty", "toy"], 2, "kitti2012"),
        (&["--dataset", "saliency"], 2, "PATHS"),
        (&["--dataset", "saliency", "toy", "--method", "best"], 2, "frequency_tuned"),
        (&["--dataset", "saliency", "toy", "--shard", "3/2"], 2, "1 <= I <= N"),
        (&["--dataset", "saliency", "--dataset", "bag", "toy"], 2, "one for each"),
        (&["--dataset", "kitti2012", "toy"], 1, "toy"),
        (&["--merge", "toy"], 1, "toy"),
        (&["--dataset", "saliency", "toy", "--peers", "none.json"], 2, "none.json"),
    ];
    for (arguments, code, text) in cases {
        let output = evaluate(folder.path(), arguments);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {errors}");
        assert!(errors.contains(text), "{arguments:?}: {errors}");
    }
}
