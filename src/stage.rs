//! The stages of the method: one file, one noun, one verb each.

pub mod coarse;
pub mod depth;
pub mod ground;
mod per_thread;
pub mod pole;
pub mod preprocess;
pub mod refine;
pub mod regions;
pub mod roi;
pub mod saliency;
pub mod standing;
pub mod stereo;
pub mod table;
pub mod track;
