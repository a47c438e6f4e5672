//! A plane that is looked down upon: a table top, a floor under a drone, a wall.

use crate::camera::StereoRig;
use crate::image::Image;
use crate::stage::ground::plane::{Draws, Fit, Measured, through};
use crate::stage::ground::running::RunningPlane;
use crate::stage::ground::{GroundState, Plane, cell_centre};

/// Spread of the coarse disparity about a plane in pixels (one standard
/// deviation): a fifth of a cell. It does not grow with the disparity.
pub const NOISE_PX: f32 = 0.8;
/// Relief from which something stands off the plane: two standard deviations.
pub const RELIEF_PX: f32 = 2.0 * NOISE_PX;
/// Largest distance of a cell from the plane it belongs to, in pixels, and of
/// two cells of one surface.
const TOLERANCE_PX: f32 = 1.5;
/// A cell is firm when so many of the 24 around it lie on one surface with it:
/// chance matches on bare surfaces do not.
const REACH: usize = 2;
const FIRM: usize = 12;
/// Cells that are asked, and the share of them that must be firm.
const ASKED: usize = 6400;
const LEAST_FIRM: f32 = 0.04;
/// Share of the firm cells on the plane, less half of the share below it, to
/// begin with: photographed tables have .48 to .64, rooms, streets, leaves and
/// cloths .39 and less.
const ACQUIRE: f32 = 0.43;
/// The same to go on with the last plane.
const KEEP: f32 = 0.25;
const BELOW: f32 = 0.5;
/// Planes tried in a frame without a known one.
const TRIALS: usize = 300;
/// Most cells that vote on them.
const VOTERS: usize = 400;
/// Reweighted least-squares steps.
const STEPS: usize = 4;
/// Least cosine between the plane's normal and the optical axis: what is seen
/// flatter than from 60 degrees is a ground or a wall that one goes along.
const LEAST_FACING: f32 = 0.5;
/// Least cosine between the normal and the image's vertical: what hangs over the
/// camera carries nothing, but a camera that looks down may be tilted a little.
const LEAST_UPRIGHT: f32 = -0.25;
/// Median disparity of the plane in pixels from which a thing a tenth as high as
/// the plane is distant has a relief.
const LEAST_DISPARITY: f32 = 10.0 * RELIEF_PX;
/// Least extent of what is seen of it, in parts of the image's width and height.
const LEAST_EXTENT: f32 = 0.3;

/// The estimator of a plane seen from above, with its memory of the last one.
#[derive(Debug, Default)]
pub struct Table {
    running: RunningPlane,
    /// The firm cells.
    votes: Vec<Measured>,
    seen: Vec<f32>,
}

impl Table {
    /// Forgets the last plane.
    pub fn reset(&mut self) {
        self.running.reset();
    }

    /// The plane in use.
    pub const fn plane(&self) -> Option<&Plane> {
        self.running.get()
    }

    /// Where it comes from.
    pub const fn state(&self) -> GroundState {
        match self.plane() {
            None => GroundState::None,
            Some(_) if self.running.is_held() => GroundState::TableHeld,
            Some(_) => GroundState::Table,
        }
    }

    /// Looks for the plane in the checked disparity of each cell (full-size
    /// pixels, `x_l - x_r`; NaN where there is none).
    ///
    /// Consensus of triples of firm cells (Fischler and Bolles 1981; the draws are a
    /// fixed sequence), then iteratively reweighted least squares. What lies below a
    /// candidate counts against it. While the last plane has support none is searched.
    pub fn run(&mut self, checked: &Image<f32>, rig: &StereoRig) {
        let asked = self.collect(checked, rig);
        let last = self.plane().copied().filter(|_| asked);
        let known = last.and_then(|last| self.refine(last, checked, rig));
        let shown = known.filter(|(_, support)| *support >= KEEP).or_else(|| {
            let found = if asked { self.search(rig) } else { None };
            let found = found.and_then(|plane| self.refine(plane, checked, rig));
            found.filter(|(_, support)| *support >= ACQUIRE)
        });
        self.running.update(shown.map(|(plane, _)| plane), rig);
    }

    /// Gathers firm cells; false with too few.
    fn collect(&mut self, checked: &Image<f32>, rig: &StereoRig) -> bool {
        self.votes.clear();
        let offset = rig.disparity_offset() as f32;
        let (width, height) = (checked.width(), checked.height());
        // Odd, so that no column is preferred.
        let step = (checked.size().area() / ASKED).max(1) | 1;
        let mut asked = 0;
        for i in (0..checked.size().area()).step_by(step) {
            let (x, y) = (i % width, i / width);
            if x < REACH || y < REACH || x + REACH >= width || y + REACH >= height {
                continue;
            }
            asked += 1;
            let d = checked.get(x, y);
            // False for NaN.
            if d - offset > 1.0 && neighbours_on_it(checked, x, y, d) >= FIRM {
                let (u, v) = cell_centre(x, y);
                self.votes.push(Measured { u, v, d: d - offset });
            }
        }
        self.votes.len() as f32 > LEAST_FIRM * asked as f32 && self.votes.len() >= 30
    }

