//! Measured tables: what every method yields on data with truth.
//!
//! ```text
//! data set -> scenes -> for each method: frames -> pipeline -> Part
//! parts (of any number of runs and machines) -> tables, report
//! ```
//!
//! A [`Part`] is one scene by one method: everything in it can be added to
//! that of other scenes, so that scenes can be measured in any order and place.

mod figures;
mod group;
pub mod part;
mod peer;
pub mod readme;
pub mod report;
mod tables;

use std::path::PathBuf;

use figures::Figures;
pub use part::{Part, Run, Shot};
pub use peer::{Peer, Peers};
pub use tables::{csv, json, markdown, tables};

/// All that was measured, to be shown.
#[derive(Clone, Debug, Default)]
pub struct Evaluation {
    /// The command that measured it.
    pub command: String,
    /// The parts, in any order.
    pub parts: Vec<Part>,
    /// What other matchers yield on the same pairs.
    pub peers: Vec<Peer>,
    /// Where the pictures of [`Shot::file`] lie.
    pub folder: PathBuf,
}
