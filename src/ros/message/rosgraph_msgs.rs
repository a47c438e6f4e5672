//! Simulated time.

#![allow(missing_docs, reason = "the .msg texts document the fields")]

use serde::{Deserialize, Serialize};

use super::builtin_interfaces::Time;

/// The time of a simulation or of a bag being played.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clock {
    pub clock: Time,
}

message! { Clock = "rosgraph_msgs/msg/Clock" }