    /// The best of planes through triples of votes.
    fn search(&self, rig: &StereoRig) -> Option<Plane> {
        let skip = self.votes.len().div_ceil(VOTERS);
        let mut best = (0.0_f32, None);
        let mut consider = |plane: Option<Plane>| {
            if let Some(plane) = plane.filter(|plane| lies_below(plane, rig)) {
                let score: f32 =
                    self.votes.iter().step_by(skip).map(|vote| value(&plane, *vote)).sum();
                if score > best.0 {
                    best = (score, Some(plane));
                }
            }
        };
        let mut draws = Draws::new();
        let mut random = || self.votes[draws.below(self.votes.len())];
        for _ in 0..TRIALS {
            let coefficients = through([random(), random(), random()]);
            consider(coefficients.and_then(|[a, b, c]| Plane::new(a, b, c, rig)));
        }
        best.1
    }

    /// Least squares over the votes near the plane, reweighted (Tukey), and its support.
    fn refine(
        &mut self,
        start: Plane,
        checked: &Image<f32>,
        rig: &StereoRig,
    ) -> Option<(Plane, f32)> {
        let mut plane = start;
        for _ in 0..STEPS {
            let mut fit = Fit::default();
            for vote in &self.votes {
                let ratio = (vote.d - plane.disparity(vote.u, vote.v)) / TOLERANCE_PX;
                if ratio.abs() < 1.0 {
                    fit.add(*vote, (1.0 - ratio * ratio).powi(2));
                }
            }
            let [a, b, c] = fit.solve()?;
            plane = Plane::new(a, b, c, rig)?;
        }
        let (mut below, mut sums) = (0_usize, [0.0_f64; 4]);
        self.seen.clear();
        for vote in &self.votes {
            let at = plane.disparity(vote.u, vote.v);
            let relief = vote.d - at;
            if relief.abs() < TOLERANCE_PX {
                self.seen.push(at);
                let (u, v) = (f64::from(vote.u), f64::from(vote.v));
                sums = [sums[0] + u, sums[1] + v, sums[2] + u * u, sums[3] + v * v];
            }
            below += usize::from(relief <= -TOLERANCE_PX);
        }
        if self.seen.is_empty() {
            return None;
        }
        let (n, all) = (self.seen.len() as f64, self.votes.len() as f32);
        let half = self.seen.len() / 2;
        let middle = *self.seen.select_nth_unstable_by(half, f32::total_cmp).1;
        plane.distance_m = rig.depth_scale() as f32 / middle;
        // Of a uniform spread the length is the standard deviation times √12.
        let extent = |sum: f64, squares: f64, cells: usize| {
            let variance = (squares / n - (sum / n).powi(2)).max(0.0);
            (12.0 * variance).sqrt() as f32 / (cells * crate::stage::coarse::CELL) as f32
        };
        let wide = extent(sums[0], sums[2], checked.width()) >= LEAST_EXTENT
            && extent(sums[1], sums[3], checked.height()) >= LEAST_EXTENT;
        let plausible = wide && middle >= LEAST_DISPARITY && lies_below(&plane, rig);
        plausible.then_some((plane, (n as f32 - BELOW * below as f32) / all))
    }
}

/// Whether the camera looks down upon the plane.
fn lies_below(plane: &Plane, rig: &StereoRig) -> bool {
    plane.facing(rig) >= LEAST_FACING && plane.upright(rig) >= LEAST_UPRIGHT
}

/// How many of the cells around (x, y) lie on one surface with it.
fn neighbours_on_it(checked: &Image<f32>, x: usize, y: usize, d: f32) -> usize {
    let rows = y - REACH..=y + REACH;
    let near = |row: &[f32]| row.iter().filter(|e| (*e - d).abs() <= TOLERANCE_PX).count();
    rows.map(|y| near(&checked.row(y)[x - REACH..=x + REACH])).sum::<usize>() - 1
}

/// What a vote says for a plane.
#[inline]
fn value(plane: &Plane, vote: Measured) -> f32 {
    let ratio = (vote.d - plane.disparity(vote.u, vote.v)) / TOLERANCE_PX;
    if ratio <= -1.0 { -BELOW } else { (1.0 - ratio * ratio).max(0.0) }
}
