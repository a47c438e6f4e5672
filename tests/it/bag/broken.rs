//! Bags that are damaged, or hold data that cannot be used: never a panic, never
//! an allocation that the file only claims to need, and every loss counted.

use std::fs;
use std::path::Path;

use proptest::prelude::*;
use salient_stereo::config::Config;
use salient_stereo::input::FrameSource;
use salient_stereo::input::bag::{BagOptions, BagSource, Limits};
use salient_stereo::output::bag::Packing;

use super::recipe::{Miscalibrate, Recipe, Spoil, failure, observe};
use super::{PACKINGS, metadata};

fn bytes_of(recipe: &Recipe) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    recipe.write(&path);
    fs::read(path).unwrap()
}

/// Reads to the end whatever `bytes` are; the number of pairs when they are a bag.
fn read(folder: &Path, bytes: &[u8]) -> Option<usize> {
    let path = folder.join("broken.mcap");
    fs::write(&path, bytes).unwrap();
    let limits = Limits { message: 1 << 20, chunk: 4 << 20 };
    let options = BagOptions { limits, ..BagOptions::default() };
    let mut source = BagSource::open(&path, &Config::default(), options).ok()?;
    let mut pairs = 0;
    while let Ok(Some(_)) = source.next_observation() {
        pairs += 1;
    }
    Some(pairs)
}

#[test]
fn everything_before_a_cut_is_used() {
    let folder = tempfile::tempdir().unwrap();
    for packing in PACKINGS {
        let recipe = Recipe { packing, ..Recipe::default() };
        let whole = bytes_of(&recipe);
        let mut before = 0;
        for len in (0..whole.len()).step_by(61) {
            let pairs = read(folder.path(), &whole[..len]).unwrap_or(0);
            assert!(
                pairs >= before,
                "{packing:?}: {pairs} pairs of {len} bytes, {before} of fewer"
            );
            before = pairs;
        }
        assert_eq!(before, recipe.frames, "the summary is not needed");
    }
}

#[test]
fn a_cut_is_reported_with_what_was_found_and_lost() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    let recipe = Recipe { packing: Packing::Unchunked, ..Recipe::default() };
    let whole = bytes_of(&recipe);
    // In the middle of the pixels of the last right image.
    let pixels = recipe.picture(5, true).pixels().as_flattened()[..32].to_vec();
    let at = whole.windows(32).rposition(|window| window == pixels).unwrap() + 40;
    fs::write(&path, &whole[..at]).unwrap();
    let mut source = BagSource::open(&path, &Config::default(), BagOptions::default()).unwrap();
    let note = source.notes()[0].clone();
    assert!(note.contains("22 messages found") && note.contains("bytes are unusable"), "{note}");
    let mut pairs = 0;
    while source.next_observation().unwrap().is_some() {
        pairs += 1;
    }
    assert_eq!(pairs, 5);
    assert_eq!(source.tally().unpaired_left, 1);
    assert!(source.tally().skipped.keys().any(|reason| reason.contains("cut")));
}

#[test]
fn a_damaged_chunk_costs_only_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    for packing in [Packing::Zstd, Packing::Lz4, Packing::Plain] {
        let recipe = Recipe { packing, ..Recipe::default() };
        let mut bytes = bytes_of(&recipe);
        // Somewhere inside the third of six chunks.
        let chunk = bytes.windows(4).position(|w| w == b"left").unwrap();
        let at = chunk + (bytes.len() - chunk) / 4;
        bytes[at] ^= 0x10;
        fs::write(&path, &bytes).unwrap();
        let (observed, tally) = observe(&path, &Config::default());
        assert!(observed.len() + 1 >= recipe.frames, "{packing:?} {}: {tally:?}", observed.len());
        if observed.len() < recipe.frames {
            assert!(tally.skipped.keys().any(|reason| reason.starts_with("chunk")), "{tally:?}");
            assert_eq!(tally.skipped["message lost in a damaged chunk"], 4);
        }
    }
}

