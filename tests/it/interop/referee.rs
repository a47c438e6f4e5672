//! The metrics beside programs of other makes that compute the same figures.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use image::GrayImage;
use salient_stereo::image::{Image, Size};
use salient_stereo::metric::{Confusion, DisparityStats, MapStats, SparsificationStats, fill};
use serde_json::{Value, json};

use super::{python, script};

/// Numbers that look random and are the same everywhere, 0..=1.
fn noise(seed: usize, x: usize, y: usize) -> f64 {
    let mut bits = (seed as u64) << 40 | (x as u64) << 20 | y as u64;
    for _ in 0..3 {
        bits = (bits ^ (bits >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d;
    }
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

fn save(folder: &Path, name: &str, image: &Image<u8>) {
    fs::create_dir_all(folder).unwrap();
    let pixels = image.pixels().to_vec();
    let picture = GrayImage::from_raw(image.width() as u32, image.height() as u32, pixels);
    picture.unwrap().save(folder.join(format!("{name}.png"))).unwrap();
}

fn save_pfm(folder: &Path, name: &str, image: &Image<f32>) {
    fs::create_dir_all(folder).unwrap();
    let mut bytes = format!("Pf\n{} {}\n-1\n", image.width(), image.height()).into_bytes();
    for y in (0..image.height()).rev() {
        bytes.extend(image.row(y).iter().flat_map(|value| value.to_le_bytes()));
    }
    fs::write(folder.join(format!("{name}.pfm")), bytes).unwrap();
}

fn check(script: &Path, arguments: &[&Path], scores: &Value) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scores.json");
    fs::write(&file, scores.to_string()).unwrap();
    let output = python().arg(script).args(arguments).arg(&file).output();
    let output = output.unwrap_or_else(|e| panic!("{}: {e}", python().get_program().display()));
    let mut text = String::from_utf8_lossy(&output.stdout).into_owned();
    write!(text, "{}", String::from_utf8_lossy(&output.stderr)).unwrap();
    println!("{text}");
    assert!(output.status.success(), "{text}");

    // Without scores: a table.
    let output = python().arg(script).args(arguments).output().unwrap();
    assert!(output.status.success() && String::from_utf8_lossy(&output.stdout).contains("|---|"));
}

/// How near (x, y) is to the middle of a soft blob: 1 there, 0 far away.
fn blob(size: Size, seed: usize, x: usize, y: usize) -> f64 {
    let place = |index: usize, end: usize| noise(seed, index, 7) * end as f64;
    let radius = 1.0 + 0.3 * (size.width.min(size.height) as f64) * noise(seed, 3, 7);
    let (dx, dy) = (x as f64 - place(1, size.width), y as f64 - place(2, size.height));
    (1.5 - 0.7 * dx.hypot(dy) / radius).clamp(0.0, 1.0)
}

/// Maps of every kind; of flat ones only black and white, as the structure
/// measure of other flat ones hangs on the rounding of their mean.
fn maps(size: Size, seed: usize, mask: &Image<u8>) -> Vec<(&'static str, Image<u8>)> {
    let of = |value: &dyn Fn(usize, usize) -> f64| {
        Image::from_fn(size, |x, y| (value(x, y).clamp(0.0, 1.0) * 255.0).round() as u8)
    };
    let truth = |x, y| f64::from(mask.get(x, y)) / 255.0;
    vec![
        ("black", of(&|_, _| 0.0)),
        ("white", of(&|_, _| 1.0)),
        ("noise", of(&|x, y| noise(seed, x, y))),
        ("weak", of(&|x, y| 0.3 + 0.2 * noise(seed + 1, x, y))),
        ("gradient", of(&|x, y| 0.1 + (x * 7 + y * 3) as f64 / 1000.0)),
        ("blob", of(&|x, y| blob(size, seed, x, y))),
        ("other blob", of(&|x, y| 0.8 * blob(size, seed + 1, x, y))),
        ("perfect", of(&truth)),
        ("inverted", of(&|x, y| 1.0 - truth(x, y))),
        ("rough", of(&|x, y| 0.6 * truth(x, y) + 0.4 * noise(seed + 2, x, y))),
    ]
}

fn masks(size: Size, seed: usize) -> Vec<(&'static str, Image<u8>)> {
    let of = |salient: &dyn Fn(usize, usize) -> bool| {
        Image::from_fn(size, |x, y| 255 * u8::from(salient(x, y)))
    };
    vec![
        ("empty", of(&|_, _| false)),
        ("full", of(&|_, _| true)),
        ("one", of(&|x, y| x == size.width / 2 && y == size.height / 3)),
        ("blob", of(&|x, y| blob(size, seed, x, y) > 0.4)),
        ("last row", of(&|_, y| y + 1 == size.height)),
        ("last column", of(&|x, _| x + 1 == size.width)),
        ("noise", of(&|x, y| noise(seed + 3, x, y) > 0.8)),
    ]
}

#[test]
fn pysodmetrics_finds_the_same_map_scores() {
    let Some(script) = script("referee_saliency.py") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (maps_folder, masks_folder) = (folder.path().join("maps"), folder.path().join("masks"));
    let (mut as_is, mut stretched) = (MapStats::default(), MapStats::default());
    let mut each = serde_json::Map::new();
    let sizes = [(1, 1), (2, 1), (1, 7), (5, 4), (13, 9), (31, 17), (48, 64), (97, 61)];
    for (seed, (width, height)) in sizes.into_iter().enumerate() {
        let size = Size::new(width, height);
        for (mask_name, mask) in masks(size, seed) {
            for (map_name, map) in maps(size, seed, &mask) {
                let name = format!("{width}x{height} {map_name} on {mask_name}");
                save(&maps_folder, &name, &map);
                save(&masks_folder, &name, &mask);
                let (mut alone, mut alone_stretched) = (MapStats::default(), MapStats::default());
                alone.add(&map, &mask);
                alone_stretched.add_stretched(&map, &mask);
                as_is.merge(&alone);
                stretched.merge(&alone_stretched);
                if let (Some(a), Some(b)) = (alone.total(), alone_stretched.total()) {
                    each.insert(name, json!({ "as_is": a, "stretched": b }));
                }
            }
        }
    }
    let scores = json!({ "as_is": as_is.total(), "stretched": stretched.total(), "each": each });
    check(&script, &[&maps_folder, &masks_folder], &scores);
}

/// Disparity that rises to the lower right, with holes; true holes are others.
fn disparities(size: Size, seed: usize) -> (Image<f32>, Image<f32>, Image<f32>) {
    let truth = Image::from_fn(size, |x, y| {
        let hole = noise(seed, x, y) < 0.2;
        if hole { f32::NAN } else { 1.0 + 0.7 * x as f32 + 0.3 * y as f32 }
    });
    let confidence = Image::from_fn(size, |x, y| noise(seed + 1, x, y) as f32);
    let disparity = Image::from_fn(size, |x, y| {
        let hole = noise(seed + 2, x / 5, y) < 0.3 || y % 11 == 3;
        let spread = 12.0 * (1.0 - f64::from(confidence.get(x, y))).powi(2);
        let error = spread * (2.0 * noise(seed + 3, x, y) - 1.0);
        if hole { f32::NAN } else { 1.0 + 0.7 * x as f32 + 0.3 * y as f32 + error as f32 }
    });
    (truth, disparity, confidence)
}

#[test]
fn numpy_finds_the_same_stereo_scores() {
    let Some(script) = script("referee_stereo.py") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (mut found, mut whole) = (DisparityStats::default(), DisparityStats::default());
    let (mut sparsification, mut salient) = (SparsificationStats::default(), Confusion::default());
    let sizes = [(97, 61), (1, 1), (40, 13), (1, 30), (120, 90)];
    for (seed, (width, height)) in sizes.into_iter().enumerate() {
        let size = Size::new(width, height);
        let (truth, disparity, confidence) = disparities(size, 5 * seed);
        let name = format!("{seed:03}");
        save_pfm(&folder.path().join("truth"), &name, &truth);
        save_pfm(&folder.path().join("disparity"), &name, &disparity);
        save_pfm(&folder.path().join("confidence"), &name, &confidence);
        let pairs = |d: &Image<f32>| -> Vec<(f32, f32)> {
            d.pixels().iter().copied().zip(truth.pixels().iter().copied()).collect()
        };
        found.add(pairs(&disparity));
        let errors = pairs(&disparity).into_iter().map(|(d, t)| (d - t).abs());
        sparsification.add(&mut confidence.pixels().iter().copied().zip(errors).collect());
        let mut without_holes = disparity.clone();
        fill(&mut without_holes);
        whole.add(pairs(&without_holes));

        let mask = |seed| Image::from_fn(size, |x, y| 255 * u8::from(blob(size, seed, x, y) > 0.3));
        let (ours, truth) = (mask(seed), mask(seed + 1));
        save(&folder.path().join("found"), &name, &ours);
        save(&folder.path().join("salient"), &name, &truth);
        let pixels = ours.pixels().iter().zip(truth.pixels());
        salient.add(pixels.map(|(ours, truth)| (*ours != 0, *truth != 0)));
    }
    let scores = json!({
        "disparity": found.total(),
        "filled": whole.total(),
        "sparsification": sparsification.total(),
        "salient": salient.total(),
    });
    check(&script, &[folder.path()], &scores);
}
