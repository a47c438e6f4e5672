//! Whether a true object keeps its track.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Counts identity switches (CLEAR MOT, Bernardin and Stiefelhagen 2008): a
/// true object that was matched to one track is matched to another one. A gap
/// in between does not excuse the switch.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct IdSwitches {
    track_of: BTreeMap<u16, u32>,
    switches: u64,
    /// Objects of scenes that are over.
    past_objects: usize,
}

impl IdSwitches {
    /// Adds the matches of one frame as (true object, track id); track 0 means
    /// that tracking is off and is not counted.
    pub fn add(&mut self, matches: impl IntoIterator<Item = (u16, u32)>) {
        for (object, track) in matches.into_iter().filter(|(_, track)| *track != 0) {
            let before = self.track_of.insert(object, track);
            self.switches += u64::from(before.is_some_and(|before| before != track));
        }
    }

    /// Adds the counts of another scene, whose objects are others.
    pub fn merge(&mut self, other: &Self) {
        self.switches += other.switches;
        self.past_objects += other.objects();
    }

    /// Switches so far; `None` when no object was ever matched to a track.
    pub fn total(&self) -> Option<u64> {
        (self.objects() > 0).then_some(self.switches)
    }

    /// True objects that were ever matched to a track.
    pub fn objects(&self) -> usize {
        self.track_of.len() + self.past_objects
    }
}
