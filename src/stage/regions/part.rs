//! Parts two things that hang together by a thread: a cable, a handle's shadow.

use super::candidates::{Candidates, PixelBox};

/// A neck is parted when it is narrower than this part of the narrower thing: the
/// grip of a drill has .6 of it, half parts ragged masks, a quarter does like a third.
const NECK: f32 = 0.33;
/// A thing of its own is at least so wide, in parts of the widest one.
const LEAST_WIDTH: f32 = 0.25;
/// and so large, in parts of all: a plug belongs to its cable.
const LEAST_AREA: f32 = 0.1;
/// Half of the least width of a thing of its own, in thirds of a pixel: what is
/// narrower than 16 pixels is the ragged edge of a mask.
const LEAST_RADIUS: u16 = 8 * STRAIGHT;
/// Distances to a neighbour in a row or column and across (Borgefors 1986).
const STRAIGHT: u16 = 3;
const ACROSS: u16 = 4;
/// No basin has reached the pixel yet.
const NONE: u32 = u32::MAX;

/// A part while it grows.
#[derive(Clone, Copy, Debug)]
struct Basin {
    /// Another basin that this one has become a part of, or itself.
    of: u32,
    /// Distance of its innermost pixel from the edge.
    peak: u16,
    /// Pixels so far.
    area: u32,
}

/// The former of parts, with its buffers.
#[derive(Debug, Default)]
pub struct Part {
    /// Distance from the edge per pixel of a box with a border of one, in thirds of a pixel.
    distance: Vec<u16>,
    /// Pixels of the candidate by decreasing distance.
    order: Vec<u32>,
    starts: Vec<u32>,
    basin: Vec<u32>,
    basins: Vec<Basin>,
    ids: Vec<u32>,
}

impl Part {
    /// Parts candidate `id` at its necks: a watershed of the distance from the
    /// edge (Vincent and Soille 1991) in which two basins become one where the
    /// pass between them is at least a third as high as the lower peak, or that peak
    /// lower than a quarter of the highest one or 8 pixels, or its basin there smaller than a
    /// tenth of all. The widest part keeps the id, the
    /// others get new ones at the end of the boxes.
    pub fn run(&mut self, id: u32, candidates: &mut Candidates) {
        let bounds = candidates.boxes[id as usize - 1];
        if bounds.area == 0 {
            return;
        }
        let width = bounds.width() + 2;
        let highest = self.measure(id, &bounds, candidates);
        if highest < LEAST_RADIUS {
            return;
        }
        self.sort(highest);
        self.flood(width, highest);
        self.write(id, &bounds, candidates);
    }

    /// Chamfer distances of the candidate's pixels from its edge; returns the largest.
    fn measure(&mut self, id: u32, bounds: &PixelBox, candidates: &Candidates) -> u16 {
        let (width, height) = (bounds.width() + 2, bounds.height() + 2);
        self.distance.clear();
        self.distance.resize(width * height, 0);
        let distance = &mut self.distance;
        for y in 1..height - 1 {
            let ids = &candidates.ids.row(bounds.y0 + y - 1)[bounds.x0..bounds.x1];
            for (x, _) in (1..).zip(ids).filter(|(_, other)| **other == id) {
                let at = y * width + x;
                let above = at - width;
                let straight = distance[at - 1].min(distance[above]) + STRAIGHT;
                let across = distance[above - 1].min(distance[above + 1]) + ACROSS;
                distance[at] = straight.min(across);
            }
        }
        let mut highest = 0;
        for y in (1..height - 1).rev() {
            for x in (1..width - 1).rev() {
                let at = y * width + x;
                let below = at + width;
                let straight = distance[at + 1].min(distance[below]) + STRAIGHT;
                let across = distance[below - 1].min(distance[below + 1]) + ACROSS;
                distance[at] = distance[at].min(straight).min(across);
                highest = highest.max(distance[at]);
            }
        }
        highest
    }

