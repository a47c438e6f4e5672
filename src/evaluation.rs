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
pub mod maps;
pub mod measure;
pub mod method;
mod motion;
pub mod part;
mod peer;
pub mod readme;
pub mod report;
mod run;
mod shots;
pub mod store;
mod tables;
mod truth;

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
}
