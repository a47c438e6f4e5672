//! Everything that only ROS 2 knows: messages, conversions, parameters, the node.

pub mod args;
pub mod calibration;
pub mod cdr;
pub mod convert;
pub mod diagnostics;
pub mod echo;
pub mod endpoint;
pub mod environment;
pub mod graph;
pub mod log;
pub mod message;
pub mod names;
pub mod node;
pub mod params;
pub mod play;
pub mod qos;
pub mod runtime;
pub mod schema;
pub mod security;
pub mod services;
pub mod time;
pub mod yaml;
#[cfg(feature = "zenoh")]
pub mod zenoh;

/// Name of the node before remapping.
pub const NODE_NAME: &str = "salient_stereo";
