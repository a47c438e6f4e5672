//! Removal of small patches of disparity.

use rayon::prelude::*;

use crate::image::Image;
use crate::simd::prelude::*;
use crate::simd::{Level, Simd, dispatch, i16x16};
use crate::stage::refine::{Area, ROWS_AT_ONCE};
use crate::stage::stereo::NO_MATCH;

/// Columns of a word: one bit each.
const WORD: usize = 64;
const LANES: usize = 16;

/// Connected patches, stretch by stretch: pixels of one row whose disparities
/// follow each other closely.
#[derive(Default)]
pub struct Speckles {
    rows: Rows,
    /// First stretch of each row of the area, and one more.
    firsts: Vec<usize>,
    stretches: Vec<Stretch>,
    parents: Vec<u32>,
    areas: Vec<u32>,
    /// First row of the area.
    y0: usize,
    least: usize,
}

/// How the pixels of each row of the area hang together, a bit per column.
#[derive(Default)]
struct Rows {
    /// Words per row.
    stride: usize,
    links: Vec<Links>,
}

#[derive(Clone, Copy, Default)]
struct Links {
    /// A stretch starts here.
    starts: u64,
    /// A stretch ends here.
    ends: u64,
    /// Close to the pixel above.
    up: u64,
    /// Stretches that start in the words before.
    before: u32,
}

#[derive(Clone, Copy)]
struct Stretch {
    x0: u32,
    x1: u32,
}

impl Speckles {
    /// Finds every 4-connected patch inside `area` of fewer than `least` pixels
    /// in which neighbours differ by at most `range` steps.
    pub fn find(
        &mut self,
        level: Level,
        image: &Image<i16>,
        area: &Area,
        least: usize,
        range: i32,
    ) {
        (self.y0, self.least) = (area.rows.start, least);
        self.firsts.clear();
        self.stretches.clear();
        if least <= 1 {
            return;
        }
        self.rows.read(level, image, area, range);
        self.split(area.rows.len());
        self.join(area.rows.len());
        // A parent stands before its children: one walk leads all to their roots.
        for i in 0..self.parents.len() {
            let parent = self.parents[i] as usize;
            self.parents[i] = self.parents[parent];
        }
        for (i, stretch) in self.stretches.iter().enumerate() {
            self.areas[self.parents[i] as usize] += stretch.x1 - stretch.x0;
        }
    }

    /// Sets to [`NO_MATCH`] what belongs to a small patch in `row`, the columns
    /// of the area in image row `y`.
    pub fn erase(&self, y: usize, row: &mut [i16]) {
        let i = y - self.y0;
        let Some(firsts) = self.firsts.get(i..i + 2) else { return };
        for index in firsts[0]..firsts[1] {
            if (self.areas[self.parents[index] as usize] as usize) < self.least {
                let Stretch { x0, x1 } = self.stretches[index];
                row[x0 as usize..x1 as usize].fill(NO_MATCH);
            }
        }
    }

    /// Cuts the rows into stretches.
    fn split(&mut self, rows: usize) {
        for y in 0..rows {
            let first = self.stretches.len();
            self.firsts.push(first);
            let mut closed = first;
            for (i, word) in self.rows.row_mut(y).iter_mut().enumerate() {
                word.before = (self.stretches.len() - first) as u32;
                let x = (i * WORD) as u32;
                let starts = bits(word.starts).map(|bit| Stretch { x0: x + bit, x1: 0 });
                self.stretches.extend(starts);
                for bit in bits(word.ends) {
                    self.stretches[closed].x1 = x + bit + 1;
                    closed += 1;
                }
            }
        }
        self.firsts.push(self.stretches.len());
        self.parents.clear();
        self.parents.extend(0..self.stretches.len() as u32);
        self.areas.clear();
        self.areas.resize(self.stretches.len(), 0);
    }

    /// Joins the stretches of a row with those above that they touch.
    fn join(&mut self, rows: usize) {
        for y in 1..rows {
            let mut touching_before = false;
            for i in 0..self.rows.stride {
                let (above, here) = (self.rows.row(y - 1)[i], self.rows.row(y)[i]);
                // One touch of each pair of stretches is enough: where one of
                // them starts, or the touch itself.
                let new = !(here.up << 1 | u64::from(touching_before));
                touching_before = here.up >> (WORD - 1) != 0;
                for bit in bits(here.up & (new | here.starts | above.starts)) {
                    let upper = self.firsts[y - 1] + above.stretch_at(bit);
                    let lower = self.firsts[y] + here.stretch_at(bit);
                    self.unite(upper as u32, lower as u32);
                }
            }
        }
    }

