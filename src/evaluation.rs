//! Measured tables: what every method yields on data with truth.
//!
//! ```text
//! data set -> scenes -> for each method: frames -> pipeline -> Part
//! parts (of any number of runs and machines) -> tables, report
//! ```
//!
//! A [`Part`] is one scene by one method: everything in it can be added to
//! that of other scenes, so that scenes can be measured in any order and place.

pub mod part;

pub use part::{Part, Run, Shot};
