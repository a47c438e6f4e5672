//! Stage times of the methods as stacked bars.

use crate::evaluation::figures::STAGE_GROUPS;
use crate::evaluation::group::Group;
use crate::output::html::text::{escape, ms, percent};

/// Colours of [`STAGE_GROUPS`], as those of the stages.
const COLORS: [&str; STAGE_GROUPS.len()] =
    ["var(--s0)", "var(--s2)", "var(--s3)", "var(--s4)", "var(--s5)", "var(--s7)"];

/// True when any method has times.
pub fn has_any(group: &Group) -> bool {
    group.compared().iter().any(|merged| merged.figures.times.is_some())
}

/// One bar per method, all on the scale of the slowest one.
pub fn html(group: &Group) -> String {
    let rows: Vec<_> = group
        .compared()
        .into_iter()
        .filter_map(|merged| Some((merged, merged.figures.times?)))
        .collect();
    let length = |groups: &[f64]| groups.iter().sum::<f64>();
    let longest = rows.iter().map(|(_, times)| length(&times.groups)).fold(0.0, f64::max);
    let keys: String = STAGE_GROUPS
        .iter()
        .zip(COLORS)
        .map(|((name, _), color)| {
            format!("<span class=\"key\" style=\"--c:{color}\">{name}</span>")
        })
        .collect();
    let bars: String = rows
        .iter()
        .map(|(merged, times)| {
            let parts: String = STAGE_GROUPS
                .iter()
                .zip(COLORS)
                .zip(times.groups)
                .map(|(((name, _), color), value)| {
                    let share = if longest > 0.0 { value / longest } else { 0.0 };
                    format!(
                        "<i style=\"--v:{share:.4};--c:{color}\" title=\"{name} {} ms\"></i>",
                        ms(value)
                    )
                })
                .collect();
            let saved = merged.figures.saved_total.map_or_else(String::new, |saved| {
                let (sign, size) = if saved < 0.0 { ("+", -saved) } else { ("−", saved) };
                format!(" <small>{sign}{}</small>", percent(size))
            });
            format!(
                "<div class=\"stackrow\"><span>{}</span><span class=\"stack\">{parts}</span><span class=\"n\">{} ms{saved}</span></div>",
                escape(merged.label()),
                ms(times.total.p50)
            )
        })
        .collect();
    format!(
        "<p class=\"sub\">Medians of the stages, one bar per method; at the end the median of the whole frame, and how it compares with full-frame SGM.</p><p class=\"chips\">{keys}</p><div class=\"stacks\">{bars}</div>"
    )
}
