//! Masks seen cell by cell: counts, removal, connected components.

use crate::image::{Image, Size};
use crate::stage::coarse::CELL;
use crate::stage::roi::bits::BitMask;

/// Cells per word of a mask.
const PER_WORD: usize = u64::BITS as usize / CELL;

// A cell is a nibble of each of four rows.
const _: () = assert!(CELL == 4);

/// How many pixels of each cell are set, 0..=16.
pub fn count_cells(mask: &BitMask, out: &mut Image<u8>) {
    let cells = mask.size().divided_by(CELL);
    out.resize(cells);
    for y in 0..cells.height {
        let rows = y * CELL..((y + 1) * CELL).min(mask.size().height);
        for (word, counts) in out.row_mut(y).chunks_mut(PER_WORD).enumerate() {
            let (mut even, mut odd) = (0, 0);
            for row in rows.clone() {
                let nibbles = nibble_counts(mask.row(row)[word]);
                even += nibbles & 0x0f0f_0f0f_0f0f_0f0f;
                odd += nibbles >> 4 & 0x0f0f_0f0f_0f0f_0f0f;
            }
            for (pair, (even, odd)) in
                counts.chunks_mut(2).zip(even.to_le_bytes().into_iter().zip(odd.to_le_bytes()))
            {
                pair[0] = even;
                if let Some(second) = pair.get_mut(1) {
                    *second = odd;
                }
            }
        }
    }
}

/// Set bits of each nibble, in place.
const fn nibble_counts(word: u64) -> u64 {
    let pairs = word - (word >> 1 & 0x5555_5555_5555_5555);
    (pairs & 0x3333_3333_3333_3333) + (pairs >> 2 & 0x3333_3333_3333_3333)
}

/// Clears the pixels of every cell for which `keep` of its column and row is false.
pub fn retain_cells(mask: &mut BitMask, mut keep: impl FnMut(usize, usize) -> bool) {
    let cells = mask.size().divided_by(CELL);
    for y in 0..cells.height {
        let rows = y * CELL..((y + 1) * CELL).min(mask.size().height);
        for first in (0..cells.width).step_by(PER_WORD) {
            let mut kept = 0;
            for x in first..(first + PER_WORD).min(cells.width) {
                kept |= (u64::from(keep(x, y)) * 0xf) << (CELL * (x - first));
            }
            for row in rows.clone() {
                mask.row_mut(row)[first / PER_WORD] &= kept;
            }
        }
    }
}

/// Connected components of cells that hold set pixels (8 neighbours).
#[derive(Default)]
pub struct Components {
    counts: Image<u8>,
    /// Per cell the index of another cell of its component, or its own.
    parents: Vec<u32>,
    /// Per root cell the set pixels of its component.
    areas: Vec<u32>,
}

impl Components {
    /// Clears components of fewer than `min_area` set pixels.
    pub fn remove_small(&mut self, mask: &mut BitMask, min_area: u32) {
        count_cells(mask, &mut self.counts);
        let Size { width, height } = self.counts.size();
        self.parents.clear();
        self.parents.extend(0..(width * height) as u32);
        let (counts, parents) = (&self.counts, &mut self.parents);
        for y in 0..height {
            let here = counts.row(y);
            let above = if y > 0 { counts.row(y - 1) } else { &[] };
            let occupied = |x: usize| above.get(x).is_some_and(|&count| count > 0);
            for x in (0..width).filter(|&x| here[x] > 0) {
                let i = y * width + x;
                // The cell above touches all other neighbours that came before.
                if occupied(x) {
                    join(parents, i, i - width);
                    continue;
                }
                if x > 0 && here[x - 1] > 0 {
                    join(parents, i, i - 1);
                } else if x > 0 && occupied(x - 1) {
                    join(parents, i, i - width - 1);
                }
                if occupied(x + 1) {
                    join(parents, i, i - width + 1);
                }
            }
        }
        // A parent never comes after its child: one pass makes all of them roots.
        for i in 0..parents.len() {
            parents[i] = parents[parents[i] as usize];
        }
        self.areas.clear();
        self.areas.resize(width * height, 0);
        for (i, &count) in counts.pixels().iter().enumerate() {
            if count > 0 {
                self.areas[parents[i] as usize] += u32::from(count);
            }
        }
        let areas = &self.areas;
        retain_cells(mask, |x, y| areas[parents[y * width + x] as usize] >= min_area);
    }
}

/// The representative of a cell's component; halves the path on the way.
fn root(parents: &mut [u32], mut i: usize) -> usize {
    while parents[i] as usize != i {
        parents[i] = parents[parents[i] as usize];
        i = parents[i] as usize;
    }
    i
}

/// Makes two components one. The smaller index becomes the root.
fn join(parents: &mut [u32], a: usize, b: usize) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b)] = a.min(b) as u32;
}
