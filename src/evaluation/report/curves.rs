//! Curves of the methods over each other.

use super::color;
use crate::evaluation::group::{FULL_FRAME, Group, Merged, OURS};
use crate::metric::{PROFILE_STEP, SPARSIFICATION_STEPS};
use crate::output::html::plot::{Axis, Plot};
use crate::output::html::text::escape;

/// The methods whose sparsification is shown: two lines each are as many as
/// can be told apart.
const SPARSIFIED: [&str; 3] = [FULL_FRAME, "paper", OURS];

type Points = Vec<(f64, f64)>;

/// All plots of a data set; empty when there is no curve.
pub fn html(group: &Group) -> String {
    let plots = [
        precision_recall(group),
        recall_by_area(group),
        error_by_disparity(group),
        sparsification(group),
    ];
    let plots = plots.concat();
    if plots.is_empty() { plots } else { format!("<div class=\"split\">{plots}</div>") }
}

fn lines(group: &Group, points: impl Fn(&Merged) -> Option<Points>) -> Vec<(&Merged, Points)> {
    let lines = group.compared().into_iter().map(|merged| (merged, points(merged)));
    lines.filter_map(|(merged, points)| Some((merged, points.filter(|p| !p.is_empty())?))).collect()
}

fn titled(
    title: &str,
    note: &str,
    group: &Group,
    lines: &[(&Merged, Points)],
    plot: &Plot,
) -> String {
    let keys: String = lines
        .iter()
        .map(|(merged, _)| {
            let color = color(group, merged);
            format!("<span class=\"key\" style=\"--c:{color}\">{}</span>", escape(merged.label()))
        })
        .collect();
    format!(
        "<div><div class=\"plothead\"><b>{title}</b><span>{note}</span></div>{}<p class=\"chips\">{keys}</p></div>",
        plot.html()
    )
}

/// A plot in the unit square.
fn unit_plot(title: &str, note: &str, group: &Group, lines: &[(&Merged, Points)]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let mut plot = Plot::new(Axis::exactly(1.0, ""), Axis::exactly(1.0, ""));
    for (merged, points) in lines {
        plot.curve(points, &color(group, merged));
    }
    titled(title, note, group, lines, &plot)
}

fn precision_recall(group: &Group) -> String {
    let lines = lines(group, |merged| {
        let map = merged.figures.map.as_ref()?;
        // From the highest threshold to the lowest: recall grows.
        let points = map.recall.iter().copied().zip(map.precision.iter().copied()).rev();
        Some(points.collect())
    });
    unit_plot("Precision", "over recall of the attention map, by threshold", group, &lines)
}

fn recall_by_area(group: &Group) -> String {
    let lines = lines(group, |merged| {
        let map = merged.figures.map.as_ref()?;
        Some(map.area.iter().copied().zip(map.recall.iter().copied()).rev().collect())
    });
    unit_plot("Recall", "over the share of the image at or above the threshold", group, &lines)
}

fn error_by_disparity(group: &Group) -> String {
    let step = f64::from(PROFILE_STEP);
    let lines = lines(group, |merged| {
        let bins = merged.figures.errors.iter();
        Some(bins.map(|bin| (bin.from_px + step / 2.0, bin.score.epe_px)).collect())
    });
    let all = || lines.iter().flat_map(|(_, points)| points);
    let farthest = all().map(|point| point.0 + step / 2.0).fold(0.0, f64::max);
    let highest = all().map(|point| point.1).fold(0.0, f64::max);
    if lines.is_empty() {
        return String::new();
    }
    let mut plot = Plot::new(Axis::exactly(farthest, " px"), Axis::up_to(highest, " px"));
    for (merged, points) in &lines {
        plot.line(points, step * 1.5, &color(group, merged));
    }
    titled(
        "End-point error",
        "over true disparity, in the region of interest, in steps of 8 px",
        group,
        &lines,
        &plot,
    )
}

