//! What moves by itself: the flow that the camera's own motion does not explain.

use nalgebra::{SMatrix, SVector};

use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, prelude::*, u32x16};
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
    ranked: Vec<u32>,
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
        self.blocks.resize(flow.blocks.size());
        let residuals = self.residuals.as_flattened();
        let cells = scene.cells.gray.size();
        let width = self.blocks.width();
        let blocks = self.blocks.pixels_mut().iter_mut().enumerate();
        for ((i, out), (block, r)) in blocks.zip(flow.blocks.pixels().iter().zip(residuals)) {
            let [u, v] = self.equations[i / LANES].expected(&found, i % LANES);
            let x = middle(i % width, cells.width) as f64;
            let y = middle(i / width, cells.height) as f64;
            // What was out of view has no past that could have moved.
            let was_seen = (0.0..cells.width as f64).contains(&(x + u))
                && (0.0..cells.height as f64).contains(&(y + v));
            let motion = block.firmness * (1.0 - (-0.5 * (r / (3.0 * spread)).powi(2)).exp());
            *out = if was_seen { motion } else { 0.0 };
        }
        self.ranked.clear();
        self.ranked.extend(self.blocks.pixels().iter().map(|motion| motion.to_bits()));
        let rank = ((1.0 - MOVERS) * (self.ranked.len() - 1) as f32) as u32;
        self.ranked.resize(self.ranked.len().next_multiple_of(LANES), u32::MAX);
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
        let (cx, cy) = scene.rig.principal_point();
        let (cx, cy) = (cx as f32, cy as f32);
        let (fx, fy) = (scene.rig.focal_px() as f32, scene.rig.focal_y_px() as f32);
        let filled = &scene.coarse.filled;
        let offset = scene.rig.disparity_offset() as f32;
        let per_pixel = PER_METRE / scene.rig.depth_scale() as f32;
        let cell = CELL as f32;
        self.equations.clear();
        self.equations.resize(flow.blocks.size().area().div_ceil(LANES), Equations::default());
        let places =
            (0..flow.blocks.height()).flat_map(|y| (0..flow.blocks.width()).map(move |x| (x, y)));
        for (i, ((x, y), block)) in places.zip(flow.blocks.pixels()).enumerate() {
            let (u, v) = (middle(x, filled.width()), middle(y, filled.height()));
            let (a, b) = ((u as f32 * cell - cx) / fx, (v as f32 * cell - cy) / fy);
            let (f, g) = (fx / cell, fy / cell);
            let rows = if has_depth {
                let near = (filled.get(u, v) - offset).max(0.0) * per_pixel;
                [
                    [-near, 0.0, a * near, a * b, -(1.0 + a * a), b].map(|e| e * f),
                    [0.0, -near, b * near, 1.0 + b * b, -a * b, -a].map(|e| e * g),
                ]
            } else {
                [[1.0, a, b, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, a, b]]
            };
            let (e, lane) = (&mut self.equations[i / LANES], i % LANES);
            for (to, from) in e.rows.as_flattened_mut().iter_mut().zip(rows.as_flattened()) {
                to[lane] = *from;
            }
            for (to, from) in e.shift.iter_mut().zip(block.shift) {
                to[lane] = from;
            }
            e.firmness[lane] = block.firmness;
        }
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
        let Self { level, equations, residuals, .. } = self;
        dispatch!(*level, simd => {
            for (e, out) in equations.iter().zip(residuals.iter_mut()) {
                e.residuals(simd, &found, out);
            }
        });
        self.ranked.resize(LANES * self.equations.len(), 0);
        let Self { level, equations, residuals, ranked, .. } = self;
        let ranked = ranked.as_chunks_mut::<LANES>().0;
        let middle = dispatch!(*level, simd => {
            let mut firm = [0; LANES];
            for ((e, residuals), out) in equations.iter().zip(residuals.iter()).zip(&mut *ranked) {
                for i in 0..LANES {
                    // The others come behind all.
                    let is_firm = e.firmness[i] > FIRM;
                    out[i] = if is_firm { residuals[i].to_bits() } else { u32::MAX };
                    firm[i] += u32::from(is_firm);
                }
            }
            ranked_at(simd, ranked, firm.iter().sum::<u32>() / 2)
        });
        RAYLEIGH * middle
    }
}

/// The value of this rank, from 0, of values that are not negative, given by
/// their bits: those have the same order. Bit by bit it is asked how many are
/// smaller, which takes less time than to sort them.
#[inline(always)]
fn ranked_at<S: Simd>(simd: S, values: &[[u32; LANES]], rank: u32) -> f32 {
    let (none, one) = (u32x16::splat(simd, 0), u32x16::splat(simd, 1));
    let mut value = 0;
    for bit in (0..31).rev() {
        let above = value | 1 << bit;
        let mut smaller = none;
        for values in values {
            let values = u32x16::load_array_ref(simd, values);
            smaller += values.simd_lt(above).select(one, none);
        }
        if smaller.as_slice().iter().sum::<u32>() <= rank {
            value = above;
        }
    }
    f32::from_bits(value)
}

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

impl Equations {
    /// The shift of a block under the motion that was found.
    fn expected(&self, found: &Unknowns, lane: usize) -> [f64; 2] {
        self.rows.map(|row| row.iter().zip(found.iter()).map(|(c, f)| f64::from(c[lane]) * f).sum())
    }

    /// Lengths of what is left of the shifts.
    #[inline(always)]
    fn residuals<S: Simd>(&self, simd: S, found: &[f32; UNKNOWNS], out: &mut Lanes) {
        let mut squares = f32x16::splat(simd, 0.0);
        for (row, shift) in self.rows.iter().zip(&self.shift) {
            let mut left = f32x16::from_slice(simd, shift);
            for (coefficients, found) in row.iter().zip(found) {
                left -= f32x16::from_slice(simd, coefficients) * *found;
            }
            squares += left * left;
        }
        squares.sqrt().store_slice(out);
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
