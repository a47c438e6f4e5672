//! Tables and report of an evaluation, from parts made by hand.

use std::collections::BTreeMap;

use salient_stereo::evaluation::readme::{self, SpliceError};
use salient_stereo::evaluation::{self, Evaluation, Part, Peer, Peers, Run, Shot, report};
use salient_stereo::image::{Image, Size};
use salient_stereo::metric::{Confusion, DisparityStats, ErrorProfile, Mean};
use salient_stereo::output::score::Scores;
use salient_stereo::table::{Cell, Table};
use serde_json::json;

/// Counts of `scored` frames, of which `hits` of `objects` objects were found.
fn scores(scored: u64, hits: u64, objects: u64, distances: &[f64]) -> Scores {
    let mut value = serde_json::to_value(Scores::default()).unwrap();
    value["frames"] = json!(scored);
    value["scored"] = json!(scored);
    for rows in ["masks", "boxes"] {
        for counts in value[rows].as_array_mut().unwrap() {
            *counts = json!({
                "frames": scored, "true_positives": hits, "false_positives": 0,
                "false_negatives": objects - hits,
            });
        }
    }
    value["roi_disparity"] = serde_json::to_value(disparity(90, 0.5, 10)).unwrap();
    value["distance"] = json!({ "absolute": 1.0, "relative": distances });
    serde_json::from_value(value).unwrap()
}

/// `known` pixels that are off by `error` and `holes` without an estimate.
fn disparity(known: usize, error: f32, holes: usize) -> DisparityStats {
    let mut stats = DisparityStats::default();
    stats.add(std::iter::repeat_n((20.0 + error, 20.0), known));
    stats.add(std::iter::repeat_n((f32::NAN, 20.0), holes));
    stats
}

fn mean(value: f64) -> Mean {
    let mut mean = Mean::default();
    mean.add(value);
    mean
}

fn run(changed: &[&str]) -> Run {
    Run {
        version: "0.1.0".into(),
        commit: "0a1b2c3".into(),
        executable: "e0e0".into(),
        config: format!("cfg{}", changed.len()),
        changed: changed.iter().map(|&text| text.to_owned()).collect(),
        seed: 7,
        machine: "2 cores".into(),
        threads: 2,
    }
}

/// One scene of four frames that take `scale` milliseconds per stage and of
/// which `tp` pixels are found.
fn part(dataset: &str, scene: &str, method: &str, scale: f64, tp: u64) -> Part {
    Part {
        dataset: dataset.into(),
        scene: scene.into(),
        method: method.into(),
        run: run(&["saliency.mode=x"]),
        frames: 4,
        size: [640, 480],
        times: vec![[scale; 9]; 4],
        matched: mean(0.25),
        salient: Confusion {
            true_positives: tp,
            false_positives: 100 - tp,
            false_negatives: 100 - tp,
            true_negatives: 800,
        },
        scores: scores(4, 2, 4, &[0.02, 0.1, 0.04]),
        frame: disparity(80, 1.0, 20),
        filled_frame: disparity(100, 4.0, 0),
        errors: ErrorProfile { bins: vec![DisparityStats::default(), disparity(50, 0.25, 0)] },
        continuity: mean(0.9),
        true_continuity: mean(0.95),
        ..Part::default()
    }
}

fn peer(scene: &str, matching_ms: f64) -> Peer {
    Peer {
        dataset: "kitti2012".into(),
        scene: scene.into(),
        method: "OpenCV SGBM".into(),
        version: "5.0.0".into(),
        threads: 1,
        matching_ms,
        known: 1000,
        pixels: 830,
        known_with_occluded: 1100,
        epe_px: 2.0,
        d1: 0.07,
        bad_2: 0.1,
        density: 0.83,
        filled_d1: 0.14,
        ..Peer::default()
    }
}

fn evaluation() -> Evaluation {
    Evaluation {
        command: "salient_stereo evaluate kitti <folder>".into(),
        parts: vec![
            part("kitti2012", "000002", "scene", 1.0, 60),
            part("kitti2012", "000001", "scene", 1.0, 80),
            part("kitti2012", "000001", "full_frame", 4.0, 10),
            part("kitti2012", "000001", "my_own", 2.0, 50),
            part("kitti2012", "000001", "c2", 2.0, 50),
            part("bag street", "a|b", "paper", 2.0, 50),
        ],
        peers: vec![peer("000001", 30.0), peer("000001", 20.0), peer("000002", 10.0)],
    }
}