fn sparsification(group: &Group) -> String {
    let spread = |values: &[f64]| -> Points {
        let removed = |i: usize| i as f64 / SPARSIFICATION_STEPS as f64;
        values.iter().enumerate().map(|(i, value)| (removed(i), *value)).collect()
    };
    let lines = lines(group, |merged| {
        let shown = SPARSIFIED.contains(&merged.method.as_str());
        shown.then_some(spread(&merged.figures.sparsification.as_ref()?.by_confidence))
    });
    let highest =
        lines.iter().flat_map(|(_, points)| points).map(|point| point.1).fold(1.0, f64::max);
    if lines.is_empty() {
        return String::new();
    }
    let mut plot = Plot::new(Axis::exactly(1.0, ""), Axis::up_to(highest, ""));
    for (merged, points) in &lines {
        plot.curve(points, &color(group, merged));
        if let Some(score) = &merged.figures.sparsification {
            plot.dashed_curve(&spread(&score.by_error), &color(group, merged));
        }
    }
    titled(
        "Sparsification",
        "remaining error over the share of pixels removed, least confident first; dashed: worst first",
        group,
        &lines,
        &plot,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::figures::Bin;
    use crate::evaluation::{Evaluation, Part};
    use crate::metric::{DisparityScore, MapScore, SparsificationScore};

    fn bin(from_px: f64, epe_px: f64) -> Bin {
        let score = DisparityScore {
            epe_px,
            d1: 0.0,
            bad_1: 0.0,
            bad_2: 0.0,
            bad_3: 0.0,
            bad_4: 0.0,
            density: 1.0,
            pixels: 1,
        };
        Bin { from_px, score }
    }

    /// Two methods that are compared and a step of the ablation.
    fn group() -> Group {
        let part = |method: &str| Part { method: method.into(), ..Part::default() };
        let parts = vec![part("scene"), part("my <own>"), part("c1")];
        let mut group = Group::all(&Evaluation { parts, ..Evaluation::default() }).remove(0);
        for merged in &mut group.methods {
            let falling: Vec<f64> = (0..256).map(|i| 1.0 - f64::from(i) / 255.0).collect();
            merged.figures.map = Some(MapScore {
                images: 1,
                max_f: 0.5,
                mean_f: 0.5,
                adaptive_f: 0.5,
                weighted_f: 0.5,
                s_measure: 0.5,
                max_e: 0.5,
                mean_e: 0.5,
                adaptive_e: 0.5,
                mae: 0.5,
                precision: vec![0.5; 256],
                recall: falling.clone(),
                area: falling,
                roi_90: 0.9,
                roi_95: 0.95,
            });
            merged.figures.errors = vec![bin(0.0, 0.5), bin(8.0, 1.0), bin(64.0, 12.0)];
            merged.figures.sparsification = Some(SparsificationScore {
                by_confidence: vec![1.0; SPARSIFICATION_STEPS],
                by_error: vec![0.5; SPARSIFICATION_STEPS],
                ause: 0.5,
            });
        }
        group
    }

    #[test]
    fn every_compared_method_has_its_curves() {
        let html = html(&group());
        for title in ["Precision", "Recall", "End-point error", "Sparsification"] {
            assert_eq!(html.matches(&format!("<b>{title}</b>")).count(), 1, "{title}");
        }
        // Ours in four plots, the other one in all but the sparsification.
        assert_eq!(html.matches("scene (ours)").count(), 4);
        assert_eq!(html.matches("my &lt;own&gt;").count(), 3);
        assert!(!html.contains("c1:") && !html.contains("NaN"));
        assert_eq!(html.matches("line dashed").count(), 1);
        // From the lower left, and a gap where bins are empty: the rest is a dot.
        assert!(recall_by_area(&group()).contains("d=\"M0.0 1000.0L"));
        assert_eq!(error_by_disparity(&group()).matches("class=\"dots\"").count(), 2);
    }

    #[test]
    fn without_curves_there_is_no_plot() {
        let group = Group {
            dataset: String::new(),
            methods: Vec::new(),
            peers: Vec::new(),
            same_pairs: None,
        };
        assert_eq!(html(&group), "");
    }
}