#[test]
fn a_length_that_is_only_claimed_allocates_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let magic = b"\x89MCAP0\r\n";
    let header = [&[1_u8][..], &8_u64.to_le_bytes(), &[0; 8]].concat();
    for code in 0..=16_u8 {
        for len in [u64::MAX, 1 << 62, 1 << 40, u64::from(u32::MAX)] {
            let record = [&[code][..], &len.to_le_bytes(), &[0xff; 64]].concat();
            read(folder.path(), &[&magic[..], &header, &record].concat());
            // The same inside an uncompressed chunk that is as long as it says.
            let chunk = [
                &[0; 16][..],
                &u64::MAX.to_le_bytes(),
                &[0; 4],
                &[0; 4],
                &len.to_le_bytes(),
                &record,
            ]
            .concat();
            let chunk = [&[6_u8][..], &(chunk.len() as u64).to_le_bytes(), &chunk].concat();
            read(folder.path(), &[&magic[..], &header, &chunk].concat());
        }
    }
}

#[test]
fn a_chunk_that_decompresses_without_end_is_stopped_at_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.mcap");
    let bomb = zstd::bulk::compress(&vec![0; 64 << 20], 3).unwrap();
    let chunk = [
        &[0; 16][..],
        &(64_u64 << 20).to_le_bytes(),
        &[0; 4],
        &4_u32.to_le_bytes(),
        b"zstd",
        &(bomb.len() as u64).to_le_bytes(),
        &bomb,
    ]
    .concat();
    let chunk = [&[6_u8][..], &(chunk.len() as u64).to_le_bytes(), &chunk].concat();
    let mut bytes = b"\x89MCAP0\r\n".to_vec();
    bytes.extend_from_slice(&chunk);
    // A bag behind it, whose own magic is not repeated.
    let good = bytes_of(&Recipe::default());
    bytes.extend_from_slice(&good[8..good.len() - 200]);
    fs::write(&path, &bytes).unwrap();
    let limits = Limits { message: 1 << 20, chunk: 4 << 20 };
    let options = BagOptions { limits, ..BagOptions::default() };
    let mut source = BagSource::open(&path, &Config::default(), options).unwrap();
    let mut pairs = 0;
    while source.next_observation().unwrap().is_some() {
        pairs += 1;
    }
    assert_eq!(pairs, 6);
    assert_eq!(source.tally().skipped["chunk larger than 4 MiB"], 1);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    /// Any byte may be any other byte.
    #[test]
    fn flipped_bytes_never_panic(
        packing in prop::sample::select(PACKINGS.to_vec()),
        compressed in any::<bool>(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1_u8..), 1..8),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let recipe = Recipe { packing, compressed, frames: 3, truth: Some(true), ..Recipe::default() };
        let mut bytes = bytes_of(&recipe);
        for (at, with) in &flips {
            let at = at.index(bytes.len());
            bytes[at] ^= with;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Some(pairs) = read(folder.path(), &bytes) {
            prop_assert!(pairs <= 3);
        }
    }
}

#[test]
fn other_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    for (bytes, wanted) in [
        (&b""[..], "the file is empty"),
        (b"\x89PNG\r\n\x1a\n....", "not an MCAP file: it starts with \"\\x89PNG"),
        (b"#ROSBAG V2.0\n", "ROS 1 bag"),
        (b"SQLite format 3\0", "ros2 bag convert"),
    ] {
        fs::write(&path, bytes).unwrap();
        let text = failure(&path, &Config::default());
        assert!(text.contains(wanted), "{text}");
    }
    fs::write(&path, b"\x89MCAP0\r\n\x01\xff").unwrap();
    let text = failure(&path, &Config::default());
    assert!(text.contains("holds no message") && text.contains("no index"), "{text}");
    let text = failure(&folder.path().join("none.mcap"), &Config::default());
    assert!(text.contains("none.mcap"), "{text}");
    fs::write(folder.path().join("a.db3"), b"SQLite format 3\0").unwrap();
    assert!(failure(&folder.path().join("a.db3"), &Config::default()).contains("sqlite3"));
}

#[test]
fn folders_that_are_no_bags_are_named() {
    let folder = tempfile::tempdir().unwrap();
    assert!(failure(folder.path(), &Config::default()).contains("no bag folder"));
    let yaml = folder.path().join("metadata.yaml");
    for (text, wanted) in [
        ("a: [", "not a bag's metadata"),
        ("rosbag2_bagfile_information: {relative_file_paths: []}", "relative_file_paths is empty"),
        (
            "rosbag2_bagfile_information: {storage_identifier: sqlite3, relative_file_paths: [a.db3]}",
            "ros2 bag convert",
        ),
        (
            "rosbag2_bagfile_information: {storage_identifier: mcap, compression_mode: FILE, compression_format: zstd, relative_file_paths: [a.mcap.zstd]}",
            "compression of whole files",
        ),
        (
            "rosbag2_bagfile_information: {storage_identifier: mcap, relative_file_paths: [gone.mcap]}",
            "gone.mcap",
        ),
    ] {
        fs::write(&yaml, text).unwrap();
        let text = failure(folder.path(), &Config::default());
        assert!(text.contains(wanted), "{text}");
    }
}

