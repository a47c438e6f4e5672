//! The commands: pairings of a source and sinks.

pub mod node;
pub mod render;
