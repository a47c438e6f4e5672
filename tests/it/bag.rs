//! Bags, written and read: every form a bag may have, and what is said about
//! those that are broken.

mod broken;
mod choice;
mod demo;
pub mod recipe;
mod sink;

use std::fs;

use recipe::{Recipe, observe, pairs, stamps};
use salient_stereo::config::{CameraInfoPolicy, Config, Input};
use salient_stereo::image::Picture;
use salient_stereo::input::FrameSource;
use salient_stereo::input::bag::{BagError, BagOptions, BagSource};
use salient_stereo::output::bag::Packing;

const PACKINGS: [Packing; 4] = [Packing::Zstd, Packing::Lz4, Packing::Plain, Packing::Unchunked];

#[test]
fn the_same_messages_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for packing in PACKINGS {
        let bytes = ["a.mcap", "b.mcap"].map(|name| {
            let path = folder.path().join(name);
            Recipe { packing, ..Recipe::default() }.write(&path);
            fs::read(path).unwrap()
        });
        assert!(bytes[0] == bytes[1], "{packing:?}");
    }
}

#[test]
fn every_packing_gives_back_the_pictures() {
    let folder = tempfile::tempdir().unwrap();
    for packing in PACKINGS {
        for compressed in [false, true] {
            let recipe = Recipe { packing, compressed, ..Recipe::default() };
            let path = folder.path().join("bag.mcap");
            recipe.write(&path);
            let mut source =
                BagSource::open(&path, &Config::default(), BagOptions::default()).unwrap();
            assert!(source.notes().is_empty(), "{:?}", source.notes());
            for i in 0..recipe.frames {
                let frame = source.next_observation().unwrap().unwrap().frame;
                assert_eq!(frame.stamp, recipe.stamp(i));
                assert_eq!(&*frame.frame_id, "left_optical");
                assert_eq!(frame.left, Picture::Rgb(recipe.picture(i, false)));
                assert_eq!(frame.right, Picture::Rgb(recipe.picture(i, true)));
                assert!((frame.rig.baseline_m - 0.5).abs() < 1e-12);
            }
            assert!(source.next_observation().unwrap().is_none());
            assert!(source.next_observation().unwrap().is_none(), "the end stays the end");
            assert!(!source.tally().has_losses(), "{:?}", source.tally());
            assert_eq!(source.tally().pairs, recipe.frames as u64);
            assert_eq!(source.progress(), Some(1.0));
        }
    }
}

#[test]
fn a_folder_is_read_by_its_metadata_and_without() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ride");
    let recipe = Recipe::default();
    recipe.write(&path);
    assert_eq!(pairs(&path), recipe.frames);
    fs::remove_file(path.join("metadata.yaml")).unwrap();
    let source = BagSource::open(&path, &Config::default(), BagOptions::default()).unwrap();
    assert!(source.notes()[0].contains("no metadata.yaml"), "{:?}", source.notes());
    assert_eq!(pairs(&path), recipe.frames);
}

/// Twelve files of one frame each, so that `_10` follows `_9`.
fn split(folder: &std::path::Path) -> Vec<String> {
    let recipe = Recipe { frames: 1, ..Recipe::default() };
    (0..12)
        .map(|i| {
            let name = format!("ride_{i}.mcap");
            Recipe { first: i, ..recipe.clone() }.write(&folder.join(&name));
            name
        })
        .collect()
}

fn metadata(files: &[String]) -> String {
    let files: Vec<_> = files.iter().map(|file| format!("    - {file}\n")).collect();
    let files = files.concat();
    format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  relative_file_paths:\n{files}  compression_format: \"\"\n  compression_mode: \"\"\n"
    )
}

#[test]
fn a_split_bag_is_one_bag() {
    let folder = tempfile::tempdir().unwrap();
    let mut files = split(folder.path());
    let expected: Vec<_> = (0..12).map(|i| Recipe::default().stamp(i)).collect();
    assert_eq!(stamps(folder.path()), expected);
    // The order of the list does not matter: log times decide.
    files.reverse();
    fs::write(folder.path().join("metadata.yaml"), metadata(&files)).unwrap();
    assert_eq!(stamps(folder.path()), expected);
    // Only what is listed belongs to the bag.
    fs::write(folder.path().join("metadata.yaml"), metadata(&files[..4])).unwrap();
    assert_eq!(stamps(folder.path()), expected[8..]);
}

#[test]
fn files_and_chunks_that_overlap_come_out_in_order() {
    let folder = tempfile::tempdir().unwrap();
    // One recorder for each camera, and one chunk around all of it.
    let left = Recipe { right: false, packing: Packing::Plain, flush: false, ..Recipe::default() };
    let right = Recipe { left: false, ..Recipe::default() };
    left.write(&folder.path().join("ride_0.mcap"));
    right.write(&folder.path().join("ride_1.mcap"));
    let (observed, tally) = observe(folder.path(), &Config::default());
    assert_eq!(observed.len(), left.frames);
    assert!(!tally.has_losses(), "{tally:?}");
}