fn find<'a>(tables: &'a [Table], start: &str) -> &'a Table {
    tables.iter().find(|table| table.title.starts_with(start)).unwrap_or_else(|| panic!("{start}"))
}

/// The cell of the row and column of these names, as shown.
fn cell(table: &Table, row: &str, column: &str) -> String {
    let x =
        table.columns.iter().position(|c| c.name == column).unwrap_or_else(|| panic!("{column}"));
    let row = table.rows.iter().find(|r| r.cells[0] == Cell::text(row));
    row.unwrap_or_else(|| panic!("no row")).cells[x].to_string()
}

#[test]
fn merging_adds_every_count_up() {
    let mut first = part("d", "1", "scene", 1.0, 60);
    let mut second = part("d", "2", "scene", 3.0, 80);
    first.skipped = BTreeMap::from([("no partner".into(), 1)]);
    second.skipped = BTreeMap::from([("no partner".into(), 2), ("broken".into(), 4)]);
    second.monocular = true;
    second.errors.bins.push(disparity(7, 2.0, 0));
    second.frame = disparity(80, 3.0, 20);
    let mut sum = first.clone();
    sum.merge(&second);
    assert_eq!(sum.frames, 8);
    assert_eq!(sum.skipped, BTreeMap::from([("no partner".into(), 3), ("broken".into(), 4)]));
    assert!(!sum.monocular, "the first one has two cameras");
    assert_eq!(sum.times.len(), 8);
    assert_eq!(sum.salient.true_positives, 140);
    assert_eq!(sum.matched.count, 2);
    assert_eq!(sum.frame.total().unwrap().epe_px, 2.0);
    assert_eq!(sum.filled_frame.total().unwrap().pixels, 200);
    assert_eq!(sum.errors.bins.len(), 3);
    assert_eq!(sum.errors.bins[1].total().unwrap().pixels, 100);
    let summary = sum.scores.summary().unwrap();
    assert_eq!((summary.frames, summary.main_regions().unwrap().true_positives), (8, 4));
    assert_eq!(sum.continuity.count, 2);
    assert_eq!((sum.scene.as_str(), sum.run), ("1", first.run.clone()));

    // Adding nothing changes nothing.
    let mut same = first.clone();
    same.merge(&Part::default());
    let figures =
        |part: Part| evaluation::json(&Evaluation { parts: vec![part], ..Evaluation::default() });
    assert_eq!(figures(same), figures(first));
}

