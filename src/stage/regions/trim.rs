//! Outlines of narrow things, at the edges that the image shows.
//!
//! A matching window that lies half on a thing takes the thing's disparity:
//! what is nearer grows by up to half a window on either side. A car does not
//! mind, a person doubles, and a post has more of the wall behind it than of
//! itself. The image knows where the thing ends (compare the weighted median of
//! Ma et al., "Constant Time Weighted Median Filtering for Stereo Matching and
//! Beyond", ICCV 2013, which asks the colours of every pixel).

use super::candidates::{Candidates, PixelBox};
use super::runs::run;
use crate::image::Image;
use crate::perception::View;
use crate::simd::{LANES, Level, Simd, abs_diff, dispatch, load, prelude::*, u8x32, u16x16};

/// Width in metres (of a road scene) up to which a thing is narrow: a person
/// who walks, a trunk, a post.
pub const NARROW_M: f32 = 1.2;
/// Most pixels that are cut from one end of a row, and the largest part of the row.
const MOST_PX: usize = 6;
const MOST_PART: [usize; 2] = [2, 5];
/// Rows above and below over which an edge is added up, every other one: sides
/// are upright.
const BAND: usize = 3;
/// What an edge loses per pixel further inward.
const INWARD: f32 = 0.8;
/// Pixels beyond the end of a row where what is beside the thing is looked for.
const ASIDE: usize = 2;
/// How much nearer that must be to hide a part of the thing, in parts of the disparity.
const NEARER: f32 = 1.1;

/// Places where an edge may be, in whole groups of eight, and the pixels that are
/// read for all of them: from the one before to the one behind.
const PLACES: usize = (MOST_PX + 1).next_multiple_of(8);
const READ: usize = PLACES + 2;
/// The bytes of colours that are read: three times one vector, the last of them two
/// pixels and two channels further on.
const READ_COLOR: usize = LANES + 2 * 3 + 2;

// The edges of all places fit into a vector.
const _: () = assert!(3 * (PLACES - 1) < LANES);

/// What the cutting of one thing asks.
#[derive(Clone, Copy)]
pub struct Trim<'a> {
    /// The image that the masks belong to.
    pub left: &'a View,
    /// Disparity in pixels, NaN where there is none.
    pub disparity: &'a Image<f32>,
    /// Disparity of the thing.
    pub surface: f32,
}

impl Trim<'_> {
    /// Moves both ends of every row of candidate `id`, counted from 1, inward to the strongest
    /// upright edge (maximum over R, G and B of |I(x + 1) − I(x − 1)|, added up
    /// over four of seven rows) within six pixels and two fifths of the row. An end at
    /// something nearer stays: there it is the other thing that grew.
    pub fn run(&self, level: Level, id: u32, out: &mut Candidates) {
        dispatch!(level, simd => self.cut(simd, id, out));
    }

    #[inline(always)]
    fn cut<S: Simd>(&self, simd: S, id: u32, out: &mut Candidates) {
        let bounds = out.boxes[id as usize - 1];
        let own = out.first + id - 1;
        let mut cut = PixelBox::NONE;
        for y in bounds.y0..bounds.y1 {
            let mut next = bounds.x0;
            while let Some((other, pixels)) = run(&out.ids.row(y)[..bounds.x1], next) {
                next = pixels.end;
                if other != own {
                    continue;
                }
                let [left, right] = self.ends(simd, pixels.start, pixels.end, y);
                let row = out.ids.row_mut(y);
                row[pixels.start..left].fill(0);
                row[right..pixels.end].fill(0);
                cut.join(&PixelBox { x0: left, y0: y, x1: right, y1: y + 1, area: right - left });
            }
        }
        out.boxes[id as usize - 1] = cut;
    }

    /// The new ends of the pixels `from..to` of row `y`.
    #[inline(always)]
    fn ends<S: Simd>(&self, simd: S, from: usize, to: usize, y: usize) -> [usize; 2] {
        let most = MOST_PX.min((to - from) * MOST_PART[0] / MOST_PART[1]);
        let hidden = |x: Option<usize>| {
            let beside = x.and_then(|x| self.disparity.row(y).get(x));
            beside.is_some_and(|d| *d > NEARER * self.surface)
        };
        let mut ends = [from, to];
        if !hidden(from.checked_sub(ASIDE)) {
            ends[0] += strongest(self.edges(simd, from, y)[..=most].iter());
        }
        if !hidden(Some(to - 1 + ASIDE)) {
            ends[1] -= strongest(self.edges(simd, to - 1 - most, y)[..=most].iter().rev());
        }
        ends
    }

    /// The edges at the pixels from `x` on, added up over the rows around `y`.
    #[inline(always)]
    fn edges<S: Simd>(&self, simd: S, x: usize, y: usize) -> [u16; PLACES] {
        if self.left.is_gray { self.gray_edges(x, y) } else { self.color_edges(simd, x, y) }
    }

    /// The same of a view without colours.
    #[inline(always)]
    fn gray_edges(&self, x: usize, y: usize) -> [u16; PLACES] {
        let rows = y.saturating_sub(BAND)..(y + BAND + 1).min(self.left.gray.height());
        let mut sums = [0; PLACES];
        for y in rows.step_by(2) {
            let row = self.left.gray.row(y);
            if let Some(near) =
                row.get(x.wrapping_sub(1)..).and_then(|row| row.first_chunk::<READ>())
            {
                for i in 0..PLACES {
                    sums[i] += u16::from(near[i].abs_diff(near[i + 2]));
                }
            } else {
                let last = row.len() - 1;
                for (x, sum) in (x..=last).zip(&mut sums) {
                    let (before, after) = (row[x.saturating_sub(1)], row[(x + 1).min(last)]);
                    *sum += u16::from(before.abs_diff(after));
                }
            }
        }
        sums
    }

    /// The same of colours.
    #[inline(always)]
    fn color_edges<S: Simd>(&self, simd: S, x: usize, y: usize) -> [u16; PLACES] {
        let rgb = &self.left.rgb;
        let rows = y.saturating_sub(BAND)..(y + BAND + 1).min(rgb.height());
        let mut sums = [0; PLACES];
        let before = x.wrapping_sub(1).wrapping_mul(3);
        let (own, read) = (rgb.row(y).as_flattened(), before..before.saturating_add(READ_COLOR));
        if own.get(read.clone()).is_none() {
            for y in rows.step_by(2) {
                let row = rgb.row(y);
                let last = row.len() - 1;
                for (x, sum) in (x..=last).zip(&mut sums) {
                    let (before, after) = (row[x.saturating_sub(1)], row[(x + 1).min(last)]);
                    let steps = before.iter().zip(after).map(|(a, b)| a.abs_diff(b));
                    *sum += u16::from(steps.max().unwrap_or(0));
                }
            }
            return sums;
        }
        let [mut low, mut high] = [u16x16::splat(simd, 0); 2];
        for y in rows.step_by(2) {
            let row = &rgb.row(y).as_flattened()[read.clone()];
            let mut most = u8x32::splat(simd, 0);
            for channel in 0..3 {
                let (before, after) = (load(simd, row, channel), load(simd, row, channel + 6));
                most = most.max(abs_diff(before, after));
            }
            let (first, second) = most.widen();
            low += first;
            high += second;
        }
        let mut all = [0; LANES];
        low.store_slice(&mut all[..LANES / 2]);
        high.store_slice(&mut all[LANES / 2..]);
        // The channels of a pixel begin with every third.
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum = all[3 * i];
        }
        sums
    }
}

