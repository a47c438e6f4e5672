//! Tables with typed cells, written as Markdown, CSV and JSON.

use std::fmt::{self, Display};

use serde_json::{Value, json};

/// What stands where there is no value.
pub const MISSING: &str = "–";

/// One value of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// No value.
    Missing,
    /// Words.
    Text(String),
    /// A finite number and how many of its decimals are shown.
    Number {
        /// The number, unrounded.
        value: f64,
        /// Decimals shown.
        decimals: usize,
    },
}

impl Cell {
    /// Words.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number; what is absent or not finite is missing.
    pub fn number(value: impl Into<Option<f64>>, decimals: usize) -> Self {
        match value.into() {
            Some(value) if value.is_finite() => Self::Number { value, decimals },
            _ => Self::Missing,
        }
    }

    /// The number, unrounded.
    pub const fn value(&self) -> Option<f64> {
        match self {
            Self::Number { value, .. } => Some(*value),
            _ => None,
        }
    }
}

impl Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => f.write_str(MISSING),
            Self::Text(text) => f.write_str(text),
            Self::Number { value, decimals } => {
                let text = format!("{value:.decimals$}");
                // A small negative number rounds to "-0.0".
                let is_zero = text.bytes().all(|letter| b"-0.".contains(&letter));
                f.write_str(if is_zero { text.trim_start_matches('-') } else { &text })
            }
        }
    }
}

/// Which value of a column is the best one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Best {
    /// The largest.
    Highest,
    /// The smallest.
    Lowest,
}

/// One column of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its head, with the unit.
    pub name: String,
    /// What it means, in a sentence; may be empty.
    pub help: String,
    /// Which value is marked, if any.
    pub best: Option<Best>,
}

/// One row of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// As many as there are columns.
    pub cells: Vec<Cell>,
    /// True for values quoted from elsewhere: shown, but never marked as best.
    pub quoted: bool,
}

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Its name.
    pub title: String,
    /// What has to be known about it, a sentence or two each.
    pub notes: Vec<String>,
    /// The columns; the first one names the rows.
    pub columns: Vec<Column>,
    /// The rows.
    pub rows: Vec<Row>,
}

impl Table {
    /// True when the cell is the best one of its column, as shown: equal
    /// texts are equally good. Where all are equal, none is.
    pub fn is_best(&self, row: usize, column: usize) -> bool {
        let Some(best) = self.columns.get(column).and_then(|c| c.best) else { return false };
        let cell = |row: &Row| row.cells.get(column).cloned().filter(|_| !row.quoted);
        let Some(own) = self.rows.get(row).and_then(cell) else { return false };
        let Some(value) = own.value() else { return false };
        let (mut beats, mut beaten) = (false, false);
        for other in self.rows.iter().filter_map(cell) {
            let Some(rival) = other.value() else { continue };
            let ahead = match best {
                Best::Highest => rival > value,
                Best::Lowest => rival < value,
            };
            if other.to_string() != own.to_string() {
                beaten |= ahead;
                beats |= !ahead;
            }
        }
        beats && !beaten
    }

    /// True for columns of numbers, which stand to the right.
    pub fn is_numeric(&self, column: usize) -> bool {
        let mut cells = self.rows.iter().filter_map(|row| row.cells.get(column));
        cells.any(|cell| cell.value().is_some())
    }

    /// Title in bold, the table with aligned columns and bold best values, and
    /// the notes as a list.
    pub fn markdown(&self) -> String {
        let mut lines = vec![format!("**{}**", escape_markdown(&self.title)), String::new()];
        lines.extend(self.markdown_grid());
        if !self.notes.is_empty() {
            lines.push(String::new());
        }
        lines.extend(self.notes.iter().map(|note| format!("- {}", escape_markdown(note))));
        lines.join("\n") + "\n"
    }

