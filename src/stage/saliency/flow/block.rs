//! Blocks of a view and what they differ from in the view before.

use super::{BlockShift, STEP};
use crate::image::Image;

/// Side of a block in pixels: blocks overlap by half.
const BLOCK: usize = 8;
/// Pixels whose differences are added up at once.
const GROUP: usize = 32;
/// Pixels of a block.
pub const AREA: f32 = (BLOCK * BLOCK) as f32;

/// Mean rise of the difference in gray levels, one pixel off the best place,
/// from which that place is taken to parts of a pixel.
const LEAST_RISE: f32 = 0.75;
/// The same, summed over both axes, from which a block's shift is firm.
const FIRM_RISE: f32 = 4.0;

/// What is known of a block around one place: sums of absolute differences, there and
/// one pixel before and behind it along both axes; [`NEVER`] where that is not inside
/// the view.
#[derive(Clone, Copy, Debug)]
pub struct Around {
    /// The place: how far the block has moved, columns and rows.
    pub shift: [i32; 2],
    /// The sum there.
    pub here: u32,
    /// The sums one pixel before and behind, along the columns' axis and the rows'.
    pub beside: [[u32; 2]; 2],
}

/// More than any sum of differences.
pub const NEVER: u32 = u32::MAX;

/// A sum of differences; `None` where there is none.
pub fn known(cost: u32) -> Option<u32> {
    (cost != NEVER).then_some(cost)
}

impl Default for Around {
    fn default() -> Self {
        Self { shift: [0; 2], here: NEVER, beside: [[NEVER; 2]; 2] }
    }
}

impl Around {
    /// Of a block, where there is one.
    #[inline(always)]
    pub fn of(block: Option<&Block>, before: &Windows, shift: [i32; 2]) -> Self {
        let mut out = Self { shift, ..Self::default() };
        let Some(block) = block else { return out };
        if let Some(place) = block.place(shift)
            && let Some(([left, right], [above, here, below])) = before.around(place)
        {
            // Nothing of it is at the edge.
            out.here = block.differences(here);
            out.beside = [
                [block.differences(left), block.differences(right)],
                [block.differences(above), block.differences(below)],
            ];
            return out;
        }
        let [u, v] = shift;
        out.here = block.cost(before, shift);
        out.beside = [
            [block.cost(before, [u - 1, v]), block.cost(before, [u + 1, v])],
            [block.cost(before, [u, v - 1]), block.cost(before, [u, v + 1])],
        ];
        out
    }

    /// See [`Flow::sharpen`](super::Flow::sharpen).
    #[inline(always)]
    pub fn sharpened(&self) -> BlockShift {
        let mut out = BlockShift { shift: self.shift.map(|shift| shift as f32), firmness: 0.0 };
        let Some(lowest) = known(self.here) else { return out };
        let mut rises = 0.0;
        for (shift, [less, more]) in out.shift.iter_mut().zip(self.beside) {
            let (less, more) = (known(less), known(more));
            let most = less.unwrap_or(lowest).max(more.unwrap_or(lowest));
            let rise = most.saturating_sub(lowest) as f32 / AREA;
            rises += rise;
            if let (Some(less), Some(more)) = (less, more)
                && rise >= LEAST_RISE
            {
                let slope = (less as f32 - more as f32) / AREA;
                *shift += (slope / (2.0 * rise)).clamp(-0.5, 0.5);
            }
        }
        out.firmness = (rises / FIRM_RISE).min(1.0);
        out
    }
}

/// The rows of a block, one after the other.
type Pixels = [u8; BLOCK * BLOCK];

/// A block of a view.
pub struct Block {
    pixels: Pixels,
    /// Its left upper corner, and those of the last ones inside the view.
    start: [usize; 2],
    last: [usize; 2],
}

impl Block {
    /// Block `(x, y)`; those at the edge move inside. `None` where the view is smaller.
    #[inline(always)]
    pub fn new(view: &Image<u8>, x: usize, y: usize) -> Option<Self> {
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

    /// The left upper corner of its shifted place, where that is inside the view.
    #[inline(always)]
    fn place(&self, shift: [i32; 2]) -> Option<[usize; 2]> {
        let x = usize::try_from(self.start[0] as i32 + shift[0]).ok()?;
        let y = usize::try_from(self.start[1] as i32 + shift[1]).ok()?;
        (x <= self.last[0] && y <= self.last[1]).then_some([x, y])
    }

    /// Sum of absolute differences between the block and its shifted place;
    /// [`NEVER`] where that is not inside the view.
    #[inline(always)]
    pub fn cost(&self, before: &Windows, shift: [i32; 2]) -> u32 {
        match self.place(shift).and_then(|place| before.block(place)) {
            Some(place) => self.differences(place),
            None => NEVER,
        }
    }

    /// Sum of absolute differences between the block and another one.
    #[inline(always)]
    fn differences(&self, place: &Pixels) -> u32 {
        // In groups of what one instruction adds up: in one sum of all it is given half.
        let groups = self.pixels.as_chunks::<GROUP>().0.iter().zip(place.as_chunks::<GROUP>().0);
        let mut sum = 0;
        for (here, there) in groups {
            let mut part = 0;
            for i in 0..GROUP {
                part += u32::from(here[i].abs_diff(there[i]));
            }
            sum += part;
        }
        sum
    }
}

/// A view in which every block stands in one piece: of each pixel the row of
/// [`BLOCK`] pixels that begins with it, column by column.
#[derive(Debug, Default)]
pub struct Windows {
    height: usize,
    rows: Vec<[u8; BLOCK]>,
}

impl Windows {
    /// Takes the windows of `view` in.
    pub fn take(&mut self, view: &Image<u8>) {
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
    fn block(&self, [x, y]: [usize; 2]) -> Option<&Pixels> {
        let rows: &[[u8; BLOCK]; BLOCK] = self.rows.get(x * self.height + y..)?.first_chunk()?;
        rows.as_flattened().first_chunk()
    }

    /// The blocks to the left and to the right of that and those above, here and below;
    /// `None` where one is not inside the view.
    #[inline(always)]
    fn around(&self, [x, y]: [usize; 2]) -> Option<([&Pixels; 2], [&Pixels; 3])> {
        let (left, above) = (x.checked_sub(1)?, y.checked_sub(1)?);
        if above + BLOCK + 2 > self.height {
            return None;
        }
        let sides = [self.block([left, y])?, self.block([x + 1, y])?];
        let rows: &[[u8; BLOCK]; BLOCK + 2] =
            self.rows.get(x * self.height + above..)?.first_chunk()?;
        let rows = rows.as_flattened();
        let upright =
            [rows.first_chunk()?, rows[BLOCK..].first_chunk()?, rows[2 * BLOCK..].first_chunk()?];
        Some((sides, upright))
    }
}
