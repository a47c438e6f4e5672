//! The HTML report: whole, self-contained, bounded, and safe against foreign text.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use salient_stereo::camera::{Camera, StereoRig};
use salient_stereo::config::Config;
use salient_stereo::image::{Image, Picture, Size};
use salient_stereo::input::{Observation, Tally, Truth};
use salient_stereo::output::Sink;
use salient_stereo::output::report::{ReportError, ReportSink, RunFacts};
use salient_stereo::output::score::ScoreSink;
use salient_stereo::perception::{Perception, Region, Stage, StereoFrame, TrackState};
use salient_stereo::stamp::Stamp;

/// A box of constant disparity on a plane: `[x, y, width, height]`, disparity, id.
type Thing = ([usize; 4], f32, u16);

fn inside([x, y, width, height]: [usize; 4], px: usize, py: usize) -> bool {
    (x..x + width).contains(&px) && (y..y + height).contains(&py)
}

/// A frame with two moving boxes and a perception that is right up to half a
/// pixel: what a pipeline would make of it.
fn scene(size: Size, index: u32, frame_id: &str) -> (Observation, Perception) {
    let Size { width, height } = size;
    let camera =
        |tx| Camera::pinhole(size, width as f64, width as f64 / 2.0, height as f64 / 3.0, tx);
    let rig = Arc::new(StereoRig::new(camera(0.0), camera(-0.4 * width as f64), 0.0).unwrap());
    let step = index as usize * width / 200;
    let things: [Thing; 2] = [
        ([width / 8 + step, height / 3, width / 8 + 1, height / 3 + 1], width as f32 / 20.0, 1),
        ([width * 5 / 8, height / 4, width / 12 + 1, height / 4 + 1], width as f32 / 40.0, 2),
    ];
    let thing = |x, y| things.into_iter().find(|(bounds, _, _)| inside(*bounds, x, y));
    let rgb = Image::from_fn(size, |x, y| {
        let noise = ((x * 7 + y * 13) ^ (x * y)) as u8 % 24;
        match thing(x, y) {
            Some((_, _, id)) => [200 - noise, 60 + 70 * (id as u8 - 1), 40 + noise],
            None if y < height / 3 => [150, 175, 205],
            None => [90 + noise, 92 + noise, 96 + noise],
        }
    });
    let true_disparity = Image::from_fn(size, |x, y| {
        thing(x, y).map_or((y as f32 - height as f32 / 3.0).max(0.5) / 6.0, |(_, d, _)| d)
    });
    let objects = Image::from_fn(size, |x, y| thing(x, y).map_or(0, |(_, _, id)| id));

    let mut out = Perception::new(size, Arc::clone(&rig));
    let stamp = Stamp(1_700_000_000_000_000_000 + i64::from(index) * 100_000_000);
    (out.stamp, out.right_stamp) = (stamp, stamp);
    out.frame_id = Arc::from(frame_id);
    out.left.gray = Image::from_fn(size, |x, y| rgb.get(x, y)[1]);
    out.left.rgb = rgb.clone();
    out.attention = Image::from_fn(size.divided_by(4), |x, y| {
        let (u, v) = ((4 * x + 2).min(width - 1), (4 * y + 2).min(height - 1));
        if objects.get(u, v) != 0 { 0.9 } else { 0.2 }
    });
    out.roi.salient = Image::from_fn(size, |x, y| if objects.get(x, y) != 0 { 255 } else { 0 });
    out.roi.matched = Image::from_fn(size, |x, y| {
        let near = things.iter().any(|([bx, by, w, h], _, _)| {
            inside([bx.saturating_sub(7), by.saturating_sub(7), w + 14, h + 14], x, y)
        });
        if near { 255 } else { 0 }
    });
    let matched = out.roi.matched.pixels().iter().filter(|m| **m != 0).count();
    out.roi.fraction = matched as f32 / size.area() as f32;
    out.disparity = Image::from_fn(size, |x, y| {
        let hole = (x + y) % 11 == 0 || out.roi.matched.get(x, y) == 0;
        if hole { f32::NAN } else { true_disparity.get(x, y) + 0.5 }
    });
    let scale = rig.depth_scale() as f32;
    out.depth = Image::from_fn(size, |x, y| {
        let z = scale / out.disparity.get(x, y);
        if z > 80.0 { f32::INFINITY } else { z }
    });
    out.labels = objects.clone();
    out.max_disparity = 64.0;
    out.rejections.small_area = 2;
    for (i, ([x, y, w, h], disparity, id)) in things.into_iter().enumerate() {
        let (right, bottom) = ((x + w).min(width), (y + h).min(height));
        if x >= right || y >= bottom {
            continue;
        }
        let depth = scale / (disparity + 0.5);
        let edge = |x: usize, y: usize| [x as f32, y as f32];
        *out.regions.push_empty() = Region {
            label: id,
            track_id: 7 + i as u32,
            track_state: if index == 0 { TrackState::New } else { TrackState::Active },
            x: x as u32,
            y: y as u32,
            width: (right - x) as u32,
            height: (bottom - y) as u32,
            contour: vec![
                edge(x, y),
                edge(right - 1, y),
                edge(right - 1, bottom - 1),
                edge(x, bottom - 1),
            ],
            mask: vec![255; (right - x) * (bottom - y)],
            area: ((right - x) * (bottom - y)) as u32,
            mean_saliency: 0.9,
            median_depth: depth,
            depth_stddev: depth * 0.02,
            near_depth: depth * 0.97,
            far_depth: depth * 1.05,
            confidence: 0.8 + 0.05 * i as f32,
            extent: [1.8, 1.5, f64::NAN],
            velocity: [f64::NAN; 3],
            ..Region::default()
        };
    }
    for stage in Stage::ALL {
        let base = 1.0 + stage as usize as f64;
        out.times.set(stage, base + f64::from(index * 7 % 5) * 0.2);
    }

    let frame = StereoFrame {
        stamp,
        right_stamp: stamp,
        frame_id: Arc::from(frame_id),
        left: Picture::Rgb(rgb.clone()),
        right: Picture::Rgb(rgb),
        rig,
    };
    let truth =
        Truth { disparity: Some(true_disparity), objects: Some(objects), ..Truth::default() };
    (Observation { frame, truth: Some(truth) }, out)
}

