//! DAVIS and photographs with masks.

use std::fs;
use std::path::Path;

use image::{GrayImage, Luma, Rgb, RgbImage};
use salient_stereo::image::Size;
use salient_stereo::input::FrameSource as _;
use salient_stereo::input::dataset::DatasetKind::{Davis, Saliency};
use salient_stereo::input::dataset::DatasetSource;

use super::{all, data, first, open, opened, refused, save, truth_of, try_open, write};

fn jpeg(path: &Path, width: u32, height: u32) {
    save(path, &RgbImage::from_pixel(width, height, Rgb([90, 60, 30])));
}

/// A palette image of 5 x 2 whose index is `x` in the upper row and 0 below.
fn palette(depth: png::BitDepth, upper: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 5, 2);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(depth);
    encoder.set_palette(
        (0..768).map(|v| (v * 7 % 256) as u8).collect::<Vec<u8>>()
            [..3 * 4.max(1 << (depth as u8).min(8))]
            .to_vec(),
    );
    let mut writer = encoder.write_header().unwrap();
    let lower = vec![0; upper.len()];
    writer.write_image_data(&[upper, &lower].concat()).unwrap();
    writer.finish().unwrap();
    bytes
}

fn davis(root: &Path) {
    for (sequence, frames) in [("bear", 2), ("dance", 1)] {
        for frame in 0..frames {
            jpeg(&root.join(format!("JPEGImages/480p/{sequence}/{frame:05}.jpg")), 5, 2);
            let mask = GrayImage::from_fn(5, 2, |x, _| Luma([if x > 2 { 255 } else { 0 }]));
            save(&root.join(format!("Annotations/480p/{sequence}/{frame:05}.png")), &mask);
        }
    }
}

#[test]
fn davis_has_one_object_or_several() {
    let root = tempfile::tempdir().unwrap();
    davis(root.path());
    let scenes = opened(Davis, root.path(), &["bear"]);
    assert!(scenes[0].monocular && !scenes[0].stills && scenes[0].frame_rate_hz == 24.0);
    let objects = truth_of(&scenes[0]).objects.unwrap();
    assert_eq!(objects.row(0), [0, 0, 0, 1, 1]);
    let frames = all(scenes);
    assert_eq!(frames[0].1.frame.left, frames[0].1.frame.right);
    assert_eq!(frames[1].1.frame.stamp.0 - frames[0].1.frame.stamp.0, 41_666_667);

    // What counts is the index, not the colour, at every depth.
    let mask = root.path().join("Annotations/480p/dance/00000.png");
    for (depth, upper, expected) in [
        (png::BitDepth::Eight, vec![0, 1, 2, 3, 255], [0, 1, 2, 3, 0]),
        (png::BitDepth::Four, vec![0x01, 0x23, 0x40], [0, 1, 2, 3, 4]),
        (png::BitDepth::Two, vec![0b00_01_10_11, 0b01_00_00_00], [0, 1, 2, 3, 1]),
        (png::BitDepth::One, vec![0b0101_1000], [0, 1, 0, 1, 1]),
    ] {
        write(&mask, &palette(depth, &upper));
        let objects = truth_of(&opened(Davis, root.path(), &["dance"])[0]).objects.unwrap();
        assert_eq!((objects.row(0), objects.row(1)), (&expected[..], &[0; 5][..]));
    }
    let whole = palette(png::BitDepth::Eight, &[0, 1, 2, 3, 4]);
    for content in [&whole[..whole.len() / 2], b"no PNG"] {
        write(&mask, content);
        let text = first(&opened(Davis, root.path(), &["dance"])[0]).unwrap_err().to_string();
        assert!(text.contains("dance/00000.png"), "{text}");
    }
    save(&mask, &GrayImage::new(5, 3));
    let text = first(&opened(Davis, root.path(), &["dance"])[0]).unwrap_err().to_string();
    assert!(text.contains("is 5x3, but the left image is 5x2"), "{text}");
}

#[test]
fn davis_has_splits() {
    let root = tempfile::tempdir().unwrap();
    davis(root.path());
    let text = refused(Davis, root.path(), &["@val"]);
    assert!(text.contains("'@val'") && text.contains("ImageSets"), "{text}");
    write(&root.path().join("ImageSets/2017/val.txt"), b"dance\nswan\n");
    let found = try_open(Davis, root.path(), &["@val"]).unwrap();
    assert_eq!(found.scenes.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["dance"]);
    assert!(found.skipped.len() == 1 && found.skipped[0].0 == "swan");
    let pairs = b"/JPEGImages/480p/bear/00000.jpg /Annotations/480p/bear/00000.png\n\
                  /JPEGImages/480p/bear/00001.jpg /Annotations/480p/bear/00001.png\n";
    write(&root.path().join("ImageSets/480p/val.txt"), pairs);
    let text = refused(Davis, root.path(), &["@val"]);
    assert!(text.contains("@2017/val"), "{text}");
    assert_eq!(opened(Davis, root.path(), &["@480p/val"])[0].name, "bear");
}

