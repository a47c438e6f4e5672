//! Minimum barrier distance to the image's border.
//!
//! What cannot be reached from the border without climbing over an edge stands
//! out (Zhang, Sclaroff, Lin, Shen, Price and Mech, "Minimum Barrier Salient
//! Object Detection at 80 FPS", ICCV 2015): the barrier of a path is the
//! difference of the largest and the smallest value on it.

#![allow(
    clippy::inline_always,
    reason = "a kernel gets the wide instructions only where `dispatch` inlines it"
)]

use crate::image::{Image, Size};
use crate::simd::{Level, dispatch};

/// Channels that are computed side by side: Y, Cb, Cr and disparity.
const CHANNELS: usize = 4;
/// Rows that are computed side by side.
const ROWS: usize = 8;
/// Bytes of a step: one cell of each row.
const LANES: usize = ROWS * CHANNELS;
/// Bytes of a step in memory: with the row above and the one below.
const STRIDE: usize = LANES + 2 * CHANNELS;
/// Raster scans: forward, backward, forward.
const PASSES: usize = 3;

/// Barrier distances of colours and of a fourth channel.
///
/// In a raster scan a cell depends on two of its neighbours, so that neither
/// rows nor columns can be computed side by side, but what lies on a diagonal
/// can (a wavefront). Bands of [`ROWS`] rows are therefore stored askew: step
/// `t` of a band holds, row after row, the cells `(t − 1 − r, r)`. In a step the
/// neighbours to the left and above are at the step before, those to the right
/// and below at the step after, each as one run of bytes.
#[derive(Debug)]
pub struct Barrier {
    level: Level,
    /// The cells' values; those of the best path to each, the largest and the
    /// smallest; and their difference.
    value: Vec<u8>,
    high: Vec<u8>,
    low: Vec<u8>,
    span: Vec<u8>,
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
        Self { level, value: Vec::new(), high: Vec::new(), low: Vec::new(), span: Vec::new() }
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
        let bands = Bands { width: size.width, steps: size.width + ROWS + 1 };
        self.take(rgb, fourth, bands);
        let count = size.height.div_ceil(ROWS);
        for pass in 0..PASSES {
            for i in 0..count {
                let band = if pass % 2 == 0 { i } else { count - 1 - i };
                self.scan(bands, band, pass % 2 == 0);
                // The next band needs the last row of this one, or the first.
                if i + 1 < count && pass % 2 == 0 {
                    self.hand_on(bands, (band, ROWS), (band + 1, 0));
                } else if i + 1 < count {
                    self.hand_on(bands, (band, 1), (band - 1, ROWS + 1));
                }
            }
        }
        for y in 0..size.height {
            let cells = color.row_mut(y).iter_mut().zip(extra.row_mut(y));
            for (x, (color, extra)) in cells.enumerate() {
                let at = bands.place(y / ROWS, y % ROWS + 1, x);
                let [y, cb, cr, fourth] = four(&self.span, at);
                *color = f32::from(u16::from(y) + u16::from(cb) + u16::from(cr));
                *extra = f32::from(fourth);
            }
        }
    }

    /// Writes the values askew. Beyond the image a cell is one that no path
    /// leads to or through: its barrier is 0, so that none is better, and it
    /// spans all values, so that what leads through it has a barrier of 255.
    fn take(&mut self, rgb: &Image<[u8; 3]>, fourth: &Image<u8>, bands: Bands) {
        let Size { width, height } = rgb.size();
        let bytes = height.div_ceil(ROWS) * bands.steps * STRIDE;
        for (buffer, outside) in [
            (&mut self.value, 0),
            (&mut self.high, u8::MAX),
            (&mut self.low, 0),
            (&mut self.span, 0),
        ] {
            buffer.clear();
            buffer.resize(bytes, outside);
        }
        for y in 0..height {
            let cells = rgb.row(y).iter().zip(fourth.row(y));
            for (x, (&rgb, &fourth)) in cells.enumerate() {
                let [luma, cb, cr] = ycbcr(rgb);
                let value = [luma, cb, cr, fourth];
                let border = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
                let at = bands.place(y / ROWS, y % ROWS + 1, x);
                for buffer in [&mut self.value, &mut self.high, &mut self.low] {
                    buffer[at..at + CHANNELS].copy_from_slice(&value);
                }
                self.span[at..at + CHANNELS].fill(if border { 0 } else { u8::MAX });
            }
        }
    }

    /// Copies the paths of a slot of one band into a slot of another.
    fn hand_on(&mut self, bands: Bands, from: (usize, usize), to: (usize, usize)) {
        for x in 0..bands.width {
            let (from, to) = (bands.place(from.0, from.1, x), bands.place(to.0, to.1, x));
            for buffer in [&mut self.high, &mut self.low] {
                buffer.copy_within(from..from + CHANNELS, to);
            }
        }
    }

    /// One scan over a band.
    fn scan(&mut self, bands: Bands, band: usize, forward: bool) {
        let bytes = band * bands.steps * STRIDE..(band + 1) * bands.steps * STRIDE;
        let value = &self.value[bytes.clone()];
        let (high, low) = (&mut self.high[bytes.clone()], &mut self.low[bytes.clone()]);
        let span = &mut self.span[bytes];
        dispatch!(self.level, _simd => {
            if forward {
                for step in 1..bands.steps {
                    let before = (step - 1) * STRIDE;
                    // Above, then to the left.
                    let neighbours = [before, before + CHANNELS];
                    relax(value, high, low, span, step * STRIDE + CHANNELS, neighbours);
                }
            } else {
                for step in (0..bands.steps - 1).rev() {
                    let after = (step + 1) * STRIDE;
                    // Below, then to the right.
                    let neighbours = [after + 2 * CHANNELS, after + CHANNELS];
                    relax(value, high, low, span, step * STRIDE + CHANNELS, neighbours);
                }
            }
        });
    }
}

