//! The page: the template with the run's figures in it.

use std::collections::BTreeMap;
use std::io::{self, Write};

use serde_json::Value;

use super::{ReportSink, frames, scores, timing};
use crate::config::{Config, SaliencyMode};
use crate::output::html::page::{self, Page};
use crate::output::html::plot::Plot;
use crate::output::html::template;
use crate::output::html::text::{count, escape, hex, metres, ms, or_dash, percent, utc};
use crate::output::picture::track_color;
use crate::perception::Rejections;

const BODY: &str = include_str!("page.html");
const VIEWER: &str = include_str!("viewer.html");
const STYLE: &str = include_str!("viewer.css");
const SCRIPT: &str = include_str!("viewer.js");

/// Writes the whole page.
pub fn write<W: Write>(report: &ReportSink, out: &mut W) -> io::Result<()> {
    let page = Page {
        title: title(&report.facts.source),
        kicker: &report.facts.command,
        style: STYLE,
        scripts: true,
    };
    page::write(&page, out, |out| {
        template::write(BODY, out, |slot, out| match slot {
            "frames" => frames::write(report, out),
            _ => out.write_all(fill(report, slot).as_bytes()),
        })
    })
}

fn fill(report: &ReportSink, name: &str) -> String {
    match name {
        "script" => SCRIPT.to_owned(),
        "facts" => facts(report),
        "notice" => notice(report),
        "kpis" => kpis(report),
        "viewer" if report.totals.frames > 0 => VIEWER.to_owned(),
        "truth" => scores::html(report),
        "tracks" => tracks(report),
        "times" => timing::html(&report.stats),
        "counters" => counters(report),
        "settings" => settings(&report.facts.config),
        "sampling" => sampling(report),
        _ => String::new(),
    }
}

/// The last part of a path.
fn title(source: &str) -> &str {
    let trimmed = source.trim_end_matches(['/', '\\']);
    trimmed.rsplit(['/', '\\']).find(|part| !part.is_empty()).unwrap_or("run")
}

fn facts(report: &ReportSink) -> String {
    let totals = &report.totals;
    let mut facts = Vec::new();
    if let Some(size) = totals.size {
        facts.push(format!("{} × {} px", size.width, size.height));
    }
    facts.push(count(totals.frames, "frame"));
    let seconds = totals.last.seconds_since(totals.first);
    if seconds > 0.0 && totals.frames > 1 {
        facts.push(format!("{seconds:.1} s"));
        facts.push(format!("{:.1} Hz", (totals.frames - 1) as f64 / seconds));
    }
    if totals.frames > 0 {
        facts.extend(utc(totals.first));
        facts.push(format!("frame id {}", escape(&totals.frame_id)));
    }
    let mode = match report.facts.config.saliency.mode {
        SaliencyMode::Scene => "scene",
        SaliencyMode::Paper => "paper",
        SaliencyMode::FrequencyTuned => "frequency-tuned",
        SaliencyMode::SpectralResidual => "spectral residual",
        SaliencyMode::FullFrame => "full frame",
    };
    facts.push(format!("saliency mode {mode}"));
    let source = escape(&report.facts.source);
    if source != escape(title(&report.facts.source)) {
        facts.push(format!("<code>{source}</code>"));
    }
    facts.join(" · ")
}

fn notice(report: &ReportSink) -> String {
    if report.totals.frames == 0 {
        return "<p class=\"notice\">No stereo pair reached the pipeline in this run. The counters below say what was met instead.</p>".to_owned();
    }
    match &report.tally {
        Some(tally) if tally.has_losses() => {
            let unpaired = tally.unpaired_left + tally.unpaired_right;
            let skipped: u64 = tally.skipped.values().sum();
            let parts: Vec<String> = [(unpaired, "unpaired image"), (skipped, "skipped input")]
                .into_iter()
                .filter(|(number, _)| *number > 0)
                .map(|(number, noun)| count(number, noun))
                .collect();
            format!(
                "<p class=\"notice\">Not everything was used: {}. See <a href=\"#counters\">the counters</a>.</p>",
                parts.join(" and ")
            )
        }
        _ => String::new(),
    }
}

fn kpi(value: &str, unit: &str, what: &str) -> String {
    format!("<div class=\"kpi\"><b>{value} <small>{unit}</small></b><span>{what}</span></div>")
}

fn kpis(report: &ReportSink) -> String {
    let totals = &report.totals;
    let frames = totals.frames as f64;
    let mut out = String::new();
    if totals.frames == 0 {
        return out;
    }
    if let Some(times) = report.stats.summary().filter(|times| times.total_ms.p50 > 0.0) {
        out += &kpi(
            &ms(times.total_ms.p50),
            "ms",
            &format!("median per frame · {:.0} Hz", 1000.0 / times.total_ms.p50),
        );
    }
    out += &kpi(&format!("{:.1}", totals.regions as f64 / frames), "", "regions per frame");
    out += &kpi(&percent(totals.roi_fraction / frames), "", "of the image is matched");
    if let Some(summary) = report.scores.summary() {
        if let Some(row) = summary.main_regions() {
            let [p, r] = [row.precision, row.recall].map(|v| or_dash(v, |v| format!("{v:.2}")));
            out += &kpi(&format!("{:.2}", row.f1), "F1", &format!("regions · P {p} R {r}"));
        }
        if let Some(row) = &summary.disparity_in_roi {
            out += &kpi(
                &format!("{:.2}", row.epe_px),
                "px",
                &format!("disparity error · D1 {}", percent(row.d1)),
            );
        }
        if let Some(row) = &summary.distance {
            out += &kpi(
                &percent(row.mean_relative_error),
                "",
                &format!("distance error · {}", metres(row.mean_error_m)),
            );
        }
    }
    out
}

