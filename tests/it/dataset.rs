//! Data sets in their published layouts, and their export as bags.

mod kitti;
mod masks;
mod middlebury;
mod rendered;

use std::fs;
use std::path::{Path, PathBuf};

use image::{ImageBuffer, Rgb, RgbImage};
use salient_stereo::config::Config;
use salient_stereo::input::dataset::{
    DatasetError, DatasetKind, DatasetSource, Opened, PairFiles, Scene, open,
};
use salient_stereo::input::{FrameSource, Observation, Truth};
use salient_stereo::output::bag::{Exported, export_bag};

use super::bag::recipe::observe as read_bag;

fn write(path: &Path, content: &[u8]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, content).unwrap();
}

fn save<P: image::PixelWithColorType>(path: &Path, picture: &ImageBuffer<P, Vec<P::Subpixel>>)
where
    [P::Subpixel]: image::EncodableLayout,
{
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    picture.save(path).unwrap();
}

/// The scenes of a data set that is whole.
fn opened(kind: DatasetKind, path: &Path, scenes: &[&str]) -> Vec<Scene> {
    let Opened { scenes, skipped } = try_open(kind, path, scenes).unwrap();
    assert!(skipped.is_empty(), "{skipped:?}");
    scenes
}

/// What is said of a data set that cannot be opened.
fn refused(kind: DatasetKind, path: &Path, scenes: &[&str]) -> String {
    try_open(kind, path, scenes).unwrap_err().to_string()
}

fn try_open(kind: DatasetKind, path: &Path, scenes: &[&str]) -> Result<Opened, DatasetError> {
    let scenes: Vec<String> = scenes.iter().map(ToString::to_string).collect();
    open(kind, path, &scenes)
}

/// The truth of the only frame of a scene.
fn truth_of(scene: &Scene) -> Truth {
    first(scene).unwrap().truth.unwrap()
}

/// The first frame of a scene.
fn first(scene: &Scene) -> Result<Observation, DatasetError> {
    DatasetSource::new(vec![scene.clone()]).next_observation().map(Option::unwrap)
}

/// Folder of real data, `None` (said aloud) when it is not there.
fn data(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("SALIENT_STEREO_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let folder = folder.join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("{} is not there: nothing to check", folder.display());
    None
}

fn all(scenes: Vec<Scene>) -> Vec<(String, Observation)> {
    let mut source = DatasetSource::new(scenes);
    let mut frames = Vec::new();
    while let Some(observation) = source.next_observation().unwrap() {
        frames.push((source.scene().to_owned(), observation));
    }
    assert_eq!(source.progress(), Some(1.0));
    frames
}

#[test]
fn a_pair_of_files_is_a_data_set() {
    let folder = tempfile::tempdir().unwrap();
    let [left, right] = ["left.png", "right.ppm"].map(|name| folder.path().join(name));
    save(&left, &RgbImage::from_pixel(10, 6, Rgb([1, 2, 3])));
    save(&right, &RgbImage::from_pixel(10, 6, Rgb([4, 5, 6])));
    let files = PairFiles { left: left.clone(), right: right.clone(), ..PairFiles::default() };
    let frame = files.clone().open().unwrap().next_observation().unwrap().unwrap().frame;
    assert_eq!((frame.rig.focal_px(), frame.rig.baseline_m), (10.0, 0.1));
    let calibrated = PairFiles {
        focal_px: Some(994.978),
        baseline_m: Some(0.193_001),
        right_offset_px: Some(31.086),
        ..files.clone()
    };
    let frame = calibrated.open().unwrap().next_observation().unwrap().unwrap().frame;
    assert!((frame.rig.disparity_offset() + 31.086).abs() < 1e-9);

    save(&right, &RgbImage::from_pixel(9, 6, Rgb([4, 5, 6])));
    let text = files.clone().open().unwrap().next_observation().err().unwrap().to_string();
    assert!(text.contains("right.ppm is 9x6, but the left image is 10x6"), "{text}");
    write(&right, b"no image");
    let text = files.clone().open().unwrap().next_observation().err().unwrap().to_string();
    assert!(text.contains("right.ppm"), "{text}");
    fs::remove_file(&right).unwrap();
    let text = files.open().err().unwrap().to_string();
    assert!(text.contains("right.ppm is missing"), "{text}");
}

#[test]
fn an_exported_scene_comes_back_as_it_was() {
    let root = tempfile::tempdir().unwrap();
    kitti::kitti2012(root.path());
    let scenes = opened(DatasetKind::Kitti2012, root.path(), &["3"]);
    let path = root.path().join("scene.mcap");
    let exported = export_bag(&mut DatasetSource::new(scenes.clone()), &path, |_| true).unwrap();
    assert_eq!(exported, Exported { pairs: 3, disparities: 1, objects: 0 });
    let (observed, tally) = read_bag(&path, &Config::default());
    assert!(!tally.has_losses(), "{tally:?}");
    let expected = all(scenes);
    assert_eq!(observed.len(), expected.len());
    for (bag, (_, files)) in observed.iter().zip(&expected) {
        assert_eq!(bag.frame.stamp, files.frame.stamp);
        assert_eq!(bag.frame.frame_id, files.frame.frame_id);
        assert_eq!((&bag.frame.left, &bag.frame.right), (&files.frame.left, &files.frame.right));
        assert_eq!(bag.frame.rig, files.frame.rig);
        let maps = [&bag.truth, &files.truth]
            .map(|truth| truth.as_ref().and_then(|truth| truth.disparity.as_ref()));
        match maps {
            [None, None] => {}
            [Some(bag), Some(files)] => {
                let same = |(a, b): (&f32, &f32)| a == b || (a.is_nan() && b.is_nan());
                assert!(bag.pixels().iter().zip(files.pixels()).all(same));
            }
            _ => panic!("truth got lost"),
        }
    }
}
