//! Runs of one id in a row.

use std::ops::Range;

use crate::simd::{Simd, padded, prelude::*, u32x16};

/// Ids that are compared at once.
const LANES: usize = 16;

/// Words that hold the edges of a row of `width` ids.
pub fn edge_words(width: usize) -> usize {
    width / 64 + 1
}

/// Sets the bit of every place whose id is another than that of the place before, with 0
/// before the first one and behind the last one.
#[inline(always)]
pub fn find_edges<S: Simd>(simd: S, ids: &[u32], edges: &mut [u64]) {
    edges.fill(0);
    let mut last = u32x16::splat(simd, 0);
    for x in (0..=ids.len()).step_by(LANES) {
        let here: u32x16<S> = padded(simd, ids, x, 0);
        let same = last.slide::<{ LANES - 1 }>(here).simd_eq(here);
        edges[x / 64] |= (!same).to_bitmask() << (x % 64);
        last = here;
    }
}

/// The runs of one id each between the edges of a row, those of 0 among them.
#[derive(Clone)]
pub struct Spans<'a> {
    edges: &'a [u64],
    /// Index of the word that is looked at, and those of its bits that were not.
    index: usize,
    word: u64,
    start: Option<usize>,
}

impl<'a> Spans<'a> {
    /// Those of the row in which the edges were found.
    #[inline(always)]
    pub fn new(edges: &'a [u64]) -> Self {
        let mut spans =
            Self { edges, index: 0, word: edges.first().copied().unwrap_or(0), start: None };
        spans.start = spans.next_edge();
        spans
    }

    #[inline(always)]
    fn next_edge(&mut self) -> Option<usize> {
        while self.word == 0 {
            self.index += 1;
            self.word = *self.edges.get(self.index)?;
        }
        let edge = self.index * 64 + self.word.trailing_zeros() as usize;
        self.word &= self.word - 1;
        Some(edge)
    }
}

impl Iterator for Spans<'_> {
    type Item = Range<usize>;

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        let start = self.start?;
        self.start = self.next_edge();
        self.start.map(|end| start..end)
    }
}

/// The first run from place `from` on of an id that is not 0.
#[inline(always)]
pub fn run(ids: &[u32], from: usize) -> Option<(u32, Range<usize>)> {
    let start = same(ids, from, 0);
    let id = *ids.get(start)?;
    Some((id, start..same(ids, start, id)))
}

/// The first place from `from` on that does not have this id.
#[inline(always)]
fn same(ids: &[u32], mut from: usize, id: u32) -> usize {
    while let Some(group) = ids[from..].first_chunk::<8>() {
        let mut others = 0;
        for other in group {
            others |= other ^ id;
        }
        if others != 0 {
            break;
        }
        from += group.len();
    }
    from + ids[from..].iter().take_while(|other| **other == id).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{self, dispatch};

    #[test]
    fn runs_between_edges_are_those_that_are_looked_for() {
        for width in [0, 1, 15, 16, 17, 63, 64, 65, 128, 200] {
            for seed in 1..40 {
                let ids: Vec<u32> =
                    (0..width).map(|x| ((x / (1 + seed % 9) * seed * 7) as u32 >> 2) % 3).collect();
                let mut expected = Vec::new();
                while let Some((id, cells)) =
                    run(&ids, expected.last().map_or(0, |(_, cells): &(_, Range<usize>)| cells.end))
                {
                    expected.push((id, cells));
                }
                for level in simd::available() {
                    let mut edges = vec![u64::MAX; edge_words(width)];
                    dispatch!(level, simd => find_edges(simd, &ids, &mut edges));
                    let spans = Spans::new(&edges).filter(|cells| ids[cells.start] != 0);
                    let found: Vec<_> = spans.map(|cells| (ids[cells.start], cells)).collect();
                    assert_eq!(found, expected, "{ids:?}, {level:?}");
                }
            }
        }
    }

    #[test]
    fn runs_end_where_the_id_changes() {
        let ids = [[0; 11].as_slice(), &[3; 9], &[4; 1], &[0; 2], &[4; 17]].concat();
        let mut found = Vec::new();
        let mut next = 0;
        while let Some((id, cells)) = run(&ids, next) {
            next = cells.end;
            found.push((id, cells));
        }
        assert_eq!(found, [(3, 11..20), (4, 20..21), (4, 23..40)]);
    }
}
