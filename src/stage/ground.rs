//! The plane that things stand on.

pub(super) mod height;
pub(super) mod plane;
pub(super) mod running;

use crate::camera::StereoRig;
use crate::image::{Image, Size};
use crate::stage::coarse::CELL;

pub use plane::Plane;
use plane::{Draws, Fit, Measured, normal, through};
use running::RunningPlane;

/// Strips into which the view is cut from left to right.
const STRIPS: usize = 16;
/// Cells at the lower end of each strip: where there is a ground they show it,
/// unless a thing stands on the image's edge.
const FOOT: usize = 6;
/// Share of those that must lie on a plane to begin with: a street between
/// parked cars shows a half, a narrow corridor a third, cloths and walls below a quarter.
const ACQUIRE: f32 = 0.28;
/// The same to go on with the last plane.
const KEEP: f32 = 0.15;
/// Least change of disparity over what is seen of a plane, in tolerances: a
/// smaller one is no tilt but noise. A floor seen from 70 degrees above with an
/// opening angle of 40 has 4.4.
const LEAST_SPAN: f32 = 4.0;
/// Part of the cells, from the bottom of the image, among which the first
/// guesses are drawn.
const LOWER_PART: f32 = 0.6;
/// One in so many cells votes on the first guesses.
const SKIP: usize = 4;
/// Planes tried per frame when there is none yet, and when there is one.
const TRIALS: usize = 240;
const TRIALS_NEAR: usize = 48;
/// Most cells that vote.
const MAX_VOTERS: usize = 1600;
/// Fewest cells on a plane, and the disparity of the plane in pixels from which
/// they count: above the horizon there is none.
const LEAST_SEEN: usize = 20;
const LEAST_DISPARITY: f32 = 2.0;
/// Reweighted least-squares steps.
const STEPS: usize = 5;
/// Least cosine between the plane's normal and the image's vertical: a floor
/// seen from 70 degrees above still counts, a wall ahead does not.
const MIN_UPRIGHT: f32 = 0.3;
/// Largest sine of the camera's roll.
const MAX_ROLL: f32 = 0.35;

/// Whether there is a plane to reckon with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum GroundState {
    /// No plane: nothing can be said about heights.
    #[default]
    None = 0,
    /// A plane was measured in this frame.
    Measured = 1,
    /// The last plane is used; this frame did not support one.
    Held = 2,
    /// A plane that is looked down upon was measured in this frame.
    Table = 3,
    /// The last such plane is used.
    TableHeld = 4,
}

impl GroundState {
    /// Name in reports and diagnostics.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "no plane",
            Self::Measured => "plane",
            Self::Held => "plane held",
            Self::Table => "plane from above",
            Self::TableHeld => "plane from above held",
        }
    }
}

/// What the attention of a frame reckons with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footing {
    /// Whether there is a plane, and which.
    pub state: GroundState,
    /// It.
    pub plane: Option<Plane>,
}

impl Footing {
    /// The ground, if that is it.
    pub fn ground(&self) -> Option<&Plane> {
        let ground = matches!(self.state, GroundState::Measured | GroundState::Held);
        self.plane.as_ref().filter(|_| ground)
    }

    /// The plane that is looked down upon, if that is it.
    pub fn table(&self) -> Option<&Plane> {
        let table = matches!(self.state, GroundState::Table | GroundState::TableHeld);
        self.plane.as_ref().filter(|_| table)
    }
}

/// A measured cell, and the strip of the view that it lies in.
#[derive(Clone, Copy, Debug)]
struct Vote {
    cell: Measured,
    strip: usize,
}

/// Every few of the votes, field by field, so that a plane is held against
/// several at once.
#[derive(Debug, Default)]
struct Sample {
    u: Vec<f32>,
    v: Vec<f32>,
    d: Vec<f32>,
    strip: Vec<usize>,
}