/// The step inward at which the edge is strongest.
#[inline(always)]
fn strongest<'a>(edges: impl Iterator<Item = &'a u16>) -> usize {
    let (mut best, mut step, mut weight) = (0.0, 0, 1.0);
    for (k, edge) in edges.enumerate() {
        let edge = f32::from(*edge) * weight;
        if edge > best {
            (best, step) = (edge, k);
        }
        weight *= INWARD;
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;
    use crate::simd;

    const SIZE: Size = Size::new(40, 20);

    /// A candidate of columns 10..26 before an image that is bright in columns
    /// 14..22, seen by a gray or a colour camera.
    fn cut(nearer: Option<usize>, is_gray: bool) -> (Candidates, usize) {
        let gray = Image::from_fn(SIZE, |x, _| if (14..22).contains(&x) { 200 } else { 40 });
        let green = |x, y| if gray.get(x, y) > 40 { [40, 200, 40] } else { [40; 3] };
        let rgb = if is_gray { Image::default() } else { Image::from_fn(SIZE, green) };
        let left = View { rgb, gray, is_gray, gradient: Image::default() };
        let disparity = Image::from_fn(SIZE, |x, _| if Some(x) == nearer { 20.0 } else { 10.0 });
        let mut out = Candidates::default();
        out.clear(SIZE, 2);
        for y in 2..18 {
            out.ids.row_mut(y)[10..26].fill(2);
            out.boxes[1].add(10, y, 0xffff);
        }
        Trim { left: &left, disparity: &disparity, surface: 10.0 }.run(simd::detect(), 2, &mut out);
        let area = out.ids.pixels().iter().filter(|id| **id == 2).count();
        (out, area)
    }

    #[test]
    fn the_ends_move_to_the_edges_of_the_image() {
        for is_gray in [true, false] {
            let (out, area) = cut(None, is_gray);
            let b = &out.boxes[1];
            // An edge between two pixels is seen from both.
            assert!((13..=14).contains(&b.x0) && (22..=23).contains(&b.x1), "{b:?}");
            assert_eq!((b.y0, b.y1, b.area), (2, 18, area));
            assert!((8 * 16..=10 * 16).contains(&area), "{area}");
        }
    }

    #[test]
    fn two_fifths_of_a_short_row_are_cut_and_no_half() {
        // Of ten pixels; an edge between two is seen from both, and the outer one is taken.
        for (edge, expected) in [(12, 11), (15, 14), (16, 10)] {
            let gray = Image::from_fn(SIZE, |x, _| if x < edge { 40 } else { 200 });
            let left = View { gray, is_gray: true, ..View::default() };
            let disparity = Image::filled(SIZE, 10.0);
            let mut out = Candidates::default();
            out.clear(SIZE, 2);
            for y in 2..18 {
                out.ids.row_mut(y)[10..20].fill(2);
                out.boxes[1].add(10, y, 0x3ff);
            }
            let trim = Trim { left: &left, disparity: &disparity, surface: 10.0 };
            trim.run(simd::detect(), 2, &mut out);
            assert_eq!(out.boxes[1].x0, expected, "{edge}");
        }
    }

    #[test]
    fn an_end_at_something_nearer_stays() {
        let (out, _) = cut(Some(8), true);
        assert_eq!(out.boxes[1].x0, 10);
        assert!(out.boxes[1].x1 < 26);
    }
}