#[test]
fn cells_are_what_was_counted() {
    let tables = evaluation::tables(&evaluation());
    let attention = find(&tables, "kitti2012: Table III-a");
    let names: Vec<String> = attention.rows.iter().map(|row| row.cells[0].to_string()).collect();
    let expected = ["full-frame SGM", "scene (ours)", "my_own", "paper's own figure (simulated)"];
    assert_eq!(names, expected);
    assert_eq!(cell(attention, "scene (ours)", "F1"), "0.700");
    assert_eq!(cell(attention, "scene (ours)", "accuracy"), "0.935", "1740 of 1860");
    assert_eq!(cell(attention, "scene (ours)", "ROI area, %"), "25.0");
    assert_eq!(cell(attention, "scene (ours)", "Hz"), "111.1");
    assert_eq!(cell(attention, "paper's own figure (simulated)", "F1"), "0.930");
    assert_eq!(cell(attention, "paper's own figure (simulated)", "Hz"), "–");
    assert!(attention.columns.iter().all(|column| column.name != "max-F"), "nothing measured it");

    let stereo = find(&tables, "kitti2012: Table III-b");
    assert_eq!(cell(stereo, "scene (ours)", "EPE in ROI, px"), "0.50");
    assert_eq!(cell(stereo, "scene (ours)", "density in ROI, %"), "90.0");
    assert_eq!(cell(stereo, "scene (ours)", "EPE, px"), "1.00");
    assert_eq!(cell(stereo, "scene (ours)", "filled D1, %"), "100.00");
    assert_eq!(cell(stereo, "OpenCV SGBM 5.0.0", "EPE, px"), "2.00");
    assert_eq!(cell(stereo, "OpenCV SGBM 5.0.0", "D1, %"), "7.00");
    assert_eq!(cell(stereo, "OpenCV SGBM 5.0.0", "matching, ms"), "20.0");
    assert_eq!(cell(stereo, "OpenCV SGBM 5.0.0", "EPE in ROI, px"), "–");

    let regions = find(&tables, "kitti2012: Table III-c");
    // 2 of 4: F1 = 2 · 2 / (2 · 2 + 2).
    assert_eq!(cell(regions, "scene (ours)", "region F1 @ .5"), "0.667");
    assert_eq!(cell(regions, "scene (ours)", "distance error, %"), "4.0");

    let stages = find(&tables, "kitti2012: Table IV");
    assert_eq!(cell(stages, "scene (ours)", "coarse + stereo"), "2.00");
    assert_eq!(cell(stages, "scene (ours)", "depth + regions + track"), "3.00");
    assert_eq!(cell(stages, "scene (ours)", "p99"), "9.0");
    assert_eq!(cell(stages, "scene (ours)", "saved in total, %"), "75.0");
    assert_eq!(cell(stages, "my_own", "saved in matching, %"), "50.0");
    assert_eq!(cell(stages, "full-frame SGM", "saved in total, %"), "–");
    assert_eq!(cell(stages, "paper's own figure (simulated)", "saved in total, %"), "32.4");

    let ablation = find(&tables, "kitti2012: Table V");
    assert_eq!(cell(ablation, "c2: + colour", "F1"), "0.500");
    let check = find(&tables, "kitti2012: Fourth check");
    assert_eq!(cell(check, "scene (ours)", "depth continuity, %"), "90.0");
    assert_eq!(cell(check, "scene (ours)", "truth's own, %"), "95.0");

    // Each data set has its own tables.
    let other = find(&tables, "bag street: Table III-a");
    assert_eq!(cell(other, "paper's fusion", "F1"), "0.500");
    assert!(!tables.iter().any(|table| table.title.starts_with("bag street: Table V")));
}

#[test]
fn peers_are_compared_on_their_own_pairs() {
    let mut evaluation = evaluation();
    evaluation.parts.push(Part {
        frame: disparity(80, 5.0, 20),
        ..part("kitti2012", "000009", "full_frame", 4.0, 10)
    });
    let tables = evaluation::tables(&evaluation);
    let stereo = find(&tables, "kitti2012: Table III-b");
    assert_eq!(cell(stereo, "full-frame SGM", "EPE, px"), "3.00");
    assert_eq!(cell(stereo, "full-frame SGM on the peers' pairs", "EPE, px"), "1.00");
    let text = readme::section(&evaluation);
    assert!(
        text.contains("- full-frame SGM on the peers' pairs, better: matching on 2 threads is"),
        "{text}"
    );
}

