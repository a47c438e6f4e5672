//! Posts, as far up as the image shows them.
//!
//! The post of a lamp or of a sign is a few pixels wide and ends far above what
//! is matched: with the disparities alone it is a stump. Two straight sides of
//! one colour, one above the other, are no accident.

use std::ops::Range;

use crate::image::Image;
use crate::perception::View;
use crate::stage::ground::Plane;
use crate::stage::regions::candidates::{Candidates, PixelBox};
use crate::stage::standing::climb::TALL_M;
use crate::stage::standing::size_scale;

/// Width of the widest post, metres (of a road scene); a trunk is wider.
const WIDEST_M: f32 = 0.15;
/// The narrowest one whose colour can be told, pixels.
const LEAST_PX: usize = 2;
/// Pixels by which a matching window widens what is nearer, both sides together.
const WIDENED_PX: f32 = 4.0;
/// A post is known at least up to this height, metres: what is lower ends there.
const LEAST_TOP_M: f32 = 1.9;
/// It goes on by so much, and as high as nothing else that stands on a road; at the
/// upper edge of the image so many steps are enough.
const LEAST_RISE_M: f32 = 1.5;
const LEAST_STEPS: usize = 2;
/// Rows below the known top in which its sides are looked for.
const ROWS: usize = 12;
/// Rows that are followed at once, and by how many pixels it may lean in them.
const STEP: usize = 4;
const LEAN: [isize; 3] = [0, -1, 1];
/// Steps in a row that need not show it: a leaf, a wire, a cornice behind it.
const GAP: usize = 1;
/// Pixels beside it whose colour is asked, and how far from it they begin.
const ASIDE: usize = 2;
const APART: usize = 1;
/// Least contrast to both sides and largest change of its own colour from step to step
/// (of 255, in one of R, G and B), and how much of it the next step expects.
const CONTRAST: f32 = 15.0;
const CHANGE: f32 = 20.0;
const RENEWAL: f32 = 0.3;

/// Columns of some rows.
type Span = (Range<usize>, Range<usize>);

/// The follower of posts, with its buffers.
#[derive(Debug, Default)]
pub struct Posts {
    band: Band,
    up: Vec<Span>,
    down: Vec<Span>,
}

/// What is known of the thing that may be a post.
#[derive(Clone, Copy)]
pub struct Stump<'a> {
    /// The left view.
    pub left: &'a View,
    /// What it stands on.
    pub plane: &'a Plane,
    /// Its disparity, pixels (`cx_l - cx_r` subtracted).
    pub disparity: f32,
    /// Pixels that a metre is wide there.
    pub metre_px: f32,
}

/// A piece of a post: columns and colour.
#[derive(Clone)]
struct Shaft {
    columns: Range<usize>,
    colour: [f32; 3],
    /// To the side from which it differs less.
    contrast: f32,
}

impl Posts {
    /// If candidate `id`, counted from 1, is narrow and the image shows it high above its upper
    /// end, gives it the pixels of the post up there and takes those from it that
    /// are beside the post.
    pub fn run(&mut self, stump: &Stump<'_>, id: u32, out: &mut Candidates) {
        let bounds = out.boxes[id as usize - 1];
        let own = out.first + id - 1;
        let scale = size_scale(stump.plane);
        let height =
            |y: usize| stump.plane.height(bounds.x0 as f32, y as f32, stump.disparity) / scale;
        if bounds.area == 0 || height(bounds.y0) < LEAST_TOP_M {
            return;
        }
        let widest = WIDEST_M * scale * stump.metre_px;
        let rows = bounds.y0..bounds.y1.min(bounds.y0 + ROWS);
        let Some(columns) = upper_part(&out.ids, own, &bounds, &rows, widest + WIDENED_PX) else {
            return;
        };
        let Some(shaft) = self.find(stump.left, rows, columns, widest) else { return };
        let Self { band, up, down } = self;
        let upward = (0..bounds.y0.div_ceil(STEP))
            .map(|k| bounds.y0.saturating_sub((k + 1) * STEP)..bounds.y0 - k * STEP);
        let end = band.follow(stump.left, &shaft, upward, up);
        let rises = height(end) >= (height(bounds.y0) + LEAST_RISE_M).max(TALL_M);
        if up.is_empty() || !(rises || end == 0 && up.len() >= LEAST_STEPS) {
            return;
        }
        let downward = (bounds.y0..bounds.y1).step_by(STEP).map(|y| y..(y + STEP).min(bounds.y1));
        band.follow(stump.left, &shaft, downward, down);
        self.write(id, &bounds, &shaft, out);
    }

