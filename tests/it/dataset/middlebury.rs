//! Middlebury, and its portable float maps.

use std::fs;
use std::path::Path;

use image::{GrayImage, Luma, RgbImage};
use salient_stereo::input::dataset::DatasetKind::Middlebury;

use super::{all, data, first, open, opened, refused, save, truth_of, write};

const CALIBRATION: &str = "cam0=[999.4 0 3.25; 0 999.4 2.5; 0 0 1]\ncam1=[999.4 0 35.25; 0 999.4 2.5; 0 0 1]\n\
     doffs=32\nbaseline=193.001\nwidth=6\nheight=4\nndisp=70\n";

fn pair(folder: &Path, left: &str, right: &str, width: u32, height: u32) {
    for name in [left, right] {
        save(&folder.join(name), &RgbImage::new(width, height));
    }
}

/// A little-endian PFM of 6 x 4, whose value is `x + 10 y`, infinite at (0, 0).
fn pfm() -> Vec<u8> {
    let mut bytes = b"Pf\n6 4\n-1.0\n".to_vec();
    for y in (0..4).rev() {
        for x in 0..6 {
            let d = if (x, y) == (0, 0) { f32::INFINITY } else { (x + 10 * y) as f32 };
            bytes.extend(d.to_le_bytes());
        }
    }
    bytes
}

/// A scene in the layout of 2014.
fn float_scene(folder: &Path) {
    pair(folder, "im0.png", "im1.png", 6, 4);
    write(&folder.join("calib.txt"), CALIBRATION.as_bytes());
    write(&folder.join("disp0GT.pfm"), &pfm());
}

#[test]
fn scenes_of_2014_have_float_maps_a_mask_and_a_calibration() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("trainingQ/Shelf");
    float_scene(&folder);
    let mask = GrayImage::from_fn(6, 4, |x, _| Luma([[0, 128, 255][x.min(2) as usize]]));
    save(&folder.join("mask0nocc.png"), &mask);
    let scenes = opened(Middlebury, root.path(), &["Shelf"]);
    assert_eq!(scenes[0].name, "trainingQ/Shelf");
    assert!(!scenes[0].monocular && scenes[0].stills);
    let rig = first(&scenes[0]).unwrap().frame.rig;
    assert_eq!((rig.focal_px(), rig.principal_point()), (999.4, (3.25, 2.5)));
    assert!((rig.baseline_m - 0.193_001).abs() < 1e-9);
    let truth = truth_of(&scenes[0]);
    let [visible, every] = [truth.disparity, truth.disparity_with_occluded].map(Option::unwrap);
    // The lowest row comes first in the file, and doffs is added.
    assert_eq!(visible.get(3, 2), 23.0 + 32.0);
    assert_eq!(every.get(1, 2), 21.0 + 32.0);
    assert!(visible.get(1, 2).is_nan() && every.get(0, 0).is_nan());

    // The other byte order, the other name, no mask.
    fs::remove_file(folder.join("mask0nocc.png")).unwrap();
    fs::remove_file(folder.join("disp0GT.pfm")).unwrap();
    let mut big = b"Pf 6 4 1\n".to_vec();
    big.extend((0..24).flat_map(|d| (d as f32).to_be_bytes()));
    write(&folder.join("disp0.pfm"), &big);
    // The scene itself can be the path.
    let scenes = opened(Middlebury, &folder, &[]);
    assert_eq!(scenes[0].name, "Shelf");
    let truth = truth_of(&scenes[0]);
    assert_eq!(truth.disparity.unwrap().get(5, 3), 5.0 + 32.0);
    assert!(truth.disparity_with_occluded.is_none());
}