#[test]
fn tables_say_how_they_were_measured() {
    let mut evaluation = evaluation();
    let notes = |evaluation: &Evaluation| {
        let tables = evaluation::tables(evaluation);
        find(&tables, "kitti2012: Table III-b").notes.join("\n")
    };
    let text = notes(&evaluation);
    for part in [
        "scene (ours) 2 scenes, 8 frames, 640 × 480 px (first scene), none skipped",
        "full-frame SGM 1 scene, 4 frames",
        "Run: seed 7; salient_stereo version 0.1.0; commit 0a1b2c3; machine 2 cores, 2 threads.",
        "Configuration: cfg1 (saliency.mode=x).",
        "OpenCV SGBM 5.0.0: 3 pairs (the same scenes), 1 thread",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    evaluation.parts[0].run.seed = 8;
    evaluation.parts[0].run.config = "other".into();
    evaluation.parts[0].run.changed.clear();
    evaluation.parts[1].skipped = BTreeMap::from([("broken".into(), 2)]);
    evaluation.parts.push(evaluation.parts[1].clone());
    let text = notes(&evaluation);
    for part in [
        "Merged from differing runs: seeds 7 / 8; salient_stereo version 0.1.0;",
        "scene (ours) differs among its scenes: cfg1 (saliency.mode=x), other (defaults)",
        "4 skipped (broken: 4)",
        "3 scenes, 12 frames",
        "of which only 2 are different",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn the_order_of_parts_does_not_matter() {
    let forth = evaluation();
    let mut back = evaluation();
    back.parts.reverse();
    assert_eq!(evaluation::tables(&forth), evaluation::tables(&back));
}

#[test]
fn nothing_measured_gives_no_table() {
    assert!(evaluation::tables(&Evaluation::default()).is_empty());
    let bare = Part { dataset: "d".into(), method: "scene".into(), ..Part::default() };
    let evaluation = Evaluation { parts: vec![bare], ..Evaluation::default() };
    assert!(evaluation::tables(&evaluation).is_empty());
    assert_eq!(evaluation::json(&evaluation)["results"][0]["method"], "scene");
}

#[test]
fn markdown_csv_and_json_hold_every_table() {
    let evaluation = evaluation();
    let tables = evaluation::tables(&evaluation);
    let (markdown, csv) = (evaluation::markdown(&evaluation), evaluation::csv(&evaluation));
    let json = evaluation::json(&evaluation);
    for table in &tables {
        assert!(markdown.contains(&format!("**{}**", table.title)));
        assert!(csv.contains(&format!("# {}\n", table.title)) && csv.contains(&table.csv()));
    }
    assert!(markdown.contains(&evaluation.command));
    assert_eq!(json["tables"].as_array().unwrap().len(), tables.len());
    assert_eq!(json["results"].as_array().unwrap().len(), 5);
    assert_eq!(json["results"][0]["scenes"][0], "a|b");
    let figures = &json["results"][2]["figures"];
    assert_eq!(figures["salient"]["f1"], 0.7);
    assert_eq!(figures["errors"][0]["from_px"], 8.0);
    assert_eq!(figures["errors"][0]["epe_px"], 0.25);
    assert_eq!(json["peers"].as_array().unwrap().len(), 3);
}

#[test]
fn peers_are_read_with_and_without_what_may_be_unknown() {
    let text = r#"{"peers": [{"dataset": "kitti2012", "scene": "000027", "method": "OpenCV SGBM",
        "version": "5.0.0", "matching_ms": 310.5, "known": 96000, "pixels": 79000, "known_with_occluded": 101000,
        "epe_px": 2.09, "d1": 0.072, "bad_2": 0.1, "density": 0.827, "filled_d1": 0.141}]}"#;
    let Peers { peers } = serde_json::from_str(text).unwrap();
    assert_eq!((peers[0].threads, peers[0].matching_ms), (0, 310.5));
    let alone = Evaluation { peers, ..Evaluation::default() };
    let tables = evaluation::tables(&alone);
    assert_eq!(tables.len(), 1, "a data set that only peers were measured on");
    assert_eq!(cell(&tables[0], "OpenCV SGBM 5.0.0", "density, %"), "82.7");
}

