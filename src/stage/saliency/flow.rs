//! Where the cells of this frame were in the previous one.

use crate::image::{Image, Size};
use crate::simd::{Level, dispatch};
use crate::stage::preprocess::resize::box_mean;
use crate::stage::saliency::upsample::upsample;

/// Halvings of the quarter-size view.
const LEVELS: usize = 3;
/// Pixels between blocks along each axis.
const STEP: usize = 4;
/// Side of a block in pixels: blocks overlap by half.
const BLOCK: usize = 8;
const AREA: f32 = (BLOCK * BLOCK) as f32;
/// Search at the coarsest level in its pixels, to each side: with one more
/// pixel at each finer level, 15 cells or 60 full-size pixels in all.
const REACH: i32 = 3;
/// What a pixel of distance from the prediction costs, in gray levels summed
/// over a block: without texture the prediction stands.
const STIFFNESS: u32 = 12;
/// Mean difference in gray levels up to which a match is trusted fully, and
/// over which trust fades to none.
const SURE: f32 = 16.0;
const FADE: f32 = 16.0;

/// Mean rise of the difference in gray levels, one pixel off the best place,
/// from which that place is taken to parts of a pixel.
const LEAST_RISE: f32 = 0.75;
/// The same, summed over both axes, from which a block's shift is firm.
const FIRM_RISE: f32 = 4.0;

/// How a block moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockShift {
    /// Columns and rows from the block to its place in the previous frame, to
    /// parts of a pixel.
    pub shift: [f32; 2],
    /// 0 where any other shift would do as well, 1 where texture holds the block firm.
    pub firmness: f32,
}

/// Block matching from coarse to fine on the quarter-size gray view.
pub struct Flow {
    level: Level,
    now: [Image<u8>; LEVELS],
    before: [Image<u8>; LEVELS],
    windows: [Windows; LEVELS],
    grid: Image<[i32; 2]>,
    next: Image<[i32; 2]>,
    rows: [Vec<[i32; 2]>; 3],
    block: Image<f32>,
    /// One per 4x4 pixels: see [`Flow::sharpen`].
    pub blocks: Image<BlockShift>,
    /// Columns from each cell to its place in the previous frame.
    pub dx: Image<f32>,
    /// Rows from each cell to its place in the previous frame.
    pub dy: Image<f32>,
    /// 1 where the two places look alike, 0 where what is here now was not
    /// seen before.
    pub trust: Image<f32>,
}

impl Flow {
    /// The stage at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            now: Default::default(),
            before: Default::default(),
            windows: Default::default(),
            grid: Image::default(),
            next: Image::default(),
            rows: Default::default(),
            block: Image::default(),
            blocks: Image::default(),
            dx: Image::default(),
            dy: Image::default(),
            trust: Image::default(),
        }
    }

    /// Matches two views of one size.
    pub fn run(&mut self, before: &Image<u8>, now: &Image<u8>) {
        pyramid(self.level, before, &mut self.before);
        pyramid(self.level, now, &mut self.now);
        self.grid.resize(Size::default());
        for level in (0..LEVELS).rev() {
            let (now, windows) = (&self.now[level], &mut self.windows[level]);
            windows.take(&self.before[level]);
            self.next.resize(now.size().divided_by(STEP));
            dispatch!(self.level, _simd => refine(now, windows, &self.grid, &mut self.next));
            let Self { next, rows, grid, .. } = self;
            dispatch!(self.level, _simd => median(next, rows, grid));
        }
        let (size, grid) = (now.size(), &self.grid);
        self.block.resize(grid.size());
        for (axis, out) in [&mut self.dx, &mut self.dy].into_iter().enumerate() {
            for (value, shift) in self.block.pixels_mut().iter_mut().zip(grid.pixels()) {
                *value = shift[axis] as f32;
            }
            upsample(self.level, &self.block, size, out);
        }
        let (now, before, trust) = (&self.now[0], &self.windows[0], &mut self.block);
        dispatch!(self.level, _simd => {
            for y in 0..grid.height() {
                for (x, value) in trust.row_mut(y).iter_mut().enumerate() {
                    let cost = Block::new(now, x, y).and_then(|b| b.cost(before, grid.get(x, y)));
                    let mean = cost.unwrap_or(0) as f32 / AREA;
                    *value = (1.0 - (mean - SURE) / FADE).clamp(0.0, 1.0);
                }
            }
        });
        upsample(self.level, &self.block, size, &mut self.trust);
    }

    /// Fills [`Flow::blocks`]: the shifts of the last run to parts of a pixel.
    ///
    /// Around its minimum the sum of absolute differences has the shape of a V
    /// with arms of one slope: with values l and r one pixel to either side of
    /// the lowest, c, it is at (l − r) / (2 (max(l, r) − c)).
    pub fn sharpen(&mut self) {
        self.blocks.resize(self.grid.size());
        let Self { level, now: [now, ..], windows: [before, ..], grid, blocks, .. } = self;
        dispatch!(*level, _simd => {
            for y in 0..grid.height() {
                for x in 0..grid.width() {
                    blocks.set(x, y, sharpened(now, before, (x, y), grid.get(x, y)));
                }
            }
        });
    }
}

