//! Time as data: nanoseconds carried by the messages, never read from a clock.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A message time stamp in nanoseconds since the epoch of its source.
///
/// Stamps are only compared with other stamps of the same stream, never with
/// wall time, so a replay at any speed gives the same result.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Stamp(pub i64);

impl Stamp {
    /// Stamp from the `sec`, `nanosec` pair of `builtin_interfaces/Time`.
    pub const fn from_parts(sec: i32, nanosec: u32) -> Self {
        Self(sec as i64 * 1_000_000_000 + nanosec as i64)
    }

    /// Stamp from seconds.
    pub fn from_seconds(seconds: f64) -> Self {
        Self((seconds * 1e9).round() as i64)
    }

    /// The `sec` part of `builtin_interfaces/Time` (rounded towards minus infinity).
    pub const fn sec(self) -> i32 {
        self.0.div_euclid(1_000_000_000) as i32
    }

    /// The `nanosec` part of `builtin_interfaces/Time`, 0..1e9.
    pub const fn nanosec(self) -> u32 {
        self.0.rem_euclid(1_000_000_000) as u32
    }

    /// `self − earlier` in seconds; negative when `self` is the earlier one.
    pub fn seconds_since(self, earlier: Self) -> f64 {
        (self.0 - earlier.0) as f64 * 1e-9
    }
}

impl fmt::Display for Stamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:09}", self.0.div_euclid(1_000_000_000), self.nanosec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_survive_the_round_trip_also_before_the_epoch() {
        for (sec, nanosec) in [(0, 0), (5, 999_999_999), (-1, 500_000_000), (i32::MAX, 1)] {
            let stamp = Stamp::from_parts(sec, nanosec);
            assert_eq!((stamp.sec(), stamp.nanosec()), (sec, nanosec));
        }
    }
}
