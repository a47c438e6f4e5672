//! Regions of things that stand on the ground, from the fine disparity.

mod adopt;
mod fill;
mod paint;
mod post;
mod shrink;

use std::ops::Range;

use super::RegionSource;
use super::candidates::Candidates;
use super::runs::{Spans, edge_words, find_edges};
use super::trim::{NARROW_M, Trim};
use crate::image::{Image, Size};
use crate::perception::Rejections;
use crate::simd::{Level, dispatch};
use crate::stage::ground::Plane;
use crate::stage::roi::bits::{BitMask, bits_from, even_bits, first_set, last_set};
use crate::stage::standing::{HIGH, Standing, Things, WIDE, size_scale};
use adopt::adopt;
use paint::Painter;
use post::{Posts, Stump};
use shrink::shrink;

/// Share of a thing's cells that must be salient.
const LEAST_SALIENT: f32 = 0.4;
/// The former of such regions, with its buffers.
#[derive(Debug)]
pub struct Upright {
    level: Level,
    standing: Standing,
    things: Things,
    painter: Painter,
    posts: Posts,
    cells: Image<f32>,
    /// The cells whose disparity is a fine one.
    fine: BitMask,
    salient: Vec<u32>,
    number: Vec<u32>,
    /// Per row of cells the edges between things.
    edges: Vec<u64>,
    /// Of a row, the salient cells.
    bits: Vec<u64>,
}

impl Upright {
    /// The former with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            standing: Standing::new(level),
            things: Things::default(),
            painter: Painter::new(level),
            posts: Posts::default(),
            cells: Image::default(),
            fine: BitMask::default(),
            salient: Vec::new(),
            number: Vec::new(),
            edges: Vec::new(),
            bits: Vec::new(),
        }
    }

    /// Candidates for regions on `plane`, of things of at least `min_area`
    /// pixels; those that are refused here are counted.
    pub fn run(
        &mut self,
        plane: &Plane,
        source: &RegionSource<'_>,
        min_area: usize,
        out: &mut Candidates,
        rejections: &mut Rejections,
    ) {
        shrink(self.level, source, &mut self.cells, &mut self.fine);
        let least_cells = (min_area / (WIDE * HIGH)).max(1) as u32;
        self.standing.run(&self.cells, plane, source.rig, least_cells, &mut self.things);
        let count = self.choose(&source.roi.salient);
        self.painter.run(plane, source, (&self.things, &self.fine), count, out);
        self.trim(plane, source, out);
        self.follow(plane, source, out);
        adopt(source.poles, source.disparity, out);
        rejections.floating = self.things.floating;
        rejections.background = self.things.background;
        rejections.not_salient = (self.things.list.len() - count) as u32;
    }

    /// Numbers the things that are salient; returns how many.
    fn choose(&mut self, salient: &BitMask) -> usize {
        self.salient.clear();
        self.salient.resize(self.things.list.len(), 0);
        self.number.clear();
        self.number.resize(self.things.list.len(), 0);
        let words = edge_words(self.things.ids.width());
        self.edges.resize(self.things.ids.height() * words, 0);
        self.bits.resize(words, 0);
        let Self { level, things, salient: counts, number, edges, bits, .. } = self;
        dispatch!(*level, simd => {
            for ((cy, row), edges) in things.ids.rows().enumerate().zip(edges.chunks_exact_mut(words)) {
                find_edges(simd, row, edges);
                let Some(first) = first_set(edges, 0) else { continue };
                let end = last_set(edges, row.len() + 1).unwrap_or(first);
                let Size { width, height } = salient.size();
                let pixels = salient.row((cy * HIGH + HIGH / 2).min(height - 1));
                right_pixels(pixels, width, first..end, bits);
                for cells in Spans::new(edges) {
                    if let Some(thing) = row[cells.start].checked_sub(1) {
                        number[thing as usize] += cells.len() as u32;
                        counts[thing as usize] += count_set(bits, cells);
                    }
                }
            }
        });
        let mut count = 0;
        for (number, &salient) in self.number.iter_mut().zip(&self.salient) {
            let chosen = salient as f32 >= LEAST_SALIENT * *number as f32 && salient > 0;
            count += u32::from(chosen);
            *number = if chosen { count } else { 0 };
        }
        if count as usize == self.number.len() {
            return self.number.len();
        }
        for (cy, edges) in (0..self.things.ids.height()).zip(self.edges.chunks_exact(words)) {
            let row = self.things.ids.row_mut(cy);
            for cells in Spans::new(edges) {
                if let Some(thing) = row[cells.start].checked_sub(1) {
                    row[cells].fill(self.number[thing as usize]);
                }
            }
        }
        count as usize
    }

    /// Cuts narrow things at the edges that the image shows.
    fn trim(&self, plane: &Plane, source: &RegionSource<'_>, out: &mut Candidates) {
        let narrow = NARROW_M * size_scale(plane);
        for (thing, &id) in self.things.list.iter().zip(&self.number).filter(|(_, id)| **id != 0) {
            let bounds = &out.boxes[id as usize - 1];
            let depth = thing.depth_m[0].midpoint(thing.depth_m[1]);
            let focal = source.rig.focal_px() as f32;
            if bounds.area == 0 || bounds.width() as f32 * depth > narrow * focal {
                continue;
            }
            let surface = source.rig.depth_scale() as f32 / depth;
            let trim = Trim { left: source.left, disparity: source.disparity, surface };
            trim.run(self.level, id, out);
        }
    }

    /// Follows what may be posts up to their ends.
    fn follow(&mut self, plane: &Plane, source: &RegionSource<'_>, out: &mut Candidates) {
        for (thing, &id) in self.things.list.iter().zip(&self.number).filter(|(_, id)| **id != 0) {
            let depth = thing.depth_m[0].midpoint(thing.depth_m[1]);
            let stump = Stump {
                left: source.left,
                plane,
                disparity: source.rig.depth_scale() as f32 / depth,
                metre_px: source.rig.focal_px() as f32 / depth,
            };
            self.posts.run(&stump, id, out);
        }
    }
}

