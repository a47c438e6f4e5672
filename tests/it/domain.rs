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
