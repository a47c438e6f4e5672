//! Minimum barrier distance to the image's border.
//!
//! What cannot be reached from the border without climbing over an edge stands
//! out (Zhang, Sclaroff, Lin, Shen, Price and Mech, "Minimum Barrier Salient
//! Object Detection at 80 FPS", ICCV 2015): the barrier of a path is the
//! difference of the largest and the smallest value on it.

use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, prelude::*, transpose_words, u8x64, u32x16};

/// Channels that are computed side by side: Y, Cb, Cr and disparity.
const CHANNELS: usize = 4;
/// Rows that are computed side by side.
const ROWS: usize = 16;
/// Bytes of a step: one cell of each row.
const LANES: usize = ROWS * CHANNELS;
/// Raster scans: forward, backward, forward.
const PASSES: usize = 3;

/// The cells of a step, in bytes; four of them are a cell.
type Step = [u8; LANES];

/// Barrier distances of colours and of a fourth channel.
///
/// In a raster scan a cell depends on two of its neighbours, so that neither
/// rows nor columns can be computed side by side, but what lies on a diagonal
/// can (a wavefront). Bands of `ROWS` rows are therefore stored askew: step
/// `t` of a band holds, row after row, the cells `(t − r, r)`. Of a step the
/// neighbours to the left are the step before, those above the same one row
/// further down; to the right and below it is the step after.
#[derive(Debug)]
pub struct Barrier {
    level: Level,
    size: Size,
    /// The cells' values; those of the best path to each, the largest and the
    /// smallest; and their difference.
    value: Vec<Step>,
    high: Vec<Step>,
    low: Vec<Step>,
    span: Vec<Step>,
    /// What cells begin with, for images of `size`: 255 where there is none, and
    /// the barrier.
    outside: Vec<Step>,
    first: Vec<Step>,
    /// The cells of a band, row by row, with room before and behind each row.
    rows: Vec<u32>,
}

/// The colour in ITU-R BT.601 YCbCr, full range.
#[inline]
pub fn ycbcr([r, g, b]: [u8; 3]) -> [u8; 3] {
    let (r, g, b) = (i32::from(r), i32::from(g), i32::from(b));
    // 16 fraction bits; + 128 for chroma. Sums stay within 0..=255.
    let y = (19_595 * r + 38_470 * g + 7_471 * b + 32_768) >> 16;
    let cb = (-11_059 * r - 21_709 * g + 32_768 * b + 8_421_375) >> 16;
    let cr = (32_768 * r - 27_439 * g - 5_329 * b + 8_421_375) >> 16;
    [y as u8, cb as u8, cr as u8]
}

impl Barrier {
    /// The distance at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            size: Size::default(),
            value: Vec::new(),
            high: Vec::new(),
            low: Vec::new(),
            span: Vec::new(),
            outside: Vec::new(),
            first: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// Fills `color` with the sum of the barriers of Y, Cb and Cr (0..=765)
    /// and `extra` with that of the fourth channel (0..=255).
    pub fn run(
        &mut self,
        rgb: &Image<[u8; 3]>,
        fourth: &Image<u8>,
        color: &mut Image<f32>,
        extra: &mut Image<f32>,
    ) {
        let size = rgb.size();
        color.resize(size);
        extra.resize(size);
        if self.size != size {
            self.fit(size);
        }
        let bands = self.bands();
        dispatch!(self.level, simd => {
            self.take(simd, rgb, fourth);
            for pass in 0..PASSES {
                for i in 0..bands {
                    match pass {
                        0 => self.scan::<_, true, true>(simd, i),
                        1 => self.scan::<_, false, false>(simd, bands - 1 - i),
                        _ => self.scan::<_, true, false>(simd, i),
                    }
                }
            }
            self.give(color, extra);
        });
    }

    fn bands(&self) -> usize {
        self.size.height.div_ceil(ROWS)
    }

    /// Steps of a band: each row starts one later than the one above.
    fn steps(&self) -> usize {
        self.size.width + ROWS - 1
    }

    /// Step and byte of a cell.
    #[inline(always)]
    fn place(&self, x: usize, y: usize) -> (usize, usize) {
        (y / ROWS * self.steps() + x + y % ROWS, y % ROWS * CHANNELS)
    }

    /// Beyond the image a cell is one that no path leads to or through: its
    /// barrier is 0, so that none is better, and it spans all values, so that
    /// what leads through it has a barrier of 255.
    fn fit(&mut self, size: Size) {
        self.size = size;
        let steps = self.bands() * self.steps();
        for (buffer, outside) in [
            (&mut self.value, 0),
            (&mut self.high, 0),
            (&mut self.low, 0),
            (&mut self.span, 0),
            (&mut self.outside, u8::MAX),
            (&mut self.first, 0),
        ] {
            buffer.clear();
            buffer.resize(steps, [outside; LANES]);
        }
        let Size { width, height } = size;
        for y in 0..height {
            for x in 0..width {
                let (step, at) = self.place(x, y);
                let border = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
                self.outside[step][at..at + CHANNELS].fill(0);
                self.first[step][at..at + CHANNELS].fill(if border { 0 } else { u8::MAX });
            }
        }
    }

    /// Length of a row of the buffer: whole groups of steps go beyond its cells, which
    /// begin with number [`ROWS`].
    fn stride(&self) -> usize {
        self.size.width + 3 * ROWS
    }

