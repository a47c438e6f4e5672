//! Data sets in their published layouts, and their export as bags.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, ImageBuffer, Luma, Rgb, RgbImage};
use salient_stereo::config::Config;
use salient_stereo::image::{Picture, Size};
use salient_stereo::input::dataset::{
    DatasetError, DatasetSource, Kitti, KittiTruth, KittiYear, PairFiles,
};
use salient_stereo::input::{FrameSource, Observation};
use salient_stereo::output::bag::{Exported, export_bag};

use super::bag::recipe::observe as read_bag;

const P0: &str = "P0: 7.0e+02 0.0 6.0 0.0 0.0 7.0e+02 3.0 0.0 0.0 0.0 1.0 0.0\n";
const P1: &str = "P1: 7.0e+02 0.0 8.0 -3.5e+02 0.0 7.0e+02 3.0 0.0 0.0 0.0 1.0 0.0\n";

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

/// Two scenes of KITTI 2012: one with three frames, one with one.
fn kitti2012(root: &Path) -> PathBuf {
    let training = root.join("training");
    for (scene, frames) in [("000003", vec![9, 10, 11]), ("000027", vec![10])] {
        write(&training.join(format!("calib/{scene}.txt")), format!("{P0}{P1}").as_bytes());
        for number in frames {
            for (folder, base) in [("image_0", 10), ("image_1", 90)] {
                let picture =
                    GrayImage::from_fn(16, 8, |x, y| Luma([(base + x + y + number) as u8]));
                save(&training.join(format!("{folder}/{scene}_{number:02}.png")), &picture);
            }
        }
        for (folder, value) in [("disp_noc", 512_u16), ("disp_occ", 768)] {
            let truth = ImageBuffer::<Luma<u16>, _>::from_fn(16, 8, |x, _| {
                Luma([if x < 2 { 0 } else { value }])
            });
            save(&training.join(format!("{folder}/{scene}_10.png")), &truth);
        }
    }
    training
}

fn all(source: &mut DatasetSource) -> Vec<(String, Observation)> {
    let mut frames = Vec::new();
    while let Some(observation) = source.next_observation().unwrap() {
        frames.push((source.scene().to_owned(), observation));
    }
    frames
}

#[test]
fn kitti_2012_gives_its_scenes_with_calibration_and_truth() {
    let root = tempfile::tempdir().unwrap();
    let training = kitti2012(root.path());
    for path in [root.path(), &training] {
        let mut source = Kitti::new(path, KittiYear::Y2012).open().unwrap();
        let frames = all(&mut source);
        let names: Vec<_> = frames.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["000003", "000003", "000003", "000027"]);
        assert_eq!(source.progress(), Some(1.0));
        let (_, with_truth) = &frames[1];
        let Picture::Gray(left) = &with_truth.frame.left else { panic!("gray") };
        assert_eq!((left.size(), left.get(0, 0)), (Size::new(16, 8), 20));
        let rig = &with_truth.frame.rig;
        assert!((rig.baseline_m - 0.5).abs() < 1e-12);
        assert_eq!((rig.focal_px(), rig.principal_point()), (700.0, (6.0, 3.0)));
        // Truth is x_l - x_r - (cx_l - cx_r), and the file has x_l - x_r.
        assert!((rig.disparity_offset() + 2.0).abs() < 1e-12);
        let truth = with_truth.truth.as_ref().unwrap().disparity.as_ref().unwrap();
        assert!(truth.get(1, 0).is_nan());
        assert_eq!(truth.get(2, 0), 2.0 + 2.0);
        assert!(frames[0].1.truth.is_none());
        let stamps: Vec<i64> = frames.iter().map(|(_, o)| o.frame.stamp.0).collect();
        assert_eq!(stamps[1] - stamps[0], 100_000_000);
        assert!(stamps.windows(2).all(|two| two[0] < two[1]));
    }
}

#[test]
fn one_scene_and_all_truth_can_be_chosen() {
    let root = tempfile::tempdir().unwrap();
    kitti2012(root.path());
    for scene in ["000027", "27"] {
        let kitti = Kitti {
            scene: Some(scene.into()),
            truth: KittiTruth::All,
            ..Kitti::new(root.path(), KittiYear::Y2012)
        };
        let frames = all(&mut kitti.open().unwrap());
        assert_eq!(frames.len(), 1);
        let truth = frames[0].1.truth.as_ref().unwrap().disparity.as_ref().unwrap();
        assert_eq!(truth.get(5, 5), 3.0 + 2.0);
    }
    let kitti = Kitti { scene: Some("000099".into()), ..Kitti::new(root.path(), KittiYear::Y2012) };
    let text = kitti.open().err().unwrap().to_string();
    assert!(text.contains("'000099'") && text.contains("000003, 000027"), "{text}");
}

