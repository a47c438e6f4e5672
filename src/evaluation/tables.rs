//! The tables: one set per data set, with what has to be known about them.

mod ablation;
mod checks;
mod circumstances;
mod measure;
mod methods;
mod simulated;
mod stages;

use serde_json::{Value, json};

use super::Evaluation;
use super::group::{Group, Merged, PeerTotal};
use crate::table::{Cell, Column, Row, Table};
pub use circumstances::{circumstances, data, peer_notes, runs};
pub use measure::{Measure, find as measure};
pub use simulated::simulated;

/// What the row of quoted values is called.
const SIMULATED_LABEL: &str = "paper's own figure (simulated)";

/// All tables of all data sets.
pub fn tables(evaluation: &Evaluation) -> Vec<Table> {
    Group::all(evaluation).iter().flat_map(of_group).collect()
}

/// The tables of one data set.
pub fn of_group(group: &Group) -> Vec<Table> {
    let mut tables = methods::tables(group);
    tables.extend(stages::table(group));
    tables.extend(ablation::table(group));
    tables.extend(checks::table(group));
    tables
}

/// All tables as Markdown.
pub fn markdown(evaluation: &Evaluation) -> String {
    let tables: Vec<String> = tables(evaluation).iter().map(Table::markdown).collect();
    let command = evaluation.command.replace('\n', " ");
    tables.join("\n") + &format!("\nMeasured by\n\n    {command}\n")
}

/// All tables as CSV, one after the other: each with its title and notes in
/// front, behind `#`, and an empty line after it.
pub fn csv(evaluation: &Evaluation) -> String {
    tables(evaluation).iter().fold(String::new(), |out, table| {
        let comments = std::iter::once(&table.title).chain(&table.notes);
        let comments: Vec<String> =
            comments.map(|line| format!("# {}\n", line.replace(['\n', '\r'], " "))).collect();
        out + &comments.concat() + &table.csv() + "\n"
    })
}

/// The tables, and of every data set and method all figures, curves and runs:
/// `{"command", "tables": […], "results": [{"dataset", "method", "scenes", "frames",
/// "skipped", "runs", "figures"}], "peers": […]}`.
pub fn json(evaluation: &Evaluation) -> Value {
    let groups = Group::all(evaluation);
    let result = |group: &Group, merged: &Merged| {
        json!({
            "dataset": group.dataset,
            "method": merged.method,
            "label": merged.label(),
            "scenes": merged.scenes,
            "frames": merged.total.frames,
            "skipped": merged.total.skipped,
            "size": merged.total.size,
            "monocular": merged.total.monocular,
            "runs": merged.runs,
            "figures": merged.figures.json(),
        })
    };
    let results: Vec<Value> = groups
        .iter()
        .flat_map(|group| group.methods.iter().map(move |merged| result(group, merged)))
        .collect();
    json!({
        "command": evaluation.command,
        "tables": groups.iter().flat_map(of_group).map(|table| table.json()).collect::<Vec<_>>(),
        "results": results,
        "peers": evaluation.peers,
    })
}

/// Builds a table of one row per method and, where `peers` are given, one per
/// peer. Columns without any measured value are left out; `None` when none
/// remains.
pub fn build(
    title: &str,
    group: &Group,
    rows: &[&Merged],
    peers: &[PeerTotal],
    measures: &[&Measure],
) -> Option<Table> {
    let has_value = |measure: &&&Measure| {
        rows.iter().any(|merged| measure.of(&merged.figures).is_some())
            || peers.iter().any(|peer| measure.of_peer(&peer.mean).is_some())
    };
    let measures: Vec<&Measure> = measures.iter().filter(has_value).copied().collect();
    if measures.is_empty() {
        return None;
    }
    // A method without any figure here (a baseline of attention has no
    // disparity) has no row either.
    let has_figure =
        |merged: &&&Merged| measures.iter().any(|measure| measure.of(&merged.figures).is_some());
    let rows: Vec<&Merged> = rows.iter().filter(has_figure).copied().collect();
    let row = |name: &str, quoted, value: &dyn Fn(&Measure) -> Option<f64>| Row {
        cells: std::iter::once(Cell::text(name))
            .chain(measures.iter().map(|measure| measure.cell(value(measure))))
            .collect(),
        quoted,
    };
    let mut table = Table {
        title: format!("{}: {title}", group.dataset),
        notes: Vec::new(),
        columns: std::iter::once(Column { name: "method".into(), help: String::new(), best: None })
            .chain(measures.iter().map(|measure| measure.column()))
            .collect(),
        rows: Vec::new(),
    };
    for merged in &rows {
        table.rows.push(row(merged.label(), false, &|measure| measure.of(&merged.figures)));
    }
    let quoted = |measure: &Measure| simulated(measure.key).map(|figure| figure.value);
    if measures.iter().any(|measure| quoted(measure).is_some()) {
        table.rows.push(row(SIMULATED_LABEL, true, &quoted));
    }
    let mut shown = Vec::new();
    for peer in peers {
        let value = |measure: &Measure| measure.of_peer(&peer.mean);
        if measures.iter().any(|measure| value(measure).is_some()) {
            table.rows.push(row(&peer.label, false, &value));
            shown.push(peer);
        }
    }
    table.notes = circumstances(&rows, &shown);
    let figures = measures.iter().filter_map(|measure| simulated(measure.key));
    table.notes.extend(figures.map(simulated::Simulated::note));
    table.notes.dedup();
    Some(table)
}

/// Finds the measures of a table by their keys.
pub fn measures(keys: &[&str]) -> Vec<&'static Measure> {
    keys.iter().filter_map(|key| measure(key)).collect()
}
