//! What is matched: bands of rows, runs of tiles, and the disparities of each tile.

use std::ops::Range;

use crate::image::{Image, Size};
use crate::simd::LANES;
use crate::stage::coarse::CELL;

/// Rows of a band: as many as a vector has lanes, because the horizontal paths
/// walk all rows of a band at once.
pub const BAND: usize = LANES;

/// Runs closer than this many pixels become one.
const MERGE: usize = 24;

/// Share of the image from which on everything is matched.
const FULL_FRAME_FROM: f32 = 0.6;

/// Pixels around a tile whose coarse disparities count for its range.
const REACH: usize = 12;

/// Pixels by which the range exceeds the coarse disparities.
const SLACK: f32 = 3.0;

/// Least disparities of a tile, where so many are searched: fewer would have no
/// second best that is no neighbour of the best.
pub const LEAST: usize = 8;

/// The same where the tile itself has too few of them.
const FAR_REACH: usize = 48;
const FAR_SLACK: f32 = 8.0;

/// A tile of 32 columns and the rows of its band.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Smallest disparity.
    pub lo: usize,
    /// Number of disparities, >= 1.
    pub n: usize,
}

/// Adjacent tiles: tile `k` covers the columns from `x0 + 32 k`. The last one
/// may reach beyond the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// First column.
    pub x0: usize,
    /// Its tiles in [`Plan::tiles`].
    pub tiles: Range<usize>,
    /// Smallest disparity of its tiles.
    pub lo: usize,
    /// One more than the largest disparity of its tiles.
    pub hi: usize,
}

/// Up to 32 rows that are matched independently of all others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Band {
    /// First row.
    pub y0: usize,
    /// One after the last row.
    pub y1: usize,
    /// Its runs in [`Plan::runs`].
    pub runs: Range<usize>,
    /// Smallest disparity of its runs.
    pub lo: usize,
    /// One more than the largest disparity of its runs.
    pub hi: usize,
}

/// The matched part of an image.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Bands from top to bottom.
    pub bands: Vec<Band>,
    /// Runs, band by band, from left to right.
    pub runs: Vec<Run>,
    /// Tiles, run by run, from left to right.
    pub tiles: Vec<Tile>,
    columns: Vec<u8>,
}

impl Plan {
    /// Everything, with all disparities of `search`.
    pub fn whole(&mut self, size: Size, search: &Range<usize>) {
        self.clear();
        for y0 in (0..size.height).step_by(BAND) {
            self.push_band(size, y0..(y0 + BAND).min(size.height), None, None, search);
        }
    }

    /// Where `mask` is set; the disparities of each tile from the coarse ones
    /// around it, all of `search` where they are too few to be trusted.
    pub fn of_mask(
        &mut self,
        mask: &Image<u8>,
        fraction: f32,
        coarse: Option<&Image<f32>>,
        search: &Range<usize>,
    ) {
        self.clear();
        let size = mask.size();
        let mask = (fraction < FULL_FRAME_FROM).then_some(mask);
        let active = |y: usize| {
            mask.is_none_or(|mask| mask.row(y).iter().fold(0, |any, &value| any | value) != 0)
        };
        let mut y = 0;
        while y < size.height {
            if !active(y) {
                y += 1;
                continue;
            }
            let mut end = (y + BAND).min(size.height);
            while !active(end - 1) {
                end -= 1;
            }
            self.push_band(size, y..end, mask, coarse, search);
            y = end;
        }
    }

    fn clear(&mut self) {
        self.bands.clear();
        self.runs.clear();
        self.tiles.clear();
    }

