//! Stage times: a table of percentiles and a plot over the frames.

use crate::metric::{Percentiles, StageStats};
use crate::output::html::plot::Plot;
use crate::output::html::text::{count, ms, percent};
use crate::perception::Stage;

/// Most columns of the plot.
const COLUMNS: usize = 400;

/// The section about stage times; empty when nothing was measured.
pub fn html(stats: &StageStats) -> String {
    let Some(summary) = stats.summary().filter(|summary| summary.total_ms.p99 > 0.0) else {
        return String::new();
    };
    let cells = |p: Percentiles| {
        [p.p50, p.p95, p.p99].map(|v| format!("<td class=\"n\">{}</td>", ms(v))).concat()
    };
    let sum: f64 = summary.stages.iter().map(|p| p.p50).sum();
    let mut rows = String::new();
    for stage in Stage::ALL {
        let times = summary.get(stage);
        let share = if sum > 0.0 { times.p50 / sum } else { 0.0 };
        let color = format!("var(--s{})", stage as usize);
        rows += &format!(
            "<tr><td><span class=\"swatch\" style=\"--c:{color}\"></span>{}</td>{}<td class=\"opt\"><span class=\"meter\" style=\"--v:{share:.3};--c:{color}\"></span>{}</td></tr>",
            stage.name(),
            cells(times),
            percent(share)
        );
    }
    rows += &format!(
        "<tr class=\"sum\"><td>matching</td>{}<td class=\"opt\"></td></tr><tr class=\"sum\"><td>total</td>{}<td class=\"opt\"></td></tr>",
        cells(summary.matching_ms),
        cells(summary.total_ms)
    );
    let (plot, per_column) = plot(stats, summary.total_ms);
    let columns = if per_column > 1 {
        format!("each column is the slowest of {}", count(per_column as u64, "frame"))
    } else {
        "every frame".to_owned()
    };
    format!(
        "<section><h2>Stage times</h2><p class=\"sub\">Milliseconds over {}, percentiles by nearest rank. Matching is coarse + stereo + refine.</p><div class=\"split uneven\"><div class=\"list\"><table><thead><tr><th>stage</th><th class=\"n\">p50</th><th class=\"n\">p95</th><th class=\"n\">p99</th><th class=\"opt\">share of the medians</th></tr></thead><tbody>{rows}</tbody></table></div><div><div class=\"plothead\"><b>Time per frame</b><span>{columns}; the dashed line is the median</span></div>{plot}</div></div></section>",
        count(summary.frames, "frame")
    )
}

fn plot(stats: &StageStats, total: Percentiles) -> (String, usize) {
    let samples = stats.samples();
    let per_column = samples.len().div_ceil(COLUMNS).max(1);
    let columns: Vec<(f64, _)> = samples
        .chunks(per_column)
        .enumerate()
        .filter_map(|(i, chunk)| {
            let slowest = chunk.iter().max_by(|a, b| a.total().total_cmp(&b.total()))?;
            Some(((i * per_column) as f64 * stats.stride() as f64, *slowest))
        })
        .collect();
    // One slow start must not flatten everything else.
    let highest = columns.iter().map(|(_, times)| times.total()).fold(0.0, f64::max);
    let top = highest.min(total.p95 * 2.5);
    let mut plot = Plot::over_frames(stats.frames(), top, " ms").with_class("high");
    let x: Vec<f64> = columns.iter().map(|(x, _)| *x).collect();
    let mut low = vec![0.0; columns.len()];
    for stage in Stage::ALL {
        let high: Vec<f64> =
            low.iter().zip(&columns).map(|(low, (_, times))| low + times.get(stage)).collect();
        plot.area(&x, &low, &high, &format!("var(--s{})", stage as usize));
        low = high;
    }
    plot.reference(total.p50);
    (plot.html(), per_column * usize::try_from(stats.stride()).unwrap_or(usize::MAX))
}
