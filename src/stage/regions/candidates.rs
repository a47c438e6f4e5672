//! What may become a region.

use crate::image::{Image, Size};

/// A box of pixels and how many of them belong to a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelBox {
    /// Left edge.
    pub x0: usize,
    /// Upper edge.
    pub y0: usize,
    /// Right edge, exclusive.
    pub x1: usize,
    /// Lower edge, exclusive.
    pub y1: usize,
    /// Pixels of the candidate.
    pub area: usize,
}

impl PixelBox {
    /// No pixel at all.
    pub const NONE: Self = Self { x0: usize::MAX, y0: usize::MAX, x1: 0, y1: 0, area: 0 };

    /// Width in pixels.
    pub const fn width(&self) -> usize {
        self.x1 - self.x0
    }

    /// Height in pixels.
    pub const fn height(&self) -> usize {
        self.y1 - self.y0
    }

    /// Takes those pixels of row `y` in whose bit is set, column `x` being the lowest.
    #[inline(always)]
    pub fn add(&mut self, x: usize, y: usize, bits: u64) {
        if bits != 0 {
            self.join(&Self {
                x0: x + bits.trailing_zeros() as usize,
                y0: y,
                x1: x + 64 - bits.leading_zeros() as usize,
                y1: y + 1,
                area: bits.count_ones() as usize,
            });
        }
    }

    /// Takes the pixels of `other` in, which are others.
    #[inline(always)]
    pub fn join(&mut self, other: &Self) {
        (self.x0, self.x1) = (self.x0.min(other.x0), self.x1.max(other.x1));
        (self.y0, self.y1) = (self.y0.min(other.y0), self.y1.max(other.y1));
        self.area += other.area;
    }
}

/// What may become a region: an id for every pixel, and a box for every id.
#[derive(Debug, Default)]
pub struct Candidates {
    /// `first` + index into `boxes`; 0 and what is below `first` is background.
    pub ids: Image<u32>,
    /// Id of the first box.
    pub first: u32,
    /// Tight box of each candidate; of area 0 where it is none (any more).
    pub boxes: Vec<PixelBox>,
    /// Candidates with pixels beyond what was matched, that the image alone shows, and
    /// how many.
    pub followed: Vec<(u32, usize)>,
}

impl Candidates {
    /// An id that no candidate has.
    pub(super) const NEVER: u32 = u32::MAX;

    /// No pixel belongs to any of `count` candidates: their ids are others than
    /// those of the frame before, which stand.
    pub fn clear(&mut self, size: Size, count: usize) {
        let next = self.first as usize + self.boxes.len();
        if self.ids.size() == size && next + count < Self::NEVER as usize {
            self.first = next as u32;
        } else {
            self.ids.resize(size);
            self.ids.fill(0);
            self.first = 1;
        }
        self.forget_boxes(count);
    }

    fn forget_boxes(&mut self, count: usize) {
        self.boxes.clear();
        self.boxes.resize(count, PixelBox::NONE);
        self.followed.clear();
    }

    /// How many pixels of candidate `id` the image alone shows.
    pub fn followed_of(&self, id: u32) -> usize {
        self.followed.iter().find(|(other, _)| *other == id).map_or(0, |(_, pixels)| *pixels)
    }

    /// Numbers the boxes again from `ids`, of which there are `count`.
    pub(super) fn measure_boxes(&mut self, count: usize) {
        self.first = 1;
        self.forget_boxes(count);
        let width = self.ids.width();
        for (y, row) in self.ids.rows().enumerate() {
            let mut x = 0;
            while x < width {
                let id = row[x];
                let start = x;
                while x < width && row[x] == id {
                    x += 1;
                }
                if id != 0 {
                    let b = &mut self.boxes[id as usize - 1];
                    b.x0 = b.x0.min(start);
                    b.x1 = b.x1.max(x);
                    b.y0 = b.y0.min(y);
                    b.y1 = y + 1;
                    b.area += x - start;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ids of earlier frames stand in the image and mean nothing, until they
    /// run out.
    #[test]
    fn ids_are_used_once_until_they_run_out() {
        let size = Size::new(3, 2);
        let mut candidates = Candidates::default();
        candidates.clear(size, 5);
        assert_eq!((candidates.first, candidates.boxes.len()), (1, 5));
        candidates.ids.fill(4);
        candidates.clear(size, 2);
        assert_eq!((candidates.first, candidates.ids.get(0, 0)), (6, 4));
        candidates.first = Candidates::NEVER - 4;
        candidates.clear(size, 1);
        assert_eq!(candidates.first, Candidates::NEVER - 2);
        candidates.ids.fill(Candidates::NEVER - 2);
        candidates.clear(size, 1);
        assert_eq!((candidates.first, candidates.ids.get(0, 0)), (1, 0));
        candidates.ids.fill(1);
        candidates.clear(Size::new(2, 2), 1);
        assert_eq!((candidates.first, candidates.ids.get(1, 1)), (1, 0));
    }
}
