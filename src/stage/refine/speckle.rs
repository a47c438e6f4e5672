//! Removal of small patches of disparity.

use crate::image::Image;
use crate::stage::refine::Area;
use crate::stage::stereo::NO_MATCH;

/// Connected patches, run by run.
#[derive(Default)]
pub struct Speckles {
    runs: Vec<Stretch>,
    /// First run of each row.
    rows: Vec<usize>,
    parents: Vec<u32>,
    areas: Vec<u32>,
}

/// Pixels of one row whose disparities follow each other closely.
#[derive(Clone, Copy)]
struct Stretch {
    x0: u32,
    x1: u32,
}

impl Speckles {
    /// Inside `area`, sets to [`NO_MATCH`] every 4-connected patch of fewer than `least`
    /// pixels in which neighbours differ by at most `range` steps.
    pub fn remove(&mut self, image: &mut Image<i16>, area: &Area, least: usize, range: i32) {
        let (rows, columns) = (&area.rows, &area.columns);
        self.runs.clear();
        self.rows.clear();
        let close = |a: i16, b: i16| (i32::from(a) - i32::from(b)).abs() <= range;
        for y in rows.clone() {
            self.rows.push(self.runs.len());
            let row = &image.row(y)[..columns.end];
            let mut x = columns.start;
            while x < row.len() {
                if row[x] == NO_MATCH {
                    x += 1;
                    continue;
                }
                let start = x;
                x += 1;
                while x < row.len() && row[x] != NO_MATCH && close(row[x], row[x - 1]) {
                    x += 1;
                }
                self.runs.push(Stretch { x0: start as u32, x1: x as u32 });
            }
        }
        self.rows.push(self.runs.len());
        self.parents.clear();
        self.parents.extend(0..self.runs.len() as u32);
        self.areas.clear();
        self.areas.extend(self.runs.iter().map(|r| r.x1 - r.x0));
        for (i, y) in rows.clone().enumerate().skip(1) {
            let (above, here) = (image.row(y - 1), image.row(y));
            let mut upper = self.rows[i - 1];
            let upper_end = self.rows[i];
            for lower in self.rows[i]..self.rows[i + 1] {
                let run = self.runs[lower];
                while upper < upper_end && self.runs[upper].x1 <= run.x0 {
                    upper += 1;
                }
                let mut candidate = upper;
                while candidate < upper_end && self.runs[candidate].x0 < run.x1 {
                    let from = self.runs[candidate].x0.max(run.x0) as usize;
                    let to = self.runs[candidate].x1.min(run.x1) as usize;
                    let touching =
                        above[from..to].iter().zip(&here[from..to]).any(|(&a, &b)| close(a, b));
                    if touching {
                        self.join(candidate as u32, lower as u32);
                    }
                    candidate += 1;
                }
            }
        }
        for (i, y) in rows.clone().enumerate() {
            let row = image.row_mut(y);
            for index in self.rows[i]..self.rows[i + 1] {
                let root = self.root(index as u32);
                if (self.areas[root as usize] as usize) < least {
                    let run = self.runs[index];
                    row[run.x0 as usize..run.x1 as usize].fill(NO_MATCH);
                }
            }
        }
    }

    fn root(&mut self, mut index: u32) -> u32 {
        while self.parents[index as usize] != index {
            let parent = self.parents[index as usize];
            self.parents[index as usize] = self.parents[parent as usize];
            index = self.parents[index as usize];
        }
        index
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            // The smaller index stays root: the result does not depend on the order.
            let (root, child) = (a.min(b), a.max(b));
            self.parents[child as usize] = root;
            self.areas[root as usize] += self.areas[child as usize];
        }
    }
}
