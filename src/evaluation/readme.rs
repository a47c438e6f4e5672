//! The section of the README that is made of measurements.

use thiserror::Error;

use super::Evaluation;
use super::group::{FULL_FRAME, Group, Merged, OURS, PeerTotal, label};
use super::tables::{self, Measure};
use crate::output::html::text::count;
use crate::table::{Best, escape_markdown};

/// How the line before the section begins.
const BEGIN: &str = "<!-- evaluation: begin";

/// How the line after the section begins.
const END: &str = "<!-- evaluation: end";

/// The methods of the section.
const ROWS: [&str; 3] = [FULL_FRAME, "paper", OURS];

/// The measures that are compared by how many times one is faster.
const MATCHING: &str = "matching_ms";
const FRAME: &str = "p50_ms";

/// The columns of the section.
const COLUMNS: [&str; 12] = [
    "f1",
    "max_f",
    "matched",
    "region_f1_50",
    "distance",
    "epe",
    "d1",
    "frame_epe",
    "frame_d1",
    MATCHING,
    FRAME,
    "saved_total",
];

/// Why a text has no place for the section.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SpliceError {
    /// A marker is missing or there more than once.
    #[error("the text has {count} lines that begin with \"{marker}\", 1 expected")]
    Count {
        /// How the line should begin.
        marker: &'static str,
        /// Lines that do.
        count: usize,
    },
    /// The end comes before the beginning.
    #[error("line {end} ends the section that begins in line {begin}")]
    Order {
        /// Line of the first marker, from 1.
        begin: usize,
        /// Line of the second marker, from 1.
        end: usize,
    },
}

/// Replaces what stands between the lines `<!-- evaluation: begin … -->` and
/// `<!-- evaluation: end -->` by `text`.
///
/// # Errors
/// When there is not one line of each, in this order.
pub fn splice(readme: &str, text: &str) -> Result<String, SpliceError> {
    let lines: Vec<&str> = readme.split_inclusive('\n').collect();
    let find = |marker: &'static str| {
        let mut found = lines.iter().enumerate().filter(|(_, line)| line.starts_with(marker));
        match (found.next(), found.count()) {
            (Some((at, _)), 0) => Ok(at),
            (first, more) => {
                Err(SpliceError::Count { marker, count: usize::from(first.is_some()) + more })
            }
        }
    };
    let (begin, end) = (find(BEGIN)?, find(END)?);
    if end < begin {
        return Err(SpliceError::Order { begin: begin + 1, end: end + 1 });
    }
    let (before, after) = (lines[..=begin].concat(), lines[end..].concat());
    Ok(format!("{before}\n{}\n\n{after}", text.trim_matches('\n')))
}

/// What the README says: a small table per data set, what is won and what is
/// lost, and the command that measured it.
pub fn section(evaluation: &Evaluation) -> String {
    let groups = Group::all(evaluation);
    let all: Vec<&Merged> = groups.iter().flat_map(|group| &group.methods).collect();
    let mut lines = vec!["## How good is it, really".to_owned(), String::new()];
    lines.push(format!(
        "Measured by `{}`. {} Every data set stands alone. The paper's own figures are from simulation, not from these data.",
        evaluation.command.replace(['\n', '`'], " "),
        tables::runs(&all).map_or_else(String::new, |text| escape_markdown(&text)),
    ));
    for group in &groups {
        lines.extend(chapter(group));
    }
    lines.join("\n") + "\n"
}

fn chapter(group: &Group) -> Vec<String> {
    let mut rows: Vec<&Merged> = ROWS.iter().filter_map(|name| group.method(name)).collect();
    let ours = rows.last().map(|merged| format!("{}.", tables::data(merged)));
    let peers: Vec<&PeerTotal> = group.peers.iter().collect();
    let facts: Vec<String> = ours.into_iter().chain(tables::peer_notes(&peers, &rows)).collect();
    rows.extend(&group.same_pairs);
    let Some(table) = tables::build("", group, &rows, &group.peers, &tables::measures(&COLUMNS))
    else {
        return Vec::new();
    };
    let mut lines = vec![String::new(), format!("### {}", escape_markdown(&group.dataset))];
    lines.extend([String::new(), escape_markdown(&facts.join(" ")), String::new()]);
    lines.extend(table.markdown_grid());
    lines.push(String::new());
    lines.extend(verdicts(group).iter().map(|text| format!("- {}", escape_markdown(text))));
    lines
}

