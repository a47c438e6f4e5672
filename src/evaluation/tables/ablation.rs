//! Table V: what each cue adds.

use super::{build, measures};
use crate::evaluation::group::{ABLATION, Group, Merged};
use crate::table::Table;

const COLUMNS: [&str; 7] = ["f1", "max_f", "mae", "matched", "region_f1_50", "epe", "p50_ms"];

/// Table V; `None` when no step of the ablation was measured.
pub fn table(group: &Group) -> Option<Table> {
    let rows: Vec<&Merged> = ABLATION.iter().filter_map(|name| group.method(name)).collect();
    build("Table V, cue ablation", group, &rows, &[], &measures(&COLUMNS))
}
