//! Where the tables go.

use std::fs;
use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::command::CommandError;
use crate::command::print::put;
use crate::command::watch::{make_parent, write_file, write_json};
use crate::evaluation::{self, Evaluation, Part, Peer, Peers, readme, report};

/// Outputs of `evaluate`.
#[derive(Clone, Debug, Args)]
pub struct Outputs {
    /// Write tables, scores and curves as JSON (`-`: to stdout)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the tables as Markdown (`-`, and without any output: to stdout)
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Write the tables as CSV, one after the other
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write a report with plots and pictures as one HTML file
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Replace the section between the evaluation marks of this Markdown file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// Rows of other matchers: JSON of benches/peers/stereo.py (repeatable)
    #[arg(long, value_name = "FILE")]
    peers: Vec<PathBuf>,
    /// The command to name in tables and reports instead of this one
    #[arg(long, value_name = "TEXT")]
    made_by: Option<String>,
}

/// The outputs, after a look at what can be known before the work.
pub struct Checked {
    outputs: Outputs,
    peers: Vec<Peer>,
}

impl Outputs {
    /// Reads the rows of others and looks for the marks in the Markdown file,
    /// so that hours of work do not end in a typing error.
    ///
    /// # Errors
    /// Files that cannot be read or are something else.
    pub fn check(&self) -> Result<Checked, CommandError> {
        let usage = |e: String| CommandError::Usage(e);
        let mut peers = Vec::new();
        for path in &self.peers {
            let text = fs::read(path)
                .map_err(|e| usage(format!("cannot read {}: {e}", path.display())))?;
            let file: Peers = serde_json::from_slice(&text)
                .map_err(|e| usage(format!("{} holds no peers: {e}", path.display())))?;
            peers.extend(file.peers);
        }
        if let Some(path) = &self.readme {
            let text = fs::read_to_string(path)
                .map_err(|e| usage(format!("cannot read {}: {e}", path.display())))?;
            readme::splice(&text, "").map_err(|e| usage(format!("{}: {e}", path.display())))?;
        }
        Ok(Checked { outputs: self.clone(), peers })
    }
}

impl Checked {
    /// Makes the tables and writes them.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(self, parts: Vec<Part>) -> Result<(), CommandError> {
        let Self { outputs, peers } = self;
        let command = outputs.made_by.clone().unwrap_or_else(command_line);
        let evaluation = Evaluation { command, parts, peers };
        if let Some(path) = &outputs.json {
            write_json(path, &evaluation::json(&evaluation))?;
        }
        if let Some(path) = &outputs.csv {
            write_file(path, evaluation::csv(&evaluation).as_bytes())?;
        }
        if let Some(path) = &outputs.report {
            make_parent(path)?;
            let failed = |e| CommandError::failed(format!("cannot write {}: {e}", path.display()));
            let mut file = std::io::BufWriter::new(fs::File::create(path).map_err(failed)?);
            report::write(&evaluation, &mut file).and_then(|()| file.flush()).map_err(failed)?;
        }
        if let Some(path) = &outputs.readme {
            let text = fs::read_to_string(path).map_err(CommandError::failed)?;
            let text = readme::splice(&text, &readme::section(&evaluation))
                .map_err(CommandError::failed)?;
            write_file(path, text.as_bytes())?;
        }
        let Outputs { json, markdown, csv, report, readme, .. } = &outputs;
        let quiet = [json, csv, report, readme].iter().any(|output| output.is_some());
        match markdown {
            Some(path) if path.as_os_str() != "-" => {
                write_file(path, evaluation::markdown(&evaluation).as_bytes())?;
            }
            None if quiet => {}
            _ => put(format_args!("{}", evaluation::markdown(&evaluation))),
        }
        Ok(())
    }
}

/// The command as it was given, without the folder of the program.
fn command_line() -> String {
    let mut words = std::env::args();
    let program = words.next().unwrap_or_default();
    let program = program.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
    let quote = |word: String| if word.contains(' ') { format!("'{word}'") } else { word };
    std::iter::once(program).chain(words.map(quote)).collect::<Vec<_>>().join(" ")
}