#[test]
fn float_maps_that_are_none_are_named() {
    let root = tempfile::tempdir().unwrap();
    float_scene(root.path());
    let map = root.path().join("disp0GT.pfm");
    for (content, wanted) in [
        (&b""[..], "header ends before the magic"),
        (b"Pf\n6 4", "header ends before the height"),
        (b"Pf\n6 4\n", "header ends before the scale"),
        (b"PF\n6 4\n-1\n0000", "starts with \"PF\""),
        (b"Pf\n6 four\n-1\n0000", "a size of 6 x four"),
        (b"Pf\n6 4\n0\n0000", "a scale of 0"),
        (b"Pf\n6 4\n-1\n0000", "6x4 pixels take 96 bytes, but 4 are there"),
        (b"Pf\n31623 31623\n-1\n0000", "31623x31623"),
        (b"Pf\n16384 16384\n-1\n0000", "take 1073741824 bytes, but 4 are there"),
        (b"Pf\n18446744073709551615 18446744073709551615\n-1\n0000", "18446744073709551615x"),
        (b"Pf\n1 1\n-1\n0000", "is 1x1, but the left image is 6x4"),
    ] {
        write(&map, content);
        let text = first(&opened(Middlebury, root.path(), &[])[0]).unwrap_err().to_string();
        assert!(text.contains("disp0GT.pfm") && text.contains(wanted), "{text}");
    }
    write(&map, &pfm());
    assert!(first(&opened(Middlebury, root.path(), &[])[0]).is_ok());
    save(&root.path().join("mask0nocc.png"), &GrayImage::new(5, 4));
    let text = first(&opened(Middlebury, root.path(), &[])[0]).unwrap_err().to_string();
    assert!(text.contains("mask0nocc.png is 5x4"), "{text}");
}

#[test]
fn a_calibration_of_2014_that_is_none_is_named() {
    for (from, to, wanted) in [
        ("cam0=[999.4 0 3.25;", "cam0=[999.4 x 3.25;", "cam0: invalid float"),
        ("cam0=[999.4", "cam0=[-1", "the focal length is -1"),
        ("0 999.4 2.5; 0 0 1]\ncam1", "]\ncam1", "cam0 has 3 numbers, not 9"),
        ("doffs=32", "doffs=nan", "doffs is 'nan'"),
        ("baseline=193.001\n", "", "no line 'baseline='"),
    ] {
        let root = tempfile::tempdir().unwrap();
        float_scene(root.path());
        let text = CALIBRATION.replacen(from, to, 1);
        assert_ne!(text, CALIBRATION);
        write(&root.path().join("calib.txt"), text.as_bytes());
        let text = refused(Middlebury, root.path(), &[]);
        assert!(text.contains("calib.txt") && text.contains(wanted), "{text}");
    }
    let root = tempfile::tempdir().unwrap();
    float_scene(root.path());
    fs::remove_file(root.path().join("calib.txt")).unwrap();
    let text = refused(Middlebury, root.path(), &[]);
    assert!(text.contains("calib.txt is missing"), "{text}");
}

#[test]
fn scenes_of_2005_and_2006_are_scaled_by_their_size() {
    let root = tempfile::tempdir().unwrap();
    for (name, width, factor) in [("Full", 1240, 1_u8), ("Half", 620, 2), ("Third", 413, 3)] {
        let folder = root.path().join(name);
        pair(&folder, "view1.png", "view5.png", width, 6);
        let map = GrayImage::from_fn(width, 6, |x, _| Luma([if x == 0 { 0 } else { 60 }]));
        save(&folder.join("disp1.png"), &map);
        let scene = &opened(Middlebury, root.path(), &[name])[0];
        let frame = first(scene).unwrap().frame;
        assert!((frame.rig.focal_px() - 3740.0 / f64::from(factor)).abs() < 1e-9);
        assert!((frame.rig.baseline_m - 0.16).abs() < 1e-12);
        let disparity = truth_of(scene).disparity.unwrap();
        assert_eq!(disparity.get(1, 1), 60.0 / f32::from(factor));
        assert!(disparity.get(0, 1).is_nan());
        assert!(scene.notes[0].contains(&format!("value / {factor}")), "{:?}", scene.notes);
    }
    // The names under which one of them goes round.
    let folder = root.path().join("plant");
    pair(&folder, "plantL.png", "plantR.png", 1240, 6);
    save(&folder.join("plantGT.png"), &GrayImage::from_pixel(1240, 6, Luma([60])));
    let scene = &opened(Middlebury, root.path(), &["plant"])[0];
    assert_eq!(truth_of(scene).disparity.unwrap().get(1, 1), 60.0);
}

