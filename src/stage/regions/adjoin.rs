//! Gives what lies against a larger thing to that thing.
//!
//! Seen from above the neck of a bottle or the rim of a cup is so much nearer
//! than the rest that it is a surface of its own, but nothing floats over a table.

use super::candidates::{Candidates, PixelBox};

/// Share of its outline along which a candidate lies against another one to be
/// a part of it: two boxes side by side share a quarter.
const LEAST_SHARED: f32 = 0.3;
/// and its area in parts of the other one's, at most.
const MOST_AREA: f32 = 0.35;

/// The former, with its buffers.
#[derive(Debug, Default)]
pub struct Adjoin {
    /// Edges between the pixels of two candidates, as pairs of ids, the lower one in the high half.
    edges: Vec<u64>,
    /// Edges of each candidate's pixels to others and to nothing.
    outline: Vec<u32>,
    /// Best neighbour of each candidate so far, and the edges shared with it.
    best: Vec<(u32, u32)>,
    /// New id of each candidate.
    ids: Vec<u32>,
}

impl Adjoin {
    /// Every candidate that shares three tenths of its outline with one of three
    /// times its area becomes a part of the one with which it shares most.
    /// Candidates of no area stay out of it; those that became a part have none
    /// any more. Returns how many did.
    pub fn run(&mut self, candidates: &mut Candidates) -> u32 {
        self.trace(candidates);
        let boxes = &candidates.boxes;
        self.best.clear();
        self.best.resize(boxes.len(), (0, 0));
        self.edges.sort_unstable();
        for same in self.edges.chunk_by(|a, b| a == b) {
            let pair = [(same[0] >> 32) as u32, same[0] as u32];
            let area = |id: u32| boxes[id as usize - 1].area as f32;
            let [a, b] = pair.map(area);
            let (large, small) = if a >= b { (pair[0], pair[1]) } else { (pair[1], pair[0]) };
            let best = &mut self.best[small as usize - 1];
            if same.len() as u32 > best.1 && area(small) <= MOST_AREA * area(large) {
                *best = (large, same.len() as u32);
            }
        }
        self.ids.clear();
        self.ids.extend(1..=boxes.len() as u32);
        for (i, &(large, shared)) in self.best.iter().enumerate() {
            if shared as f32 >= LEAST_SHARED * self.outline[i] as f32 && shared > 0 {
                self.ids[i] = large;
            }
        }
        self.write(candidates)
    }

    /// Walks along all outlines.
    fn trace(&mut self, candidates: &Candidates) {
        let Candidates { ids, boxes, .. } = candidates;
        self.edges.clear();
        self.outline.clear();
        self.outline.resize(boxes.len(), 0);
        let kept = |id: u32| id != 0 && boxes[id as usize - 1].area > 0;
        let mut border = |a: u32, b: u32| {
            if a == b {
                return;
            }
            let (a, b) = (a.min(b), a.max(b));
            for id in [a, b].into_iter().filter(|id| kept(*id)) {
                self.outline[id as usize - 1] += 1;
            }
            if kept(a) && kept(b) {
                self.edges.push((u64::from(a) << 32) | u64::from(b));
            }
        };
        // All outlines lie in the box of all boxes, with a border of one.
        let mut all = PixelBox::NONE;
        boxes.iter().filter(|b| b.area > 0).for_each(|b| all.join(b));
        let columns = all.x0.saturating_sub(1)..(all.x1 + 1).min(ids.width());
        let rows = all.y0.saturating_sub(1)..(all.y1 + 1).min(ids.height());
        for y in rows.clone() {
            let row = &ids.row(y)[columns.clone()];
            for pair in row.windows(2) {
                border(pair[0], pair[1]);
            }
            if y + 1 < rows.end {
                for (&above, &below) in row.iter().zip(&ids.row(y + 1)[columns.clone()]) {
                    border(above, below);
                }
            }
        }
    }

    /// Writes the ids of the joined ones, and their boxes; returns how many there are.
    fn write(&mut self, candidates: &mut Candidates) -> u32 {
        let mut joined = 0;
        for i in 0..self.ids.len() {
            // Each step leads to a larger one.
            let mut to = self.ids[i];
            while self.ids[to as usize - 1] != to {
                to = self.ids[to as usize - 1];
            }
            if to as usize == i + 1 {
                continue;
            }
            let part = std::mem::replace(&mut candidates.boxes[i], PixelBox::NONE);
            for y in part.y0..part.y1 {
                for id in &mut candidates.ids.row_mut(y)[part.x0..part.x1] {
                    *id = if *id == i as u32 + 1 { to } else { *id };
                }
            }
            candidates.boxes[to as usize - 1].join(&part);
            joined += 1;
        }
        joined
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Image, Size};

    /// Joins rectangles (x, y, width, height), later ones on top; the areas that are left.
    fn areas(rectangles: &[[usize; 4]]) -> Vec<usize> {
        let mut ids = Image::new(Size::new(80, 60));
        for (id, &[x, y, width, height]) in (1..).zip(rectangles) {
            for v in y..y + height {
                ids.row_mut(v)[x..x + width].fill(id);
            }
        }
        let measure = |ids: &Image<u32>, id: u32| {
            let mut b = PixelBox::NONE;
            for (y, row) in ids.rows().enumerate() {
                for (x, _) in row.iter().enumerate().filter(|(_, other)| **other == id) {
                    (b.x0, b.x1, b.y0, b.y1) =
                        (b.x0.min(x), b.x1.max(x + 1), b.y0.min(y), b.y1.max(y + 1));
                    b.area += 1;
                }
            }
            b
        };
        let boxes: Vec<_> = (1..=rectangles.len() as u32).map(|id| measure(&ids, id)).collect();
        let mut candidates = Candidates { ids, first: 1, boxes, followed: Vec::new() };
        let joined = Adjoin::default().run(&mut candidates);
        let empty = candidates.boxes.iter().filter(|b| b.area == 0).count();
        assert_eq!(joined as usize, empty);
        for (id, b) in (1..).zip(&candidates.boxes) {
            assert_eq!(*b, measure(&candidates.ids, id), "{id}");
        }
        candidates.boxes.iter().map(|b| b.area).collect()
    }

    #[test]
    fn what_a_thing_encloses_on_two_sides_is_a_part_of_it() {
        // A rim over the end of a cup, and a speck on the rim.
        assert_eq!(areas(&[[10, 10, 30, 40], [15, 5, 12, 20], [18, 12, 4, 4]]), [1260, 0, 0]);
    }

    #[test]
    fn things_side_by_side_stay_two() {
        assert_eq!(areas(&[[10, 10, 20, 20], [30, 10, 20, 20]]), [400, 400]);
        assert_eq!(areas(&[[10, 10, 20, 20], [30, 12, 10, 10], [60, 10, 5, 5]]), [400, 100, 25]);
        // Two long ones.
        assert_eq!(areas(&[[10, 10, 40, 10], [10, 20, 40, 9]]), [400, 360]);
        assert!(areas(&[]).is_empty());
    }
}