fn facts(source: &str, config: Config) -> RunFacts {
    RunFacts { command: "replay".into(), source: source.into(), config }
}

fn report(path: &Path, frames: impl Iterator<Item = (Observation, Perception)>) -> String {
    let mut sink = ReportSink::create(path, facts("bags/street.mcap", Config::default())).unwrap();
    for (observation, perception) in frames {
        sink.write(&observation, &perception).unwrap();
    }
    sink.note_tally(&Tally { pairs: 3, unpaired_left: 1, ..Tally::default() });
    sink.finish().unwrap();
    fs::read_to_string(path).unwrap()
}

fn data(page: &str) -> Vec<serde_json::Value> {
    let parts = page.split("<script type=\"application/json\" class=\"frame\">").skip(1);
    parts
        .map(|part| serde_json::from_str(part.split("</script>").next().unwrap()).unwrap())
        .collect()
}

fn decode(uri: &serde_json::Value) -> image::DynamicImage {
    use base64::Engine as _;
    let (_, coded) = uri.as_str().unwrap().split_once(";base64,").unwrap();
    let bytes = base64::engine::general_purpose::STANDARD.decode(coded).unwrap();
    image::load_from_memory(&bytes).unwrap()
}

#[test]
fn a_report_is_one_whole_page_without_outside_resources() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new/folder/run.html");
    let size = Size::new(160, 60);
    let page = report(&path, (0..3).map(|i| scene(size, i, "left_camera")));
    assert!(page.starts_with("<!doctype html>") && page.trim_end().ends_with("</html>"));
    assert!(!page.contains("{{") && !page.contains("NaN") && !page.contains("inf\""));
    for outside in ["http://", "https://", "src=\"/", "@import", "url("] {
        let page = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!page.contains(outside), "{outside}");
    }
    for text in ["street.mcap", "2023-11-14 22:13:20 UTC", "160 × 60 px", "10.0 Hz"] {
        assert!(page.contains(text), "{text}");
    }
    // Scores are there, and the loss is said.
    assert!(page.contains("Against the truth") && page.contains("0.50 px"));
    assert!(page.contains("1 unpaired image"));

    let frames = data(&page);
    assert_eq!(frames.len(), 3);
    assert_eq!(frames[2]["regions"][0]["name"], "#7");
    assert_eq!(frames[0]["regions"][1]["state"], "new");
    assert!(frames[0]["regions"][0]["speed"].is_null());
    for layer in ["roi", "disparity", "depth"] {
        let picture = decode(&frames[1]["layers"][layer]);
        assert_eq!((picture.width(), picture.height()), (160, 60), "{layer}");
    }
    assert_eq!(decode(&frames[1]["left"]).width(), 160);
}

