//! What moves by itself: the flow that the camera's own motion does not explain.

use nalgebra::{SMatrix, SVector};

use crate::image::{Image, Size};
use crate::simd::{Level, Simd, dispatch, f32x16, i32x16, prelude::*};
use crate::stage::coarse::CELL;
use crate::stage::saliency::AttentionScene;
use crate::stage::saliency::flow::Flow;
use crate::stage::saliency::upsample::upsample;

/// Unknowns of the camera's motion.
const UNKNOWNS: usize = 6;
/// Fewest firm blocks that tell it, and the firmness from which one is.
const LEAST_BLOCKS: usize = 24;
const FIRM: f32 = 0.3;
/// Mean trust in the flow from which the two frames show one scene.
const LEAST_TRUST: f32 = 0.5;
/// Reweighted least-squares steps.
const STEPS: usize = 6;
/// Spread of the residuals that the first step assumes, and the least one, in
/// cells: matches are no better than that.
const FIRST_SPREAD: f32 = 4.0;
const LEAST_SPREAD: f32 = 0.25;
/// A length of Rayleigh's distribution in units of its median.
const RAYLEIGH: f32 = 1.25;
/// Weight of what the model does not explain, so that it can be found again.
const OUTLIER: f32 = 1e-4;
/// Keeps unknowns that nothing tells at 0, in parts of the normal matrix' trace.
const RIDGE: f64 = 1e-4;
/// Inverse distances are counted in these per metre, to be of the order of the others.
const PER_METRE: f32 = 10.0;

/// Share of the blocks that the movers of a view exceed: a car across the street
/// covers a twentieth of it.
const MOVERS: f32 = 0.05;
/// What is left after each frame of what they moved more than now: they stop for
/// a frame, and what rests would flare up. Of clips with masks .7 to .9 do alike.
const HELD: f32 = 0.8;

type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Unknowns = SVector<f64, UNKNOWNS>;

/// Blocks whose equations stand side by side.
const LANES: usize = 16;
type Lanes = [f32; LANES];

/// Equations of sixteen blocks: the shift that each has for each unknown at 1,
/// in cells. What is left over in the last ones has firmness 0.
#[derive(Clone, Copy, Debug, Default)]
struct Equations {
    rows: [[Lanes; UNKNOWNS]; 2],
    shift: [Lanes; 2],
    firmness: Lanes,
}

/// The camera's motion and what is left, with the buffers.
#[derive(Debug)]
pub struct EgoMotion {
    level: Level,
    equations: Vec<Equations>,
    residuals: Vec<Lanes>,
    /// Bits of what a rank is asked of.
    ranked: Vec<i32>,
    blocks: Image<f32>,
    /// `C_M` per cell, 0..=1.
    pub motion: Image<f32>,
    /// `C_M` that a twentieth of the blocks exceeds; it falls by a fifth per frame at most.
    pub most: f32,
}