#[inline(always)]
fn sharpened(
    now: &Image<u8>,
    before: &Windows,
    (x, y): (usize, usize),
    best: [i32; 2],
) -> BlockShift {
    let mut out = BlockShift { shift: best.map(|shift| shift as f32), firmness: 0.0 };
    let Some(block) = Block::new(now, x, y) else { return out };
    let Some(lowest) = block.cost(before, best) else { return out };
    let mut rises = 0.0;
    for axis in 0..2 {
        let (mut back, mut on) = (best, best);
        back[axis] -= 1;
        on[axis] += 1;
        let (less, more) = (block.cost(before, back), block.cost(before, on));
        let most = less.unwrap_or(lowest).max(more.unwrap_or(lowest));
        let rise = most.saturating_sub(lowest) as f32 / AREA;
        rises += rise;
        if let (Some(less), Some(more)) = (less, more)
            && rise >= LEAST_RISE
        {
            let slope = (less as f32 - more as f32) / AREA;
            out.shift[axis] += (slope / (2.0 * rise)).clamp(-0.5, 0.5);
        }
    }
    out.firmness = (rises / FIRM_RISE).min(1.0);
    out
}

/// Shifts of the blocks of one level from those of the coarser one, of which
/// the coarsest level has none.
#[inline(always)]
fn refine(
    now: &Image<u8>,
    before: &Windows,
    coarser: &Image<[i32; 2]>,
    shifts: &mut Image<[i32; 2]>,
) {
    let coarsest = coarser.size().is_empty();
    let reach = if coarsest { REACH } else { 1 };
    for y in 0..shifts.height() {
        for x in 0..shifts.width() {
            let guess = if coarsest {
                [0, 0]
            } else {
                let u = (x / 2).min(coarser.width() - 1);
                let v = (y / 2).min(coarser.height() - 1);
                coarser.get(u, v).map(|shift| 2 * shift)
            };
            let Some(block) = Block::new(now, x, y) else {
                shifts.set(x, y, guess);
                continue;
            };
            let mut search = Search { before, block, guess, best: guess, cost: u32::MAX };
            search.consider(guess);
            let left = if x > 0 { shifts.get(x - 1, y) } else { guess };
            let above = if y > 0 { shifts.get(x, y - 1) } else { guess };
            // Often the same: nothing is weighed twice.
            let still = [0, 0];
            if still != guess {
                search.consider(still);
            }
            if left != guess && left != still {
                search.consider(left);
            }
            if above != guess && above != still && above != left {
                search.consider(above);
            }
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let shift = [guess[0] + dx, guess[1] + dy];
                    // At the finer levels a step along one axis at a time.
                    let step = shift != guess && (coarsest || dx * dy == 0);
                    if step && shift != still && shift != left && shift != above {
                        search.consider(shift);
                    }
                }
            }
            shifts.set(x, y, search.best);
        }
    }
}

/// The search for one block's place. (Methods and no closures, which would be
/// compiled without the wide instructions.)
struct Search<'a> {
    before: &'a Windows,
    block: Block,
    guess: [i32; 2],
    best: [i32; 2],
    cost: u32,
}

impl Search<'_> {
    #[inline(always)]
    fn consider(&mut self, shift: [i32; 2]) {
        if let Some(cost) = self.block.cost(self.before, shift) {
            let off = shift[0].abs_diff(self.guess[0]) + shift[1].abs_diff(self.guess[1]);
            let cost = cost + STIFFNESS * off;
            if cost < self.cost {
                (self.best, self.cost) = (shift, cost);
            }
        }
    }
}

fn pyramid(level: Level, view: &Image<u8>, out: &mut [Image<u8>; LEVELS]) {
    out[0].copy_from(view);
    for i in 1..LEVELS {
        let (finer, coarser) = out.split_at_mut(i);
        let (fine, coarse) = (&finer[i - 1], &mut coarser[0]);
        let size = fine.size().divided_by(2);
        coarse.resize(size);
        box_mean::<1, 2>(level, fine.pixels(), fine.width(), coarse.pixels_mut(), size.width);
    }
}

/// A block of a view.
struct Block {
    pixels: [u8; BLOCK * BLOCK],
    /// Its left upper corner, and those of the last ones inside the view.
    start: [usize; 2],
    last: [usize; 2],
}

