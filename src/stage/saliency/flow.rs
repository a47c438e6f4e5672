//! Where the cells of this frame were in the previous one.

mod block;

use crate::image::{Image, Size};
use crate::simd::{Level, dispatch};
use crate::stage::preprocess::resize::box_mean;
use crate::stage::saliency::upsample::upsample;
use block::{AREA, Around, Block, NEVER, Windows, known};

/// Halvings of the quarter-size view.
const LEVELS: usize = 3;
/// Pixels between blocks along each axis.
const STEP: usize = 4;
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
    /// What was looked at last of the finest level.
    around: Image<Around>,
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
            around: Image::default(),
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
            self.around.resize(self.next.size());
            let Self { next, rows, around, grid, .. } = self;
            dispatch!(self.level, _simd => refine(now, windows, grid, around, next));
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
        let Self { now: [now, ..], windows: [before, ..], grid, around, block, .. } = self;
        dispatch!(self.level, _simd => {
            for y in 0..grid.height() {
                let shifts = grid.row(y).iter().zip(around.row_mut(y));
                for (x, (value, (shift, around))) in block.row_mut(y).iter_mut().zip(shifts).enumerate() {
                    if around.shift != *shift {
                        *around = Around::of(Block::new(now, x, y).as_ref(), before, *shift);
                    }
                    let mean = known(around.here).unwrap_or(0) as f32 / AREA;
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
        self.blocks.resize(self.around.size());
        let Self { level, around, blocks, .. } = self;
        dispatch!(*level, _simd => {
            for (block, around) in blocks.pixels_mut().iter_mut().zip(around.pixels()) {
                *block = around.sharpened();
            }
        });
    }
}

/// Shifts of the blocks of one level from those of the coarser one, of which
/// the coarsest level has none, and at the others what is around those that were guessed.
#[inline(always)]
fn refine(
    now: &Image<u8>,
    before: &Windows,
    coarser: &Image<[i32; 2]>,
    around: &mut Image<Around>,
    shifts: &mut Image<[i32; 2]>,
) {
    let coarsest = coarser.size().is_empty();
    for y in 0..shifts.height() {
        for x in 0..shifts.width() {
            let guess = if coarsest {
                [0, 0]
            } else {
                let u = (x / 2).min(coarser.width() - 1);
                let v = (y / 2).min(coarser.height() - 1);
                coarser.get(u, v).map(|shift| 2 * shift)
            };
            let block = Block::new(now, x, y);
            let mut search = Search { before, guess, best: guess, cost: NEVER };
            let others = [
                [0, 0],
                if x > 0 { shifts.get(x - 1, y) } else { guess },
                if y > 0 { shifts.get(x, y - 1) } else { guess },
            ];
            if coarsest {
                if let Some(block) = &block {
                    search.look_around(block, others);
                }
            } else {
                let near = Around::of(block.as_ref(), before, guess);
                search.weigh(guess, near.here);
                if let Some(block) = &block {
                    search.consider(block, others);
                }
                let [[left, right], [up, down]] = near.beside;
                let [u, v] = guess;
                // A step along one axis at a time.
                search.weigh([u, v - 1], up);
                search.weigh([u - 1, v], left);
                search.weigh([u + 1, v], right);
                search.weigh([u, v + 1], down);
                around.set(x, y, near);
            }
            shifts.set(x, y, search.best);
        }
    }
}

/// The search for one block's place. (Methods and no closures, which would be
/// compiled without the wide instructions.)
struct Search<'a> {
    before: &'a Windows,
    guess: [i32; 2],
    best: [i32; 2],
    cost: u32,
}

impl Search<'_> {
    /// Takes a place if it is better: of equal ones the first stays.
    #[inline(always)]
    fn weigh(&mut self, shift: [i32; 2], cost: u32) {
        let off = shift[0].abs_diff(self.guess[0]) + shift[1].abs_diff(self.guess[1]);
        let cost = cost.saturating_add(STIFFNESS * off);
        if cost < self.cost {
            (self.best, self.cost) = (shift, cost);
        }
    }

    /// The shifts of nothing and of blocks beside, which are often the same: nothing is
    /// weighed twice.
    #[inline(always)]
    fn consider(&mut self, block: &Block, [still, left, above]: [[i32; 2]; 3]) {
        if still != self.guess {
            self.weigh(still, block.cost(self.before, still));
        }
        if left != self.guess && left != still {
            self.weigh(left, block.cost(self.before, left));
        }
        if above != self.guess && above != still && above != left {
            self.weigh(above, block.cost(self.before, above));
        }
    }

    /// The same, and all places within reach of the guess.
    #[inline(always)]
    fn look_around(&mut self, block: &Block, others: [[i32; 2]; 3]) {
        self.weigh(self.guess, block.cost(self.before, self.guess));
        self.consider(block, others);
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                let shift = [self.guess[0] + dx, self.guess[1] + dy];
                self.weigh(shift, block.cost(self.before, shift));
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
