//! Bags as an output: ROS 2 messages in MCAP files, laid out as rosbag2 does.

mod export;
mod metadata;
mod sink;
mod write;

pub use export::{ExportError, Exported, export_bag};
pub use sink::{BagSink, BagTopicsOut};
pub use write::{BagWriteError, BagWriter, Packing, Topic};
