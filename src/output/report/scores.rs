//! The section about the truth.

use super::ReportSink;
use crate::metric::{DisparityScore, RegionScore};
use crate::output::html::plot::Plot;
use crate::output::html::text::{count, metres, or_dash, percent};

/// Scores against the truth; empty when the source knows none.
pub fn html(report: &ReportSink) -> String {
    let Some(summary) = report.scores.summary() else { return String::new() };
    let mut tables = String::new();
    tables += &region_table("Regions, by mask", &summary.regions_by_mask);
    tables += &region_table("Regions, by box", &summary.regions_by_box);
    let disparities = [
        ("where matched", summary.disparity_in_roi),
        ("on true objects", summary.disparity_on_objects),
    ];
    tables += &disparity_table(&disparities);

    let two = |v: f64| format!("{v:.3}");
    let mut rest = Vec::new();
    if let Some(pixels) = summary.pixels {
        rest.push(("pixel accuracy (eq. 7)", two(pixels.accuracy)));
        rest.push(("pixel precision (eq. 8)", or_dash(pixels.precision, two)));
        rest.push(("pixel recall (eq. 8)", or_dash(pixels.recall, two)));
        rest.push(("pixel F1 (eq. 9)", or_dash(pixels.f1, two)));
    }
    if let Some(roi) = summary.roi {
        rest.push((
            "object pixels inside the region of interest",
            or_dash(roi.pixel_recall, percent),
        ));
        rest.push(("objects at least 90 % inside", or_dash(roi.objects_90, percent)));
    }
    if let Some(distance) = summary.distance {
        rest.push(("mean distance error", metres(distance.mean_error_m)));
        rest.push(("mean relative distance error", percent(distance.mean_relative_error)));
    }
    if let Some(switches) = summary.id_switches {
        rest.push(("identity switches", switches.to_string()));
    }
    if summary.unscorable_frames > 0 {
        rest.push(("frames whose truth does not fit", summary.unscorable_frames.to_string()));
    }
    if !rest.is_empty() {
        let rows: String = rest
            .iter()
            .map(|(name, value)| {
                format!("<tr><td class=\"wrap\">{name}</td><td class=\"n\">{value}</td></tr>")
            })
            .collect();
        tables +=
            &format!("<table><caption>Pixels and objects</caption><tbody>{rows}</tbody></table>");
    }
    if tables.is_empty() {
        tables += "<p>Nothing could be compared: no match lies where the truth is known.</p>";
    }
    format!(
        "<section><h2>Against the truth</h2><p class=\"sub\">{} of {} with truth. Objects smaller than <code>regions.min_area</code> are not asked for.</p>{}<div class=\"split\">{tables}</div></section>",
        summary.scored_frames,
        count(summary.frames, "frame"),
        plots(report)
    )
}

fn region_table(caption: &str, rows: &[RegionScore]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let two = |v: f64| format!("{v:.3}");
    let rows: String = rows
        .iter()
        .map(|row| {
            format!(
                "<tr><td>≥ {}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{:.3}</td><td class=\"n\">{:.2}</td></tr>",
                row.iou,
                or_dash(row.precision, two),
                or_dash(row.recall, two),
                row.f1,
                row.false_positives_per_frame
            )
        })
        .collect();
    format!(
        "<table><caption>{caption}</caption><thead><tr><th>IoU</th><th class=\"n\">precision</th><th class=\"n\">recall</th><th class=\"n\">F1</th><th class=\"n\">false / frame</th></tr></thead><tbody>{rows}</tbody></table>"
    )
}

fn disparity_table(rows: &[(&str, Option<DisparityScore>)]) -> String {
    let rows: String = rows
        .iter()
        .filter_map(|(name, score)| Some((name, (*score)?)))
        .map(|(name, s)| {
            format!(
                "<tr><td>{name}</td><td class=\"n\">{:.2} px</td><td class=\"n\">{}</td><td class=\"n opt\">{}</td><td class=\"n opt\">{}</td><td class=\"n\">{}</td></tr>",
                s.epe_px,
                percent(s.d1),
                percent(s.bad_1),
                percent(s.bad_2),
                percent(s.density)
            )
        })
        .collect();
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<table><caption>Disparity</caption><thead><tr><th>pixels</th><th class=\"n\" title=\"mean absolute error, eq. 10\">EPE</th><th class=\"n\" title=\"error above 3 px and above 5 %\">D1</th><th class=\"n opt\">bad-1</th><th class=\"n opt\">bad-2</th><th class=\"n\">density</th></tr></thead><tbody>{rows}</tbody></table>"
    )
}

fn plots(report: &ReportSink) -> String {
    let frames = report.totals.frames;
    let points = |value: fn(&super::Row) -> Option<f64>| -> Vec<(f64, f64)> {
        let rows = report.rows.items().iter();
        rows.filter_map(|row| Some((row.index as f64, value(row)?))).collect()
    };
    let (f1, epe) = (points(|row| row.f1), points(|row| row.epe));
    if frames < 2 {
        return String::new();
    }
    let gap = report.rows.stride() as f64 * 1.5;
    let mut out = String::new();
    for (title, note, points, top, unit, color) in [
        ("Region F1", "per frame, by mask, IoU ≥ 0.5", f1, 1.0, "", "var(--good)"),
        ("End-point error", "per frame, where matched", epe, 0.0, " px", "var(--s4)"),
    ] {
        if points.is_empty() {
            continue;
        }
        let highest = points.iter().map(|point| point.1).fold(top, f64::max);
        let mut plot = Plot::over_frames(frames, highest, unit).with_class("low");
        plot.line(&points, gap, color);
        out += &format!(
            "<div><div class=\"plothead\"><b>{title}</b><span>{note}</span></div>{}</div>",
            plot.html()
        );
    }
    if out.is_empty() { out } else { format!("<div class=\"split\">{out}</div>") }
}
