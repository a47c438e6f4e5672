//! Saliency-guided stereo perception: which things in view matter, and how far
//! they are.
//!
//! Data flows one way through the rooms:
//!
//! ```text
//! door in -> sync -> pipeline stages -> door out
//! ```
//!
//! | room | what it holds |
//! |---|---|
//! | [`config`], [`error`], [`stamp`], [`image`], [`camera`], [`perception`], [`simd`] | the nouns |
//! | `input` | doors in: live topics, bags, dataset folders, the renderer |
//! | [`sync`] | pairs left, right and camera infos by stamp |
//! | [`pipeline`], [`stage`] | the method: one frame in, one perception out |
//! | `output` | doors out: live topics, bags, the HTML report |
//! | `ros` | messages, conversions, parameters, the node |
//! | `metric` | what the field measures, and stage times over many frames |
//! | `evaluation`, `table` | measured tables: methods on data with truth |
//! | `drive`, `command` | sources paired with sinks, and the command line |
//!
//! Without the default feature `tool` only the core remains, which knows no
//! ROS, file, socket or clock.

pub mod camera;
#[cfg(feature = "tool")]
pub mod command;
pub mod config;
#[cfg(feature = "tool")]
pub mod drive;
pub mod error;
#[cfg(feature = "tool")]
pub mod evaluation;
pub mod image;
#[cfg(feature = "tool")]
pub mod input;
#[cfg(feature = "tool")]
pub mod mailbox;
#[cfg(feature = "tool")]
pub mod metric;
#[cfg(feature = "tool")]
pub mod output;
pub mod perception;
pub mod pipeline;
#[cfg(feature = "tool")]
pub mod ros;
pub mod simd;
pub mod stage;
pub mod stamp;
pub mod sync;
#[cfg(feature = "tool")]
pub mod table;
