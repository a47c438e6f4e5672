//! The SIMD room: the one place that decides which instructions are used.
//!
//! A [`Level`] is chosen once and handed to every stage; kernels are generic
//! over it and give the same result at every level. Calls of
//! [`fearless_simd::dispatch`] stand inside rayon closures, never around them:
//! around them the closures would be compiled without the wide instructions.

pub use fearless_simd::{Level, dispatch};

/// The best instruction set of this processor.
pub fn detect() -> Level {
    Level::new()
}
