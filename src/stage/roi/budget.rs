//! The area budget: which tiles are worth matching.

use crate::image::Image;
use crate::stage::coarse::CELL;
use crate::stage::roi::bits::BitMask;
use crate::stage::roi::cells::{count_cells, retain_cells};

/// Cells per tile along each axis: a tile is 16x16 pixels.
pub const TILE: usize = 4;
/// Steps of the ranking of tiles.
const RANKS: usize = 256;

/// Keeps the most salient tiles of a mask within a budget of pixels.
#[derive(Default)]
pub struct Budget {
    counts: Image<u8>,
    /// Per tile: mask pixels, and saliency summed over them.
    tiles: Vec<(u32, f32)>,
    kept: Vec<bool>,
    columns: usize,
}

impl Budget {
    /// Chooses the tiles of `matched` by mean saliency over their mask pixels,
    /// which gives the most saliency in all, until `limit` pixels are spent.
    /// Among tiles of one rank (1/256) the upper left ones come first, and one
    /// that no longer fits is passed over.
    pub fn choose(&mut self, matched: &BitMask, attention: &Image<f32>, limit: usize) {
        count_cells(matched, &mut self.counts);
        let tiles = self.counts.size().divided_by(TILE);
        self.columns = tiles.width;
        self.tiles.clear();
        self.tiles.resize(tiles.area(), (0, 0.0));
        for y in 0..self.counts.height() {
            let cells = self.counts.row(y).iter().zip(attention.row(y));
            for (x, (&count, &saliency)) in cells.enumerate() {
                let (area, sum) = &mut self.tiles[y / TILE * tiles.width + x / TILE];
                *area += u32::from(count);
                *sum += f32::from(count) * saliency;
            }
        }
        let mut areas = [0_usize; RANKS];
        for &tile in &self.tiles {
            areas[rank(tile)] += tile.0 as usize;
        }
        // The ranks above `cut` fit as a whole.
        let mut left = limit;
        let mut cut = RANKS;
        while cut > 0 && areas[cut - 1] <= left {
            cut -= 1;
            left -= areas[cut];
        }
        self.kept.clear();
        for &tile in &self.tiles {
            let fits = rank(tile) + 1 == cut && tile.0 as usize <= left;
            if fits {
                left -= tile.0 as usize;
            }
            self.kept.push(fits || rank(tile) >= cut);
        }
    }

    /// Clears what lies outside the chosen tiles.
    pub fn apply(&self, mask: &mut BitMask) {
        retain_cells(mask, |x, y| self.kept[y / TILE * self.columns + x / TILE]);
    }
}

/// Mean saliency of a tile in steps.
fn rank((area, sum): (u32, f32)) -> usize {
    // The cast takes the NaN of an empty tile to 0.
    ((sum / area as f32 * RANKS as f32) as usize).min(RANKS - 1)
}

// A tile's area in pixels is exact in a float.
const _: () = assert!((TILE * CELL).pow(2) < 1 << 24);
