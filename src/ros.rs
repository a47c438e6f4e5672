//! Everything that only ROS 2 knows: messages, conversions, parameters, the node.

pub mod cdr;
pub mod message;
pub mod schema;
