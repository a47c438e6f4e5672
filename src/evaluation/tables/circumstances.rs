//! What has to be known about a table: data, run, configuration.

use std::collections::BTreeSet;

use crate::evaluation::Run;
use crate::evaluation::group::{Merged, PeerTotal};
use crate::output::html::text::count;

/// The notes of a table: what the rows were measured on, by what, and how
/// the methods are set. What differs among rows or parts is said so.
pub fn circumstances(rows: &[&Merged], peers: &[&PeerTotal]) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(per_method("Data: ", rows, data));
    notes.extend(runs(rows));
    notes.extend(configurations(rows));
    notes.extend(peer_notes(peers, rows));
    notes
}

/// What is the same for all rows is said once.
fn per_method(head: &str, rows: &[&Merged], text: impl Fn(&Merged) -> String) -> Option<String> {
    let texts: Vec<String> = rows.iter().map(|merged| text(merged)).collect();
    let first = texts.first()?;
    if texts.iter().all(|text| text == first) {
        return Some(format!("{head}{first}."));
    }
    let each = rows.iter().zip(&texts).map(|(merged, text)| format!("{} {text}", merged.label()));
    Some(format!("{head}{}.", each.collect::<Vec<_>>().join("; ")))
}

/// Scenes, frames, size and losses of one method.
pub fn data(merged: &Merged) -> String {
    let total = &merged.total;
    let scenes = merged.scenes.len();
    let mut parts = vec![count(scenes as u64, "scene"), count(total.frames, "frame")];
    let [width, height] = total.size;
    if width > 0 {
        let which = if scenes > 1 { " (first scene)" } else { "" };
        parts.push(format!("{width} × {height} px{which}"));
    }
    let skipped: u64 = total.skipped.values().sum();
    if skipped == 0 {
        parts.push("none skipped".into());
    } else {
        let reasons: Vec<String> =
            total.skipped.iter().map(|(reason, count)| format!("{reason}: {count}")).collect();
        parts.push(format!("{skipped} skipped ({})", reasons.join(", ")));
    }
    if total.monocular {
        parts.push("one camera only".into());
    }
    let distinct = merged.scenes.iter().collect::<BTreeSet<_>>().len();
    if distinct < scenes {
        parts.push(format!("of which only {distinct} are different"));
    }
    parts.join(", ")
}

/// Seed, version, commit and machine; what differs is listed.
pub fn runs(rows: &[&Merged]) -> Option<String> {
    let all: Vec<&Run> = rows.iter().flat_map(|merged| &merged.runs).collect();
    all.first()?;
    let mut differing = false;
    let mut values = |noun: &str, value: &dyn Fn(&Run) -> String| {
        let values: BTreeSet<String> = all.iter().map(|run| value(run)).collect();
        differing |= values.len() > 1;
        let plural = if values.len() > 1 { "s" } else { "" };
        let values: Vec<String> = values.into_iter().collect();
        format!("{noun}{plural} {}", values.join(" / "))
    };
    let unknown = |text: &str| if text.is_empty() { "unknown" } else { text }.to_owned();
    let parts = [
        values("seed", &|run| run.seed.to_string()),
        values("salient_stereo version", &|run| unknown(&run.version)),
        values("commit", &|run| unknown(&run.commit)),
        values("machine", &|run| {
            format!("{}, {}", unknown(&run.machine), count(run.threads as u64, "thread"))
        }),
    ];
    let head = if differing { "Merged from differing runs" } else { "Run" };
    Some(format!("{head}: {}.", parts.join("; ")))
}

fn configurations(rows: &[&Merged]) -> Option<String> {
    let config = |run: &Run| {
        let changed = match run.changed.len() {
            0 => "defaults".to_owned(),
            _ => run.changed.join(" "),
        };
        format!("{} ({changed})", if run.config.is_empty() { "unknown" } else { &run.config })
    };
    per_method("Configuration: ", rows, |merged| {
        let configs: BTreeSet<String> = merged.runs.iter().map(config).collect();
        let configs: Vec<String> = configs.into_iter().collect();
        match configs.len() {
            0 | 1 => configs.concat(),
            _ => format!("differs among its scenes: {}", configs.join(", ")),
        }
    })
}

/// What the peers were measured on; those on the same pairs in one sentence.
pub fn peer_notes(peers: &[&PeerTotal], rows: &[&Merged]) -> Vec<String> {
    let mut notes: Vec<(String, Vec<&str>)> = Vec::new();
    for peer in peers {
        let text = pairs(peer, rows);
        match notes.iter_mut().find(|(other, _)| *other == text) {
            Some((_, labels)) => labels.push(&peer.label),
            None => notes.push((text, vec![&peer.label])),
        }
    }
    notes.iter().map(|(text, labels)| format!("{}: {text}", labels.join(", "))).collect()
}

fn pairs(peer: &PeerTotal, rows: &[&Merged]) -> String {
    let ours: BTreeSet<&String> = rows.iter().flat_map(|merged| &merged.scenes).collect();
    let theirs: BTreeSet<&String> = peer.scenes.iter().collect();
    let which = if ours == theirs {
        " (the same scenes)".to_owned()
    } else if ours.is_empty() {
        String::new()
    } else {
        let both = theirs.intersection(&ours).count();
        format!(" ({both} of our {})", count(ours.len() as u64, "scene"))
    };
    let mut parts = vec![count(peer.scenes.len() as u64, "pair") + &which];
    if peer.mean.threads > 0 {
        parts.push(count(peer.mean.threads as u64, "thread"));
    }
    if !peer.mean.machine.is_empty() {
        parts.push(peer.mean.machine.clone());
    }
    parts.push("means over the pixels of all pairs, of the time the median.".into());
    parts.join(", ")
}
