//! Bags as an output: the general writer.

mod metadata;
mod write;

pub use write::{BagWriteError, BagWriter, Packing, Topic};
