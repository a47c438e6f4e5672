//! Depth-aware connected components of the salient pixels.

use super::candidates::Candidates;
use super::union_find::UnionFind;
use crate::image::{Image, Size};

/// Disparity difference in pixels that is noise at any distance.
pub const TOLERANCE_PX: f32 = 0.7;
/// Disparity difference in parts of the disparity that one surface may have
/// from a pixel to the next.
pub const TOLERANCE_PART: f32 = 0.05;
/// A salient pixel that no component has reached yet.
const PENDING: u32 = Candidates::NEVER;

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
