//! The one image type, its size, and the two pixel forms a door may deliver.

use std::fmt;

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Size {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

impl Size {
    /// Size from width and height.
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    /// Number of pixels.
    pub const fn area(self) -> usize {
        self.width * self.height
    }

    /// True when there is no pixel.
    pub const fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// The size after division by `factor`, rounded up, so that every pixel of
    /// `self` has a cell: pixel `(x, y)` belongs to cell `(x / factor, y / factor)`.
    #[must_use]
    pub const fn divided_by(self, factor: usize) -> Self {
        Self { width: self.width.div_ceil(factor), height: self.height.div_ceil(factor) }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// An image: rows of pixels without padding.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image<T> {
    size: Size,
    data: Vec<T>,
}

impl<T: Copy + Default> Image<T> {
    /// An image of default pixels.
    pub fn new(size: Size) -> Self {
        Self::filled(size, T::default())
    }

    /// An image in which every pixel is `value`.
    pub fn filled(size: Size, value: T) -> Self {
        Self { size, data: vec![value; size.area()] }
    }

    /// An image over existing pixels; `None` unless there are exactly `size.area()`.
    pub fn from_vec(size: Size, data: Vec<T>) -> Option<Self> {
        (data.len() == size.area()).then_some(Self { size, data })
    }

    /// An image computed pixel by pixel from `(x, y)`.
    pub fn from_fn(size: Size, mut pixel: impl FnMut(usize, usize) -> T) -> Self {
        let mut image = Self::new(size);
        for y in 0..size.height {
            for (x, out) in image.row_mut(y).iter_mut().enumerate() {
                *out = pixel(x, y);
            }
        }
        image
    }

    /// Changes the size and keeps the capacity. The pixels are unspecified
    /// afterwards: whoever resizes writes them all.
    pub fn resize(&mut self, size: Size) {
        self.size = size;
        self.data.resize(size.area(), T::default());
    }

    /// Takes over size and pixels of `other` and keeps the capacity.
    pub fn copy_from(&mut self, other: &Self) {
        self.resize(other.size);
        self.data.copy_from_slice(&other.data);
    }

    /// Sets every pixel.
    pub fn fill(&mut self, value: T) {
        self.data.fill(value);
    }

    /// The pixel at `(x, y)`.
    pub fn get(&self, x: usize, y: usize) -> T {
        self.data[y * self.size.width + x]
    }

    /// Sets the pixel at `(x, y)`.
    pub fn set(&mut self, x: usize, y: usize, value: T) {
        self.data[y * self.size.width + x] = value;
    }

    /// The pixel nearest to `(x, y)` inside the image.
    pub fn get_clamped(&self, x: isize, y: isize) -> T {
        let x = x.clamp(0, self.size.width as isize - 1) as usize;
        let y = y.clamp(0, self.size.height as isize - 1) as usize;
        self.get(x, y)
    }
}

impl<T> Image<T> {
    /// Width and height.
    pub const fn size(&self) -> Size {
        self.size
    }

    /// Number of columns.
    pub const fn width(&self) -> usize {
        self.size.width
    }

    /// Number of rows.
    pub const fn height(&self) -> usize {
        self.size.height
    }

    /// Row `y`, left to right.
    pub fn row(&self, y: usize) -> &[T] {
        let width = self.size.width;
        &self.data[y * width..(y + 1) * width]
    }

    /// Row `y`, to be written.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        let width = self.size.width;
        &mut self.data[y * width..(y + 1) * width]
    }

    /// All rows, top to bottom.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[T]> {
        self.data.chunks_exact(self.size.width.max(1))
    }

    /// All pixels in row order.
    pub fn pixels(&self) -> &[T] {
        &self.data
    }

    /// All pixels in row order, to be written.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// The pixels, without a copy.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }
}

/// What a camera delivers once its encoding is undone: 8 bits per channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Picture {
    /// One channel.
    Gray(Image<u8>),
    /// Red, green, blue.
    Rgb(Image<[u8; 3]>),
}

impl Picture {
    /// Width and height.
    pub const fn size(&self) -> Size {
        match self {
            Self::Gray(image) => image.size(),
            Self::Rgb(image) => image.size(),
        }
    }
}

impl Default for Picture {
    fn default() -> Self {
        Self::Gray(Image::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_vec_refuses_a_wrong_length() {
        assert!(Image::from_vec(Size::new(3, 2), vec![0_u8; 5]).is_none());
        assert!(Image::from_vec(Size::new(3, 2), vec![0_u8; 6]).is_some());
    }

    #[test]
    fn resize_keeps_the_capacity() {
        let mut image = Image::<u8>::new(Size::new(64, 64));
        let before = image.pixels().as_ptr();
        image.resize(Size::new(8, 8));
        image.resize(Size::new(64, 64));
        assert_eq!(before, image.pixels().as_ptr());
    }

    #[test]
    fn division_rounds_up() {
        assert_eq!(Size::new(1242, 375).divided_by(4), Size::new(311, 94));
    }
}
