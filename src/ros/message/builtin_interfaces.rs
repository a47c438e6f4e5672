//! Time.

#![allow(missing_docs, reason = "the .msg texts document the fields")]

use serde::{Deserialize, Serialize};

use crate::stamp::Stamp;

/// A point in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Time {
    pub sec: i32,
    pub nanosec: u32,
}

impl From<Stamp> for Time {
    fn from(stamp: Stamp) -> Self {
        Self { sec: stamp.sec(), nanosec: stamp.nanosec() }
    }
}

impl From<Time> for Stamp {
    fn from(time: Time) -> Self {
        Self::from_parts(time.sec, time.nanosec)
    }
}

/// A span of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Duration {
    pub sec: i32,
    pub nanosec: u32,
}

impl From<std::time::Duration> for Duration {
    /// Saturates after 68 years.
    fn from(span: std::time::Duration) -> Self {
        Self {
            sec: i32::try_from(span.as_secs()).unwrap_or(i32::MAX),
            nanosec: span.subsec_nanos(),
        }
    }
}

message! {
    Time = "builtin_interfaces/msg/Time",
    Duration = "builtin_interfaces/msg/Duration",
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_and_stamp_convert_both_ways() {
        for stamp in [Stamp(0), Stamp(-1), Stamp(1_700_000_000_123_456_789)] {
            assert_eq!(Stamp::from(Time::from(stamp)), stamp);
        }
        assert_eq!(Time::from(Stamp(-1)), Time { sec: -1, nanosec: 999_999_999 });
    }
}
