//! Table III: the methods side by side.

use super::{build, measures};
use crate::evaluation::figures::Figures;
use crate::evaluation::group::Group;
use crate::table::Table;

const ATTENTION: [&str; 14] = [
    "accuracy",
    "precision",
    "recall",
    "f1",
    "max_f",
    "mean_f",
    "weighted_f",
    "s",
    "max_e",
    "mae",
    "matched",
    "roi_90",
    "p50_ms",
    "hz",
];

const STRETCHED: [&str; 9] = [
    "stretched_max_f",
    "stretched_mean_f",
    "stretched_adaptive_f",
    "stretched_weighted_f",
    "stretched_s",
    "stretched_max_e",
    "stretched_mean_e",
    "stretched_adaptive_e",
    "stretched_mae",
];

const STEREO: [&str; 12] = [
    "epe",
    "d1",
    "bad_2",
    "density",
    "filled_d1",
    "frame_epe",
    "frame_d1",
    "frame_bad_2",
    "frame_density",
    "frame_filled_d1",
    "ause",
    "matching_ms",
];

const REGIONS: [&str; 5] = ["region_f1_30", "region_f1_50", "region_f1_75", "distance", "switches"];

/// Table III in its parts, as far as there is anything to show.
pub fn tables(group: &Group) -> Vec<Table> {
    let rows = group.compared();
    // Time alone is the business of Table IV.
    let any = |has: fn(&Figures) -> bool| rows.iter().any(|merged| has(&merged.figures));
    let table = |title, keys: &[&str]| build(title, group, &rows, &[], &measures(keys));
    let tables = [
        any(|f| f.salient.is_some() || f.map.is_some())
            .then(|| table("Table III-a, attention", &ATTENTION))
            .flatten(),
        table("Table III-a, attention maps stretched to the full range", &STRETCHED),
        (any(|f| f.frame.is_some() || f.in_roi().is_some()) || !group.peers.is_empty())
            .then(|| disparity(group))
            .flatten(),
        table("Table III-c, regions", &REGIONS),
    ];
    tables.into_iter().flatten().collect()
}

fn disparity(group: &Group) -> Option<Table> {
    let mut rows = group.compared();
    rows.extend(&group.same_pairs);
    let mut table =
        build("Table III-b, disparity", group, &rows, &group.peers, &measures(&STEREO))?;
    if rows.iter().any(|merged| merged.figures.frame.is_some()) {
        table.notes.push(
            "Columns without “in ROI” are over the whole frame: there a method that matches less has less density, and its errors are those of fewer pixels.".into(),
        );
    }
    Some(table)
}
