//! Other streets of the same kind: who stands where, and what it looks like.

use super::super::noise::pick;

/// Which of the streets; [`SHIPPED`](Self::SHIPPED) leaves everything where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variation(pub u32);

impl Variation {
    /// The street of the shipped bag.
    pub const SHIPPED: Self = Self(0);
    /// Its own numbers, so that those of two streets do not meet.
    const APART: u32 = 7919;
    const STYLES: u32 = 1000;

    /// By how much item `id` is moved, between `low` and `high`.
    pub fn shift(self, id: u32, low: f64, high: f64) -> f64 {
        if self == Self::SHIPPED { 0.0 } else { self.pick(id, low, high) }
    }

    /// A factor for item `id`, between `low` and `high`.
    pub fn scale(self, id: u32, low: f64, high: f64) -> f64 {
        if self == Self::SHIPPED { 1.0 } else { self.pick(id, low, high) }
    }

    /// What item `id` is instead of `own`.
    pub fn choose<T: Copy>(self, id: u32, own: T, among: &[T]) -> T {
        if self == Self::SHIPPED {
            return own;
        }
        let place = self.pick(id, 0.0, among.len() as f64) as usize;
        among.get(place).copied().unwrap_or(own)
    }

    /// What chooses clothes or leaves, instead of `own`.
    pub const fn style(self, own: u32) -> u32 {
        own.wrapping_add(self.0.wrapping_mul(Self::STYLES))
    }

    fn pick(self, id: u32, low: f64, high: f64) -> f64 {
        pick(self.0.wrapping_mul(Self::APART).wrapping_add(id), 77, low, high)
    }
}
