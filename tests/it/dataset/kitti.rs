//! KITTI 2012 and 2015.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, ImageBuffer, Luma, Rgb, RgbImage};
use salient_stereo::image::{Image, Picture, Size};
use salient_stereo::input::FrameSource;
use salient_stereo::input::dataset::{
    DatasetError, DatasetKind, DatasetSource, open, open_kitti2012_in_color,
};

use super::{all, data, first, opened, refused, save, truth_of, write};

const P0: &str = "P0: 7.0e+02 0.0 6.0 0.0 0.0 7.0e+02 3.0 0.0 0.0 0.0 1.0 0.0\n";
const P1: &str = "P1: 7.0e+02 0.0 8.0 -3.5e+02 0.0 7.0e+02 3.0 0.0 0.0 0.0 1.0 0.0\n";

/// Two scenes of KITTI 2012: one with three frames, one with one.
pub fn kitti2012(root: &Path) -> PathBuf {
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

#[test]
fn kitti_2012_gives_its_scenes_with_calibration_and_truth() {
    let root = tempfile::tempdir().unwrap();
    let training = kitti2012(root.path());
    for path in [root.path(), &training] {
        let frames = all(opened(DatasetKind::Kitti2012, path, &[]));
        let names: Vec<_> = frames.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["000003", "000003", "000003", "000027"]);
        let (_, with_truth) = &frames[1];
        let Picture::Gray(left) = &with_truth.frame.left else { panic!("gray") };
        assert_eq!((left.size(), left.get(0, 0)), (Size::new(16, 8), 20));
        let rig = &with_truth.frame.rig;
        assert!((rig.baseline_m - 0.5).abs() < 1e-12);
        assert_eq!((rig.focal_px(), rig.principal_point()), (700.0, (6.0, 3.0)));
        // Truth is x_l - x_r - (cx_l - cx_r), and the file has x_l - x_r.
        assert!((rig.disparity_offset() + 2.0).abs() < 1e-12);
        let truth = with_truth.truth.as_ref().unwrap();
        let visible = truth.disparity.as_ref().unwrap();
        assert!(visible.get(1, 0).is_nan());
        assert_eq!(visible.get(2, 0), 2.0 + 2.0);
        assert_eq!(truth.disparity_with_occluded.as_ref().unwrap().get(2, 0), 3.0 + 2.0);
        assert!(truth.flow.is_none() && truth.objects.is_none());
        assert!(frames[0].1.truth.is_none());
        let stamps: Vec<i64> = frames.iter().map(|(_, o)| o.frame.stamp.0).collect();
        assert_eq!(stamps[1] - stamps[0], 100_000_000);
        assert!(stamps.windows(2).all(|two| two[0] < two[1]));
    }
}

#[test]
fn scenes_are_chosen_by_name() {
    let root = tempfile::tempdir().unwrap();
    kitti2012(root.path());
    for name in ["000027", "27"] {
        let scenes = opened(DatasetKind::Kitti2012, root.path(), &[name]);
        let names: Vec<_> = scenes.iter().map(|scene| scene.name.as_str()).collect();
        assert_eq!(names, ["000027"]);
    }
    // Named twice is read once.
    let scenes = opened(DatasetKind::Kitti2012, root.path(), &["27", "3", "000027"]);
    let names: Vec<_> = scenes.iter().map(|scene| scene.name.as_str()).collect();
    assert_eq!(names, ["000027", "000003"]);
    let text = refused(DatasetKind::Kitti2012, root.path(), &["000099"]);
    assert!(text.contains("'000099'") && text.contains("000003, 000027"), "{text}");
}

#[test]
fn kitti_2015_gives_colour_motion_objects_and_the_rectified_matrices() {
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
    let flow = ImageBuffer::<Rgb<u16>, _>::from_fn(16, 8, |x, _| {
        Rgb([32768 + 64 * 3, 32768 - 32, u16::from(x > 0)])
    });
    save(&training.join("flow_occ/000000_10.png"), &flow);
    save(&training.join("flow_noc/000000_10.png"), &truth);
    save(&training.join("obj_map/000000_10.png"), &GrayImage::from_pixel(16, 8, Luma([7])));
    let calibration = "calib_time: 09-Jan-2012 13:57:47\nP_rect_02: 700 0 6 45.0 0 700 3 0.2 0 0 1 0.003\nP_rect_03: 700 0 6 -305.0 0 700 3 2.2 0 0 1 0.003\n";
    write(&training.join("calib_cam_to_cam/000000.txt"), calibration.as_bytes());
    let scenes = opened(DatasetKind::Kitti2015, root.path(), &[]);
    let mut source = DatasetSource::new(scenes.clone());
    assert_eq!(source.current_file(), None);
    let frame = source.next_observation().unwrap().unwrap().frame;
    assert_eq!(source.current_file(), Some(training.join("image_2/000000_10.png").as_path()));
    let Picture::Rgb(left) = &frame.left else { panic!("colour") };
    assert_eq!(left.get(3, 2), [3, 2, 10]);
    assert!((frame.rig.baseline_m - 0.5).abs() < 1e-12);
    let truth = truth_of(&scenes[0]);
    // Only disp_occ_0 is there: better than no truth.
    assert_eq!(truth.disparity.unwrap().get(0, 0), 10.0);
    assert_eq!(truth.disparity_with_occluded.unwrap().get(0, 0), 10.0);
    let flow = truth.flow.unwrap();
    assert_eq!(flow.get(1, 0), [3.0, -0.5]);
    assert!(flow.get(0, 0)[0].is_nan());
    assert_eq!(truth.objects.unwrap().get(5, 5), 7);
    assert_eq!(all(scenes).len(), 2);

    // Motion that is none is named.
    save(&training.join("flow_occ/000000_10.png"), &RgbImage::new(16, 8));
    let text = first(&opened(DatasetKind::Kitti2015, root.path(), &[])[0]).unwrap_err().to_string();
    assert!(text.contains("flow_occ") && text.contains("16-bit RGB"), "{text}");
}

