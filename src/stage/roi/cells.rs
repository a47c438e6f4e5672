//! Masks seen cell by cell: counts, removal, connected components.

use std::ops::Range;

use crate::image::Image;
use crate::stage::coarse::CELL;
use crate::stage::regions::union_find::UnionFind;
use crate::stage::roi::bits::{BitMask, first_clear, first_set};

/// Pixels per word of a mask, and cells.
const WORD: usize = u64::BITS as usize;
const PER_WORD: usize = WORD / CELL;

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
            if rows.clone().all(|row| mask.row(row)[first / PER_WORD] == 0) {
                continue;
            }
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
    /// Set pixels of the word row of cells that is looked at: one bit for each cell.
    occupied: Vec<u64>,
    runs: Vec<Run>,
    sets: UnionFind,
    /// Per representative the set pixels of its component.
    areas: Vec<u32>,
}

/// Cells side by side that hold set pixels, and how many of those.
#[derive(Clone, Copy, Debug)]
struct Run {
    y: u32,
    start: u32,
    end: u32,
    area: u32,
}

impl Components {
    /// Clears components of fewer than `min_area` set pixels.
    pub fn remove_small(&mut self, mask: &mut BitMask, min_area: u32) {
        self.find_runs(mask);
        self.areas.clear();
        self.areas.resize(self.runs.len(), 0);
        for (i, run) in (0..).zip(&self.runs) {
            self.areas[self.sets.find(i) as usize] += run.area;
        }
        for (i, run) in (0..).zip(&self.runs) {
            if self.areas[self.sets.find(i) as usize] < min_area {
                clear(mask, run);
            }
        }
    }

    /// All runs, row by row, and unions between those of neighbouring rows.
    fn find_runs(&mut self, mask: &BitMask) {
        let cells = mask.size().divided_by(CELL);
        self.runs.clear();
        self.sets.clear();
        self.occupied.resize(cells.width.div_ceil(WORD), 0);
        let mut above = 0;
        for y in 0..cells.height {
            let rows = rows_of(mask, y);
            self.occupied.fill(0);
            for word in 0..mask.size().width.div_ceil(WORD) {
                let any = rows.clone().fold(0, |any, row| any | mask.row(row)[word]);
                let at = word * PER_WORD;
                self.occupied[at / WORD] |= occupied_nibbles(any) << (at % WORD);
            }
            let here = self.runs.len();
            let mut next = first_set(&self.occupied, 0);
            while let Some(start) = next {
                let end = first_clear(&self.occupied, start);
                next = first_set(&self.occupied, end);
                let area = rows.clone().map(|row| count(mask.row(row), start, end)).sum();
                self.runs.push(Run { y: y as u32, start: start as u32, end: end as u32, area });
                self.sets.push();
            }
            // Runs of this row and of the row above, both from left to right.
            let (mut upper, mut lower) = (above, here);
            while upper < here && lower < self.runs.len() {
                let (a, b) = (self.runs[upper], self.runs[lower]);
                if a.start <= b.end && b.start <= a.end {
                    self.sets.union(upper as u32, lower as u32);
                }
                // The one that ends first can touch no other.
                if a.end < b.end {
                    upper += 1;
                } else {
                    lower += 1;
                }
            }
            above = here;
        }
    }
}

/// The rows of pixels of a row of cells.
fn rows_of(mask: &BitMask, y: usize) -> Range<usize> {
    y * CELL..((y + 1) * CELL).min(mask.size().height)
}

/// One bit for each nibble that is not 0.
const fn occupied_nibbles(word: u64) -> u64 {
    let pairs = word | word >> 1;
    let mut bits = (pairs | pairs >> 2) & 0x1111_1111_1111_1111;
    // Every fourth bit moves to the others.
    bits = (bits | bits >> 3) & 0x0303_0303_0303_0303;
    bits = (bits | bits >> 6) & 0x000f_000f_000f_000f;
    bits = (bits | bits >> 12) & 0x0000_00ff_0000_00ff;
    (bits | bits >> 24) & 0xffff
}

/// The bits of each word that belong to the cells `start..end`.
fn parts(start: usize, end: usize) -> impl Iterator<Item = (usize, u64)> {
    let (start, end) = (start * CELL, end * CELL);
    (start / WORD..end.div_ceil(WORD)).map(move |word| {
        let from = u64::MAX << start.saturating_sub(word * WORD);
        let to = u64::MAX >> ((word + 1) * WORD).saturating_sub(end);
        (word, from & to)
    })
}

/// Set pixels of a row in the cells `start..end`.
fn count(row: &[u64], start: usize, end: usize) -> u32 {
    parts(start, end).map(|(word, bits)| (row[word] & bits).count_ones()).sum()
}

fn clear(mask: &mut BitMask, run: &Run) {
    for row in rows_of(mask, run.y as usize) {
        let row = mask.row_mut(row);
        for (word, bits) in parts(run.start as usize, run.end as usize) {
            row[word] &= !bits;
        }
    }
}
