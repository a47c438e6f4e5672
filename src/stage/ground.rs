//! The plane that things stand on.

use crate::camera::StereoRig;
use crate::image::{Image, Size};
use crate::stage::coarse::CELL;

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
/// Frames without support after which the last plane is given up.
const PATIENCE: u32 = 10;
/// Share of the new plane in the running one, and the relative change of the
/// camera's height over which it is another plane.
const RENEWAL: f32 = 0.5;
const MAX_STEP: f32 = 0.25;
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
/// Camera heights in metres that a plane may have.
const HEIGHTS_M: std::ops::RangeInclusive<f32> = 0.05..=20.0;

/// A plane in disparity space: d = a v + b u + c, with u, v in full-size pixels
/// and d in pixels (`cx_l - cx_r` subtracted).
///
/// In space it is n · P = f B with n = (b fx, a fy, a cy + b cx + c), because
/// d = f B / Z and u = fx X / Z + cx, v = fy Y / Z + cy. The height of a point
/// above it is therefore `(f B / |n|) (d − d_plane) / d`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Change of disparity per row.
    pub a: f32,
    /// Change of disparity per column.
    pub b: f32,
    /// Disparity at the origin of the image.
    pub c: f32,
    /// Height of the camera above the plane, metres.
    pub camera_height_m: f32,
    /// Median distance of what was seen of the plane along the optical axis, metres.
    pub distance_m: f32,
}

impl Plane {
    /// The plane with these coefficients; `None` when it is no plane in space, or
    /// nearer or farther than anything stands on.
    pub fn new(a: f32, b: f32, c: f32, rig: &StereoRig) -> Option<Self> {
        let n = normal(a, b, c, rig);
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        let camera_height_m = rig.depth_scale() as f32 / length;
        HEIGHTS_M.contains(&camera_height_m).then_some(Self {
            a,
            b,
            c,
            camera_height_m,
            distance_m: 10.0,
        })
    }

    /// Cosine between the plane's normal and the image's vertical: 1 for a floor
    /// under a level camera.
    pub fn upright(&self, rig: &StereoRig) -> f32 {
        normal(self.a, self.b, self.c, rig)[1] * self.camera_height_m / rig.depth_scale() as f32
    }

    /// Cosine between the plane's normal and the optical axis: 1 for what is seen
    /// straight from above.
    pub fn facing(&self, rig: &StereoRig) -> f32 {
        normal(self.a, self.b, self.c, rig)[2] * self.camera_height_m / rig.depth_scale() as f32
    }

    /// A plane between this one and `new`.
    #[must_use]
    pub fn mixed(&self, new: &Self, share: f32, rig: &StereoRig) -> Self {
        let blend = |o: f32, n: f32| o + share * (n - o);
        let mixed =
            Self::new(blend(self.a, new.a), blend(self.b, new.b), blend(self.c, new.c), rig);
        let distance_m = blend(self.distance_m, new.distance_m);
        // Two planes before the camera have one between them, but rounding may say otherwise.
        mixed.map_or(*new, |plane| Self { distance_m, ..plane })
    }

    /// Disparity of the plane at pixel (u, v).
    #[inline]
    pub fn disparity(&self, u: f32, v: f32) -> f32 {
        self.a * v + self.b * u + self.c
    }

    /// Height in metres above the plane of a point at pixel (u, v) with disparity `d` > 0.
    #[inline]
    pub fn height(&self, u: f32, v: f32, d: f32) -> f32 {
        self.camera_height_m * (d - self.disparity(u, v)) / d
    }

    /// Size of the scene against a road's, 0.03..=1: every length that has to
    /// do with the things on the plane is given for a plane seen at 10 m and
    /// multiplied by this.
    pub fn scale(&self) -> f32 {
        (self.distance_m / 10.0).clamp(0.03, 1.0)
    }
}

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

/// A measured cell: pixel and disparity.
#[derive(Clone, Copy, Debug)]
struct Vote {
    u: f32,
    v: f32,
    d: f32,
    strip: usize,
}

