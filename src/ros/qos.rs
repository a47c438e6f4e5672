//! Quality of service of every topic, with the resource limits that `RustDDS`
//! needs: without them a reader keeps 64 samples of a topic and a reliable
//! writer up to 8192 unacknowledged ones, which is gigabytes of images.

mod overrides;

pub use overrides::{PREFIX, QosOverrides, Role};

use rustdds::policy::{Durability, History, Lifespan, ResourceLimits};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};

/// Samples kept per topic: ROS 2's keep-last depth of the interface.
const DEPTH: i32 = 5;

const fn limits(max_samples: i32) -> ResourceLimits {
    ResourceLimits { max_samples, max_instances: 1, max_samples_per_instance: max_samples }
}

const fn keep_last(depth: i32) -> QosPolicyBuilder {
    QosPolicyBuilder::new()
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth })
        .resource_limits(limits(depth))
}

/// Images and camera infos in: sensor data (best effort, volatile, keep last 5).
pub const fn sensor_data() -> QosPolicies {
    keep_last(DEPTH).best_effort().build()
}

/// Topics out: reliable, volatile, keep last 5. A full window is answered with
/// `WouldBlock` at once.
pub const fn output() -> QosPolicies {
    keep_last(DEPTH).reliable(Duration::ZERO).build()
}

/// As [`output`], with room for a minute of small messages: a subscriber that
/// crashed acknowledges nothing until its lease of some 20 s has run out, and
/// the others must not miss anything because of it.
pub const fn small_output() -> QosPolicies {
    keep_last(DEPTH).reliable(Duration::ZERO).resource_limits(limits(1000)).build()
}

/// Whoever wants every message of an [`output`]: reliable, keep last 50.
pub const fn reliable_input() -> QosPolicies {
    keep_last(50).reliable(Duration::ZERO).build()
}

/// `/clock`: best effort, the latest.
pub const fn clock() -> QosPolicies {
    keep_last(1).best_effort().build()
}

/// `/parameter_events`: reliable, volatile.
pub const fn parameter_events() -> QosPolicies {
    keep_last(100).reliable(Duration::ZERO).build()
}

/// `/rosout`: reliable, the last thousand lines of ten seconds for whoever
/// comes late.
pub const fn rosout() -> QosPolicies {
    keep_last(1000)
        .durability(Durability::TransientLocal)
        .lifespan(Lifespan { duration: Duration::from_secs(10) })
        .reliable(Duration::ZERO)
        .build()
}