    /// The strongest pair of sides among `columns`, both in contrast to what is beside.
    fn find(
        &mut self,
        left: &View,
        rows: Range<usize>,
        columns: Range<usize>,
        widest: f32,
    ) -> Option<Shaft> {
        self.band.fill(left, rows, &columns);
        let widest = (widest.round() as usize).max(LEAST_PX);
        let mut best: Option<Shaft> = None;
        // Among equals the wider one: a part of a post has no more contrast than the whole.
        let score = |shaft: &Shaft| shaft.contrast + shaft.columns.len() as f32;
        for from in columns.clone() {
            for to in from + LEAST_PX..=(from + widest).min(columns.end) {
                let shaft = self.band.shaft(from..to);
                best = match (shaft, best) {
                    (Some(new), Some(old)) if score(&new) <= score(&old) => Some(old),
                    (Some(new), _) => Some(new),
                    (None, old) => old,
                };
            }
        }
        best.filter(|shaft| shaft.contrast >= CONTRAST)
    }

    /// Writes what was followed, and where nothing was, no more than a pixel beside it.
    fn write(&self, id: u32, bounds: &PixelBox, shaft: &Shaft, out: &mut Candidates) {
        let (own, first) = (out.first + id - 1, out.first);
        let mut all = PixelBox::NONE;
        let mut y0 = bounds.y0;
        for (rows, columns) in &self.down {
            for y in rows.clone() {
                let row = out.ids.row_mut(y);
                if give(&mut row[bounds.x0..bounds.x1], own, 0) > 0 {
                    all.join(&take(row, y, columns, own, first));
                }
            }
            y0 = rows.end;
        }
        let last = self.down.last().map_or(&shaft.columns, |(_, columns)| columns);
        let near = last.start.max(bounds.x0 + 1) - 1..(last.end + 1).min(bounds.x1);
        for y in y0..bounds.y1 {
            let row = out.ids.row_mut(y);
            give(&mut row[bounds.x0..near.start], own, 0);
            give(&mut row[near.end..bounds.x1], own, 0);
            for x in near.clone() {
                all.add(x, y, u64::from(row[x] == own));
            }
        }
        let known = all.area;
        for (rows, columns) in &self.up {
            for y in rows.clone() {
                all.join(&take(out.ids.row_mut(y), y, columns, own, first));
            }
        }
        out.boxes[id as usize - 1] = all;
        out.followed.push((own, all.area - known));
    }
}

/// Gives the pixels of `id` to another; how many there were.
fn give(pixels: &mut [u32], id: u32, to: u32) -> usize {
    pixels.iter_mut().filter(|owner| **owner == id).map(|owner| *owner = to).count()
}

/// Gives those of `columns` to `id` that are nobody's: below `first`.
fn take(row: &mut [u32], y: usize, columns: &Range<usize>, id: u32, first: u32) -> PixelBox {
    let mut taken = PixelBox::NONE;
    for (x, owner) in columns.clone().zip(&mut row[columns.clone()]) {
        taken.add(x, y, u64::from(*owner < first));
        *owner = if *owner < first { id } else { *owner };
    }
    taken
}

/// The columns of candidate `id` in `rows` and one more on either side, if it is
/// no wider there than `widest` pixels on average.
fn upper_part(
    ids: &Image<u32>,
    id: u32,
    bounds: &PixelBox,
    rows: &Range<usize>,
    widest: f32,
) -> Option<Range<usize>> {
    let (mut from, mut to, mut pixels) = (bounds.x1, bounds.x0, 0);
    for y in rows.clone() {
        let row = &ids.row(y)[bounds.x0..bounds.x1];
        let Some(first) = row.iter().position(|i| *i == id) else { continue };
        let last = row.iter().rposition(|i| *i == id).unwrap_or(first);
        (from, to) = (from.min(bounds.x0 + first), to.max(bounds.x0 + last + 1));
        pixels += row.iter().filter(|i| **i == id).count();
    }
    let narrow = pixels as f32 <= widest * rows.len() as f32;
    narrow.then(|| from.saturating_sub(1)..(to + 1).min(ids.width()))
}

/// Colours of columns over a few rows, added up.
#[derive(Debug, Default)]
struct Band {
    /// First column.
    from: usize,
    rows: f32,
    /// Sums of all columns before each, and of all.
    sums: Vec<[u32; 3]>,
}