    fn push_band(
        &mut self,
        size: Size,
        rows: Range<usize>,
        mask: Option<&Image<u8>>,
        coarse: Option<&Image<f32>>,
        search: &Range<usize>,
    ) {
        self.columns.clear();
        self.columns.resize(size.width, u8::from(mask.is_none()));
        if let Some(mask) = mask {
            for y in rows.clone() {
                for (any, value) in self.columns.iter_mut().zip(mask.row(y)) {
                    *any |= value;
                }
            }
        }
        let first_run = self.runs.len();
        let mut x = 0;
        while let Some(x0) = next_set(&self.columns, x) {
            let mut end = next_clear(&self.columns, x0);
            while let Some(next) = next_set(&self.columns, end) {
                let covered = x0 + (end - x0).next_multiple_of(LANES);
                if next >= covered.max(end + MERGE) {
                    break;
                }
                end = next_clear(&self.columns, next);
            }
            let first_tile = self.tiles.len();
            for tile_x in (x0..end).step_by(LANES) {
                let tile = match coarse {
                    Some(coarse) => narrowed(coarse, tile_x, &rows, search),
                    None => Tile { lo: search.start, n: search.len() },
                };
                self.tiles.push(tile);
            }
            let tiles = &self.tiles[first_tile..];
            self.runs.push(Run {
                x0,
                tiles: first_tile..self.tiles.len(),
                lo: tiles.iter().map(|t| t.lo).min().unwrap_or(0),
                hi: tiles.iter().map(|t| t.lo + t.n).max().unwrap_or(0),
            });
            x = end.max(x0 + 1);
        }
        let runs = &self.runs[first_run..];
        self.bands.push(Band {
            y0: rows.start,
            y1: rows.end,
            runs: first_run..self.runs.len(),
            lo: runs.iter().map(|r| r.lo).min().unwrap_or(0),
            hi: runs.iter().map(|r| r.hi).max().unwrap_or(0),
        });
    }
}

fn next_set(columns: &[u8], from: usize) -> Option<usize> {
    columns.iter().skip(from).position(|&c| c != 0).map(|i| from + i)
}

fn next_clear(columns: &[u8], from: usize) -> usize {
    columns.iter().skip(from).position(|&c| c == 0).map_or(columns.len(), |i| from + i)
}

/// The disparities of one tile: those of the coarse cells in and around it,
/// with some slack. Where fewer than a third of the cells in it have a
/// disparity, its surroundings are asked as well, and everything is searched
/// where they know no more.
fn narrowed(coarse: &Image<f32>, x0: usize, rows: &Range<usize>, search: &Range<usize>) -> Tile {
    // What is not known from its surroundings has no partner further away than
    // the right image's border.
    let end = search.end.min((x0 + LANES + 1).max(search.start + LEAST));
    let all = Tile { lo: search.start, n: end - search.start };
    let window = |reach: usize| {
        let cells = |from: usize, to: usize, limit: usize| {
            (from.saturating_sub(reach) / CELL).min(limit)..(to + reach).div_ceil(CELL).min(limit)
        };
        (cells(x0, x0 + LANES, coarse.width()), cells(rows.start, rows.end, coarse.height()))
    };
    let known = |reach: usize| {
        let (columns, rows) = window(reach);
        let area = columns.len() * rows.len();
        let known: usize = rows
            .map(|y| coarse.row(y)[columns.clone()].iter().filter(|d| !d.is_nan()).count())
            .sum();
        3 * known >= area
    };
    let (reach, slack) = if known(0) {
        (REACH, SLACK)
    } else if known(FAR_REACH) {
        (FAR_REACH, FAR_SLACK)
    } else {
        return all;
    };
    let (columns, rows) = window(reach);
    let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
    for y in rows {
        for &d in &coarse.row(y)[columns.clone()] {
            // NaN changes neither.
            min = min.min(d);
            max = max.max(d);
        }
    }
    let from = (min - slack).floor().max(0.0) as usize;
    let to = (max + slack).ceil().max(0.0) as usize + 1;
    if min > max || to <= search.start || from >= search.end {
        return all;
    }
    let hi = to.max(from + LEAST).min(search.end);
    let lo = from.min(hi.saturating_sub(LEAST)).max(search.start);
    Tile { lo, n: hi - lo }
}
