//! Everything that only ROS 2 knows: messages, conversions, parameters, the node.

pub mod args;
pub mod cdr;
pub mod message;
pub mod names;
pub mod params;
pub mod schema;
pub mod yaml;

/// Name of the node before remapping.
pub const NODE_NAME: &str = "salient_stereo";
