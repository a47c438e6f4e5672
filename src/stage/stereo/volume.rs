//! The shape of one run and the sums of its path costs.

use crate::image::Image;
use crate::simd::{Block, LANES};
use crate::stage::coarse::CELL;
use crate::stage::stereo::plan::{BAND, Tile};

/// 255/w of eq. 6 around one run.
#[derive(Clone, Copy)]
pub struct Weight<'a> {
    /// 255/w per pixel of the image.
    pub image: &'a Image<u8>,
    /// Image column of the run's first column.
    pub x0: usize,
    /// Image row of the run's first row, context not counted.
    pub y0: usize,
}

impl Weight<'_> {
    /// The value at a column of the run and a row of the band.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> u8 {
        self.image.get_clamped((self.x0 + x) as isize, (self.y0 + y) as isize)
    }
}

/// One run of a band. Columns count from the run's first one, rows from the
/// band's first one, or from the first row of its context where said so.
#[derive(Clone, Copy)]
pub struct RunShape<'a> {
    /// Its tiles from left to right.
    pub tiles: &'a [Tile],
    /// Rows to be matched.
    pub rows: usize,
    /// Rows above them that only lead paths in.
    pub context_above: usize,
    /// Rows below them that only lead paths in.
    pub context_below: usize,
    /// Smallest disparity of the tiles.
    pub lo: usize,
    /// One more than the largest.
    pub hi: usize,
    /// Weights of eq. 6, if on.
    pub weight: Option<Weight<'a>>,
}

impl RunShape<'_> {
    /// Columns.
    #[inline(always)]
    pub const fn width(&self) -> usize {
        self.tiles.len() * LANES
    }

    /// Row, counted with the context, of lane `i`; lanes beyond the band repeat its last row.
    #[inline(always)]
    pub fn row(&self, i: usize) -> usize {
        self.context_above + i.min(self.rows - 1)
    }

    /// Disparities from the smallest to the largest.
    #[inline(always)]
    pub const fn range(&self) -> usize {
        self.hi - self.lo
    }

    /// Columns of the right image that the run looks at: from its own first
    /// column less `hi - 1` to its last one less `lo`.
    pub const fn right_width(&self) -> usize {
        self.width() + self.range() - 1
    }

    /// First of the right image's columns (as counted by `right_width`) that
    /// column `x` of a tile looks at: its partner at the largest disparity.
    #[inline(always)]
    pub const fn right_from(&self, x: usize, tile: &Tile) -> usize {
        x + self.hi - (tile.lo + tile.n)
    }
}

/// Sums of path costs: tile by tile, row, disparity, 32 columns. (While the
/// horizontal paths are at work: column, disparity, 32 rows.)
#[derive(Default)]
pub struct Volume {
    sums: Vec<Block>,
    starts: Vec<usize>,
    /// Sum over the paths of their minimum over the disparities: tile, row.
    floors: Vec<[u16; LANES]>,
}

impl Volume {
    /// Makes room for `tiles`. What is in it is unspecified.
    pub fn resize(&mut self, tiles: &[Tile]) {
        self.starts.clear();
        let mut start = 0;
        for tile in tiles {
            self.starts.push(start);
            start += tile.n * BAND;
        }
        self.starts.push(start);
        self.sums.resize(start, [0; LANES]);
        self.floors.resize(tiles.len() * BAND, [0; LANES]);
    }

    /// All rows of one tile.
    #[inline(always)]
    pub fn tile_mut(&mut self, tile: usize) -> &mut [Block] {
        &mut self.sums[self.starts[tile]..self.starts[tile + 1]]
    }

    /// One row of one tile: a block per disparity.
    #[inline(always)]
    pub fn row_mut(&mut self, tile: usize, y: usize) -> &mut [Block] {
        let blocks = self.tile_mut(tile);
        let n = blocks.len() / BAND;
        &mut blocks[y * n..(y + 1) * n]
    }

    /// One row of one tile, to be read.
    #[inline(always)]
    pub fn row(&self, tile: usize, y: usize) -> &[Block] {
        let blocks = &self.sums[self.starts[tile]..self.starts[tile + 1]];
        let n = blocks.len() / BAND;
        &blocks[y * n..(y + 1) * n]
    }

    /// Sums of minima of one row of one tile.
    #[inline(always)]
    pub fn floor_mut(&mut self, tile: usize, y: usize) -> &mut [u16; LANES] {
        &mut self.floors[tile * BAND + y]
    }
}

/// Where paths start that enter a run from outside: at the coarse disparity,
/// instead of knowing nothing.
#[derive(Clone, Copy)]
pub struct Seeds<'a> {
    /// Coarse disparity in pixels, NaN where unknown.
    pub coarse: &'a Image<f32>,
    /// Image column of the run's first column.
    pub x0: usize,
    /// Image row of the band's first row.
    pub y0: usize,
    /// Run column at which paths from the left start.
    pub left: usize,
    /// Run column at which paths from the right start.
    pub right: usize,
}

/// Half pixels of 32 columns or rows; [`UNKNOWN`] where nothing is known.
type HalfPixels = [i16; LANES];

/// No disparity is preferred.
const UNKNOWN: i16 = i16::MIN;

impl Seeds<'_> {
    /// Coarse disparity at a run column and an image row.
    #[inline(always)]
    pub fn at(&self, x: usize, image_y: usize) -> i16 {
        let coarse =
            self.coarse.get_clamped(((self.x0 + x) / CELL) as isize, (image_y / CELL) as isize);
        if coarse.is_nan() { UNKNOWN } else { (2.0 * coarse + 0.5) as i16 }
    }

    /// Start of 32 paths: a cost of two per pixel of distance from the coarse
    /// disparity, up to P2; none where it is unknown.
    #[inline(always)]
    pub fn costs(coarse: &HalfPixels, d: usize, p2: u8) -> Block {
        let mut out = [0; LANES];
        for (out, &coarse) in out.iter_mut().zip(coarse) {
            let cost = coarse.saturating_sub(2 * d as i16).saturating_abs().min(p2 as i16) as u8;
            *out = if coarse == UNKNOWN { 0 } else { cost };
        }
        out
    }

    /// The state of a horizontal path before its first column.
    #[inline(always)]
    pub fn fill_column(
        &self,
        tile: &Tile,
        shape: &RunShape<'_>,
        x: usize,
        p2: u8,
        state: &mut [Block],
    ) {
        let mut coarse = [UNKNOWN; LANES];
        for (i, coarse) in coarse.iter_mut().enumerate() {
            *coarse = self.at(x, self.y0 + i.min(shape.rows - 1));
        }
        for i in 0..tile.n {
            let d = tile.lo + i;
            state[d - shape.lo + 1] = Self::costs(&coarse, d, p2);
        }
    }
}