#[test]
fn early_scenes_are_scaled_by_their_information_or_as_published() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("lamp");
    pair(&folder, "imL.png", "imR.png", 384, 288);
    save(&folder.join("groundtruth.png"), &GrayImage::from_pixel(384, 288, Luma([48])));
    let disparity = |wanted: f32, from: &str| {
        let scene = &opened(Middlebury, root.path(), &["lamp"])[0];
        let truth = truth_of(scene);
        assert_eq!(truth.disparity.unwrap().get(9, 9), wanted);
        assert!(scene.notes[0].contains(from), "{:?}", scene.notes);
        truth.disparity_with_occluded
    };
    assert!(disparity(3.0, "as published for tsukuba").is_none());
    write(&folder.join("info.txt"), b"12\n15\n");
    disparity(4.0, "from info.txt");
    let mask = GrayImage::from_fn(384, 288, |x, _| Luma([if x == 0 { 0 } else { 255 }]));
    save(&folder.join("nonocc.png"), &mask);
    assert_eq!(disparity(4.0, "from info.txt").unwrap().get(0, 0), 4.0);
    write(&folder.join("info.txt"), b"none");
    let text = refused(Middlebury, root.path(), &[]);
    assert!(text.contains("info.txt") && text.contains("'none'"), "{text}");

    for (width, height, levels) in [(450, 375, 4.0), (900, 750, 2.0), (434, 380, 8.0)] {
        let root = tempfile::tempdir().unwrap();
        pair(root.path(), "im2.ppm", "im6.ppm", width, height);
        save(&root.path().join("disp2.pgm"), &GrayImage::from_pixel(width, height, Luma([48])));
        let truth = truth_of(&opened(Middlebury, root.path(), &[])[0]);
        assert_eq!(truth.disparity.unwrap().get(9, 9), 48.0 / levels);
    }
}

#[test]
fn a_folder_without_scenes_is_named() {
    let root = tempfile::tempdir().unwrap();
    fs::create_dir_all(root.path().join("a/b/c")).unwrap();
    let text = refused(Middlebury, root.path(), &[]);
    assert!(text.contains("im0.png") && text.contains("view1"), "{text}");
    let text = refused(Middlebury, &root.path().join("nowhere"), &[]);
    assert!(text.contains("nowhere"), "{text}");
}

#[test]
fn real_scenes_have_the_disparities_that_are_known_of_them() {
    let Some(root) = data("middlebury2001").and_then(|path| path.parent().map(Path::to_owned))
    else {
        return;
    };
    let found = open(Middlebury, &root, &[]).unwrap();
    // Half-size Motorcycle comes without calibration.
    let skipped: Vec<_> = found.skipped.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(skipped, ["middlebury2014/trainingH/Motorcycle"]);
    for (name, low, high) in [
        ("middlebury2001/tsukuba", 5.0, 14.0),
        ("middlebury2003/cones", 5.5, 55.0),
        ("middlebury2006/FullSize/Aloe", 43.0, 211.0),
        ("middlebury2006/HalfSize/Cloth3", 22.5, 83.0),
        ("middlebury2014/trainingQ/Motorcycle", 7.0 + 32.778, 65.0 + 32.778),
    ] {
        let scene = found.scenes.iter().find(|scene| scene.name == name).unwrap();
        let truth = truth_of(scene);
        let known: Vec<f32> =
            truth.disparity.unwrap().pixels().iter().copied().filter(|d| !d.is_nan()).collect();
        let lowest = known.iter().copied().fold(f32::MAX, f32::min);
        let highest = known.iter().copied().fold(f32::MIN, f32::max);
        assert!(lowest >= low && highest <= high, "{name} {lowest} {highest}");
        assert!(known.len() > 80_000, "{name} {}", known.len());
        println!("{name}: {lowest} to {highest} px, {} pixels", known.len());
    }
    assert_eq!(all(found.scenes.clone()).len(), found.scenes.len());
}