    /// The pixels from the innermost to the outermost, by counting.
    fn sort(&mut self, highest: u16) {
        let count = usize::from(highest) + 2;
        self.starts.clear();
        self.starts.resize(count, 0);
        let rank = |d: u16| usize::from(highest - d);
        for &d in self.distance.iter().filter(|d| **d > 0) {
            self.starts[rank(d) + 1] += 1;
        }
        for i in 1..count {
            self.starts[i] += self.starts[i - 1];
        }
        self.order.clear();
        self.order.resize(self.starts[count - 1] as usize, 0);
        for (at, &d) in self.distance.iter().enumerate().filter(|(_, d)| **d > 0) {
            let start = &mut self.starts[rank(d)];
            self.order[*start as usize] = at as u32;
            *start += 1;
        }
    }

    /// Gives every pixel a basin.
    fn flood(&mut self, width: usize, highest: u16) {
        self.basin.clear();
        self.basin.resize(self.distance.len(), NONE);
        self.basins.clear();
        let least_peak = LEAST_RADIUS.max((LEAST_WIDTH * f32::from(highest)) as u16);
        let least_area = LEAST_AREA * self.order.len() as f32;
        for i in 0..self.order.len() {
            let at = self.order[i] as usize;
            let level = self.distance[at];
            let (mut own, mut steepest) = (NONE, 0);
            for beside in [
                at - 1,
                at + 1,
                at - width,
                at + width,
                at - width - 1,
                at - width + 1,
                at + width - 1,
                at + width + 1,
            ] {
                if self.basin[beside] == NONE {
                    continue;
                }
                let mut other = find(&mut self.basins, self.basin[beside]);
                if own != NONE && own != other {
                    let (high, low) = self.by_height(own, other);
                    let lower = self.basins[low as usize];
                    if f32::from(level) >= NECK * f32::from(lower.peak)
                        || lower.peak < least_peak
                        || (lower.area as f32) < least_area
                    {
                        self.basins[low as usize].of = high;
                        self.basins[high as usize].area += lower.area;
                        (own, other) = (high, high);
                    }
                }
                // Between two basins a pixel flows up the steeper way: given to
                // the higher one, that would creep around the other along its edge.
                if own == NONE || self.distance[beside] > steepest {
                    (own, steepest) = (other, self.distance[beside]);
                }
            }
            if own == NONE {
                own = self.basins.len() as u32;
                self.basins.push(Basin { of: own, peak: level, area: 0 });
            }
            self.basin[at] = own;
            self.basins[own as usize].area += 1;
        }
    }

    /// Two basins, that with the higher peak first; of equal ones the older.
    fn by_height(&self, a: u32, b: u32) -> (u32, u32) {
        let rank = |i: u32| (self.basins[i as usize].peak, std::cmp::Reverse(i));
        if rank(a) > rank(b) { (a, b) } else { (b, a) }
    }

    /// Numbers the parts, and measures their boxes, when there is more than one.
    fn write(&mut self, id: u32, bounds: &PixelBox, candidates: &mut Candidates) {
        // The first basin holds the innermost pixel: nothing is higher.
        self.ids.clear();
        self.ids.resize(self.basins.len(), 0);
        let mut next = candidates.boxes.len() as u32;
        for i in 0..self.basins.len() {
            if self.basins[i].of == i as u32 {
                self.ids[i] = if i == 0 { id } else { next + 1 };
                next += u32::from(i > 0);
            }
        }
        if next as usize == candidates.boxes.len() {
            return;
        }
        candidates.boxes.resize(next as usize, PixelBox::NONE);
        candidates.boxes[id as usize - 1] = PixelBox::NONE;
        let width = bounds.width() + 2;
        for &at in &self.order {
            let (x, y) = (at as usize % width, at as usize / width);
            let root = find(&mut self.basins, self.basin[at as usize]);
            let part = self.ids[root as usize];
            let (x, y) = (bounds.x0 + x - 1, bounds.y0 + y - 1);
            candidates.ids.set(x, y, part);
            let pixel = PixelBox { x0: x, y0: y, x1: x + 1, y1: y + 1, area: 1 };
            candidates.boxes[part as usize - 1].join(&pixel);
        }
    }
}