/// What is better and what is worse, in words. Values that are shown alike
/// are neither.
fn verdicts(group: &Group) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(ours) = group.method(OURS) {
        let mut scene = Verdict::default();
        for key in ["f1", "max_f", "region_f1_50", "distance", "epe"] {
            let mut rivals = method(group, "paper", key);
            rivals.extend(simulation(key));
            scene.compare(ours, key, &rivals);
        }
        let mut rivals = method(group, FULL_FRAME, FRAME);
        let alone = |(name, value)| (format!("the matching alone of {name}"), value);
        rivals.extend(peers(group, MATCHING).into_iter().map(alone));
        scene.compare(ours, FRAME, &rivals);
        scene.compare(ours, "saved_total", &simulation("saved_total"));
        lines.extend(scene.lines(ours.label()));
    }
    if let Some(full) = group.same_pairs.as_ref().or_else(|| group.method(FULL_FRAME)) {
        let mut matcher = Verdict::default();
        for key in [MATCHING, "frame_epe", "frame_d1", "frame_density", "frame_filled_d1"] {
            matcher.compare(full, key, &peers(group, key));
        }
        lines.extend(matcher.lines(full.label()));
    }
    lines
}

/// What a method is compared with: a name and its value.
type Rival = (String, f64);

fn method(group: &Group, name: &str, key: &str) -> Vec<Rival> {
    let value = tables::measure(key).zip(group.method(name));
    let value = value.and_then(|(measure, merged)| measure.of(&merged.figures));
    value.map(|value| (label(name).to_owned(), value)).into_iter().collect()
}

fn simulation(key: &str) -> Vec<Rival> {
    let figure = tables::simulated(key);
    figure.map(|figure| ("the paper's simulation".to_owned(), figure.value)).into_iter().collect()
}

fn peers(group: &Group, key: &str) -> Vec<Rival> {
    let Some(measure) = tables::measure(key) else { return Vec::new() };
    let name = |peer: &PeerTotal| match peer.mean.threads {
        threads if key == MATCHING && threads > 0 => {
            format!("{} on {}", peer.label, count(threads as u64, "thread"))
        }
        _ => peer.label.clone(),
    };
    let rivals = group.peers.iter();
    rivals.filter_map(|peer| Some((name(peer), measure.of_peer(&peer.mean)?))).collect()
}

/// What one method wins and loses.
#[derive(Default)]
struct Verdict {
    better: Vec<String>,
    worse: Vec<String>,
}

impl Verdict {
    fn compare(&mut self, own: &Merged, key: &str, rivals: &[Rival]) {
        let Some(measure) = tables::measure(key) else { return };
        let Some(value) = measure.of(&own.figures) else { return };
        let shown = |value| measure.cell(Some(value)).to_string();
        let more_is_better = measure.best == Some(Best::Highest);
        let rivals = rivals.iter().filter(|rival| shown(rival.1) != shown(value));
        let (better, worse): (Vec<&Rival>, Vec<&Rival>) =
            rivals.partition(|rival| (value > rival.1) == more_is_better);
        let threads = own.total.run.threads;
        self.better.extend(sentence(measure, value, threads, &better));
        self.worse.extend(sentence(measure, value, threads, &worse));
    }

    fn lines(&self, subject: &str) -> Vec<String> {
        [("better", &self.better), ("worse", &self.worse)]
            .into_iter()
            .filter(|(_, items)| !items.is_empty())
            .map(|(word, items)| format!("{subject}, {word}: {}.", items.join("; ")))
            .collect()
    }
}

/// `D1 2.3 % (OpenCV SGBM 7.2)`; of times how many times faster or slower.
/// `None` without rivals.
fn sentence(measure: &Measure, value: f64, threads: usize, rivals: &[&Rival]) -> Option<String> {
    if rivals.is_empty() {
        return None;
    }
    let what = match measure.key {
        MATCHING => format!("matching on {} is", count(threads as u64, "thread")),
        FRAME => format!("a whole frame on {} is", count(threads as u64, "thread")),
        _ => {
            let (name, unit) = measure.name.split_once(", ").unwrap_or((measure.name, ""));
            let own = measure.cell(Some(value));
            let rivals: Vec<String> = rivals
                .iter()
                .map(|(name, value)| format!("{name} {}", measure.cell(Some(*value))))
                .collect();
            let own = format!("{name} {own} {unit}");
            return Some(format!("{} ({})", own.trim_end(), rivals.join(", ")));
        }
    };
    let ratios: Vec<String> = rivals
        .iter()
        .map(|(name, other)| {
            let (ratio, word) =
                if *other > value { (other / value, "faster") } else { (value / other, "slower") };
            format!("{ratio:.1}x {word} than {name}")
        })
        .collect();
    Some(format!("{what} {}", ratios.join(", ")))
}
