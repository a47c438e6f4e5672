//! Minimum barrier distance to the image's border.
//!
//! What cannot be reached from the border without climbing over an edge stands
//! out (Zhang, Sclaroff, Lin, Shen, Price and Mech, "Minimum Barrier Salient
//! Object Detection at 80 FPS", ICCV 2015): the barrier of a path is the
//! difference of the largest and the smallest value on it.

use crate::image::Image;

/// Channels that are computed side by side: Y, Cb, Cr and disparity.
const CHANNELS: usize = 4;
/// Raster scans: forward, backward, forward.
const PASSES: usize = 3;

/// Largest and smallest value on the best path to a cell, and their difference.
#[derive(Clone, Copy, Debug, Default)]
struct Path {
    high: [u8; CHANNELS],
    low: [u8; CHANNELS],
    barrier: [u8; CHANNELS],
}

/// Barrier distances of colours and of a fourth channel.
#[derive(Debug, Default)]
pub struct Barrier {
    values: Vec<[u8; CHANNELS]>,
    paths: Vec<Path>,
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
        self.values.clear();
        self.values.extend(rgb.pixels().iter().zip(fourth.pixels()).map(|(&rgb, &fourth)| {
            let [y, cb, cr] = ycbcr(rgb);
            [y, cb, cr, fourth]
        }));
        let (width, height) = (size.width, size.height);
        self.paths.clear();
        self.paths.extend(self.values.iter().enumerate().map(|(i, &v)| {
            let (x, y) = (i % width, i / width);
            let border = x == 0 || y == 0 || x + 1 == width || y + 1 == height;
            Path { high: v, low: v, barrier: [if border { 0 } else { 255 }; CHANNELS] }
        }));
        if width > 2 && height > 2 {
            for pass in 0..PASSES {
                if pass % 2 == 0 {
                    for y in 1..height - 1 {
                        self.scan_row::<true>(y, width);
                    }
                } else {
                    for y in (1..height - 1).rev() {
                        self.scan_row::<false>(y, width);
                    }
                }
            }
        }
        color.resize(size);
        extra.resize(size);
        for ((color, extra), path) in
            color.pixels_mut().iter_mut().zip(extra.pixels_mut()).zip(&self.paths)
        {
            let [y, cb, cr, fourth] = path.barrier;
            *color = f32::from(u16::from(y) + u16::from(cb) + u16::from(cr));
            *extra = f32::from(fourth);
        }
    }

    fn scan_row<const FORWARD: bool>(&mut self, y: usize, width: usize) {
        let from = y * width;
        let values = &self.values[from..from + width];
        let (above, rest) = self.paths.split_at_mut(from);
        let (row, below) = rest.split_at_mut(width);
        let other = if FORWARD { &above[from - width..] } else { &below[..width] };
        if FORWARD {
            let mut last = row[0];
            for x in 1..width - 1 {
                last = relax(values[x], row[x], &other[x], &last);
                row[x] = last;
            }
        } else {
            let mut last = row[width - 1];
            for x in (1..width - 1).rev() {
                last = relax(values[x], row[x], &other[x], &last);
                row[x] = last;
            }
        }
    }
}

/// The path to a cell of value `value`, if better over one of two neighbours.
#[inline]
fn relax(value: [u8; CHANNELS], mut path: Path, first: &Path, second: &Path) -> Path {
    for neighbour in [first, second] {
        for (c, &value) in value.iter().enumerate() {
            let high = neighbour.high[c].max(value);
            let low = neighbour.low[c].min(value);
            let better = high - low < path.barrier[c];
            path.barrier[c] = if better { high - low } else { path.barrier[c] };
            path.high[c] = if better { high } else { path.high[c] };
            path.low[c] = if better { low } else { path.low[c] };
        }
    }
    path
}