impl Band {
    /// Takes `columns` and what is beside them.
    fn fill(&mut self, left: &View, rows: Range<usize>, columns: &Range<usize>) {
        self.from = columns.start.saturating_sub(APART + ASIDE);
        self.rows = rows.len() as f32;
        let to = (columns.end + APART + ASIDE).min(left.gray.width());
        self.sums.clear();
        self.sums.resize(to - self.from + 1, [0; 3]);
        for y in rows {
            if left.is_gray {
                for (sum, gray) in self.sums[1..].iter_mut().zip(&left.gray.row(y)[self.from..to]) {
                    *sum = sum.map(|sum| sum + u32::from(*gray));
                }
                continue;
            }
            for (sum, pixel) in self.sums[1..].iter_mut().zip(&left.rgb.row(y)[self.from..to]) {
                *sum = [0, 1, 2].map(|i| sum[i] + u32::from(pixel[i]));
            }
        }
        let mut so_far = [0; 3];
        for sum in &mut self.sums {
            so_far = [0, 1, 2].map(|i| so_far[i] + sum[i]);
            *sum = so_far;
        }
    }

    /// Mean colour of columns; `None` where they are not all known.
    fn mean(&self, columns: Range<usize>) -> Option<[f32; 3]> {
        let from = self.sums.get(columns.start.checked_sub(self.from)?)?;
        let to = self.sums.get(columns.end - self.from)?;
        let n = self.rows * columns.len() as f32;
        Some([0, 1, 2].map(|i| (to[i] - from[i]) as f32 / n))
    }

    /// These columns as a piece of a post; `None` at the edge of the image.
    fn shaft(&self, columns: Range<usize>) -> Option<Shaft> {
        let left = columns.start.checked_sub(APART + ASIDE)?;
        let right = columns.end + APART;
        let colour = self.mean(columns.clone())?;
        let [left, right] = [self.mean(left..left + ASIDE)?, self.mean(right..right + ASIDE)?];
        let contrast = contrast(&colour, &left, &right);
        Some(Shaft { columns, colour, contrast })
    }

    /// Fills `spans` with where the post goes on from `shaft` through `blocks` of
    /// rows. Returns the first row of the last one that shows it.
    fn follow(
        &mut self,
        left: &View,
        shaft: &Shaft,
        blocks: impl Iterator<Item = Range<usize>>,
        spans: &mut Vec<Span>,
    ) -> usize {
        spans.clear();
        let (mut columns, mut colour) = (shaft.columns.clone(), shaft.colour);
        let (mut shown, mut end) = (0, usize::MAX);
        for rows in blocks {
            let around = columns.start.saturating_sub(1)..columns.end + 1;
            self.fill(left, rows.clone(), &around);
            let mut best: Option<Shaft> = None;
            for lean in LEAN {
                let moved = |x: usize| x.saturating_add_signed(lean);
                let Some(new) = self.shaft(moved(columns.start)..moved(columns.end)) else {
                    continue;
                };
                let same = difference(&new.colour, &colour) <= CHANGE;
                let better = best.as_ref().is_none_or(|old| new.contrast > old.contrast);
                if same && new.contrast >= CONTRAST && better {
                    best = Some(new);
                }
            }
            if let Some(new) = best {
                columns = new.columns;
                colour = [0, 1, 2].map(|i| colour[i] + RENEWAL * (new.colour[i] - colour[i]));
                end = rows.start;
                spans.push((rows, columns.clone()));
                shown = spans.len();
            } else {
                spans.push((rows, columns.clone()));
                if spans.len() - shown > GAP {
                    break;
                }
            }
        }
        spans.truncate(shown);
        end
    }
}

