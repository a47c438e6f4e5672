//! Table IV: where the time goes.

use super::{build, measures};
use crate::evaluation::group::{FULL_FRAME, Group};
use crate::table::Table;

const COLUMNS: [&str; 11] = [
    "preprocess_ms",
    "saliency_ms",
    "roi_ms",
    "stereo_ms",
    "refine_ms",
    "regions_ms",
    "p50_ms",
    "p95_ms",
    "p99_ms",
    "saved_total",
    "saved_matching",
];

/// Table IV; `None` when no time was measured.
pub fn table(group: &Group) -> Option<Table> {
    let rows = group.compared();
    let mut table =
        build("Table IV, milliseconds per frame", group, &rows, &[], &measures(&COLUMNS))?;
    table.notes.push(
        "Stages are medians; the median of a sum is not the sum of medians. Matching is coarse + stereo + refine.".into(),
    );
    if group.method(FULL_FRAME).is_none() {
        table
            .notes
            .push("The full-frame baseline was not measured: what is saved is not known.".into());
    }
    Some(table)
}
