//! Bags as an output: ROS 2 messages in MCAP files, laid out as rosbag2 does.

mod metadata;
mod sink;
mod write;

pub use sink::{BagSink, BagTopicsOut};
pub use write::{BagWriteError, BagWriter, Packing, Topic};
