//! DDS domains for tests.

/// Domains of one process.
const EACH: u16 = 12;

/// The domain for the `test`-th of the tests that talk over DDS: no other test
/// of this process uses it, and hardly one of another. Up to domain 101 the
/// ports lie below those that Linux gives to others.
pub fn domain(test: u16) -> u16 {
    assert!(test < EACH, "domains for {EACH} tests");
    1 + (std::process::id() % 8) as u16 * EACH + test
}

/// A TCP port for the `test`-th of the tests that talk over Zenoh, below those
/// that Linux gives to others.
#[cfg(feature = "zenoh")]
pub fn port(test: u16) -> u16 {
    20_000 + (std::process::id() % 2000) as u16 * 4 + test
}

/// The overrides of a Zenoh session that connects or listens at TCP endpoints
/// on this machine. A busy machine does not drop messages: by default a link
/// drops what it cannot take within a millisecond, as `rmw_zenoh` does.
#[cfg(feature = "zenoh")]
pub fn zenoh_overrides(connect: &[u16], listen: &[u16]) -> String {
    const DROP: &str = "transport/link/tx/queue/congestion_control/drop";
    const PATIENCE_US: u32 = 20_000_000;
    let endpoints = |ports: &[u16]| {
        let each: Vec<String> = ports.iter().map(|port| format!("tcp/127.0.0.1:{port}")).collect();
        serde_json::to_string(&each).unwrap()
    };
    format!(
        "connect/endpoints={};listen/endpoints={};\
         {DROP}/wait_before_drop={PATIENCE_US};{DROP}/max_wait_before_drop_fragments={PATIENCE_US}",
        endpoints(connect),
        endpoints(listen)
    )
}
