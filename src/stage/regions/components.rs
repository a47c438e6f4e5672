//! Depth-aware connected components of the salient pixels.

use super::union_find::UnionFind;
use crate::image::{Image, Size};

/// Disparity difference in pixels that is noise at any distance.
const TOLERANCE_PX: f32 = 0.7;
/// Disparity difference in parts of the disparity that one surface may have
/// from a pixel to the next.
const TOLERANCE_PART: f32 = 0.05;
/// A salient pixel that no component has reached yet.
const PENDING: u32 = u32::MAX;

/// True when two disparities may belong to one object:
/// |a − b| <= max(0.7 px, 5 % of the larger one). False for NaN.
#[inline]
pub fn agree(a: f32, b: f32) -> bool {
    (a - b).abs() <= tolerance(a.max(b))
}

/// By how much disparities of one object may differ from `disparity`, the larger one.
#[inline]
pub fn tolerance(disparity: f32) -> f32 {
    TOLERANCE_PX.max(TOLERANCE_PART * disparity)
}

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
    /// No pixel belongs to any of `count` candidates: their ids are others than
    /// those of the frame before, which stand.
    pub fn clear(&mut self, size: Size, count: usize) {
        let next = self.first as usize + self.boxes.len();
        if self.ids.size() == size && next + count < PENDING as usize {
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
    fn measure_boxes(&mut self, count: usize) {
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

/// Neighbouring salient pixels of one row that belong together.
#[derive(Clone, Copy, Debug)]
struct Run {
    y: u32,
    start: u32,
    end: u32,
    /// All pixels have a disparity; else none has.
    valid: bool,
}

/// The component former with its buffers.
///
/// 1. Salient pixels with disparity join their 8 neighbours when the two
///    disparities agree ([`agree`]): union–find over runs, linear in the pixels.
/// 2. Salient pixels without disparity take the component that reaches them
///    first, wave by wave; each takes one, so they never bridge two depths.
///    Between two neighbours they take the farther: what only one camera sees
///    belongs to the background.
/// 3. Fragments that touch and whose median disparities agree are one: the
///    panes and the roof of a car.
#[derive(Debug, Default)]
pub struct Components {
    runs: Vec<Run>,
    sets: UnionFind,
    /// Fragment of each run, while runs are counted: by representative.
    fragment: Vec<u32>,
    queue: Vec<u32>,
    first: Vec<u32>,
    values: Vec<f32>,
    medians: Vec<f32>,
    touching: Vec<u64>,
}

impl Components {
    /// Components of the pixels where `salient` is not 0. Both images have the same size.
    pub fn run(&mut self, salient: &Image<u8>, disparity: &Image<f32>, out: &mut Candidates) {
        self.link_runs(salient, disparity);
        let fragments = self.paint(disparity.size(), &mut out.ids);
        self.attach(disparity, &mut out.ids);
        let fragments = self.adopt_orphans(fragments, &mut out.ids);
        let count = self.merge(fragments, disparity, &mut out.ids);
        out.measure_boxes(count);
    }

    /// Step 1: runs, and unions between runs of neighbouring rows.
    fn link_runs(&mut self, salient: &Image<u8>, disparity: &Image<f32>) {
        self.runs.clear();
        self.sets.clear();
        let width = salient.width();
        let mut above = 0..0;
        for y in 0..salient.height() {
            let (mask, d) = (salient.row(y), disparity.row(y));
            let row_start = self.runs.len();
            let mut x = 0;
            while x < width {
                if mask[x] == 0 {
                    x += 1;
                    continue;
                }
                let (start, valid) = (x, !d[x].is_nan());
                x += 1;
                while x < width
                    && mask[x] != 0
                    && if valid { agree(d[x - 1], d[x]) } else { d[x].is_nan() }
                {
                    x += 1;
                }
                self.runs.push(Run { y: y as u32, start: start as u32, end: x as u32, valid });
                self.sets.push();
            }
            let row_end = self.runs.len();
            if y > 0 {
                self.link_rows(above, row_start..row_end, disparity);
            }
            above = row_start..row_end;
        }
    }

    fn link_rows(
        &mut self,
        above: std::ops::Range<usize>,
        row: std::ops::Range<usize>,
        disparity: &Image<f32>,
    ) {
        let mut first = above.start;
        for current in row {
            let c = self.runs[current];
            // Runs above that end before this one's left neighbour are done with.
            while first < above.end && self.runs[first].end < c.start {
                first += 1;
            }
            for upper in first..above.end {
                let p = self.runs[upper];
                if p.start > c.end {
                    break;
                }
                if p.valid == c.valid
                    && self.sets.find(upper as u32) != self.sets.find(current as u32)
                    && (!c.valid || runs_agree(p, c, disparity))
                {
                    self.sets.union(upper as u32, current as u32);
                }
            }
        }
    }

    /// Numbers the sets with disparity and writes the numbers; the other
    /// salient pixels become [`PENDING`].
    fn paint(&mut self, size: Size, ids: &mut Image<u32>) -> usize {
        ids.resize(size);
        ids.fill(0);
        self.fragment.clear();
        self.fragment.resize(self.runs.len(), 0);
        let mut count = 0;
        for (i, run) in self.runs.iter().enumerate() {
            let root = self.sets.find(i as u32) as usize;
            if run.valid && root == i {
                count += 1;
                self.fragment[i] = count;
            }
            let id = if run.valid { self.fragment[root] } else { PENDING };
            ids.row_mut(run.y as usize)[run.start as usize..run.end as usize].fill(id);
        }
        count as usize
    }

    /// Step 2: breadth first from all pixels that have a component.
    fn attach(&mut self, disparity: &Image<f32>, ids: &mut Image<u32>) {
        let size = ids.size();
        self.queue.clear();
        for run in self.runs.iter().filter(|r| !r.valid) {
            let y = run.y as usize;
            for x in run.start as usize..run.end as usize {
                // Farthest neighbour that was measured. Ids given in this loop
                // do not count: their pixels have no disparity.
                let mut best = (f32::INFINITY, 0);
                for_neighbours(x, y, size, |i| {
                    let (d, id) = (disparity.pixels()[i], ids.pixels()[i]);
                    if id != 0 && d < best.0 {
                        best = (d, id);
                    }
                });
                if best.1 != 0 {
                    ids.set(x, y, best.1);
                    self.queue.push((y * size.width + x) as u32);
                }
            }
        }
        let mut next = 0;
        while let Some(&at) = self.queue.get(next) {
            next += 1;
            let (x, y) = (at as usize % size.width, at as usize / size.width);
            let id = ids.pixels()[at as usize];
            for_neighbours(x, y, size, |i| {
                if ids.pixels()[i] == PENDING {
                    ids.pixels_mut()[i] = id;
                    self.queue.push(i as u32);
                }
            });
        }
    }

    /// Components without a single disparity become fragments of their own.
    fn adopt_orphans(&mut self, mut count: usize, ids: &mut Image<u32>) -> usize {
        for i in 0..self.runs.len() {
            let run = self.runs[i];
            let pixels = &mut ids.row_mut(run.y as usize)[run.start as usize..run.end as usize];
            if pixels[0] != PENDING {
                continue;
            }
            let root = self.sets.find(i as u32) as usize;
            if self.fragment[root] == 0 {
                count += 1;
                self.fragment[root] = count as u32;
            }
            pixels.fill(self.fragment[root]);
        }
        count
    }

    /// Step 3: one candidate per set of fragments; returns their number.
    fn merge(&mut self, count: usize, disparity: &Image<f32>, ids: &mut Image<u32>) -> usize {
        self.find_medians(count, disparity, ids);
        self.find_touching(ids);
        self.sets.reset(count);
        for &pair in &self.touching {
            let (a, b) = ((pair >> 32) as u32 - 1, pair as u32 - 1);
            if agree(self.medians[a as usize], self.medians[b as usize]) {
                self.sets.union(a, b);
            }
        }
        self.fragment.clear();
        let mut merged = 0;
        for i in 0..count {
            let root = self.sets.find(i as u32) as usize;
            if root == i {
                merged += 1;
            }
            let id = if root == i { merged } else { self.fragment[root] };
            self.fragment.push(id);
        }
        if merged as usize != count {
            for run in &self.runs {
                let row = &mut ids.row_mut(run.y as usize)[run.start as usize..run.end as usize];
                for id in row {
                    *id = self.fragment[*id as usize - 1];
                }
            }
        }
        merged as usize
    }

    /// Median disparity of each fragment (the upper one of an even number), NaN without any.
    fn find_medians(&mut self, count: usize, disparity: &Image<f32>, ids: &Image<u32>) {
        // Counting sort: `first[i]` becomes the end of fragment i's values.
        self.first.clear();
        self.first.resize(count + 1, 0);
        for run in self.runs.iter().filter(|r| r.valid) {
            let id = ids.get(run.start as usize, run.y as usize);
            self.first[id as usize] += run.end - run.start;
        }
        let mut total = 0;
        for n in &mut self.first {
            total += *n;
            *n = total - *n;
        }
        self.values.resize(total as usize, 0.0);
        for run in self.runs.iter().filter(|r| r.valid) {
            let y = run.y as usize;
            let d = &disparity.row(y)[run.start as usize..run.end as usize];
            let at = &mut self.first[ids.get(run.start as usize, y) as usize];
            self.values[*at as usize..][..d.len()].copy_from_slice(d);
            *at += d.len() as u32;
        }
        self.medians.clear();
        let mut start = 0;
        for &end in &self.first[1..] {
            let values = &mut self.values[start..end as usize];
            start = end as usize;
            let middle = values.len() / 2;
            self.medians.push(if values.is_empty() {
                f32::NAN
            } else {
                *values.select_nth_unstable_by(middle, f32::total_cmp).1
            });
        }
    }

    /// Pairs of fragments with neighbouring pixels, each once, in order.
    fn find_touching(&mut self, ids: &Image<u32>) {
        self.touching.clear();
        let (width, height) = (ids.width(), ids.height());
        let mut last = 0;
        for run in &self.runs {
            let y = run.y as usize;
            let row = ids.row(y);
            let below = if y + 1 < height { ids.row(y + 1) } else { &[] };
            for x in run.start as usize..run.end as usize {
                let id = row[x];
                let right = row.get(x + 1).copied().unwrap_or(0);
                let low = below.get(x.saturating_sub(1)..(x + 2).min(width)).unwrap_or(&[]);
                for &other in low.iter().chain([&right]) {
                    if other != 0 && other != id {
                        let pair = (u64::from(id.min(other)) << 32) | u64::from(id.max(other));
                        if pair != last {
                            self.touching.push(pair);
                            last = pair;
                        }
                    }
                }
            }
        }
        self.touching.sort_unstable();
        self.touching.dedup();
    }
}

/// True when any pixel of `upper` and an 8-neighbour of it in `lower` agree.
fn runs_agree(upper: Run, lower: Run, disparity: &Image<f32>) -> bool {
    let (above, row) = (disparity.row(upper.y as usize), disparity.row(lower.y as usize));
    let from = lower.start.max(upper.start.saturating_sub(1));
    let to = lower.end.min(upper.end + 1);
    (from..to).any(|x| {
        let left = upper.start.max(x.saturating_sub(1));
        let right = upper.end.min(x + 2);
        (left..right).any(|u| agree(above[u as usize], row[x as usize]))
    })
}

/// Calls `visit` with the index of each of the 8 neighbours inside the image:
/// the four nearest first.
#[inline]
fn for_neighbours(x: usize, y: usize, size: Size, mut visit: impl FnMut(usize)) {
    const AROUND: [(isize, isize); 8] =
        [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];
    for (dx, dy) in AROUND {
        let (nx, ny) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
        if nx < size.width && ny < size.height {
            visit(ny * size.width + nx);
        }
    }
}
