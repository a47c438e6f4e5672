//! Things that are rather two: cars parked nose to tail.
//!
//! They hide each other's gaps, and the side of one leads to the rear of the
//! next. Together they are deeper than a car is long, but no higher than one; what
//! is one and as deep is higher, as a bus is, or recedes evenly, as a fence does.

use super::column::Segment;
use super::join::View;
use super::thing::Thing;

/// Depth from which a thing may be two, metres (of a road scene): the length of
/// a car; and what the noise of far disparities adds, in parts of the distance.
const CAR_M: f64 = 4.8;
const NOISE_PART: f64 = 0.12;
/// Height up to which it may, metres (of a road scene): a van's. Rear and side of a
/// bus leave the same residuals as those of two cars.
const VAN_M: f32 = 2.2;
/// Share of a thing's cells in each of two, at least.
const LEAST_SHARE: f64 = 0.12;
/// Squared residuals of two depths in parts of those of a line, at most.
const MOST_RESIDUAL: f64 = 0.8;

/// Finds where such things part, with its buffers.
#[derive(Debug, Default)]
pub struct Split {
    whole: Vec<Sums>,
    left: Vec<Sums>,
    best: Vec<Best>,
    cuts: Vec<Option<u32>>,
}

/// Sums over the segments of a thing, each weighted by its cells.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// Number of cells.
    n: f64,
    /// Of columns x, of y = ln d, of x², y² and x y.
    x: f64,
    y: f64,
    xx: f64,
    yy: f64,
    xy: f64,
}

/// The best place to part a thing.
#[derive(Clone, Copy, Debug)]
struct Best {
    /// Squared residuals of two depths.
    residual: f64,
    /// First column of the right part.
    column: u32,
    /// Column of the segment looked at before.
    last: u32,
}

impl Sums {
    fn add(&mut self, s: &Segment) {
        let (n, x, y) = (f64::from(s.cells), f64::from(s.x), f64::from(s.disparity().ln()));
        self.n += n;
        self.x += n * x;
        self.y += n * y;
        self.xx += n * x * x;
        self.yy += n * y * y;
        self.xy += n * x * y;
    }

    /// Squared residuals of y against its mean.
    fn residual(&self) -> f64 {
        self.yy - self.y * self.y / self.n
    }

    /// The same against the best straight line over the columns.
    fn residual_of_line(&self) -> f64 {
        let spread = self.xx - self.x * self.x / self.n;
        let slope = self.xy - self.x * self.y / self.n;
        self.residual() - slope * slope / spread.max(f64::MIN_POSITIVE)
    }

    /// The residuals of what is left without a part.
    fn residual_without(&self, part: &Self) -> f64 {
        let (n, y, yy) = (self.n - part.n, self.y - part.y, self.yy - part.yy);
        yy - y * y / n
    }
}

impl Split {
    /// For each of the things in `list` the column of cells from which on it is another one:
    /// where one depth to the left and one to the right leave smaller squared
    /// residuals of ln d than any other two, and clearly smaller ones than a straight
    /// line over all columns (an upright plane is nearly one). Each part keeps
    /// 12 % of the cells, and `least_cells`. Asked are things deeper than a car
    /// is long, √12 standard deviations being the depth of what recedes evenly, and no
    /// higher than a van.
    ///
    /// `things` are the numbers of the segments' things, from 1; 0 is none.
    pub fn run(
        &mut self,
        segments: &[Segment],
        things: &[u32],
        list: &[Thing],
        view: &View,
        least_cells: u32,
    ) -> &[Option<u32>] {
        let of_things = || {
            segments.iter().zip(things).filter(|(_, t)| **t != 0).map(|(s, t)| (s, *t as usize - 1))
        };
        for sums in [&mut self.whole, &mut self.left] {
            sums.clear();
            sums.resize(list.len(), Sums::default());
        }
        self.best.clear();
        self.best.resize(list.len(), Best { residual: f64::INFINITY, column: 0, last: u32::MAX });
        for (s, thing) in of_things() {
            self.whole[thing].add(s);
        }
        // From left to right, as segments come.
        for (s, thing) in of_things() {
            let (whole, left, best) =
                (&self.whole[thing], &mut self.left[thing], &mut self.best[thing]);
            let least = (LEAST_SHARE * whole.n).max(f64::from(least_cells));
            if s.x != best.last && left.n >= least && whole.n - left.n >= least {
                let residual = left.residual() + whole.residual_without(left);
                if residual < best.residual {
                    *best = Best { residual, column: s.x, ..*best };
                }
            }
            best.last = s.x;
            left.add(s);
        }
        let (depth_scale, scale) = (f64::from(view.depth_scale), f64::from(view.scale));
        self.cuts.clear();
        let sums = self.whole.iter().zip(&self.best);
        self.cuts.extend(list.iter().zip(sums).map(|(thing, (whole, best))| {
            let distance = depth_scale / (whole.y / whole.n).exp();
            let depth = (12.0 * whole.residual() / whole.n).sqrt() * distance;
            let deep = depth > CAR_M * scale + NOISE_PART * distance;
            let low = thing.top_m <= VAN_M * view.scale;
            let two = best.residual < MOST_RESIDUAL * whole.residual_of_line();
            (deep && low && two).then_some(best.column)
        }));
        &self.cuts
    }
}
