//! Outlines of narrow things, at the edges that the image shows.
//!
//! A matching window that lies half on a thing takes the thing's disparity:
//! what is nearer grows by up to half a window on either side. A car does not
//! mind, a person doubles, and a post has more of the wall behind it than of
//! itself. The image knows where the thing ends (compare the weighted median of
//! Ma et al., "Constant Time Weighted Median Filtering for Stereo Matching and
//! Beyond", ICCV 2013, which asks the colours of every pixel).

use super::components::{Candidates, PixelBox};
use crate::image::Image;

/// Width in metres (of a road scene) up to which a thing is narrow: a person
/// who walks, a trunk, a post.
pub const NARROW_M: f32 = 1.2;
/// Most pixels that are cut from one end of a row, and most parts of the row.
const MOST_PX: usize = 6;
const MOST_PART: usize = 3;
/// Rows above and below over which an edge is added up, every other one: sides
/// are upright.
const BAND: usize = 3;
/// What an edge loses per pixel further inward.
const INWARD: f32 = 0.95;
/// Pixels beyond the end of a row where what is beside the thing is looked for.
const ASIDE: usize = 2;
/// How much nearer that must be to hide a part of the thing, in parts of the disparity.
const NEARER: f32 = 1.1;

/// What the cutting of one thing asks.
#[derive(Clone, Copy)]
pub struct Trim<'a> {
    /// The image that the masks belong to.
    pub rgb: &'a Image<[u8; 3]>,
    /// Disparity in pixels, NaN where there is none.
    pub disparity: &'a Image<f32>,
    /// Disparity of the thing.
    pub surface: f32,
}

impl Trim<'_> {
    /// Moves both ends of every row of candidate `id` inward to the strongest
    /// upright edge (maximum over R, G and B of |I(x + 1) − I(x − 1)|, added up
    /// over four of seven rows) within six pixels and a third of the row. An end at
    /// something nearer stays: there it is the other thing that grew.
    pub fn run(&self, id: u32, out: &mut Candidates) {
        let bounds = out.boxes[id as usize - 1];
        let mut cut = PixelBox::NONE;
        for y in bounds.y0..bounds.y1 {
            let mut x = bounds.x0;
            while x < bounds.x1 {
                let row = &out.ids.row(y)[x..bounds.x1];
                let skipped = row.iter().take_while(|at| **at != id).count();
                let length = row[skipped..].iter().take_while(|at| **at == id).count();
                let (from, to) = (x + skipped, x + skipped + length);
                x = to.max(x + 1);
                if length == 0 {
                    continue;
                }
                let [left, right] = self.ends(from, to, y);
                out.ids.row_mut(y)[from..left].fill(0);
                out.ids.row_mut(y)[right..to].fill(0);
                (cut.x0, cut.x1) = (cut.x0.min(left), cut.x1.max(right));
                (cut.y0, cut.y1) = (cut.y0.min(y), cut.y1.max(y + 1));
                cut.area += right - left;
            }
        }
        out.boxes[id as usize - 1] = cut;
    }

    /// The new ends of the pixels `from..to` of row `y`.
    fn ends(&self, from: usize, to: usize, y: usize) -> [usize; 2] {
        let most = MOST_PX.min((to - from) / MOST_PART);
        let hidden = |x: Option<usize>| {
            let beside = x.and_then(|x| self.disparity.row(y).get(x));
            beside.is_some_and(|d| *d > NEARER * self.surface)
        };
        let mut ends = [from, to];
        if !hidden(from.checked_sub(ASIDE)) {
            ends[0] += self.strongest(most, |k| from + k, y);
        }
        if !hidden(Some(to - 1 + ASIDE)) {
            ends[1] -= self.strongest(most, |k| to - 1 - k, y);
        }
        ends
    }

    /// The step inward, from 0 to `most`, at which the edge is strongest.
    fn strongest(&self, most: usize, at: impl Fn(usize) -> usize, y: usize) -> usize {
        let rows = y.saturating_sub(BAND)..(y + BAND + 1).min(self.rgb.height());
        let (mut best, mut step, mut weight) = (0.0, 0, 1.0);
        for k in 0..=most {
            let x = at(k);
            let (before, after) = (x.saturating_sub(1), (x + 1).min(self.rgb.width() - 1));
            let edge: u32 = rows
                .clone()
                .step_by(2)
                .map(|y| {
                    let row = self.rgb.row(y);
                    let steps = row[before].iter().zip(row[after]).map(|(a, b)| a.abs_diff(b));
                    u32::from(steps.max().unwrap_or(0))
                })
                .sum();
            if edge as f32 * weight > best {
                (best, step) = (edge as f32 * weight, k);
            }
            weight *= INWARD;
        }
        step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;

    const SIZE: Size = Size::new(40, 20);

    /// A candidate of columns 10..26 before an image that is bright in columns 14..22.
    fn cut(nearer: Option<usize>) -> (Candidates, usize) {
        let rgb =
            Image::from_fn(
                SIZE,
                |x, _| {
                    if (14..22).contains(&x) { [40, 200, 40] } else { [40, 40, 40] }
                },
            );
        let disparity = Image::from_fn(SIZE, |x, _| if Some(x) == nearer { 20.0 } else { 10.0 });
        let mut out = Candidates::default();
        out.clear(SIZE, 2);
        for y in 2..18 {
            out.ids.row_mut(y)[10..26].fill(2);
            out.boxes[1].add(10, y, 0xffff);
        }
        Trim { rgb: &rgb, disparity: &disparity, surface: 10.0 }.run(2, &mut out);
        let area = out.ids.pixels().iter().filter(|id| **id == 2).count();
        (out, area)
    }

    #[test]
    fn the_ends_move_to_the_edges_of_the_image() {
        let (out, area) = cut(None);
        let b = &out.boxes[1];
        // An edge between two pixels is seen from both.
        assert!((13..=14).contains(&b.x0) && (22..=23).contains(&b.x1), "{b:?}");
        assert_eq!((b.y0, b.y1, b.area), (2, 18, area));
        assert!((8 * 16..=10 * 16).contains(&area), "{area}");
    }

    #[test]
    fn an_end_at_something_nearer_stays() {
        let (out, _) = cut(Some(8));
        assert_eq!(out.boxes[1].x0, 10);
        assert!(out.boxes[1].x1 < 26);
    }
}
