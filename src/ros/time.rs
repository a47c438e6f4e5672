//! The node's time: the system clock, or `/clock` with `use_sim_time`.
//!
//! It stamps what the node says about itself (log, diagnostics, parameter
//! events). Perceptions carry the stamps of their images.

use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::stamp::Stamp;

/// Means that no simulated time is in use.
const SYSTEM: i64 = i64::MIN;

/// The node's clock, shared between threads.
#[derive(Debug)]
pub struct NodeClock {
    simulated: AtomicI64,
}

impl Default for NodeClock {
    fn default() -> Self {
        Self { simulated: AtomicI64::new(SYSTEM) }
    }
}

impl NodeClock {
    /// Uses simulated time (zero until the first `/clock`), or the system's.
    pub fn simulate(&self, on: bool) {
        if on {
            let _ = self.simulated.compare_exchange(SYSTEM, 0, Ordering::AcqRel, Ordering::Acquire);
        } else {
            self.simulated.store(SYSTEM, Ordering::Release);
        }
    }

    /// Takes a time of `/clock`, if simulated time is in use.
    pub fn set(&self, now: Stamp) {
        if self.simulated.load(Ordering::Acquire) != SYSTEM {
            self.simulated.store(now.0.max(SYSTEM + 1), Ordering::Release);
        }
    }

    /// The time now.
    pub fn now(&self) -> Stamp {
        match self.simulated.load(Ordering::Acquire) {
            SYSTEM => Stamp(
                SystemTime::now()
                    .duration_since(UNIX_EPOCH)
                    .map_or(0, |since| i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)),
            ),
            simulated => Stamp(simulated),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simulated_time_is_used_while_switched_on() {
        let clock = NodeClock::default();
        clock.set(Stamp(5));
        assert!(clock.now().0 > 1_000_000_000);
        clock.simulate(true);
        assert_eq!(clock.now(), Stamp(0));
        clock.set(Stamp(5));
        clock.simulate(true);
        assert_eq!(clock.now(), Stamp(5));
        clock.simulate(false);
        assert!(clock.now().0 > 1_000_000_000);
    }
}