impl EgoMotion {
    /// The cue with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            level,
            equations: Vec::new(),
            residuals: Vec::new(),
            ranked: Vec::new(),
            blocks: Image::default(),
            motion: Image::default(),
            most: 0.0,
        }
    }

    /// Forgets what moved before: another recording begins.
    pub fn reset(&mut self) {
        self.most = 0.0;
    }

    /// Fills [`EgoMotion::motion`] with
    /// `C_M` = 1 − exp(−(r / (3 max(s, ¼)))² / 2), r being the length of a
    /// block's shift less what the camera's motion makes of it, s its spread
    /// over the view, both in cells; less where texture does not hold the block.
    /// False, and nothing is known, when the flow tells no motion of a camera.
    ///
    /// The model is fitted by reweighted least squares (Tukey): with depth the
    /// motion field of a rigid scene (Longuet-Higgins and Prazdny 1980), linear
    /// in the camera's translation and rotation, else an affine flow.
    pub fn run(&mut self, flow: &Flow, scene: &AttentionScene<'_>, has_depth: bool) -> bool {
        let held = HELD * std::mem::take(&mut self.most);
        let trust = sum(flow.trust.pixels());
        if trust < LEAST_TRUST * flow.trust.size().area() as f32 {
            return false;
        }
        self.write_equations(flow, scene, has_depth);
        let firm = flow.blocks.pixels().iter().filter(|block| block.firmness > FIRM);
        if firm.count() < LEAST_BLOCKS {
            return false;
        }
        let mut spread = FIRST_SPREAD;
        let mut found = Unknowns::zeros();
        self.residuals_of(&found);
        for _ in 0..STEPS {
            let Some(next) = self.solve(spread) else { return false };
            found = next;
            spread = self.residuals_of(&found).max(LEAST_SPREAD);
        }
        self.write_motion(flow, scene.cells.gray.size(), &found, spread);
        self.ranked.clear();
        self.ranked.extend(self.blocks.pixels().iter().map(|motion| motion.to_bits() as i32));
        let rank = ((1.0 - MOVERS) * (self.ranked.len() - 1) as f32) as u32;
        self.ranked.resize(self.ranked.len().next_multiple_of(LANES), LAST);
        let ranked = self.ranked.as_chunks::<LANES>().0;
        let now = dispatch!(self.level, simd => ranked_at(simd, ranked, rank));
        self.most = now.max(held + (1.0 - HELD) * now);
        upsample(self.level, &self.blocks, scene.cells.gray.size(), &mut self.motion);
        true
    }

    /// x, y being the directions of a block's ray, ρ its inverse distance:
    /// u = f (−ρ tx + x ρ tz + x y wx − (1 + x²) wy + y wz),
    /// v = f (−ρ ty + y ρ tz + (1 + y²) wx − x y wy − x wz).
    fn write_equations(&mut self, flow: &Flow, scene: &AttentionScene<'_>, has_depth: bool) {
        let filled = &scene.coarse.filled;
        let cells = filled.size();
        let offset = scene.rig.disparity_offset() as f32;
        let per_pixel = PER_METRE / scene.rig.depth_scale() as f32;
        let (cx, cy) = scene.rig.principal_point();
        let lens = Lens {
            centre: [cx as f32, cy as f32],
            focal: [scene.rig.focal_px() as f32, scene.rig.focal_y_px() as f32],
        };
        let mut places = Places::new(flow.blocks.width());
        let groups = flow.blocks.pixels().chunks(LANES);
        self.equations.resize(groups.len(), Equations::default());
        dispatch!(self.level, simd => {
            for (e, blocks) in self.equations.iter_mut().zip(groups) {
                let [mut u, mut v, mut near] = [[0.0; LANES]; 3];
                e.firmness = [0.0; LANES];
                for (lane, block) in blocks.iter().enumerate() {
                    let (x, y) = places.next(cells);
                    (u[lane], v[lane]) = (x as f32, y as f32);
                    near[lane] = (filled.get(x, y) - offset).max(0.0) * per_pixel;
                    [e.shift[0][lane], e.shift[1][lane]] = block.shift;
                    e.firmness[lane] = block.firmness;
                }
                let near = has_depth.then_some(&near);
                lens.write(simd, [&u, &v], near, &mut e.rows);
            }
        });
    }

    /// Fills `blocks` with what each moved beside the camera's motion that was `found`.
    fn write_motion(&mut self, flow: &Flow, cells: Size, found: &Unknowns, spread: f32) {
        self.blocks.resize(flow.blocks.size());
        let mut places = Places::new(flow.blocks.width());
        let Self { level, equations, residuals, blocks: out, .. } = self;
        let groups = out.pixels_mut().chunks_mut(LANES).zip(flow.blocks.pixels().chunks(LANES));
        dispatch!(*level, _simd => {
            for ((out, blocks), (e, residuals)) in groups.zip(equations.iter().zip(residuals)) {
                let [u, v] = e.expected(found);
                for (lane, (out, block)) in out.iter_mut().zip(blocks).enumerate() {
                    let (x, y) = places.next(cells);
                    let (u, v) = (x as f64 + u[lane], y as f64 + v[lane]);
                    // What was out of view has no past that could have moved.
                    let was_seen = u >= 0.0
                        && u < cells.width as f64
                        && v >= 0.0
                        && v < cells.height as f64;
                    *out = 0.0;
                    if was_seen && block.firmness > 0.0 {
                        let off = residuals[lane] / (3.0 * spread);
                        *out = block.firmness * (1.0 - (-0.5 * off.powi(2)).exp());
                    }
                }
            }
        });
    }

    /// One step of least squares with weights from the residuals.
    fn solve(&self, spread: f32) -> Option<Unknowns> {
        let mut sums = Sums::default();
        let (equations, residuals) = (&self.equations, &self.residuals);
        dispatch!(self.level, _simd => {
            for (e, residuals) in equations.iter().zip(residuals) {
                sums.add(e, residuals, spread);
            }
        });
        let total = |lanes: &Lanes| lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
        let mut normal = Normal::from_fn(|i, j| total(&sums.normal[i.min(j)][i.max(j)]));
        let ridge = RIDGE * normal.trace();
        normal += Normal::identity() * ridge;
        let right = Unknowns::from_fn(|i, _| total(&sums.right[i]));
        normal.cholesky().map(|factor| factor.solve(&right))
    }

    /// Lengths of the residuals, and their spread over the firm blocks.
    fn residuals_of(&mut self, found: &Unknowns) -> f32 {
        let found = std::array::from_fn(|i| found[i] as f32);
        self.residuals.resize(self.equations.len(), [0.0; LANES]);
        self.ranked.resize(LANES * self.equations.len(), 0);
        let Self { level, equations, residuals, ranked, .. } = self;
        let ranked = ranked.as_chunks_mut::<LANES>().0;
        let middle = dispatch!(*level, simd => {
            let mut firm = 0;
            for ((e, out), ranked) in equations.iter().zip(residuals).zip(&mut *ranked) {
                let residuals = e.residuals(simd, &found);
                residuals.store_slice(out);
                let is_firm = f32x16::load_array_ref(simd, &e.firmness).simd_gt(FIRM);
                // The others come behind all.
                let last = i32x16::splat(simd, LAST);
                is_firm.select(residuals.bitcast(), last).store_slice(ranked);
                firm += is_firm.to_bitmask().count_ones();
            }
            ranked_at(simd, ranked, firm / 2)
        });
        RAYLEIGH * middle
    }
}