    /// Writes the values askew.
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, rgb: &Image<[u8; 3]>, fourth: &Image<u8>) {
        let (width, stride, steps) = (self.size.width, self.stride(), self.steps());
        self.rows.resize(ROWS * stride, 0);
        for (band, values) in self.value.chunks_exact_mut(steps).enumerate() {
            // Beyond the image all is 0.
            self.rows.fill(0);
            let upper = band * ROWS;
            let rows = self.rows.chunks_exact_mut(stride).zip(upper..self.size.height);
            for (row, y) in rows {
                let cells = rgb.row(y).iter().zip(fourth.row(y));
                for (value, (&rgb, &fourth)) in row[ROWS..ROWS + width].iter_mut().zip(cells) {
                    let [luma, cb, cr] = ycbcr(rgb);
                    *value = u32::from_le_bytes([luma, cb, cr, fourth]);
                }
            }
            for (i, values) in values.chunks_mut(ROWS).enumerate() {
                let mut cells = [u32x16::splat(simd, 0); ROWS];
                for (r, cells) in cells.iter_mut().enumerate() {
                    let at = r * stride + (i + 1) * ROWS - r;
                    *cells = u32x16::from_slice(simd, &self.rows[at..at + ROWS]);
                }
                for (value, cells) in values.iter_mut().zip(transpose_words(cells)) {
                    let cells: u8x64<S> = cells.bitcast();
                    cells.store_slice(value);
                }
            }
        }
    }

    /// Reads the barriers.
    #[inline(always)]
    fn give(&mut self, color: &mut Image<f32>, extra: &mut Image<f32>) {
        for y in 0..self.size.height {
            let (first, at) = self.place(0, y);
            let row = &mut self.rows[..self.size.width];
            for (value, step) in row.iter_mut().zip(&self.span[first..]) {
                *value = cell(step, at);
            }
            let out = color.row_mut(y).iter_mut().zip(extra.row_mut(y));
            for ((color, extra), value) in out.zip(&*row) {
                let [y, cb, cr] = [value & 0xff, value >> 8 & 0xff, value >> 16 & 0xff];
                *color = (y + cb + cr) as f32;
                *extra = (value >> 24) as f32;
            }
        }
    }

    /// One scan over a band, from the first step on or from the last one back.
    #[inline(always)]
    fn scan<S: Simd, const FORWARD: bool, const FIRST: bool>(&mut self, simd: S, band: usize) {
        const LAST: usize = LANES - CHANNELS;
        let steps = self.steps();
        let all = u8x64::splat(simd, u8::MAX);
        // Beyond the first step lies nothing.
        let mut last = Path { high: all, low: !all };
        for i in 0..steps {
            let step = if FORWARD { i } else { steps - 1 - i };
            // The cell that lies in the next band.
            let beside = if FORWARD {
                let inside = band > 0 && step + ROWS - 1 < steps;
                if inside { Some((band - 1) * steps + step + ROWS - 1) } else { None }
            } else {
                let inside = band + 1 < self.bands() && step + 1 >= ROWS;
                if inside { Some((band + 1) * steps + step + 1 - ROWS) } else { None }
            };
            let at = if FORWARD { LAST } else { 0 };
            let (high, low) = if let Some(i) = beside {
                (cell(&self.high[i], at), cell(&self.low[i], at))
            } else {
                (u32::MAX, 0)
            };
            let (high, low) = (u32x16::splat(simd, high), u32x16::splat(simd, low));
            let [up, down]: [u32x16<S>; 2] = [last.high.bitcast(), last.low.bitcast()];
            let upright = if FORWARD {
                Path { high: high.slide::<15>(up).bitcast(), low: low.slide::<15>(down).bitcast() }
            } else {
                Path { high: up.slide::<1>(high).bitcast(), low: down.slide::<1>(low).bitcast() }
            };
            let index = band * steps + step;
            let value = u8x64::load_array_ref(simd, &self.value[index]);
            let mut path = if FIRST {
                let outside = u8x64::load_array_ref(simd, &self.outside[index]);
                Path { high: value | outside, low: value }
            } else {
                Path {
                    high: u8x64::load_array_ref(simd, &self.high[index]),
                    low: u8x64::load_array_ref(simd, &self.low[index]),
                }
            };
            let span = if FIRST { &self.first } else { &self.span };
            let mut span = u8x64::load_array_ref(simd, &span[index]);
            for neighbour in [upright, last] {
                let (high, low) = (neighbour.high.max(value), neighbour.low.min(value));
                let better = (high - low).simd_lt(span);
                span = span.min(high - low);
                path.high = better.select(high, path.high);
                path.low = better.select(low, path.low);
            }
            path.high.store_slice(&mut self.high[index]);
            path.low.store_slice(&mut self.low[index]);
            span.store_slice(&mut self.span[index]);
            last = path;
        }
    }
}

/// The largest and the smallest value on the best paths to the cells of a step.
#[derive(Clone, Copy)]
struct Path<S: Simd> {
    high: u8x64<S>,
    low: u8x64<S>,
}

/// The four bytes from `at` on.
#[inline(always)]
fn cell(step: &Step, at: usize) -> u32 {
    u32::from_le_bytes(step[at..].first_chunk().copied().unwrap_or_default())
}

// A cell is a lane of 32 bits.
const _: () = assert!(CHANNELS == 4 && ROWS == 16);