/// Sets the bits of those of `cells`, and of others, whose right pixel is set in a row of
/// `width` pixels; the last column may have none, and its left one tells.
#[inline(always)]
fn right_pixels(pixels: &[u64], width: usize, cells: Range<usize>, bits: &mut [u64]) {
    let words = cells.start / 64..cells.end.div_ceil(64);
    for (index, word) in words.clone().zip(&mut bits[words]) {
        let [low, high] =
            [0, 64].map(|at| even_bits(bits_from(pixels, index * WIDE * 64 + at) >> 1));
        *word = low | high << 32;
    }
    if !width.is_multiple_of(WIDE) {
        let cell = width / WIDE;
        bits[cell / 64] |= (bits_from(pixels, width - 1) & 1) << (cell % 64);
    }
}

/// How many bits of a range are set.
#[inline(always)]
fn count_set(bits: &[u64], Range { start, end }: Range<usize>) -> u32 {
    let mut count = 0;
    let words = start / 64..end.div_ceil(64);
    for (index, word) in words.clone().zip(&bits[words]) {
        let from = u64::MAX << start.saturating_sub(index * 64);
        let to = u64::MAX >> ((index + 1) * 64).saturating_sub(end);
        count += (word & from & to).count_ones();
    }
    count
}

// A cell has a left and a right pixel.
const _: () = assert!(WIDE == 2);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_right_pixel_of_a_cell_tells() {
        for width in [1, 2, 3, 31, 32, 33, 64, 127, 128, 129, 260] {
            let pixels: Vec<bool> = (0..width).map(|x| x * x % 7 < 3).collect();
            let cells: Vec<bool> =
                pixels.chunks(2).map(|cell| cell.last().is_some_and(|pixel| *pixel)).collect();
            let mut words = vec![0; pixels.len().div_ceil(64)];
            for (x, pixel) in pixels.iter().enumerate() {
                words[x / 64] |= u64::from(*pixel) << (x % 64);
            }
            for start in 0..cells.len() {
                for end in start + 1..=cells.len() {
                    let mut bits = vec![u64::MAX; edge_words(cells.len())];
                    right_pixels(&words, width, start..end, &mut bits);
                    let expected = cells[start..end].iter().filter(|set| **set).count();
                    assert_eq!(count_set(&bits, start..end) as usize, expected);
                }
            }
        }
    }
}