#[test]
fn colour_images_of_2012_come_from_their_own_folders() {
    let root = tempfile::tempdir().unwrap();
    let training = kitti2012(root.path());
    let error = open_kitti2012_in_color(root.path(), &[]).unwrap_err().to_string();
    assert!(error.contains("colored_0"), "{error}");
    for folder in ["colored_0", "colored_1"] {
        save(&training.join(format!("{folder}/000003_10.png")), &RgbImage::new(16, 8));
    }
    let matrices = format!("{P0}{P1}{}{}", P0.replace("P0", "P2"), P1.replace("P1", "P3"));
    write(&training.join("calib/000003.txt"), matrices.as_bytes());
    let scenes = open_kitti2012_in_color(root.path(), &[]).unwrap().scenes;
    assert_eq!(scenes.len(), 1);
    assert!(matches!(first(&scenes[0]).unwrap().frame.left, Picture::Rgb(_)));
}

#[test]
fn a_scene_that_lacks_files_is_left_out_or_named() {
    for (file, wanted) in [
        ("image_1/000003_10.png", "the right image of the frame"),
        ("calib/000003.txt", "the calibration of the scene"),
    ] {
        let root = tempfile::tempdir().unwrap();
        let training = kitti2012(root.path());
        fs::remove_file(training.join(file)).unwrap();
        let says = |text: &str| assert!(text.contains(file) && text.contains(wanted), "{text}");
        // Among others it is left out, asked for by name it is an error, and so
        // it is when nothing else is there.
        let opened = open(DatasetKind::Kitti2012, root.path(), &[]).unwrap();
        assert_eq!(opened.scenes.len(), 1);
        let [(name, error)] = &opened.skipped[..] else { panic!("one") };
        assert!(name == "000003" && matches!(error, DatasetError::Missing { .. }));
        says(&error.to_string());
        says(&refused(DatasetKind::Kitti2012, root.path(), &["3"]));
        fs::remove_file(training.join("image_0/000027_10.png")).unwrap();
        says(&refused(DatasetKind::Kitti2012, root.path(), &[]));
    }
    let root = tempfile::tempdir().unwrap();
    for (kind, folder) in [(DatasetKind::Kitti2012, "image_0"), (DatasetKind::Kitti2015, "image_2")]
    {
        let text = refused(kind, root.path(), &[]);
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
        let text = refused(DatasetKind::Kitti2012, root.path(), &["3"]);
        assert!(text.contains(wanted) && text.contains("000003.txt"), "{text}");
    }
    // Swapped cameras.
    let root = tempfile::tempdir().unwrap();
    let training = kitti2012(root.path());
    let swapped = format!("{P0}{}", P1.replace("-3.5", "3.5"));
    write(&training.join("calib/000003.txt"), swapped.as_bytes());
    let scenes = opened(DatasetKind::Kitti2012, root.path(), &[]);
    let text = first(&scenes[0]).unwrap_err().to_string();
    assert!(text.contains("swapped"), "{text}");
}

#[test]
fn a_broken_image_is_an_error_and_the_next_frame_still_comes() {
    let root = tempfile::tempdir().unwrap();
    let training = kitti2012(root.path());
    write(&training.join("image_0/000003_10.png"), b"\x89PNG\r\n\x1a\n and no more");
    let mut source = DatasetSource::new(opened(DatasetKind::Kitti2012, root.path(), &["3"]));
    assert!(source.next_observation().is_ok());
    let text = source.next_observation().unwrap_err().to_string();
    assert!(text.contains("000003_10.png"), "{text}");
    assert!(source.current_file().unwrap().ends_with("image_0/000003_10.png"));
    assert!(source.next_observation().unwrap().is_some());
    assert!(source.next_observation().unwrap().is_none());
}

#[test]
fn real_scenes_are_whole() {
    let Some(kitti) = data("kitti2012") else { return };
    let scenes = opened(DatasetKind::Kitti2012, &kitti, &[]);
    let counts: Vec<_> =
        scenes.iter().map(|scene| (scene.name.clone(), scene.frames.len())).collect();
    let expected = [("000027", 5), ("000074", 4), ("000138", 2)];
    assert_eq!(counts, expected.map(|(name, n)| (name.to_owned(), n)));
    let frames = all(scenes);
    assert_eq!(frames.len(), 11);
    assert!(frames.iter().all(|(_, o)| (o.frame.rig.baseline_m - 0.537).abs() < 0.01));
    let truths: Vec<_> = frames.into_iter().filter_map(|(_, o)| o.truth).collect();
    assert_eq!(truths.len(), 3);
    for truth in truths {
        let known =
            |map: Option<Image<f32>>| map.unwrap().pixels().iter().filter(|d| !d.is_nan()).count();
        let visible = known(truth.disparity);
        let both = known(truth.disparity_with_occluded);
        assert!(60_000 < visible && visible < both && both < 200_000, "{visible} {both}");
        let flow = truth.flow.unwrap();
        let moved: Vec<_> = flow.pixels().iter().filter(|v| !v[0].is_nan()).collect();
        assert!(moved.len() > 60_000);
        assert!(moved.iter().all(|v| v[0].abs() < 512.0 && v[1].abs() < 512.0));
    }
}