#[test]
fn foreign_text_cannot_leave_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let evil = "</script><img src=x onerror=\"alert(1)\">'&{{script}}";
    let config = Config::default()
        .with("camera_info.left_url", &serde_json::json!(format!("file://{evil}")))
        .unwrap();
    let path = folder.path().join("evil.html");
    let mut sink = ReportSink::create(&path, facts(&format!("/bags/{evil}"), config)).unwrap();
    let (observation, mut perception) = scene(Size::new(40, 30), 0, evil);
    perception.frame_id = Arc::from(evil);
    sink.write(&observation, &perception).unwrap();
    let mut tally = Tally::default();
    tally.skip(format!("topic {evil} has the wrong type"));
    sink.note_tally(&tally);
    sink.add_counter(evil, 1);
    sink.finish().unwrap();
    let page = fs::read_to_string(&path).unwrap();
    assert!(!page.contains("<img src=x"), "markup got through");
    assert!(
        page.contains("&lt;/script&gt;&lt;img src=x onerror=&quot;alert(1)&quot;&gt;&#39;&amp;")
    );
    let opened = page.matches("<script").count();
    assert_eq!(opened, page.matches("</script>").count());
    assert_eq!(opened, 3, "run, one frame, viewer");
}

#[test]
fn a_run_without_frames_still_gives_a_page_that_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let page = report(&folder.path().join("empty.html"), std::iter::empty());
    assert!(page.contains("No stereo pair reached the pipeline"));
    assert!(page.contains("</html>") && !page.contains("NaN"));
    assert!(data(&page).is_empty());
}

#[test]
fn frames_without_regions_disparity_or_truth_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let bare = |size: Size, index| {
        let (mut observation, mut perception) = scene(size, index, "left");
        observation.truth = None;
        perception.regions.clear();
        perception.disparity.fill(f32::NAN);
        perception.depth.fill(f32::NAN);
        perception.roi.matched.fill(0);
        perception.roi.fraction = 0.0;
        (observation, perception)
    };
    // Odd sizes, and one that changes in the middle of the run.
    let sizes = [Size::new(1, 1), Size::new(3, 7), Size::new(97, 31), Size::new(1501, 3)];
    let frames = sizes.into_iter().enumerate().map(|(i, size)| bare(size, i as u32));
    let page = report(&folder.path().join("bare.html"), frames);
    assert!(!page.contains("Against the truth") && !page.contains("NaN"));
    let frames = data(&page);
    assert_eq!(frames.len(), 4);
    assert!(frames.iter().all(|f| f["regions"].as_array().unwrap().is_empty()));
    // Wide pictures are made smaller; coordinates stay those of the view.
    assert_eq!(frames[3]["width"], 1501);
    assert_eq!(decode(&frames[3]["left"]).width(), 751);
}

#[test]
fn a_long_run_is_thinned_out_evenly_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let size = Size::new(32, 24);
    let page =
        report(&folder.path().join("long.html"), (0..250).map(|i| scene(size, i % 9, "left")));
    let frames = data(&page);
    let shown: Vec<u64> = frames.iter().map(|f| f["index"].as_u64().unwrap()).collect();
    assert_eq!(shown, (0..250).step_by(8).collect::<Vec<u64>>());
    assert!(page.contains("shows 32 of 250 frames"), "the page says which are shown");
    assert!(page.contains("250 frames"));
}

#[test]
fn pictures_that_weigh_too_much_are_thinned_out_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("heavy.html");
    let budget = 200_000;
    let mut sink = ReportSink::create(&path, facts("heavy", Config::default()))
        .unwrap()
        .with_picture_budget(budget);
    for index in 0..32 {
        let (observation, mut perception) = scene(Size::new(160, 120), 0, "left");
        let mut state = 1 + index * 2_654_435;
        for pixel in perception.left.rgb.pixels_mut() {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            *pixel = [state as u8, (state >> 8) as u8, (state >> 16) as u8];
        }
        sink.write(&observation, &perception).unwrap();
    }
    sink.finish().unwrap();
    let page = fs::read_to_string(&path).unwrap();
    let frames = data(&page).len();
    assert!((2..16).contains(&frames), "{frames}");
    // The page without its frames weighs less than 150 kB.
    assert!(page.len() < budget * 4 / 3 + 150_000, "{}", page.len());
}