/// The value of this rank, from 0, of values that are not negative, given by
/// their bits: those have the same order. Bit by bit it is asked how many are
/// smaller, which takes less time than to sort them.
#[inline(always)]
fn ranked_at<S: Simd>(simd: S, values: &[[i32; LANES]], rank: u32) -> f32 {
    let (none, one) = (i32x16::splat(simd, 0), i32x16::splat(simd, 1));
    let mut value = 0;
    for bit in (0..31).rev() {
        let above = value | 1 << bit;
        let mut smaller = none;
        for values in values {
            let values = i32x16::load_array_ref(simd, values);
            smaller += values.simd_lt(above).select(one, none);
        }
        if smaller.as_slice().iter().sum::<i32>() as u32 <= rank {
            value = above;
        }
    }
    f32::from_bits(value as u32)
}

/// What comes behind all values.
const LAST: i32 = i32::MAX;

/// In lanes: one sum would wait for itself.
fn sum(values: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    let (whole, rest) = values.as_chunks::<LANES>();
    for values in whole {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += value;
        }
    }
    sums.iter().chain(rest).sum()
}

/// The cell in the middle of a block, of `cells`.
fn middle(block: usize, cells: usize) -> usize {
    (block * CELL + CELL / 2).min(cells - 1)
}

/// The blocks' places, row by row.
struct Places {
    x: usize,
    y: usize,
    width: usize,
}

impl Places {
    const fn new(width: usize) -> Self {
        Self { x: 0, y: 0, width }
    }