    fn root(&mut self, mut index: u32) -> u32 {
        while self.parents[index as usize] != index {
            let parent = self.parents[index as usize];
            self.parents[index as usize] = self.parents[parent as usize];
            index = self.parents[index as usize];
        }
        index
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The smaller index stays root.
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

impl Links {
    /// Which stretch of the row covers column `bit` of the word.
    fn stretch_at(self, bit: u32) -> usize {
        let up_to = self.starts & (u64::MAX >> (WORD as u32 - 1 - bit));
        (self.before + up_to.count_ones()) as usize - 1
    }
}

impl Rows {
    fn row(&self, y: usize) -> &[Links] {
        &self.links[y * self.stride..(y + 1) * self.stride]
    }

    fn row_mut(&mut self, y: usize) -> &mut [Links] {
        &mut self.links[y * self.stride..(y + 1) * self.stride]
    }

    fn read(&mut self, level: Level, image: &Image<i16>, area: &Area, range: i32) {
        self.stride = area.columns.len().div_ceil(WORD);
        self.links.clear();
        self.links.resize(self.stride * area.rows.len(), Links::default());
        let range = range.clamp(0, i32::from(i16::MAX)) as i16;
        let row = |y: usize| &image.row(y)[area.columns.clone()];
        let rows = self.links.par_chunks_exact_mut(self.stride.max(1)).enumerate();
        rows.with_min_len(ROWS_AT_ONCE).for_each(|(i, links)| {
            let y = area.rows.start + i;
            let above = if i == 0 { &[][..] } else { row(y - 1) };
            dispatch!(level, simd => read_row(simd, above, row(y), range, links));
        });
    }
}

/// The links of one row. Nothing is above where `above` is empty.
#[inline(always)]
fn read_row<S: Simd>(simd: S, above: &[i16], here: &[i16], range: i16, out: &mut [Links]) {
    let range = i16x16::splat(simd, range);
    let none = i16x16::splat(simd, NO_MATCH);
    for (i, out) in out.iter_mut().enumerate() {
        // One column more on either side; nothing is there at the ends.
        let x = i * WORD;
        let mut near = [NO_MATCH; WORD + 2];
        let left = usize::from(i == 0);
        let known = &here[(x + left) - 1..(x + WORD + 1).min(here.len())];
        near[left..left + known.len()].copy_from_slice(known);
        let mut over = [NO_MATCH; WORD];
        if let Some(known) = above.get(x..(x + WORD).min(above.len())) {
            over[..known.len()].copy_from_slice(known);
        }
        if known.iter().fold(NO_MATCH, |most, &d| most.max(d)) == NO_MATCH {
            continue;
        }
        let (mut to_left, mut to_right, mut up, mut valid) = (0, 0, 0, 0);
        for lane in (0..WORD).step_by(LANES) {
            let centre = i16x16::from_slice(simd, &near[lane + 1..lane + 1 + LANES]);
            to_left |= linked(simd, centre, &near[lane..], range) << lane;
            to_right |= linked(simd, centre, &near[lane + 2..], range) << lane;
            up |= linked(simd, centre, &over[lane..], range) << lane;
            valid |= (!centre.simd_eq(none)).to_bitmask() << lane;
        }
        *out =
            Links { starts: valid & !to_left, ends: valid & !to_right, up: valid & up, before: 0 };
    }
}

/// A bit for each of 16 pixels whose neighbour in `others` is close, if that has
/// a disparity.
#[inline(always)]
fn linked<S: Simd>(simd: S, centre: i16x16<S>, others: &[i16], range: i16x16<S>) -> u64 {
    let other = i16x16::from_slice(simd, &others[..LANES]);
    // The difference of two disparities fits; that of none is not used.
    let close = (centre.max(other) - centre.min(other)).simd_le(range);
    (close & !other.simd_eq(i16x16::splat(simd, NO_MATCH))).to_bitmask()
}

/// Places of the bits that are set, from the lowest up.
fn bits(mut word: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        (word != 0).then(|| {
            let bit = word.trailing_zeros();
            word &= word - 1;
            bit
        })
    })
}
