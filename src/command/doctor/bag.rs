//! The doctor's look at a bag.

use std::path::Path;

use super::check::FrameCheck;
use super::finding::Finding;
use super::remedy::remedy;
use crate::config::Config;
use crate::input::bag::{BagError, BagOptions, BagSource};
use crate::input::{FrameSource, Tally};

/// Reads the whole bag as `replay` would, and says what is wrong with it.
pub fn examine_bag(path: &Path, config: &Config, options: BagOptions) -> Vec<Finding> {
    let mut source = match BagSource::open(path, config, options) {
        Ok(source) => source,
        Err(error) => return vec![unreadable(&error)],
    };
    let mut findings: Vec<Finding> = source
        .notes()
        .iter()
        .map(|note| {
            Finding::warning(
                note,
                "mcap recover IN -o OUT (or ros2 bag reindex) writes an index; replay reads the bag as it is",
            )
        })
        .collect();
    let mut check = FrameCheck::new(config);
    let mut broken = None;
    loop {
        match source.next_observation() {
            Ok(Some(observation)) => check.take(&observation.frame),
            Ok(None) => break,
            Err(error) => {
                broken = Some(unreadable(&error));
                break;
            }
        }
    }
    findings.extend(broken);
    findings.extend(check.findings());
    findings.extend(losses(source.tally(), source.explain(), check.frames()));
    findings
}

fn unreadable(error: &BagError) -> Finding {
    let fix = match error {
        BagError::NoImages { .. } => {
            "name the topics with --left-image and --right-image; for raw images add --set rectify=true"
        }
        BagError::Ambiguous { .. } => {
            "name the camera's topics with --left-image and --right-image"
        }
        BagError::NoTopic { .. } | BagError::TopicType { .. } => "name one of the bag's own topics",
        BagError::Empty { .. } | BagError::NoFiles { .. } => "record again",
        // The others say in their text what to do, or leave nothing to do.
        _ => "",
    };
    Finding::fault(error.to_string(), fix)
}

/// What did not become a frame.
pub fn losses(tally: &Tally, explanation: Option<String>, frames: usize) -> Vec<Finding> {
    // A reason that leaves nothing is a fault; one that costs some frames is not.
    let finding = |what: String, fix: &str| {
        if frames == 0 { Finding::fault(what, fix) } else { Finding::warning(what, fix) }
    };
    let mut findings: Vec<Finding> =
        explanation.map(|text| finding(text, "")).into_iter().collect();
    findings.extend(
        tally
            .skipped
            .iter()
            .map(|(reason, count)| finding(format!("{count} times: {reason}"), remedy(reason))),
    );
    if frames == 0 && findings.is_empty() {
        findings.push(Finding::fault(
            format!(
                "no stereo pair: {} left and {} right images without a partner",
                tally.unpaired_left, tally.unpaired_right
            ),
            "record both image topics and their camera infos",
        ));
    }
    findings
}