/// The basin that another one has become a part of.
fn find(basins: &mut [Basin], mut basin: u32) -> u32 {
    while basins[basin as usize].of != basin {
        let of = basins[basin as usize].of;
        basins[basin as usize].of = basins[of as usize].of;
        basin = of;
    }
    basin
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Image, Size};

    /// How many parts a drawing falls into, and their areas from the largest.
    fn parts(inside: impl Fn(f32, f32) -> bool) -> Vec<usize> {
        let size = Size::new(200, 120);
        let ids = Image::from_fn(size, |x, y| u32::from(inside(x as f32, y as f32)));
        let area = ids.pixels().iter().filter(|id| **id == 1).count();
        let whole = PixelBox { x0: 0, y0: 0, x1: size.width, y1: size.height, area };
        let mut candidates = Candidates { ids, first: 1, boxes: vec![whole], followed: Vec::new() };
        Part::default().run(1, &mut candidates);
        for (id, b) in (1..).zip(&candidates.boxes) {
            let mut pixels = Vec::new();
            for y in 0..size.height {
                let row = (0..size.width).map(|x| (x, y));
                pixels.extend(row.filter(|&(x, y)| candidates.ids.get(x, y) == id));
            }
            assert_eq!(pixels.len(), b.area, "{id}");
            if candidates.boxes.len() > 1 {
                let range = |values: Vec<usize>| {
                    (values.iter().min().copied(), values.iter().max().map(|v| v + 1))
                };
                let [x, y] = [
                    range(pixels.iter().map(|p| p.0).collect()),
                    range(pixels.iter().map(|p| p.1).collect()),
                ];
                assert_eq!((x, y), ((Some(b.x0), Some(b.x1)), (Some(b.y0), Some(b.y1))));
            }
        }
        let mut areas: Vec<_> = candidates.boxes.iter().map(|b| b.area).collect();
        assert_eq!(areas.iter().sum::<usize>(), area);
        areas.sort_unstable_by(|a, b| b.cmp(a));
        areas
    }

    fn disc(x: f32, y: f32, cx: f32, radius: f32) -> bool {
        (x - cx).hypot(y - 60.0) <= radius
    }

    fn bar(x: f32, y: f32, half: f32) -> bool {
        (40.0..160.0).contains(&x) && (y - 60.0).abs() <= half
    }

    #[test]
    fn two_things_on_a_cable_are_two() {
        let areas =
            parts(|x, y| disc(x, y, 40.0, 35.0) || disc(x, y, 150.0, 18.0) || bar(x, y, 4.0));
        assert_eq!(areas.len(), 2, "{areas:?}");
        assert!(areas[1] as f32 > 2.7 * 18.0 * 18.0, "{areas:?}");
    }

    #[test]
    fn what_only_narrows_is_one() {
        // A hammer, a disc with a cable and nothing at its end, a bar, and a disc with a hole.
        assert_eq!(parts(|x, y| disc(x, y, 40.0, 25.0) || bar(x, y, 13.0)).len(), 1);
        assert_eq!(parts(|x, y| disc(x, y, 40.0, 35.0) || bar(x, y, 4.0)).len(), 1);
        assert_eq!(parts(|x, y| bar(x, y, 9.0)).len(), 1);
        assert_eq!(parts(|x, y| disc(x, y, 60.0, 50.0) && !disc(x, y, 60.0, 6.0)).len(), 1);
        // A plug at its end is none of its own, nor is a thin thing parted.
        assert_eq!(
            parts(|x, y| disc(x, y, 40.0, 40.0) || disc(x, y, 170.0, 10.0) || bar(x, y, 2.0)).len(),
            1
        );
        assert_eq!(parts(|x, y| x < 100.0 && (x - y).abs() < 3.0).len(), 1);
    }
}