#[test]
fn no_file_outside_the_folder_is_read() {
    let outer = tempfile::tempdir().unwrap();
    let secret = outer.path().join("secret.mcap");
    Recipe::default().write(&secret);
    let folder = outer.path().join("bag");
    fs::create_dir(&folder).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(&secret, folder.join("link.mcap")).unwrap();
    let absolute = secret.display().to_string();
    for named in ["../secret.mcap", "a/../../secret.mcap", "link.mcap", &absolute] {
        fs::write(folder.join("metadata.yaml"), metadata(&[named.to_owned()])).unwrap();
        let text = failure(&folder, &Config::default());
        assert!(text.contains("not inside the bag's folder"), "{named}: {text}");
    }
}

/// Pairs and the reason for which the others were skipped.
fn skipped(recipe: &Recipe) -> (usize, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    recipe.write(&path);
    let (observed, tally) = observe(&path, &Config::default());
    let reasons: Vec<_> =
        tally.skipped.iter().map(|(reason, n)| format!("{n}x {reason}")).collect();
    (observed.len(), reasons.join("; "))
}

#[test]
fn images_that_cannot_be_used_are_skipped_with_their_reason() {
    let spoilt: [(Spoil, &str); 4] = [
        (
            |i, m| {
                if i == 2 {
                    m.data.truncate(12);
                }
            },
            "1x left image: image payload is 12 bytes, 288 expected",
        ),
        (
            |i, m| {
                if i == 2 {
                    m.encoding = "jpeg2000".into();
                }
            },
            "unknown image encoding 'jpeg2000'",
        ),
        (
            |i, m| {
                if i == 2 {
                    m.step = 3;
                }
            },
            "step is 3 bytes",
        ),
        (
            |i, m| {
                if i == 2 {
                    m.height = 4;
                    m.data.truncate(4 * 48);
                }
            },
            "left image is 16x4, right image is 16x6",
        ),
    ];
    for (spoil, wanted) in spoilt {
        let (pairs, reasons) = skipped(&Recipe { spoil, ..Recipe::default() });
        assert_eq!(pairs, 5);
        assert!(reasons.contains(wanted), "{reasons}");
    }
}

#[test]
fn calibrations_that_cannot_be_used_are_skipped_with_their_reason() {
    let wrong: [(Miscalibrate, &str); 4] = [
        (|left, _| left.k = [0.0; 9], "left camera info is uncalibrated"),
        (|_, right| right.p[3] = 200.0, "swapped"),
        (|_, right| right.p[3] = 0.0, "baseline is zero"),
        (|left, _| left.width = 640, "describes 640x6"),
    ];
    for (miscalibrate, wanted) in wrong {
        let (pairs, reasons) = skipped(&Recipe { miscalibrate, ..Recipe::default() });
        assert_eq!(pairs, 0);
        assert!(reasons.starts_with("6x ") && reasons.contains(wanted), "{reasons}");
    }
}

#[test]
fn a_stamp_that_jumps_back_starts_anew() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("loop.mcap");
    // Two laps of three frames, recorded one after the other.
    let recipe = Recipe {
        clock: |i| 5_000_000_000 + 100_000_000 * (i % 3) as i64,
        recorded: Some(|i| 9_000_000_000 + 100_000_000 * i as i64),
        ..Recipe::default()
    };
    recipe.write(&path);
    let mut source = BagSource::open(&path, &Config::default(), BagOptions::default()).unwrap();
    let mut stamps = Vec::new();
    while let Some(observation) = source.next_observation().unwrap() {
        stamps.push(observation.frame.stamp);
    }
    assert_eq!(stamps, (0..6).map(|i| recipe.stamp(i)).collect::<Vec<_>>());
    assert_eq!(source.jumps(), 1);
    assert!(!source.tally().has_losses(), "{:?}", source.tally());
}