impl Sample {
    fn take(&mut self, votes: &[Vote]) {
        self.strip.clear();
        for field in [&mut self.u, &mut self.v, &mut self.d] {
            field.clear();
        }
        for Vote { cell, strip } in votes.iter().step_by(SKIP) {
            self.u.push(cell.u);
            self.v.push(cell.v);
            self.d.push(cell.d);
            self.strip.push(*strip);
        }
    }
}

/// The estimator of the ground plane, with its memory of the last one.
#[derive(Debug, Default)]
pub struct Ground {
    running: RunningPlane,
    votes: Vec<Vote>,
    sample: Sample,
    /// Disparities of the plane where cells lie on it.
    seen: Vec<f32>,
}

/// Largest distance of a cell from the plane it belongs to, in pixels.
#[inline]
fn tolerance(disparity: f32) -> f32 {
    (0.06 * disparity).max(0.5)
}

impl Ground {
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
            Some(_) if self.running.is_held() => GroundState::Held,
            Some(_) => GroundState::Measured,
        }
    }

    /// Looks for the plane in the checked disparity of each cell (full-size
    /// pixels, `x_l - x_r`; NaN where there is none).
    ///
    /// Consensus of pairs and triples of cells (Fischler and Bolles 1981; the draws
    /// are a fixed sequence), nearest to the last plane first, then iteratively
    /// reweighted least squares. What lies below a candidate counts against
    /// it, since nothing is under the ground, but only in its own strip of the
    /// view: beside a road the land may fall away.
    pub fn run(&mut self, checked: &Image<f32>, rig: &StereoRig) {
        self.collect(checked, rig);
        let found = self.search(rig).and_then(|plane| self.refine(plane, rig));
        let threshold = if self.plane().is_some() { KEEP } else { ACQUIRE };
        let shown = found.filter(|(_, support)| *support >= threshold);
        self.running.update(shown.map(|(plane, _)| plane), rig);
    }

    fn collect(&mut self, checked: &Image<f32>, rig: &StereoRig) {
        self.votes.clear();
        let offset = rig.disparity_offset() as f32;
        let step = (checked.size().area() / MAX_VOTERS).max(1) | 1;
        let width = checked.width();
        let mut i = 0;
        while i < checked.pixels().len() {
            let d = checked.pixels()[i] - offset;
            if d > 0.75 {
                let (x, y) = (i % width, i / width);
                let (u, v) = cell_centre(x, y);
                self.votes.push(Vote { cell: Measured { u, v, d }, strip: x * STRIPS / width });
            }
            i += step;
        }
        self.sample.take(&self.votes);
    }

    /// The best of the last plane and of planes through triples of votes.
    fn search(&self, rig: &StereoRig) -> Option<Plane> {
        let n = self.votes.len();
        if n < 30 {
            return None;
        }
        let mut best = (0.0_f32, None);
        let mut consider = |plane: Option<Plane>| {
            if let Some(plane) = plane {
                let score = self.score(&plane);
                if score > best.0 {
                    best = (score, Some(plane));
                }
            }
        };
        consider(self.plane().copied());
        let mut draws = Draws::new();
        let lower = ((n as f32 * LOWER_PART) as usize).max(1);
        let mut random = || self.votes[n - 1 - draws.below(lower)].cell;
        let trials = if self.plane().is_some() { TRIALS_NEAR } else { TRIALS };
        for trial in 0..trials {
            let (p, q) = (random(), random());
            // Two cells give a level plane, which is nearly always right and
            // needs fewer lucky draws; three give one with roll.
            consider(if trial % 2 == 0 {
                level(p, q, rig)
            } else {
                through([p, q, random()]).and_then(|plane| plane_of(plane, rig))
            });
        }
        best.1
    }

    /// Votes on the plane less those below it, of every few, summed over the
    /// strips where that is positive.
    fn score(&self, plane: &Plane) -> f32 {
        let mut scores = [0.0_f32; STRIPS];
        let Sample { u, v, d, strip } = &self.sample;
        let mut votes = [0.0_f32; 64];
        let fields = u.chunks(votes.len()).zip(v.chunks(votes.len())).zip(d.chunks(votes.len()));
        for (((u, v), d), strip) in fields.zip(strip.chunks(votes.len())) {
            for ((vote, d), (u, v)) in votes.iter_mut().zip(d).zip(u.iter().zip(v)) {
                let at = plane.disparity(*u, *v);
                let difference = d - at;
                let tolerance = tolerance(at);
                // Far away everything is near the plane: such votes count less.
                let weight = (at / 8.0).clamp(0.0, 1.0);
                let on = weight * (1.0 - (difference / tolerance).powi(2));
                let below = if difference < 0.0 && at > 1.0 { -0.7 * weight } else { 0.0 };
                *vote = if difference.abs() < tolerance { on } else { below };
            }
            for (strip, vote) in strip.iter().zip(votes) {
                scores[*strip] += vote;
            }
        }
        scores.iter().map(|score| score.max(0.0)).sum()
    }

    /// Least squares over the votes near the plane, reweighted (Tukey), and its
    /// support: the share of the lowest votes of all strips that lie on it.
    fn refine(&mut self, start: Plane, rig: &StereoRig) -> Option<(Plane, f32)> {
        let mut plane = start;
        for _ in 0..STEPS {
            let mut fit = Fit::default();
            for Vote { cell, .. } in &self.votes {
                let at = plane.disparity(cell.u, cell.v);
                let ratio = (cell.d - at) / tolerance(at);
                if ratio.abs() < 1.0 && at > 0.5 {
                    // The tolerance grows with disparity: so does the noise.
                    fit.add(*cell, (1.0 - ratio * ratio).powi(2) / tolerance(at));
                }
            }
            plane = plane_of(fit.solve()?, rig)?;
        }
        let (mut feet, mut on, mut all) = ([0_usize; STRIPS], 0.0_f32, 0.0_f32);
        self.seen.clear();
        // From the bottom of the image upward.
        for vote in self.votes.iter().rev() {
            let at = plane.disparity(vote.cell.u, vote.cell.v);
            let agrees = at > LEAST_DISPARITY && (vote.cell.d - at).abs() < tolerance(at);
            if agrees {
                self.seen.push(at);
            }
            let foot = &mut feet[vote.strip];
            if *foot < FOOT {
                *foot += 1;
                all += 1.0;
                on += f32::from(u8::from(agrees));
            }
        }
        if self.seen.len() < LEAST_SEEN {
            return None;
        }
        let twentieth = self.seen.len() / 20;
        let n = self.seen.len();
        let mut ranked = |i: usize| *self.seen.select_nth_unstable_by(i, f32::total_cmp).1;
        let (far, middle, near) = (ranked(twentieth), ranked(n / 2), ranked(n - 1 - twentieth));
        plane.distance_m = rig.depth_scale() as f32 / middle;
        (near - far >= LEAST_SPAN * tolerance(middle)).then_some((plane, on / all))
    }
}

/// The plane with these coefficients if it may be a ground.
fn plane_of([a, b, c]: [f32; 3], rig: &StereoRig) -> Option<Plane> {
    let n = normal(a, b, c, rig);
    let plane = Plane::new(a, b, c, rig)?;
    (plane.upright(rig) > MIN_UPRIGHT && n[0].abs() < MAX_ROLL * n[1]).then_some(plane)
}

/// The plane without roll through two votes.
fn level(p: Measured, q: Measured, rig: &StereoRig) -> Option<Plane> {
    let dv = q.v - p.v;
    if dv.abs() < 12.0 {
        return None;
    }
    let a = (q.d - p.d) / dv;
    plane_of([a, 0.0, p.d - a * p.v], rig)
}

/// Centre of a cell in full-size pixels.
#[inline]
pub fn cell_centre(x: usize, y: usize) -> (f32, f32) {
    let half = (CELL as f32 - 1.0) / 2.0;
    // Below AVX-512 there are no vectors of 64 bits that become floats.
    ((x * CELL) as i32 as f32 + half, (y * CELL) as i32 as f32 + half)
}

/// Size of the map of cells of an image of `size`.
pub fn cells(size: Size) -> Size {
    size.divided_by(CELL)
}
