//! A table as HTML.

use crate::evaluation::group::{OURS, label};
use crate::output::html::text::escape;
use crate::table::{Cell, Table};

/// A section with a table that scrolls sideways where it does not fit.
pub fn section(id: &str, title: &str, table: &Table) -> String {
    let heads: String = table
        .columns
        .iter()
        .enumerate()
        .map(|(x, column)| {
            let class = if table.is_numeric(x) { " class=\"n\"" } else { "" };
            format!(
                "<th{class} scope=\"col\" title=\"{}\">{}</th>",
                escape(&column.help),
                with_its_unit(&column.name)
            )
        })
        .collect();
    let ours = Cell::text(label(OURS));
    let rows: String = (0..table.rows.len())
        .map(|y| {
            let row = &table.rows[y];
            let class = match row.cells.first() {
                _ if row.quoted => " class=\"quoted\"",
                Some(cell) if *cell == ours => " class=\"ours\"",
                _ => "",
            };
            format!("<tr{class}>{}</tr>", cells(table, y))
        })
        .collect();
    let notes: String =
        table.notes.iter().map(|note| format!("<li>{}</li>", escape(note))).collect();
    format!(
        "<section id=\"{id}\"><h2>{}</h2><div class=\"list\" tabindex=\"0\"><table class=\"grid\"><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div><details class=\"notes\"><summary>How this was measured</summary><ul>{notes}</ul></details></section>",
        escape(title)
    )
}

/// A head whose unit does not stand alone in a line.
fn with_its_unit(name: &str) -> String {
    escape(name).replace(", ", ",&nbsp;").replace(" %", "&nbsp;%")
}

fn cells(table: &Table, y: usize) -> String {
    let cells = table.rows[y].cells.iter().enumerate();
    cells
        .map(|(x, cell)| {
            let mut classes = Vec::new();
            if table.is_numeric(x) {
                classes.push("n");
            }
            if table.is_best(y, x) {
                classes.push("best");
            }
            if *cell == Cell::Missing {
                classes.push("none");
            }
            format!("<td class=\"{}\">{}</td>", classes.join(" "), escape(&cell.to_string()))
        })
        .collect()
}
