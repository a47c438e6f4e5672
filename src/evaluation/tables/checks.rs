//! The fourth check: continuity of depth, contours and masks over time.

use super::{build, measures};
use crate::evaluation::group::Group;
use crate::table::Table;

const COLUMNS: [&str; 11] = [
    "continuity",
    "true_continuity",
    "boundary",
    "warped",
    "true_warped",
    "j_mean",
    "j_recall",
    "j_decay",
    "f_mean",
    "f_recall",
    "f_decay",
];

/// The fourth check; `None` when nothing of it was measured.
pub fn table(group: &Group) -> Option<Table> {
    let rows = group.compared();
    build("Fourth check, continuity and contours", group, &rows, &[], &measures(&COLUMNS))
}