/// How bands are laid out.
#[derive(Clone, Copy)]
struct Bands {
    width: usize,
    /// Steps of a band: each row starts one later than the one above, and the
    /// row above the band has its own.
    steps: usize,
}

impl Bands {
    /// Offset of column `x` in a slot of a band: slot 0 is the row above it,
    /// slots 1 to [`ROWS`] its rows, the last one the row below.
    fn place(self, band: usize, slot: usize, x: usize) -> usize {
        (band * self.steps + x + slot) * STRIDE + slot * CHANNELS
    }
}

fn four(bytes: &[u8], at: usize) -> [u8; CHANNELS] {
    bytes[at..].first_chunk().copied().unwrap_or_default()
}

/// The paths to the cells from `at` on, where better over one of their neighbours.
#[inline(always)]
fn relax(
    value: &[u8],
    high: &mut [u8],
    low: &mut [u8],
    span: &mut [u8],
    at: usize,
    neighbours: [usize; 2],
) {
    let load = |bytes: &[u8], at: usize| -> [u8; LANES] {
        bytes[at..].first_chunk().copied().unwrap_or([0; LANES])
    };
    let value = load(value, at);
    let (mut h, mut l, mut b) = (load(high, at), load(low, at), load(span, at));
    for neighbour in neighbours {
        let (other_high, other_low) = (load(high, neighbour), load(low, neighbour));
        for i in 0..LANES {
            let over = other_high[i].max(value[i]);
            let under = other_low[i].min(value[i]);
            let better = over - under < b[i];
            b[i] = if better { over - under } else { b[i] };
            h[i] = if better { over } else { h[i] };
            l[i] = if better { under } else { l[i] };
        }
    }
    high[at..at + LANES].copy_from_slice(&h);
    low[at..at + LANES].copy_from_slice(&l);
    span[at..at + LANES].copy_from_slice(&b);
}
