//! The matching cost: how far two descriptors differ.

use crate::config;
use crate::simd::prelude::*;
use crate::simd::{Block, LANES, Simd, abs_diff, load, load_block, u8x32};
use crate::stage::stereo::census::{OFFSETS, PLANES};

/// The difference of gradients counts up to here: a quarter of what the census
/// may say, so that one strong edge cannot outvote the surroundings.
pub const MAX_GRADIENT_COST: u8 = 6;

/// Largest cost of one pixel: all bits differ, and the gradients as well.
pub const MAX_COST: u8 = OFFSETS.len() as u8 + MAX_GRADIENT_COST;

/// One byte of 32 descriptors per plane.
pub type Descriptors<S> = [u8x32<S>; PLANES];

/// The descriptors from index `at` of rows of byte planes `stride` apart.
#[inline(always)]
pub fn descriptors<S: Simd>(simd: S, planes: &[u8], stride: usize, at: usize) -> Descriptors<S> {
    [
        load(simd, planes, at),
        load(simd, planes, at + stride),
        load(simd, planes, at + 2 * stride),
        load(simd, planes, at + 3 * stride),
    ]
}

/// Cost of 32 pairs of descriptors: the Hamming distance of the census plus the
/// difference of the gradients.
#[inline(always)]
pub fn cost<S: Simd>(a: &Descriptors<S>, b: &Descriptors<S>) -> u8x32<S> {
    ((a[0] ^ b[0]).count_ones() + (a[1] ^ b[1]).count_ones())
        + ((a[2] ^ b[2]).count_ones() + abs_diff(a[3], b[3]).min(MAX_GRADIENT_COST))
}

/// Largest penalty. Path costs are bytes: a cost, P2 and, before the smallest is
/// taken, P1 on top of P2.
pub const MAX_PENALTY: u8 = 100;
const _: () = assert!(MAX_COST as u32 + MAX_PENALTY as u32 <= 255 && 2 * MAX_PENALTY as u32 <= 255);

/// Penalties of a disparity step between two pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Penalties {
    /// For a step of one pixel.
    pub p1: u8,
    /// For a larger step between pixels of equal brightness.
    pub p2: u8,
    /// What an edge takes off P2.
    pub edges: Edges,
}

/// How much the edges of an image say about jumps of disparity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edges {
    /// Those of a view: P2 falls by 2 |dI|, down to a tenth of the way from P1 to P2.
    Sharp,
    /// Those of a shrunk view, where texture makes steps as large: P2 falls by |dI|,
    /// down to a quarter of the way.
    Blurred,
}

impl Penalties {
    /// Those of a configuration.
    pub fn of(stereo: &config::Stereo) -> Self {
        let most = i64::from(MAX_PENALTY);
        let p1 = stereo.p1.clamp(0, most);
        Self { p1: p1 as u8, p2: stereo.p2.clamp(p1, most) as u8, edges: Edges::Sharp }
    }

    /// The same for shrunk views: P2 is five sixths of that of the views, but not below P1.
    #[must_use]
    pub fn shrunk(self) -> Self {
        let p2 = u16::from(self.p2) * 5 / 6;
        Self { p2: (p2 as u8).max(self.p1), edges: Edges::Blurred, ..self }
    }

    /// P2 is never less than this, however strong the edge.
    pub const fn least_p2(self) -> u8 {
        let parts = match self.edges {
            Edges::Sharp => 10,
            Edges::Blurred => 4,
        };
        self.p1 + (self.p2 - self.p1) / parts
    }
}

/// P1 and P2 of 32 pixels.
#[derive(Clone, Copy)]
pub struct PenaltyLanes<S: Simd> {
    /// P1.
    pub p1: u8x32<S>,
    /// P2 where the brightness does not change.
    pub p2: u8x32<S>,
    /// The least P2.
    pub least: u8x32<S>,
    /// The bits of |dI| that count twice: all or none.
    twice: u8x32<S>,
}

impl<S: Simd> PenaltyLanes<S> {
    /// The penalties divided by the data weight w of eq. 6: scaling the data
    /// term by w is scaling P1 and P2 by 1/w. `reciprocals` holds 255/w of each
    /// pixel, and nothing where the weight is off.
    #[inline(always)]
    pub fn new(simd: S, penalties: Penalties, reciprocals: Option<&Block>) -> Self {
        Self {
            p1: scaled(simd, penalties.p1, reciprocals),
            p2: scaled(simd, penalties.p2, reciprocals),
            least: scaled(simd, penalties.least_p2(), reciprocals),
            twice: u8x32::splat(simd, if penalties.edges == Edges::Sharp { 255 } else { 0 }),
        }
    }

    /// P2 across a brightness step |dI|: lower where an edge makes a jump likely.
    #[inline(always)]
    pub fn p2_across(&self, step: u8x32<S>) -> u8x32<S> {
        self.p2.saturating_sub(step).saturating_sub(step & self.twice).max(self.least)
    }
}

#[inline(always)]
fn scaled<S: Simd>(simd: S, penalty: u8, reciprocals: Option<&Block>) -> u8x32<S> {
    let Some(reciprocals) = reciprocals else { return u8x32::splat(simd, penalty) };
    let mut out = [0; LANES];
    for (out, &q) in out.iter_mut().zip(reciprocals) {
        *out = ((penalty as u16 * q as u16 + 127) / 255) as u8;
    }
    load_block(simd, &out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn penalties_stay_in_order_whatever_is_configured() {
        for (p1, p2, expected) in [(8, 96, [8, 96, 16]), (100, 100, [100; 3]), (40, 7, [40; 3])] {
            let penalties = Penalties::of(&config::Stereo { p1, p2, ..Default::default() });
            let [least, shrunk] = [penalties.least_p2(), penalties.shrunk().p2];
            assert_eq!([penalties.p1, penalties.p2, least], expected);
            assert_eq!(shrunk, (expected[1] as u16 * 5 / 6).max(expected[0] as u16) as u8);
        }
        let shrunk = Penalties::of(&config::Stereo::default()).shrunk();
        assert_eq!([shrunk.p1, shrunk.p2, shrunk.least_p2()], [8, 80, 26]);
    }
}