#[test]
fn kitti_2015_gives_colour_and_the_rectified_matrices() {
    let root = tempfile::tempdir().unwrap();
    let training = root.path().join("training");
    for folder in ["image_2", "image_3"] {
        for number in [10, 11] {
            let picture = RgbImage::from_fn(16, 8, |x, y| Rgb([x as u8, y as u8, number]));
            save(&training.join(format!("{folder}/000000_{number}.png")), &picture);
        }
    }
    let truth = ImageBuffer::<Luma<u16>, _>::from_pixel(16, 8, Luma([2560_u16]));
    save(&training.join("disp_occ_0/000000_10.png"), &truth);
    let calibration = "calib_time: 09-Jan-2012 13:57:47\nP_rect_02: 700 0 6 45.0 0 700 3 0.2 0 0 1 0.003\nP_rect_03: 700 0 6 -305.0 0 700 3 2.2 0 0 1 0.003\n";
    write(&training.join("calib_cam_to_cam/000000.txt"), calibration.as_bytes());
    let frames = all(&mut Kitti::new(root.path(), KittiYear::Y2015).open().unwrap());
    assert_eq!(frames.len(), 2);
    let frame = &frames[0].1.frame;
    let Picture::Rgb(left) = &frame.left else { panic!("colour") };
    assert_eq!(left.get(3, 2), [3, 2, 10]);
    assert!((frame.rig.baseline_m - 0.5).abs() < 1e-12);
    // Only disp_occ_0 is there: better than no truth.
    let truth = frames[0].1.truth.as_ref().unwrap().disparity.as_ref().unwrap();
    assert_eq!(truth.get(0, 0), 10.0);
}

#[test]
fn a_missing_file_is_named_at_the_door() {
    for (file, wanted) in [
        ("image_1/000003_10.png", "the right image of the frame"),
        ("calib/000003.txt", "the calibration of the scene"),
    ] {
        let root = tempfile::tempdir().unwrap();
        let training = kitti2012(root.path());
        fs::remove_file(training.join(file)).unwrap();
        let error = Kitti::new(root.path(), KittiYear::Y2012).open().err().unwrap();
        assert!(matches!(error, DatasetError::Missing { .. }));
        let text = error.to_string();
        assert!(text.contains(file) && text.contains(wanted), "{text}");
    }
    let root = tempfile::tempdir().unwrap();
    for (year, folder) in [(KittiYear::Y2012, "image_0"), (KittiYear::Y2015, "image_2")] {
        let text = Kitti::new(root.path(), year).open().err().unwrap().to_string();
        assert!(text.contains(folder), "{text}");
    }
}

#[test]
fn a_calibration_that_is_none_is_named() {
    for (text, wanted) in [
        ("P0: 1 2 3\n", "P0 has 3 numbers, not 12"),
        ("P1: 1\n", "no line 'P0:'"),
        ("P0: 7 0 a 0 0 7 3 0 0 0 1 0\n", "P0: invalid float"),
    ] {
        let root = tempfile::tempdir().unwrap();
        let training = kitti2012(root.path());
        write(&training.join("calib/000003.txt"), text.as_bytes());
        let text = Kitti::new(root.path(), KittiYear::Y2012).open().err().unwrap().to_string();
        assert!(text.contains(wanted) && text.contains("000003.txt"), "{text}");
    }
    // Swapped cameras.
    let root = tempfile::tempdir().unwrap();
    let training = kitti2012(root.path());
    let swapped = format!("{P0}{}", P1.replace("-3.5", "3.5"));
    write(&training.join("calib/000003.txt"), swapped.as_bytes());
    let mut source = Kitti::new(root.path(), KittiYear::Y2012).open().unwrap();
    let text = source.next_observation().err().unwrap().to_string();
    assert!(text.contains("swapped"), "{text}");
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
    kitti2012(root.path());
    let kitti = Kitti { scene: Some("000003".into()), ..Kitti::new(root.path(), KittiYear::Y2012) };
    let path = root.path().join("scene.mcap");
    let exported = export_bag(&mut kitti.open().unwrap(), &path, |_| true).unwrap();
    assert_eq!(exported, Exported { pairs: 3, disparities: 1, objects: 0 });
    let (observed, tally) = read_bag(&path, &Config::default());
    assert!(!tally.has_losses(), "{tally:?}");
    let expected = all(&mut kitti.open().unwrap());
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

#[test]
fn real_scenes_are_whole() {
    let folder = std::env::var_os("SALIENT_STEREO_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let kitti = folder.join("kitti2012");
    if !kitti.is_dir() {
        println!("{} is not there: nothing to check", kitti.display());
        return;
    }
    let mut source = Kitti::new(&kitti, KittiYear::Y2012).open().unwrap();
    let counts: Vec<_> =
        source.scenes().iter().map(|scene| (scene.name.clone(), scene.frames.len())).collect();
    let expected = [("000027", 5), ("000074", 4), ("000138", 2)];
    assert_eq!(counts, expected.map(|(name, n)| (name.to_owned(), n)));
    let frames = all(&mut source);
    assert_eq!(frames.len(), 11);
    assert_eq!(frames.iter().filter(|(_, o)| o.truth.is_some()).count(), 3);
    assert!(frames.iter().all(|(_, o)| (o.frame.rig.baseline_m - 0.537).abs() < 0.01));
}