/// The largest difference in one channel.
fn difference(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// The largest contrast of a colour to two others in one channel in which it is not
/// between them: so is what mixes them at an edge.
fn contrast(colour: &[f32; 3], left: &[f32; 3], right: &[f32; 3]) -> f32 {
    let sides = left.iter().zip(right);
    let steps = colour.iter().zip(sides).map(|(own, (left, right))| {
        let (left, right) = (own - left, own - right);
        if left * right > 0.0 { left.abs().min(right.abs()) } else { 0.0 }
    });
    steps.fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, StereoRig};
    use crate::image::Size;

    const SIZE: Size = Size::new(120, 300);
    const DISPARITY: f32 = 21.0;
    const OWN: u32 = 3;
    /// Rows of what was matched of the thing, from 2.3 m down to the ground.
    const MATCHED: Range<usize> = 173..270;

    fn plane() -> Plane {
        let camera = |tx| Camera::pinhole(SIZE, 420.0, 60.0, 205.0, tx);
        let rig = StereoRig::new(camera(0.0), camera(-210.0), 0.0).unwrap();
        Plane::new(0.5 / 1.55, 0.0, -205.0 * 0.5 / 1.55, &rig).unwrap()
    }

    /// Candidate 1 in `columns` of a grey image, dark where `dark` says so.
    fn follow(columns: Range<usize>, dark: impl Fn(usize, usize) -> bool) -> Candidates {
        follow_from(MATCHED.start, columns, dark)
    }

    /// The same, matched from row `upper` on.
    fn follow_from(
        upper: usize,
        columns: Range<usize>,
        dark: impl Fn(usize, usize) -> bool,
    ) -> Candidates {
        let matched = upper..MATCHED.end;
        let gray = Image::from_fn(SIZE, |x, y| if dark(x, y) { 60 } else { 120 });
        let rgb = Image::from_fn(SIZE, |x, y| [gray.get(x, y), 120, 120]);
        let color = View { rgb, gray: gray.clone(), is_gray: false, ..View::default() };
        let gray = View { gray, is_gray: true, ..View::default() };
        let [out, same] =
            [color, gray].map(|left| follow_in(&left, columns.clone(), matched.clone()));
        assert_eq!(out.ids.pixels(), same.ids.pixels());
        out
    }

    fn follow_in(left: &View, columns: Range<usize>, matched: Range<usize>) -> Candidates {
        let mut out = Candidates::default();
        // The second frame: the ids of the first one stand.
        out.clear(SIZE, 2);
        out.ids.fill(1);
        out.clear(SIZE, 2);
        assert_eq!(out.first, OWN);
        for y in matched.clone() {
            out.ids.row_mut(y)[columns.clone()].fill(OWN);
        }
        out.boxes[0] = PixelBox {
            x0: columns.start,
            y0: matched.start,
            x1: columns.end,
            y1: matched.end,
            area: columns.len() * matched.len(),
        };
        // Something else that hides a part of it.
        out.ids.row_mut(30).fill(OWN + 1);
        let plane = plane();
        let stump = Stump { left, plane: &plane, disparity: DISPARITY, metre_px: 42.0 };
        Posts::default().run(&stump, 1, &mut out);
        out
    }

    fn area(out: &Candidates) -> usize {
        out.ids.pixels().iter().filter(|id| **id == OWN).count()
    }

    #[test]
    fn a_post_goes_on_as_far_as_its_two_sides() {
        // It leans.
        let from = |y: usize| 46 + y / 50;
        let out = follow(46..56, |x, y| (from(y)..from(y) + 5).contains(&x) && y >= 20);
        let b = &out.boxes[0];
        assert!((18..=21).contains(&b.y0) && b.y1 == MATCHED.end, "{b:?}");
        assert!(b.x0 >= 45 && b.x1 <= 57, "{b:?}");
        assert_eq!(b.area, area(&out));
        let true_area = 5 * (MATCHED.end - 20);
        assert!(b.area.abs_diff(true_area) < true_area / 5, "{b:?}");
        assert!(out.ids.row(30).iter().all(|id| *id == OWN + 1));
        let above: usize = (0..MATCHED.start)
            .map(|y| out.ids.row(y).iter().filter(|id| **id == OWN).count())
            .sum();
        assert_eq!((out.followed_of(OWN), out.followed_of(OWN + 1)), (above, 0));
    }

    #[test]
    fn a_leaf_before_it_does_not_end_it_and_its_end_does() {
        let post = |x: usize, y: usize| (48..53).contains(&x) && y >= 20;
        let out = follow(46..56, |x, y| post(x, y) && !(50..53).contains(&y));
        assert!(out.boxes[0].y0 <= 21);
        // At 4.1 m; what is no higher may be anything.
        let out = follow(46..56, |x, y| post(x, y) && y >= 100);
        assert_eq!((out.boxes[0].y0, out.boxes[0].x0), (MATCHED.start, 46));
    }

    #[test]
    fn what_is_no_post_stays_as_it_was() {
        // A person, a trunk, the edge of a house.
        let person = |x, y| (48..53).contains(&x) && y >= MATCHED.start;
        let trunk = |x, _| (46..58).contains(&x);
        let house = |x, _| x >= 48;
        for (columns, out) in [
            (46..56, follow(46..56, person)),
            (44..60, follow(44..60, trunk)),
            (46..56, follow(46..56, house)),
        ] {
            assert_eq!(area(&out), columns.len() * MATCHED.len());
            assert_eq!(out.followed_of(OWN), 0);
        }
    }

    #[test]
    fn at_the_upper_edge_one_step_shows_no_post() {
        let post = |x: usize, _: usize| (48..53).contains(&x);
        for (from, follows) in [(3, false), (7, true)] {
            let out = follow_from(from, 46..56, post);
            assert_eq!(out.followed_of(OWN) > 0, follows, "{from}");
        }
    }

    #[test]
    fn the_edge_of_the_image_is_no_side() {
        let out = follow(0..6, |x, _| x < 4);
        assert_eq!((out.boxes[0].y0, area(&out)), (MATCHED.start, 6 * MATCHED.len()));
    }
}