    /// The lines of the table alone.
    pub fn markdown_grid(&self) -> Vec<String> {
        let mut grid: Vec<Vec<String>> =
            vec![self.columns.iter().map(|column| escape_markdown(&column.name)).collect()];
        for (y, row) in self.rows.iter().enumerate() {
            let cells = row.cells.iter().enumerate().map(|(x, cell)| {
                let text = escape_markdown(&cell.to_string());
                if self.is_best(y, x) { format!("**{text}**") } else { text }
            });
            grid.push(cells.collect());
        }
        let length = |text: &String| text.chars().count();
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|x| grid.iter().filter_map(|row| row.get(x)).map(length).max().unwrap_or(0).max(3))
            .collect();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).enumerate().map(|(x, (text, &width))| {
                if self.is_numeric(x) {
                    format!("{text:>width$}")
                } else {
                    format!("{text:<width$}")
                }
            });
            format!("| {} |", cells.collect::<Vec<_>>().join(" | "))
        };
        let rule = widths.iter().enumerate().map(|(x, width)| {
            let dashes = "-".repeat(width - 1);
            if self.is_numeric(x) { format!("{dashes}:") } else { format!(":{dashes}") }
        });
        let rule = format!("| {} |", rule.collect::<Vec<_>>().join(" | "));
        let mut lines: Vec<String> = grid.iter().map(line).collect();
        lines.insert(1, rule);
        lines
    }

    /// RFC 4180: a line of heads and one line per row, numbers as they are
    /// shown, nothing where a value is missing.
    pub fn csv(&self) -> String {
        let heads = self.columns.iter().map(|column| column.name.clone()).collect();
        let rows = self.rows.iter().map(|row| {
            let text = |cell: &Cell| match cell {
                Cell::Missing => String::new(),
                cell => cell.to_string(),
            };
            row.cells.iter().map(text).collect::<Vec<_>>()
        });
        std::iter::once(heads).chain(rows).fold(String::new(), |out, row| {
            out + &row.iter().map(|text| quote_csv(text)).collect::<Vec<_>>().join(",") + "\n"
        })
    }

    /// `{"title", "notes", "columns": [{"name", "help"}], "rows": [[…]]}` with
    /// unrounded numbers, and `null` where a value is missing.
    pub fn json(&self) -> Value {
        let value = |cell: &Cell| match cell {
            Cell::Missing => Value::Null,
            Cell::Text(text) => json!(text),
            Cell::Number { value, .. } => json!(value),
        };
        let columns = self.columns.iter().map(|c| json!({ "name": c.name, "help": c.help }));
        let rows = self.rows.iter().map(|row| row.cells.iter().map(value).collect::<Vec<_>>());
        json!({
            "title": self.title,
            "notes": self.notes,
            "columns": columns.collect::<Vec<_>>(),
            "rows": rows.collect::<Vec<_>>(),
        })
    }
}

/// `text` as one line that Markdown takes for words only.
pub fn escape_markdown(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '\n' | '\r' | '\t' => out.push(' '),
            '<' => out.push_str("&lt;"),
            '&' => out.push_str("&amp;"),
            '|' | '\\' | '*' | '`' | '[' | ']' => {
                out.push('\\');
                out.push(letter);
            }
            letter if letter.is_control() => out.push('\u{fffd}'),
            letter => out.push(letter),
        }
    }
    out
}

fn quote_csv(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str, best: Option<Best>) -> Column {
        Column { name: name.into(), help: String::new(), best }
    }

    fn table() -> Table {
        let row = |name: &str, f1: Option<f64>, epe: f64, quoted| Row {
            cells: vec![Cell::text(name), Cell::number(f1, 2), Cell::number(epe, 1)],
            quoted,
        };
        Table {
            title: "T".into(),
            notes: vec!["seed 1".into()],
            columns: vec![
                column("method", None),
                column("F1", Some(Best::Highest)),
                column("EPE px", Some(Best::Lowest)),
            ],
            rows: vec![
                row("a|b", Some(0.504), 12.04, false),
                row("c, \"d\"", None, 0.96, false),
                row("<e>", Some(0.25), 0.97, false),
                row("paper", Some(0.93), f64::NAN, true),
            ],
        }
    }

    #[test]
    fn markdown_is_aligned_and_escaped_and_marks_the_best() {
        let expected = "\
**T**

| method |       F1 |  EPE px |
| :----- | -------: | ------: |
| a\\|b   | **0.50** |    12.0 |
| c, \"d\" |        – | **1.0** |
| &lt;e> |     0.25 | **1.0** |
| paper  |     0.93 |       – |

- seed 1
";
        assert_eq!(table().markdown(), expected);
        assert_eq!(escape_markdown("a\n*b*[c](d)`"), "a \\*b\\*\\[c\\](d)\\`");
        let widths: Vec<usize> =
            table().markdown_grid().iter().map(|line| line.chars().count()).collect();
        assert!(widths.windows(2).all(|pair| pair[0] == pair[1]), "{widths:?}");
    }

    #[test]
    fn of_equals_none_is_the_best() {
        let mut table = table();
        assert!(table.is_best(0, 1) && !table.is_best(2, 1) && !table.is_best(3, 1));
        table.rows.truncate(2);
        assert!(!table.is_best(0, 1), "a lone value");
        table.rows[1].cells[1] = Cell::number(0.496, 2);
        assert!(!table.is_best(0, 1), "both are shown as 0.50");
        assert!(!table.is_best(9, 1) && !table.is_best(0, 9) && !table.is_best(0, 0));
    }

    #[test]
    fn csv_is_quoted_and_leaves_out_what_is_missing() {
        let expected =
            "method,F1,EPE px\na|b,0.50,12.0\n\"c, \"\"d\"\"\",,1.0\n<e>,0.25,1.0\npaper,0.93,\n";
        assert_eq!(table().csv(), expected);
    }

    #[test]
    fn json_keeps_all_digits() {
        let json = table().json();
        assert_eq!(json["rows"][0][1], 0.504);
        assert!(json["rows"][1][1].is_null() && json["rows"][3][2].is_null());
        assert_eq!(json["columns"][2]["name"], "EPE px");
    }

    #[test]
    fn no_number_is_minus_zero_or_not_finite() {
        assert_eq!(Cell::number(-0.04, 1).to_string(), "0.0");
        assert_eq!(Cell::number(-0.06, 1).to_string(), "-0.1");
        assert_eq!(Cell::number(f64::INFINITY, 1), Cell::Missing);
        assert_eq!(Cell::number(None, 1).to_string(), MISSING);
    }
}