#[test]
fn a_place_that_cannot_be_written_to_is_known_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let error = ReportSink::create(folder.path(), facts("x", Config::default())).unwrap_err();
    assert!(matches!(error, ReportError::Create { .. }));
    assert!(error.to_string().contains(folder.path().to_str().unwrap()), "{error}");
}

#[test]
fn scores_of_a_run_that_is_right_up_to_half_a_pixel() {
    let mut sink = ScoreSink::new(1);
    for index in 0..4 {
        let (observation, perception) = scene(Size::new(160, 60), index, "left");
        sink.write(&observation, &perception).unwrap();
    }
    let summary = sink.summary().unwrap();
    assert_eq!((summary.frames, summary.scored_frames), (4, 4));
    let disparity = summary.disparity_in_roi.unwrap();
    assert!((disparity.epe_px - 0.5).abs() < 1e-6, "{disparity:?}");
    assert!(disparity.density > 0.8 && disparity.density < 1.0);
    for rows in [&summary.regions_by_mask, &summary.regions_by_box] {
        assert_eq!(rows.len(), 3);
        assert!(rows.iter().all(|row| row.f1 == 1.0 && row.false_positives == 0));
    }
    assert_eq!(summary.pixels.unwrap().accuracy, 1.0);
    assert_eq!(summary.id_switches, Some(0));
    assert_eq!(summary.roi.unwrap().objects_95, Some(1.0));
    // Z = fB/(d + 0.5) instead of fB/d, for d = 8 and 4.
    let expected = f64::midpoint(0.5 / 8.5, 0.5 / 4.5);
    assert!((summary.distance.unwrap().mean_relative_error - expected).abs() < 1e-6);
    let json = serde_json::to_value(&summary).unwrap();
    assert_eq!(json["regions_by_mask"][1]["iou"], 0.5);
}

#[test]
fn truth_of_a_larger_picture_is_laid_over_smaller_views() {
    // What preprocess.scale 2 gives: views of half the size, truth of the whole.
    let (mut observation, perception) = scene(Size::new(80, 30), 0, "left");
    let truth = observation.truth.take().unwrap();
    let (small, ids) = (truth.disparity.unwrap(), truth.objects.unwrap());
    let large = Size::new(161, 61);
    let at = |v: usize, most: usize| (v / 2).min(most);
    observation.truth = Some(Truth {
        disparity: Some(Image::from_fn(large, |x, y| small.get(at(x, 79), at(y, 29)) * 2.0)),
        objects: Some(Image::from_fn(large, |x, y| ids.get(at(x, 79), at(y, 29)))),
        ..Truth::default()
    });
    let mut sink = ScoreSink::new(1);
    let score = sink.score(&observation, &perception).unwrap();
    assert!((score.disparity.unwrap().epe_px - 0.5).abs() < 1e-6);
    assert_eq!(score.pixels.unwrap().f1, Some(1.0));

    // Truth of quite another size is counted and not scored.
    observation.truth =
        Some(Truth { disparity: Some(Image::new(Size::new(50, 50))), ..Truth::default() });
    assert_eq!(sink.score(&observation, &perception), None);
    assert_eq!(sink.summary().unwrap().unscorable_frames, 1);
}

#[test]
fn a_coasted_region_is_scored_by_its_own_mask() {
    // Not seen in this frame: no pixel in the label image, but a predicted mask.
    let (observation, mut perception) = scene(Size::new(160, 60), 0, "left");
    perception.labels.fill(0);
    perception.regions[0].track_state = TrackState::Coasted;
    perception.regions[1].mask.fill(0);
    // A mask that reaches out of the image, or is shorter than its box, is clipped.
    *perception.regions.push_empty() =
        Region { x: 150, y: 55, width: 40, height: 30, mask: vec![255; 900], ..Region::default() };
    *perception.regions.push_empty() = Region { x: 900, y: 900, ..Region::default() };
    let mut sink = ScoreSink::new(1);
    let score = sink.score(&observation, &perception).unwrap();
    assert_eq!(score.matched, [(0, 1)]);
    let regions = score.regions.unwrap();
    assert_eq!((regions.true_positives, regions.false_positives), (1, 3));
    assert_eq!(score.pixels.unwrap().recall, Some(0.0));
}

#[test]
fn nothing_to_score_is_no_summary() {
    let mut sink = ScoreSink::new(1);
    let (mut observation, perception) = scene(Size::new(20, 10), 0, "left");
    observation.truth = None;
    sink.write(&observation, &perception).unwrap();
    assert!(sink.summary().is_none());
    observation.truth = Some(Truth::default());
    assert!(sink.score(&observation, &perception).is_none());
}