/// The tracks that are labelled in the plot of distances.
const LABELLED_TRACKS: usize = 14;

fn tracks(report: &ReportSink) -> String {
    let mut lines: BTreeMap<u32, Vec<(f64, f64)>> = BTreeMap::new();
    for row in report.rows.items() {
        for (id, distance) in row.distances.iter().filter(|(id, _)| *id != 0) {
            lines.entry(*id).or_default().push((row.index as f64, f64::from(*distance)));
        }
    }
    if lines.is_empty() || report.totals.frames < 2 {
        return String::new();
    }
    let farthest = lines.values().flatten().map(|point| point.1).fold(0.0, f64::max);
    let mut plot = Plot::over_frames(report.totals.frames, farthest, " m").with_class("tracks");
    let gap = report.rows.stride() as f64 * 3.5;
    for (id, points) in &lines {
        plot.line(points, gap, &hex(track_color(*id)));
    }
    let mut longest: Vec<_> = lines.iter().filter(|(_, points)| points.len() > 2).collect();
    longest.sort_by_key(|(id, points)| (std::cmp::Reverse(points.len()), **id));
    for (id, points) in longest.into_iter().take(LABELLED_TRACKS) {
        if let Some((x, y)) = points.last() {
            plot.label(*x, *y, &format!("#{id}"), &hex(track_color(*id)));
        }
    }
    format!(
        "<section><h2>Distance over time</h2><p class=\"sub\">Median depth of every tracked region, by frame; {}. Click to go there.</p>{}</section>",
        count(lines.len() as u64, "track"),
        plot.html()
    )
}

fn counters(report: &ReportSink) -> String {
    let row = |name: &str, number: u64| {
        format!("<tr><td class=\"wrap\">{}</td><td class=\"n\">{number}</td></tr>", escape(name))
    };
    let mut input = row("frames processed", report.totals.frames);
    if let Some(tally) = &report.tally {
        input += &row("pairs", tally.pairs);
        input += &row("left images without a partner", tally.unpaired_left);
        input += &row("right images without a partner", tally.unpaired_right);
        for (reason, number) in &tally.skipped {
            input += &row(&format!("skipped: {reason}"), *number);
        }
    }
    for (name, number) in &report.counters {
        input += &row(name, *number);
    }
    let mut output = row("regions published", report.totals.regions);
    for (reason, number) in Rejections::REASONS.iter().zip(report.totals.rejections) {
        output += &row(&format!("refused: {reason}"), number);
    }
    format!(
        "<section id=\"counters\"><h2>Counters</h2><p class=\"sub\">Nothing is lost without being counted.</p><div class=\"split\"><table><caption>Input</caption><tbody>{input}</tbody></table><table><caption>Regions</caption><tbody>{output}</tbody></table></div></section>"
    )
}

fn settings(config: &Config) -> String {
    let defaults = Config::default().flatten();
    let all = config.flatten();
    let text = |value: &Value| {
        escape(&value.as_str().map_or_else(|| value.to_string(), ToOwned::to_owned))
    };
    let mut rows = String::new();
    let mut changed = 0;
    for ((name, value), (_, default)) in all.iter().zip(&defaults) {
        if value != default {
            changed += 1;
            rows += &format!(
                "<tr><td><code>{name}</code></td><td class=\"n\"><code>{}</code></td><td class=\"n\"><code>{}</code></td></tr>",
                text(value),
                text(default)
            );
        }
    }
    if changed == 0 {
        return format!(
            "<section><h2>Parameters</h2><p class=\"sub\">All {} parameters have their defaults.</p></section>",
            all.len()
        );
    }
    format!(
        "<section><h2>Parameters</h2><p class=\"sub\">Changed from their defaults: {changed} of {}.</p><div class=\"list\"><table><thead><tr><th>parameter</th><th class=\"n\">value</th><th class=\"n\">default</th></tr></thead><tbody>{rows}</tbody></table></div></section>",
        all.len()
    )
}

fn sampling(report: &ReportSink) -> String {
    let (shown, seen) = (report.kept.items().len(), report.totals.frames);
    match report.kept.stride() {
        _ if seen == 0 => "No frame to show.".to_owned(),
        1 => format!("All {} are shown.", count(seen, "frame")),
        stride => format!(
            "The viewer shows {shown} of {seen} frames: the first and every {stride}th after it. Tables and scores are over all frames."
        ),
    }
}
