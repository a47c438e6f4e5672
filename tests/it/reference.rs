//! Plain references: the same answer as a kernel, written for reading, with no
//! thought of speed.

pub mod preprocess;
pub mod roi;
pub mod saliency;
pub mod scene;
pub mod stereo;

use salient_stereo::image::{Image, Size};

/// Sizes at which kernels go wrong: single pixels, rows and columns, and sizes
/// that no vector, word, cell or tile divides.
pub const ODD_SIZES: [Size; 9] = [
    Size::new(1, 1),
    Size::new(2, 1),
    Size::new(1, 7),
    Size::new(3, 2),
    Size::new(5, 3),
    Size::new(33, 17),
    Size::new(64, 8),
    Size::new(67, 66),
    Size::new(131, 45),
];

/// A repeatable sequence of evenly spread numbers (`SplitMix64`).
pub struct Noise(pub u64);

impl Noise {
    /// The next number.
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next number in 0..1.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// An image of even noise.
    pub fn gray(&mut self, size: Size) -> Image<u8> {
        Image::from_fn(size, |_, _| self.next() as u8)
    }

    /// An image of even noise in three channels.
    pub fn rgb(&mut self, size: Size) -> Image<[u8; 3]> {
        Image::from_fn(size, |_, _| [self.next() as u8, self.next() as u8, self.next() as u8])
    }

    /// A map of values in 0..1.
    pub fn map(&mut self, size: Size) -> Image<f32> {
        Image::from_fn(size, |_, _| self.unit())
    }
}

/// The positions within `radius` of `(x, y)` that lie inside an image of `size`.
pub fn window(size: Size, x: usize, y: usize, radius: usize) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    for v in y.saturating_sub(radius)..=(y + radius).min(size.height - 1) {
        for u in x.saturating_sub(radius)..=(x + radius).min(size.width - 1) {
            found.push((u, v));
        }
    }
    found
}
