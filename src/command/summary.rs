//! Scores and times as text for people.

use std::fmt::Write as _;

use crate::metric::{Percentiles, StageSummary};
use crate::output::score::ScoreSummary;
use crate::perception::Stage;

/// Milliseconds per stage as a table.
pub fn times(summary: &StageSummary) -> String {
    let row = |name: &str, p: Percentiles| {
        format!("{name:<12} {:>9.3} {:>9.3} {:>9.3}\n", p.p50, p.p95, p.p99)
    };
    let mut text = format!("{:<12} {:>9} {:>9} {:>9}\n", "ms", "p50", "p95", "p99");
    for stage in Stage::ALL {
        text += &row(stage.name(), summary.get(stage));
    }
    text += &row("matching", summary.matching_ms);
    text += &row("total", summary.total_ms);
    text
}

/// How the run compares with the truth of its source; empty without truth.
pub fn scores(summary: &ScoreSummary) -> String {
    let mut text = String::new();
    if summary.scored_frames == 0 {
        return text;
    }
    let _ = writeln!(text, "against the truth of {} frames:", summary.scored_frames);
    let percent = |value: Option<f64>| {
        value.map_or_else(|| "    -".to_owned(), |v| format!("{:5.1} %", 100.0 * v))
    };
    if let Some(p) = &summary.pixels {
        let _ = writeln!(
            text,
            "  region pixels   precision {}  recall {}  F1 {}",
            percent(p.precision),
            percent(p.recall),
            percent(p.f1)
        );
    }
    for row in &summary.regions_by_mask {
        let _ = writeln!(
            text,
            "  regions IoU {:.2} precision {}  recall {}  F1 {}",
            row.iou,
            percent(row.precision),
            percent(row.recall),
            percent(Some(row.f1))
        );
    }
    if let Some(d) = &summary.disparity_in_roi {
        let _ = writeln!(
            text,
            "  disparity       EPE {:.2} px  D1 {:.1} %  valid {:.1} % of what was asked for",
            d.epe_px,
            100.0 * d.d1,
            100.0 * d.density
        );
    }
    if let Some(d) = &summary.distance {
        let _ = writeln!(
            text,
            "  distance        mean error {:.2} m ({:.1} %) over {} regions",
            d.mean_error_m,
            100.0 * d.mean_relative_error,
            d.regions
        );
    }
    if let Some(switches) = summary.id_switches {
        let _ = writeln!(text, "  identity        {switches} switches");
    }
    text
}
