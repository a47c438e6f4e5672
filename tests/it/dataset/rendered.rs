//! Sintel and Spring, and their formats.

use std::fs;
use std::path::{Path, PathBuf};

use image::{GrayImage, Luma, Rgb, RgbImage};
use salient_stereo::image::Size;
use salient_stereo::input::dataset::DatasetKind::{Sintel, Spring};

use super::{all, data, first, opened, refused, save, truth_of, write};

fn flo(width: u32, height: u32, pixels: &[[f32; 2]]) -> Vec<u8> {
    let mut bytes = 202_021.25_f32.to_le_bytes().to_vec();
    bytes.extend(width.to_le_bytes());
    bytes.extend(height.to_le_bytes());
    bytes.extend(pixels.iter().flatten().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// A stereo scene of two frames and a monocular pass.
fn sintel(root: &Path) -> PathBuf {
    let training = root.join("training");
    for folder in ["clean_left", "clean_right", "final"] {
        for frame in 1..=2 {
            let path = training.join(format!("{folder}/alley_1/frame_{frame:04}.png"));
            save(&path, &RgbImage::from_pixel(3, 2, Rgb([frame, 0, 0])));
        }
    }
    let image = |folder: &str| training.join(format!("{folder}/alley_1/frame_0001.png"));
    save(&image("disparities"), &RgbImage::from_pixel(3, 2, Rgb([5, 96, 0])));
    let marked = |x: u32| GrayImage::from_fn(3, 2, move |at, _| Luma([u8::from(at == x)]));
    save(&image("occlusions"), &marked(0));
    save(&image("outofframe"), &marked(1));
    save(&image("invalid"), &marked(2));
    let mut pixels = vec![[1.5, -2.0]; 6];
    pixels[1] = [2e9, 0.0];
    write(&training.join("flow/alley_1/frame_0001.flo"), &flo(3, 2, &pixels));
    training
}

#[test]
fn sintel_has_stereo_and_monocular_passes() {
    let root = tempfile::tempdir().unwrap();
    let training = sintel(root.path());
    let scenes = opened(Sintel, root.path(), &[]);
    let names: Vec<_> = scenes.iter().map(|scene| (scene.name.as_str(), scene.monocular)).collect();
    assert_eq!(names, [("clean/alley_1", false), ("final/alley_1", true)]);
    assert_eq!(opened(Sintel, &training, &["clean"])[0].name, "clean/alley_1");
    assert_eq!(opened(Sintel, root.path(), &["alley_1"]).len(), 2);
    let truth = truth_of(&scenes[0]);
    let [visible, every] = [truth.disparity, truth.disparity_with_occluded].map(Option::unwrap);
    assert_eq!((visible.get(2, 0), every.get(0, 0)), (21.5, 21.5));
    assert!(visible.get(0, 0).is_nan() && visible.get(1, 0).is_nan() && every.get(1, 0).is_nan());
    let flow = truth.flow.unwrap();
    assert_eq!(flow.get(0, 0), [1.5, -2.0]);
    assert!(flow.get(1, 0)[0].is_nan() && flow.get(2, 0)[1].is_nan());
    // The monocular pass has motion and no disparity; right is left.
    let truth = truth_of(&scenes[1]);
    assert!(truth.disparity.is_none() && truth.flow.is_some());
    let frames = all(scenes);
    assert_eq!(frames.len(), 4);
    assert_eq!(frames[3].1.frame.left, frames[3].1.frame.right);
    let between = frames[1].1.frame.stamp.0 - frames[0].1.frame.stamp.0;
    assert!((between - 41_666_667).abs() <= 1);

    // The depth archive has the focal length of every frame.
    let mut camera = b"PIEH".to_vec();
    for value in [1120.0_f64, 0.0, 511.5, 0.0, 1120.0, 217.5, 0.0, 0.0, 1.0] {
        camera.extend(value.to_le_bytes());
    }
    let path = training.join("camdata_left/alley_1/frame_0001.cam");
    write(&path, &camera);
    let rig = first(&opened(Sintel, root.path(), &["clean"])[0]).unwrap().frame.rig;
    assert_eq!((rig.focal_px(), rig.principal_point()), (1120.0, (511.5, 217.5)));
    assert!((rig.baseline_m - 0.1).abs() < 1e-12);
    for (content, wanted) in [(&camera[..60], "cut off"), (b"PI", "does not start")] {
        write(&path, content);
        let text = refused(Sintel, root.path(), &["clean"]);
        assert!(text.contains("frame_0001.cam") && text.contains(wanted), "{text}");
    }
}

#[test]
fn what_is_wrong_with_sintel_is_named() {
    let root = tempfile::tempdir().unwrap();
    let text = refused(Sintel, root.path(), &[]);
    assert!(text.contains("training/clean_left"), "{text}");
    let training = sintel(root.path());
    let motion = training.join("flow/alley_1/frame_0001.flo");
    for (content, wanted) in [
        (b"PIEH".to_vec(), "4 bytes are less than the header"),
        (b"PIEXabcdefgh0000".to_vec(), "a .flo file with 202021.25"),
        (flo(3, 2, &[[0.0; 2]; 5]), "3x2 pixels take 48 bytes, but 40 are there"),
        (flo(31623, 31623, &[]), "31623x31623"),
        (flo(0, 2, &[]), "0x2"),
        (flo(2, 3, &[[0.0; 2]; 6]), "is 2x3, but the left image is 3x2"),
    ] {
        write(&motion, &content);
        let text = first(&opened(Sintel, root.path(), &["clean"])[0]).unwrap_err().to_string();
        assert!(text.contains("frame_0001.flo") && text.contains(wanted), "{text}");
    }
    fs::remove_file(&motion).unwrap();
    save(&training.join("disparities/alley_1/frame_0001.png"), &GrayImage::new(3, 2));
    let text = first(&opened(Sintel, root.path(), &["clean"])[0]).unwrap_err().to_string();
    assert!(text.contains("disparities") && text.contains("8-bit RGB"), "{text}");
    fs::remove_file(training.join("clean_right/alley_1/frame_0002.png")).unwrap();
    let text = refused(Sintel, root.path(), &["clean"]);
    assert!(text.contains("clean_right/alley_1/frame_0002.png is missing"), "{text}");
}

#[test]
fn real_motion_is_read() {
    let Some(folder) = data("sintel") else { return };
    let root = tempfile::tempdir().unwrap();
    let training = root.path().join("training");
    let copy = |from: &str, to: &str| {
        fs::create_dir_all(training.join(to).parent().unwrap()).unwrap();
        fs::copy(folder.join(from), training.join(to)).unwrap();
    };
    copy("mmflow_demo/frame_0001.png", "clean/scene/frame_0001.png");
    copy("flowiz_flo/frame_0001.flo", "flow/scene/frame_0001.flo");
    let flow = truth_of(&opened(Sintel, root.path(), &[])[0]).flow.unwrap();
    assert_eq!(flow.size(), Size::new(1024, 436));
    assert!(flow.pixels().iter().all(|v| v[0].abs() < 1024.0 && v[1].abs() < 1024.0));
    assert!(flow.pixels().iter().any(|v| v[0].abs() > 1.0));
}

fn sample(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/samples").join(name)).unwrap()
}

/// One scene with one frame of 6 x 4.
fn spring(root: &Path) -> PathBuf {
    let scene = root.join("train/0001");
    for side in ["left", "right"] {
        save(&scene.join(format!("frame_{side}/frame_{side}_0001.png")), &RgbImage::new(6, 4));
    }
    write(&scene.join("disp1_left/disp1_left_0001.dsp5"), &sample("disparity.dsp5"));
    write(&scene.join("flow_FW_left/flow_FW_left_0001.flo5"), &sample("flow.flo5"));
    write(&scene.join("cam_data/intrinsics.txt"), b"2000 2000 2.5 1.5\n");
    scene
}

#[test]
fn spring_has_maps_of_twice_the_size() {
    let root = tempfile::tempdir().unwrap();
    let scene = spring(root.path());
    let scenes = opened(Spring, root.path(), &["1"]);
    let rig = first(&scenes[0]).unwrap().frame.rig;
    assert_eq!((rig.focal_px(), rig.principal_point()), (2000.0, (2.5, 1.5)));
    assert!((rig.baseline_m - 0.065).abs() < 1e-12);
    let truth = truth_of(&scenes[0]);
    let disparity = truth.disparity.unwrap();
    // Pixel (3, 2) is sample (6, 4).
    assert!((disparity.get(3, 2) - 3.04).abs() < 1e-6 && disparity.get(0, 0).is_nan());
    assert!(truth.disparity_with_occluded.is_none());
    let flow = truth.flow.unwrap();
    assert_eq!(flow.get(3, 2), [3.0, -1.0]);
    assert!(flow.get(0, 0)[0].is_nan());

    let unmatched = RgbImage::from_fn(6, 4, |x, _| {
        Rgb([[255, 0, 0], [0, 255, 0], [0, 0, 255]][(x % 3) as usize])
    });
    save(&scene.join("maps/matchmap_disp1_left/matchmap_disp1_left_0001.png"), &unmatched);
    let truth = truth_of(&opened(Spring, &root.path().join("train"), &[])[0]);
    let [visible, every] = [truth.disparity, truth.disparity_with_occluded].map(Option::unwrap);
    assert!(visible.get(3, 2).is_nan() && visible.get(4, 2).is_nan());
    assert!(visible.get(5, 2) == every.get(5, 2) && !every.get(3, 2).is_nan());

    // Without the archive of right images it is a film for motion.
    fs::remove_dir_all(scene.join("frame_right")).unwrap();
    let scenes = opened(Spring, root.path(), &[]);
    assert!(scenes[0].monocular);
    let truth = truth_of(&scenes[0]);
    assert!(truth.disparity.is_none() && truth.flow.is_some());
}

#[test]
fn what_is_wrong_with_spring_is_named() {
    let root = tempfile::tempdir().unwrap();
    let text = refused(Spring, root.path(), &[]);
    assert!(text.contains("frame_left"), "{text}");
    let scene = spring(root.path());
    let map = scene.join("disp1_left/disp1_left_0001.dsp5");
    for (content, wanted) in [
        (b"no HDF5".to_vec(), "disp1_left_0001.dsp5"),
        (sample("flow.flo5"), "disparity"),
        (sample("disparity.dsp5")[..3000].to_vec(), "disp1_left_0001.dsp5"),
    ] {
        write(&map, &content);
        let text = first(&opened(Spring, root.path(), &[])[0]).unwrap_err().to_string();
        assert!(text.contains("disp1_left_0001.dsp5") && text.contains(wanted), "{text}");
    }
    write(&map, &sample("disparity.dsp5"));
    for side in ["left", "right"] {
        save(&scene.join(format!("frame_{side}/frame_{side}_0001.png")), &RgbImage::new(5, 4));
    }
    let text = first(&opened(Spring, root.path(), &[])[0]).unwrap_err().to_string();
    assert!(text.contains("is 6x4, but the left image is 5x4"), "{text}");
    for (content, wanted) in [("1 2 3\n", "no four numbers for frame 1"), ("x\n", "invalid float")]
    {
        write(&scene.join("cam_data/intrinsics.txt"), content.as_bytes());
        let text = refused(Spring, root.path(), &[]);
        assert!(text.contains("intrinsics.txt") && text.contains(wanted), "{text}");
    }
}

/// Every cut and many changed bytes: an error or a map, never a panic.
#[test]
fn broken_arrays_do_no_harm() {
    let root = tempfile::tempdir().unwrap();
    let scene = spring(root.path());
    let path = scene.join("disp1_left/disp1_left_0001.dsp5");
    let whole = sample("disparity.dsp5");
    let scenes = opened(Spring, root.path(), &[]);
    let mut refused = 0;
    for cut in (0..whole.len()).step_by(13) {
        write(&path, &whole[..cut]);
        refused += usize::from(first(&scenes[0]).is_err());
    }
    for at in (0..whole.len()).step_by(3) {
        let mut broken = whole.clone();
        broken[at] ^= 0x81;
        write(&path, &broken);
        refused += usize::from(first(&scenes[0]).is_err());
    }
    assert!(refused > 200, "{refused}");
}
