//! Sums over windows in constant time.

use crate::image::{Image, Size};

/// Largest radius of a window.
pub const MAX_RADIUS: usize = 127;
/// Largest value of a pixel.
pub const MAX_VALUE: u16 = 32_767;

// The integral wraps around, but differences of it are exact as long as every
// window's own sum fits; below 2^31 it also converts to float in one instruction.
const _: () = assert!((2 * MAX_RADIUS + 1).pow(2) * (MAX_VALUE as usize) < 1 << 31);

/// An integral image (Viola and Jones 2001): entry `(x, y)` is the sum over
/// all pixels left of `x` and above `y`, modulo 2^32.
#[derive(Default)]
pub struct Integral {
    size: Size,
    sums: Vec<u32>,
}

impl Integral {
    /// Takes in an image with values up to [`MAX_VALUE`].
    pub fn take<T: Copy + Into<u32>>(&mut self, image: &Image<T>) {
        self.size = image.size();
        let stride = self.size.width + 1;
        self.sums.resize(stride * (self.size.height + 1), 0);
        self.sums[..stride].fill(0);
        for (y, row) in image.rows().enumerate() {
            let (above, below) = self.sums.split_at_mut((y + 1) * stride);
            let above = &above[y * stride + 1..];
            below[0] = 0;
            let mut along = 0_u32;
            for ((sum, &value), &above) in below[1..stride].iter_mut().zip(row).zip(above) {
                along = along.wrapping_add(value.into());
                *sum = along.wrapping_add(above);
            }
        }
    }

    /// The sum over columns `x.0..x.1` and rows `y.0..y.1`, which must lie
    /// inside the image.
    pub fn sum(&self, x: (usize, usize), y: (usize, usize)) -> u32 {
        let at = |x: usize, y: usize| self.sums[y * (self.size.width + 1) + x];
        let below = at(x.1, y.1).wrapping_sub(at(x.0, y.1));
        below.wrapping_sub(at(x.1, y.0).wrapping_sub(at(x.0, y.0)))
    }

    /// `μ(N_r)` for every pixel of row `y`: the mean over the part of the
    /// (2r + 1)-pixel square around it that lies inside the image, `r` at most
    /// [`MAX_RADIUS`].
    pub fn means(&self, y: usize, r: usize, out: &mut [f32]) {
        let Size { width, height } = self.size;
        let r = r.min(MAX_RADIUS);
        let rows = (y.saturating_sub(r), (y + r + 1).min(height));
        let edge = |x: usize, out: &mut f32| {
            let columns = (x.saturating_sub(r), (x + r + 1).min(width));
            let count = (rows.1 - rows.0) * (columns.1 - columns.0);
            *out = self.sum(columns, rows) as i32 as f32 / count as f32;
        };
        if width <= 2 * r {
            for (x, out) in out.iter_mut().enumerate() {
                edge(x, out);
            }
            return;
        }
        for x in (0..r).chain(width - r..width) {
            edge(x, &mut out[x]);
        }
        let stride = width + 1;
        let upper = &self.sums[rows.0 * stride..][..stride];
        let lower = &self.sums[rows.1 * stride..][..stride];
        let inner = width - 2 * r;
        let (ul, ur) = (&upper[..inner], &upper[2 * r + 1..][..inner]);
        let (ll, lr) = (&lower[..inner], &lower[2 * r + 1..][..inner]);
        let count = ((rows.1 - rows.0) * (2 * r + 1)) as f32;
        let out = &mut out[r..r + inner];
        for x in 0..inner {
            let sum = lr[x].wrapping_sub(ll[x]).wrapping_sub(ur[x].wrapping_sub(ul[x]));
            out[x] = sum as i32 as f32 / count;
        }
    }
}

/// Radii of the surrounds for a map of `size`: 1/16, 1/8 and 1/4 of its shorter
/// side, within 1..=[`MAX_RADIUS`].
pub fn surrounds(size: Size) -> [usize; 3] {
    let side = size.width.min(size.height);
    [16, 8, 4].map(|share| (side / share).clamp(1, MAX_RADIUS))
}