/// The estimator of the ground plane, with its memory of the last one.
#[derive(Debug, Default)]
pub struct Ground {
    plane: Option<Plane>,
    state: GroundState,
    failures: u32,
    votes: Vec<Vote>,
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
        self.plane = None;
        self.state = GroundState::None;
        self.failures = 0;
    }

    /// The plane in use.
    pub fn plane(&self) -> Option<&Plane> {
        self.plane.as_ref()
    }

    /// Where it comes from.
    pub fn state(&self) -> GroundState {
        self.state
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
        let threshold = if self.plane.is_some() { KEEP } else { ACQUIRE };
        let accepted = found.filter(|(_, support)| *support >= threshold).map(|(plane, _)| plane);
        match (accepted, &mut self.plane) {
            (Some(new), Some(old)) => {
                // A camera that nods moves the plane; an EMA takes the noise
                // out, but a plane that is elsewhere is taken as it is.
                let step = (new.camera_height_m / old.camera_height_m - 1.0).abs();
                let share = if step < MAX_STEP { RENEWAL } else { 1.0 };
                *old = old.mixed(&new, share, rig);
                (self.state, self.failures) = (GroundState::Measured, 0);
            }
            (Some(new), none) => {
                *none = Some(new);
                (self.state, self.failures) = (GroundState::Measured, 0);
            }
            (None, Some(_)) if self.failures < PATIENCE => {
                self.failures += 1;
                self.state = GroundState::Held;
            }
            (None, _) => self.reset(),
        }
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
                self.votes.push(Vote { u, v, d, strip: x * STRIPS / width });
            }
            i += step;
        }
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
        consider(self.plane);
        // A fixed sequence (Knuth's MMIX generator): same input, same plane.
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let lower = ((n as f32 * LOWER_PART) as usize).max(1);
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            self.votes[n - 1 - ((state >> 33) as usize) % lower]
        };
        let trials = if self.plane.is_some() { TRIALS_NEAR } else { TRIALS };
        for trial in 0..trials {
            let (p, q) = (random(), random());
            // Two cells give a level plane, which is nearly always right and
            // needs fewer lucky draws; three give one with roll.
            consider(if trial % 2 == 0 { level(p, q, rig) } else { through(p, q, random(), rig) });
        }
        best.1
    }

    /// Votes on the plane less those below it, of every few, summed over the
    /// strips where that is positive.
    fn score(&self, plane: &Plane) -> f32 {
        let mut scores = [0.0_f32; STRIPS];
        for vote in self.votes.iter().step_by(SKIP) {
            let at = plane.disparity(vote.u, vote.v);
            let difference = vote.d - at;
            let tolerance = tolerance(at);
            // Far away everything is near the plane: such votes count less.
            let weight = (at / 8.0).clamp(0.0, 1.0);
            if difference.abs() < tolerance {
                scores[vote.strip] += weight * (1.0 - (difference / tolerance).powi(2));
            } else if difference < 0.0 && at > 1.0 {
                scores[vote.strip] -= 0.7 * weight;
            }
        }
        scores.iter().map(|score| score.max(0.0)).sum()
    }

    /// Least squares over the votes near the plane, reweighted (Tukey), and its
    /// support: the share of the lowest votes of all strips that lie on it.
    fn refine(&mut self, start: Plane, rig: &StereoRig) -> Option<(Plane, f32)> {
        let mut plane = start;
        for _ in 0..STEPS {
            let mut normal = nalgebra::Matrix3::<f64>::zeros();
            let mut right = nalgebra::Vector3::<f64>::zeros();
            for vote in &self.votes {
                let at = plane.disparity(vote.u, vote.v);
                let ratio = (vote.d - at) / tolerance(at);
                if ratio.abs() < 1.0 && at > 0.5 {
                    // The tolerance grows with disparity: so does the noise.
                    let weight = f64::from((1.0 - ratio * ratio).powi(2) / tolerance(at));
                    let row = nalgebra::Vector3::new(f64::from(vote.v), f64::from(vote.u), 1.0);
                    normal += weight * row * row.transpose();
                    right += weight * f64::from(vote.d) * row;
                }
            }
            let solution = normal.try_inverse()? * right;
            plane = plane_of(solution.x as f32, solution.y as f32, solution.z as f32, rig)?;
        }
        let (mut feet, mut on, mut all) = ([0_usize; STRIPS], 0.0_f32, 0.0_f32);
        self.seen.clear();
        // From the bottom of the image upward.
        for vote in self.votes.iter().rev() {
            let at = plane.disparity(vote.u, vote.v);
            let agrees = at > LEAST_DISPARITY && (vote.d - at).abs() < tolerance(at);
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

/// |n| is f B over the distance of the camera.
fn normal(a: f32, b: f32, c: f32, rig: &StereoRig) -> [f32; 3] {
    let (cx, cy) = rig.principal_point();
    [b * rig.focal_px() as f32, a * rig.focal_y_px() as f32, a * cy as f32 + b * cx as f32 + c]
}

/// The plane with these coefficients if it may be a ground.
fn plane_of(a: f32, b: f32, c: f32, rig: &StereoRig) -> Option<Plane> {
    let n = normal(a, b, c, rig);
    let plane = Plane::new(a, b, c, rig)?;
    (plane.upright(rig) > MIN_UPRIGHT && n[0].abs() < MAX_ROLL * n[1]).then_some(plane)
}

/// The plane without roll through two votes.
fn level(p: Vote, q: Vote, rig: &StereoRig) -> Option<Plane> {
    let dv = q.v - p.v;
    if dv.abs() < 12.0 {
        return None;
    }
    let a = (q.d - p.d) / dv;
    plane_of(a, 0.0, p.d - a * p.v, rig)
}

fn through(p: Vote, q: Vote, r: Vote, rig: &StereoRig) -> Option<Plane> {
    let (du1, dv1, dd1) = (q.u - p.u, q.v - p.v, q.d - p.d);
    let (du2, dv2, dd2) = (r.u - p.u, r.v - p.v, r.d - p.d);
    let area = dv1 * du2 - dv2 * du1;
    if area.abs() < 400.0 {
        return None;
    }
    let a = (dd1 * du2 - dd2 * du1) / area;
    let b = (dv1 * dd2 - dv2 * dd1) / area;
    plane_of(a, b, p.d - a * p.v - b * p.u, rig)
}

/// Centre of a cell in full-size pixels.
#[inline]
pub fn cell_centre(x: usize, y: usize) -> (f32, f32) {
    let half = (CELL as f32 - 1.0) / 2.0;
    ((x * CELL) as f32 + half, (y * CELL) as f32 + half)
}

/// Size of the map of cells of an image of `size`.
pub fn cells(size: Size) -> Size {
    size.divided_by(CELL)
}