fn html(evaluation: &Evaluation) -> String {
    let mut out = Vec::new();
    report::write(evaluation, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

fn shot(role: &str, value: f64, file: &str) -> Shot {
    Shot { role: role.into(), frame: 3, measure: "EPE".into(), value, file: file.into() }
}

#[test]
fn the_report_is_one_whole_page_with_every_table() {
    let evaluation = evaluation();
    let page = html(&evaluation);
    assert!(page.starts_with("<!doctype html>") && page.trim_end().ends_with("</html>"));
    assert!(!page.contains("{{") && !page.contains("NaN") && !page.contains("<script"));
    for outside in ["http:", "https:", "src=\"/", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    for table in evaluation::tables(&evaluation) {
        let (_, title) = table.title.split_once(": ").unwrap();
        assert!(page.contains(&format!("<h2>{title}</h2>")), "{title}");
    }
    // Every entry of the contents leads somewhere.
    for target in page.split("href=\"#").skip(1) {
        let id = target.split('"').next().unwrap();
        assert_eq!(page.matches(&format!("id=\"{id}\"")).count(), 1, "{id}");
    }
    assert!(page.contains("evaluate kitti &lt;folder&gt;"));
    assert!(page.contains("−75 %"), "the bar says what is saved");
    assert!(page.contains("class=\"n best\">0.700"));
    assert!(!page.contains("class=\"n best\">0.930"), "quoted values are not marked");
    assert!(html(&Evaluation::default()).contains("Nothing was measured."));
}

#[test]
fn names_cannot_leave_their_place_on_the_page() {
    let evil = "</td><img src=x onerror=\"alert(1)\">'&{{words}}";
    let mut one = part(evil, evil, evil, 1.0, 50);
    one.run.machine = evil.into();
    one.run.changed = vec![evil.into()];
    one.skipped = BTreeMap::from([(evil.into(), 1)]);
    one.gallery = vec![Shot {
        role: evil.into(),
        measure: evil.into(),
        file: evil.into(),
        ..Shot::default()
    }];
    let other =
        Peer { dataset: evil.into(), method: evil.into(), version: evil.into(), ..peer(evil, 1.0) };
    let page = html(&Evaluation { command: evil.into(), parts: vec![one], peers: vec![other] });
    assert!(!page.contains("<img src=x"), "markup got through");
    assert!(
        page.contains(
            "&lt;/td&gt;&lt;img src=x onerror=&quot;alert(1)&quot;&gt;&#39;&amp;{{words}}"
        )
    );
}

#[test]
fn the_gallery_shows_the_best_and_the_worst_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let picture = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    };
    for name in ["good.jpg", "bad.jpg", "worse.jpg", "worst.jpg"] {
        picture(name, &[&[0xff, 0xd8, 0xff], name.as_bytes()].concat());
    }
    picture("text.jpg", b"no picture");
    picture("large.jpg", &[[0xff, 0xd8, 0xff].as_slice(), &vec![0; 5 << 20]].concat());
    let mut evaluation = evaluation();
    let shot = |role: &str, value: f64, name: &str| {
        shot(role, value, &folder.path().join(name).display().to_string())
    };
    evaluation.parts[0].gallery =
        vec![shot("best", 0.3, "good.jpg"), shot("worst", 5.0, "bad.jpg")];
    evaluation.parts[1].gallery = vec![
        shot("best", 0.2, "text.jpg"),
        shot("worst", 7.0, "worst.jpg"),
        shot("worst", 6.0, "worse.jpg"),
    ];
    evaluation.parts[2].gallery =
        vec![shot("best", 0.2, "gone.jpg"), shot("worst", 1.0, "large.jpg")];
    let page = html(&evaluation);
    assert_eq!(page.matches("data:image/jpeg;base64,").count(), 3, "good, worst, worse");
    let order: Vec<usize> =
        ["000001, frame 3 · EPE 0.200", "000002, frame 3 · EPE 0.300", "EPE 7.000", "EPE 6.000"]
            .iter()
            .map(|text| page.find(text).unwrap_or_else(|| panic!("{text}")))
            .collect();
    assert!(order.is_sorted(), "{order:?}");
    assert!(!page.contains("EPE 5.000"), "two of a kind are enough");
    for reason in ["text.jpg is no JPEG", "gone.jpg: ", "large.jpg is larger"] {
        assert!(page.contains(reason), "{reason}");
    }
}

#[test]
fn the_section_goes_between_its_markers() {
    let readme =
        "# A\n<!-- evaluation: begin (made by evaluate) -->\nold\n\n<!-- evaluation: end -->\nrest";
    let expected = "# A\n<!-- evaluation: begin (made by evaluate) -->\n\nnew\nlines\n\n<!-- evaluation: end -->\nrest";
    let spliced = readme::splice(readme, "new\nlines\n").unwrap();
    assert_eq!(spliced, expected);
    assert_eq!(
        readme::splice(&spliced, "new\nlines").unwrap(),
        expected,
        "twice is as good as once"
    );

    let begin = "<!-- evaluation: begin";
    let error = readme::splice("# A\n<!-- evaluation: end -->\n", "x").unwrap_err();
    assert_eq!(error, SpliceError::Count { marker: begin, count: 0 });
    assert!(
        error.to_string().contains("0 lines that begin with \"<!-- evaluation: begin\""),
        "{error}"
    );
    let twice = readme.repeat(2).replace("rest# A", "");
    assert_eq!(readme::splice(&twice, "x"), Err(SpliceError::Count { marker: begin, count: 2 }));
    let back = "<!-- evaluation: end -->\n<!-- evaluation: begin -->\n";
    assert_eq!(readme::splice(back, "x"), Err(SpliceError::Order { begin: 2, end: 1 }));
}

#[test]
fn the_section_says_what_is_won_and_what_is_lost() {
    let mut evaluation = evaluation();
    evaluation.parts.push(part("kitti2012", "000001", "paper", 2.0, 90));
    evaluation.parts.push(part("kitti2012", "000002", "full_frame", 4.0, 10));
    let text = readme::section(&evaluation);
    for part in [
        "## How good is it, really",
        "Measured by `salient_stereo evaluate kitti <folder>`.",
        "### kitti2012",
        "2 scenes, 8 frames, 640 × 480 px (first scene), none skipped. OpenCV SGBM 5.0.0: 3 pairs",
        "- scene (ours), better: a whole frame on 2 threads is 4.0x faster than full-frame SGM, 2.2x faster than the matching alone of OpenCV SGBM 5.0.0 on 1 thread; saved in total 75.0 % (the paper's simulation 32.4).",
        "- scene (ours), worse: F1 0.700 (paper's fusion 0.900, the paper's simulation 0.930); ",
        "- full-frame SGM, better: matching on 2 threads is 1.7x faster than OpenCV SGBM 5.0.0 on 1 thread; EPE 1.00 px (OpenCV SGBM 5.0.0 2.00); ",
        "- full-frame SGM, worse: density 80.0 % (OpenCV SGBM 5.0.0 83.0)",
        "### bag street",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    assert!(text.lines().count() < 50, "{}", text.lines().count());
}

#[test]
fn maps_videos_and_confidence_are_shown_as_they_were_measured() {
    let size = Size::new(40, 30);
    let mask = Image::from_fn(size, |x, y| if x < 20 && y < 15 { 255 } else { 0 });
    // Bright on the object, and as bright on a stripe beside it.
    let map = Image::from_fn(size, |x, y| if x < 24 && y < 15 { 200 } else { (x + y) as u8 });
    let mut one = part("kitti2012", "000001", "scene", 1.0, 80);
    assert!(one.map.add(&map, &mask) && one.stretched_map.add_stretched(&map, &mask));
    one.video.begin_video();
    for _ in 0..8 {
        one.video.add_frame(&Image::from_fn(size, |x, y| u8::from(x < 24 && y < 15)), &mask);
    }
    // The larger the error the less the confidence.
    let mut pixels: Vec<(f32, f32)> =
        (0..100_u8).map(|i| (f32::from(100 - i), f32::from(i))).collect();
    one.sparsification.add(&mut pixels);
    let (score, ause) = (one.map.total().unwrap(), one.sparsification.total().unwrap().ause);
    let evaluation = Evaluation { parts: vec![one], ..Evaluation::default() };
    let tables = evaluation::tables(&evaluation);
    let attention = find(&tables, "kitti2012: Table III-a");
    // 300 of the 360 bright pixels, all of the object: 1.3 P / (0.3 P + 1), β² = 0.3.
    assert_eq!(cell(attention, "scene (ours)", "max-F"), "0.867");
    assert_eq!(cell(attention, "scene (ours)", "S"), format!("{:.3}", score.s_measure));
    let check = find(&tables, "kitti2012: Fourth check");
    assert_eq!(cell(check, "scene (ours)", "J mean"), "0.833");
    let stereo = find(&tables, "kitti2012: Table III-b");
    assert_eq!(cell(stereo, "scene (ours)", "AUSE"), format!("{ause:.3}"));
    let page = html(&evaluation);
    for plot in ["Precision", "Recall", "End-point error", "Sparsification"] {
        assert!(page.contains(&format!("<b>{plot}</b>")), "{plot}");
    }
    let figures = &evaluation::json(&evaluation)["results"][0]["figures"];
    assert_eq!(figures["map"]["precision"].as_array().unwrap().len(), 256);
}