#[test]
fn messages_written_out_of_order_are_read_in_order() {
    let folder = tempfile::tempdir().unwrap();
    for packing in PACKINGS {
        let path = folder.path().join("bag.mcap");
        let recipe = Recipe { packing, backwards: true, ..Recipe::default() };
        recipe.write(&path);
        let (observed, tally) = observe(&path, &Config::default());
        // Without chunks, order is kept inside of runs only: here, one run.
        assert_eq!(observed.len(), recipe.frames, "{packing:?} {tally:?}");
        assert!(observed.windows(2).all(|two| two[0].frame.stamp < two[1].frame.stamp));
    }
}

#[test]
fn truth_comes_with_its_frame() {
    let folder = tempfile::tempdir().unwrap();
    for wide in [false, true] {
        let path = folder.path().join("bag.mcap");
        let recipe = Recipe { truth: Some(wide), ..Recipe::default() };
        recipe.write(&path);
        let (observed, tally) = observe(&path, &Config::default());
        assert!(!tally.has_losses(), "{tally:?}");
        assert_eq!(observed.len(), recipe.frames);
        for (i, observation) in observed.iter().enumerate() {
            let truth = observation.truth.as_ref().unwrap();
            let disparity = truth.disparity.as_ref().unwrap();
            assert!(disparity.get(0, 0).is_nan());
            assert_eq!(disparity.get(1, 0), 1.0 + i as f32 / 256.0);
            assert_eq!(truth.objects.as_ref().unwrap().get(2, 1), if wide { 300 } else { 3 });
        }
    }
}

#[test]
fn side_by_side_images_are_split() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let recipe = Recipe { side_by_side: true, ..Recipe::default() };
    recipe.write(&path);
    let config = Config { input: Input::SideBySide, ..Config::default() };
    let (observed, _) = observe(&path, &config);
    assert_eq!(observed.len(), recipe.frames);
    assert_eq!(observed[1].frame.left, Picture::Rgb(recipe.picture(1, false)));
    assert_eq!(observed[1].frame.right, Picture::Rgb(recipe.picture(1, true)));
}

#[test]
fn synced_camera_infos_are_found_for_every_pair() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let recipe = Recipe::default();
    recipe.write(&path);
    let mut config = Config::default();
    config.camera_info.policy = CameraInfoPolicy::Synced;
    let (observed, tally) = observe(&path, &config);
    assert_eq!(observed.len(), recipe.frames, "{tally:?}");
}

#[test]
fn stamps_apart_are_paired_by_auto_and_explained_by_exact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let recipe = Recipe { right_later_ns: 3_000_000, ..Recipe::default() };
    recipe.write(&path);
    let (observed, _) = observe(&path, &Config::default());
    assert_eq!(observed.len(), recipe.frames);
    let frame = &observed[0].frame;
    assert_eq!(frame.right_stamp.0 - frame.stamp.0, 3_000_000);

    let mut config = Config::default();
    config.sync.mode = salient_stereo::config::SyncMode::Exact;
    let mut source = BagSource::open(&path, &config, BagOptions::default()).unwrap();
    assert!(source.next_observation().unwrap().is_none());
    assert_eq!(source.tally().unpaired_left, recipe.frames as u64);
    assert!(source.tally().has_losses());
    let text = source.explain().unwrap();
    assert!(text.contains("3.000 ms") && text.contains("sync.mode"), "{text}");
}

#[test]
fn a_bag_that_was_never_finished_gives_all_it_was_given() {
    let folder = tempfile::tempdir().unwrap();
    for packing in PACKINGS {
        let (path, copy) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
        let recipe = Recipe { packing, ..Recipe::default() };
        let mut writer = recipe.write_unfinished(&path);
        // What a killed process leaves behind.
        fs::copy(&path, &copy).unwrap();
        let source = BagSource::open(&copy, &Config::default(), BagOptions::default()).unwrap();
        let note = &source.notes()[0];
        let messages = 4 * recipe.frames;
        assert!(note.contains(&format!("{messages} messages found by a scan")), "{note}");
        let (observed, tally) = observe(&copy, &Config::default());
        assert_eq!(observed.len(), recipe.frames);
        assert!(!tally.has_losses(), "{tally:?}");
        writer.finish().unwrap();
    }
}

#[test]
fn a_bag_knows_which_files_it_reads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ride");
    Recipe::default().write(&path);
    let source = BagSource::open(&path, &Config::default(), BagOptions::default()).unwrap();
    assert!(source.reads(&path));
    assert!(source.reads(&path.join("../ride/ride_0.mcap")));
    assert!(!source.reads(&folder.path().join("other.mcap")));
}

#[test]
fn a_bag_with_no_message_is_empty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    Recipe { frames: 0, ..Recipe::default() }.write(&path);
    let error = BagSource::open(&path, &Config::default(), BagOptions::default()).err().unwrap();
    assert!(matches!(error, BagError::Empty { .. }), "{error}");
}