impl Block {
    /// Block `(x, y)`; those at the edge move inside. `None` where the view is smaller.
    #[inline(always)]
    fn new(view: &Image<u8>, x: usize, y: usize) -> Option<Self> {
        let last = [view.width().checked_sub(BLOCK)?, view.height().checked_sub(BLOCK)?];
        let start =
            |block: usize, last: usize| (block * STEP).saturating_sub((BLOCK - STEP) / 2).min(last);
        let start = [start(x, last[0]), start(y, last[1])];
        let mut pixels = [0; BLOCK * BLOCK];
        for (i, row) in pixels.as_chunks_mut::<BLOCK>().0.iter_mut().enumerate() {
            *row = *view.row(start[1] + i)[start[0]..].first_chunk()?;
        }
        Some(Self { pixels, start, last })
    }

    /// Sum of absolute differences between the block and its shifted place;
    /// `None` where that is not inside the view.
    #[inline(always)]
    fn cost(&self, before: &Windows, shift: [i32; 2]) -> Option<u32> {
        let x = usize::try_from(self.start[0] as i32 + shift[0]).ok()?;
        let y = usize::try_from(self.start[1] as i32 + shift[1]).ok()?;
        if x > self.last[0] || y > self.last[1] {
            return None;
        }
        let place = before.block(x, y)?;
        let mut sum = 0;
        for (here, there) in self.pixels.iter().zip(place) {
            sum += u32::from(here.abs_diff(*there));
        }
        Some(sum)
    }
}

/// A view in which every block stands in one piece: of each pixel the row of
/// [`BLOCK`] pixels that begins with it, column by column.
#[derive(Debug, Default)]
struct Windows {
    height: usize,
    rows: Vec<[u8; BLOCK]>,
}

impl Windows {
    fn take(&mut self, view: &Image<u8>) {
        let columns = (view.width() + 1).saturating_sub(BLOCK);
        self.height = view.height();
        self.rows.resize(columns * self.height, [0; BLOCK]);
        // Written in order: the view is small enough to be read in any.
        for (x, column) in self.rows.chunks_exact_mut(self.height.max(1)).enumerate() {
            for (place, row) in column.iter_mut().zip(view.rows()) {
                if let Some(window) = row[x..].first_chunk() {
                    *place = *window;
                }
            }
        }
    }

    /// The block with its left upper corner at `(x, y)`, in rows.
    #[inline(always)]
    fn block(&self, x: usize, y: usize) -> Option<&[u8; BLOCK * BLOCK]> {
        let rows: &[[u8; BLOCK]; BLOCK] = self.rows.get(x * self.height + y..)?.first_chunk()?;
        rows.as_flattened().first_chunk()
    }
}

/// Median over 3x3 blocks, each axis by itself; beyond the edge the outermost
/// blocks continue. `rows` is a buffer.
#[inline(always)]
fn median(shifts: &Image<[i32; 2]>, rows: &mut [Vec<[i32; 2]>; 3], out: &mut Image<[i32; 2]>) {
    let Size { width, height } = shifts.size();
    out.resize(shifts.size());
    if shifts.size().is_empty() {
        return;
    }
    for y in 0..height {
        for (row, y) in rows.iter_mut().zip([y.saturating_sub(1), y, (y + 1).min(height - 1)]) {
            let shifts = shifts.row(y);
            row.clear();
            row.extend(shifts.first());
            row.extend_from_slice(shifts);
            row.extend(shifts.last());
        }
        // Axes side by side: the next block is two numbers further on.
        let [above, here, below] = rows.each_ref().map(|row| row.as_flattened());
        let n = 2 * width;
        let (above, here, below) = (&above[..n + 4], &here[..n + 4], &below[..n + 4]);
        let out = &mut out.row_mut(y).as_flattened_mut()[..n];
        for i in 0..n {
            // As in the median of an image: see `preprocess::denoise`.
            let [l0, m0, h0] = sorted([above[i], here[i], below[i]]);
            let [l1, m1, h1] = sorted([above[i + 2], here[i + 2], below[i + 2]]);
            let [l2, m2, h2] = sorted([above[i + 4], here[i + 4], below[i + 4]]);
            let low = l0.max(l1).max(l2);
            let high = h0.min(h1).min(h2);
            out[i] = sorted([low, sorted([m0, m1, m2])[1], high])[1];
        }
    }
}

/// Three values in ascending order.
#[inline(always)]
fn sorted([a, b, c]: [i32; 3]) -> [i32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    let (middle, high) = (high.min(c), high.max(c));
    [low.min(middle), low.max(middle), high]
}

// Blocks are spread over cells by the same interpolation as cells over pixels.
const _: () = assert!(STEP == crate::stage::coarse::CELL);