#[test]
fn what_is_missing_of_davis_is_named() {
    let root = tempfile::tempdir().unwrap();
    let text = refused(Davis, root.path(), &[]);
    assert!(text.contains("JPEGImages"), "{text}");
    davis(root.path());
    fs::remove_file(root.path().join("Annotations/480p/dance/00000.png")).unwrap();
    let found = open(Davis, root.path(), &[]).unwrap();
    assert!(found.scenes.len() == 1 && found.skipped[0].0 == "dance");
    fs::remove_dir_all(root.path().join("Annotations")).unwrap();
    let text = refused(Davis, root.path(), &[]);
    assert!(text.contains("Annotations/480p"), "{text}");
}

#[test]
fn photographs_come_in_scenes_of_fifty() {
    let root = tempfile::tempdir().unwrap();
    let set = root.path().join("DUTS-TE");
    for n in 0..52 {
        let (width, height) = (4 + n % 2, 3);
        jpeg(&set.join(format!("DUTS-TE-Image/photo_{n:03}.jpg")), width, height);
        let mask =
            GrayImage::from_fn(width, height, |x, _| Luma([[0, 127, 128, 255][x.min(3) as usize]]));
        if n > 0 {
            save(&set.join(format!("DUTS-TE-Mask/photo_{n:03}.png")), &mask);
        }
    }
    for (path, names) in [
        (set.as_path(), ["0000-0049", "0050-0051"]),
        (root.path(), ["DUTS-TE/0000-0049", "DUTS-TE/0050-0051"]),
    ] {
        let scenes = opened(Saliency, path, &[]);
        assert_eq!(scenes.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), names);
        assert!(scenes.iter().all(|scene| scene.monocular && scene.stills));
        assert_eq!(scenes[0].notes, ["1 photographs have no mask"]);
        let frames = all(scenes);
        assert_eq!(frames.len(), 52);
        assert!(frames[0].1.truth.is_none());
        let objects = frames[1].1.truth.clone().unwrap().objects.unwrap();
        assert_eq!((objects.size(), objects.row(0)), (Size::new(5, 3), &[0, 0, 0, 1, 1][..]));
        let stamps: Vec<i64> = frames.iter().map(|(_, o)| o.frame.stamp.0).collect();
        assert!(stamps.windows(2).all(|two| two[1] - two[0] >= 60_000_000_000));
    }
    // A mask of another size.
    save(&set.join("DUTS-TE-Mask/photo_051.png"), &GrayImage::new(9, 9));
    let scenes = opened(Saliency, &set, &["0050-0051"]);
    let mut source = DatasetSource::new(scenes);
    assert!(source.next_observation().is_ok());
    let text = source.next_observation().unwrap_err().to_string();
    assert!(text.contains("photo_051.png is 9x9"), "{text}");
}

#[test]
fn photographs_and_masks_are_found_under_other_names() {
    for (images, masks, other) in
        [("imgs", "gt", "saliency"), ("Image", "GT", "Edge"), ("both", "both", "other")]
    {
        let root = tempfile::tempdir().unwrap();
        for n in 0..3 {
            jpeg(&root.path().join(images).join(format!("{n}.jpg")), 4, 3);
            save(&root.path().join(masks).join(format!("{n}.png")), &GrayImage::new(4, 3));
        }
        save(&root.path().join(other).join("9.png"), &GrayImage::new(4, 3));
        let scenes = opened(Saliency, root.path(), &[]);
        assert_eq!((scenes.len(), scenes[0].frames.len()), (1, 3));
        assert!(scenes[0].frames[0].left.ends_with(format!("{images}/0.jpg")));
        assert!(truth_of(&scenes[0]).objects.is_some());
    }
    let root = tempfile::tempdir().unwrap();
    jpeg(&root.path().join("Image/a.jpg"), 4, 3);
    save(&root.path().join("Mask/b.png"), &GrayImage::new(4, 3));
    let text = refused(Saliency, root.path(), &[]);
    assert!(text.contains("the same names") || text.contains("have the same"), "{text}");
    assert!(refused(Saliency, &root.path().join("x"), &[]).contains("/x"));
}

#[test]
fn real_masks_are_whole() {
    if let Some(path) = data("davis") {
        let scenes = opened(Davis, &path, &["car-shadow"]);
        let frames = all(scenes);
        assert!(frames.len() > 30);
        for (_, observation) in &frames {
            let objects = observation.truth.as_ref().unwrap().objects.as_ref().unwrap();
            let share = objects.pixels().iter().filter(|&&id| id == 1).count() as f64
                / objects.size().area() as f64;
            assert!((0.001..0.5).contains(&share), "{share}");
        }
    }
    if let Some(path) = data("duts") {
        let scenes = opened(Saliency, &path, &[]);
        assert_eq!(scenes.len(), 5);
        assert!(scenes[0].name.starts_with("DUTS-TR/"), "{}", scenes[0].name);
        let frames = all(scenes);
        assert_eq!(frames.len(), 250);
        assert!(frames.iter().all(|(_, observation)| {
            let objects = observation.truth.as_ref().unwrap().objects.as_ref().unwrap();
            objects.pixels().contains(&1)
        }));
    }
}