    /// The cell in the middle of the next block, of a map of `cells`.
    #[inline(always)]
    fn next(&mut self, cells: Size) -> (usize, usize) {
        let place = (middle(self.x, cells.width), middle(self.y, cells.height));
        self.x += 1;
        if self.x == self.width {
            (self.x, self.y) = (0, self.y + 1);
        }
        place
    }
}

/// What makes rays of pixels, in pixels; horizontal before vertical.
struct Lens {
    centre: [f32; 2],
    focal: [f32; 2],
}

impl Lens {
    /// Writes the coefficients of blocks in the middle of these columns and rows of
    /// cells; `near` are their inverse distances, where they are known.
    #[inline(always)]
    fn write<S: Simd>(
        &self,
        simd: S,
        place: [&Lanes; 2],
        near: Option<&Lanes>,
        rows: &mut [[Lanes; UNKNOWNS]; 2],
    ) {
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let [mut a, mut b] = [zero; 2];
        for (axis, ray) in [&mut a, &mut b].into_iter().enumerate() {
            let at = f32x16::load_array_ref(simd, place[axis]) * CELL as f32;
            *ray = (at - self.centre[axis]) / self.focal[axis];
        }
        let coefficients = if let Some(near) = near {
            let near = f32x16::load_array_ref(simd, near);
            [
                [-near, zero, a * near, a * b, -(one + a * a), b],
                [zero, -near, b * near, one + b * b, -a * b, -a],
            ]
        } else {
            [[one, a, b, zero, zero, zero], [zero, zero, zero, one, a, b]]
        };
        for (axis, row) in rows.iter_mut().enumerate() {
            let cells = if near.is_some() { self.focal[axis] / CELL as f32 } else { 1.0 };
            for (to, from) in row.iter_mut().zip(coefficients[axis]) {
                (from * cells).store_slice(to);
            }
        }
    }
}

impl Equations {
    /// The shifts of the blocks under the motion that was found.
    #[inline(always)]
    fn expected(&self, found: &Unknowns) -> [[f64; LANES]; 2] {
        let mut shifts = [[0.0; LANES]; 2];
        for (shifts, row) in shifts.iter_mut().zip(&self.rows) {
            for (coefficients, found) in row.iter().zip(found.iter()) {
                for (shift, coefficient) in shifts.iter_mut().zip(coefficients) {
                    *shift += f64::from(*coefficient) * found;
                }
            }
        }
        shifts
    }

    /// Lengths of what is left of the shifts.
    #[inline(always)]
    fn residuals<S: Simd>(&self, simd: S, found: &[f32; UNKNOWNS]) -> f32x16<S> {
        let mut squares = f32x16::splat(simd, 0.0);
        for (row, shift) in self.rows.iter().zip(&self.shift) {
            let mut left = f32x16::load_array_ref(simd, shift);
            for (coefficients, found) in row.iter().zip(found) {
                left -= f32x16::load_array_ref(simd, coefficients) * *found;
            }
            squares += left * left;
        }
        squares.sqrt()
    }
}

/// The normal equations, summed in lanes; of the matrix, its upper half.
#[derive(Default)]
struct Sums {
    normal: [[Lanes; UNKNOWNS]; UNKNOWNS],
    right: [Lanes; UNKNOWNS],
}

impl Sums {
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "lanes by their number become one vector")]
    fn add(&mut self, e: &Equations, residuals: &Lanes, spread: f32) {
        let mut weight = [0.0; LANES];
        for i in 0..LANES {
            let ratio = residuals[i] / (3.0 * spread);
            let inlier = (1.0 - ratio * ratio).max(0.0);
            weight[i] = e.firmness[i] * (inlier * inlier + OUTLIER);
        }
        for axis in 0..2 {
            for a in 0..UNKNOWNS {
                let mut weighted = e.rows[axis][a];
                for i in 0..LANES {
                    weighted[i] *= weight[i];
                    self.right[a][i] += weighted[i] * e.shift[axis][i];
                }
                for b in a..UNKNOWNS {
                    for i in 0..LANES {
                        self.normal[a][b][i] += weighted[i] * e.rows[axis][b][i];
                    }
                }
            }
        }
    }
}
