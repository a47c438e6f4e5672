//! What moves by itself: the flow that the camera's own motion does not explain.

use nalgebra::{SMatrix, SVector};

use crate::image::Image;
use crate::stage::coarse::CELL;
use crate::stage::saliency::AttentionScene;
use crate::stage::saliency::flow::{BlockShift, Flow};
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

type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Unknowns = SVector<f64, UNKNOWNS>;

/// Equations of one block: the shift it has for each unknown at 1, in cells.
#[derive(Clone, Copy, Debug)]
struct Equations {
    rows: [[f32; UNKNOWNS]; 2],
    shift: [f32; 2],
    firmness: f32,
}

/// The camera's motion and what is left, with the buffers.
#[derive(Debug, Default)]
pub struct EgoMotion {
    equations: Vec<Equations>,
    residuals: Vec<f32>,
    ranked: Vec<f32>,
    blocks: Image<f32>,
    /// `C_M` per cell, 0..=1.
    pub motion: Image<f32>,
    /// `C_M` that a tenth of the blocks exceeds.
    pub most: f32,
}

impl EgoMotion {
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
        let trust = flow.trust.pixels().iter().sum::<f32>();
        if trust < LEAST_TRUST * flow.trust.size().area() as f32 {
            return false;
        }
        self.write_equations(flow, scene, has_depth);
        if self.equations.iter().filter(|e| e.firmness > FIRM).count() < LEAST_BLOCKS {
            return false;
        }
        let mut spread = FIRST_SPREAD;
        let mut found = Unknowns::zeros();
        for _ in 0..STEPS {
            let Some(next) = self.solve(&found, spread) else { return false };
            found = next;
            spread = self.residuals_of(&found).max(LEAST_SPREAD);
        }
        self.blocks.resize(flow.blocks.size());
        let blocks = self.blocks.pixels_mut().iter_mut();
        for ((out, e), r) in blocks.zip(&self.equations).zip(&self.residuals) {
            *out = e.firmness * (1.0 - (-0.5 * (r / (3.0 * spread)).powi(2)).exp());
        }
        self.ranked.clear();
        self.ranked.extend_from_slice(self.blocks.pixels());
        let tenth = self.ranked.len() - 1 - self.ranked.len() / 10;
        self.most = *self.ranked.select_nth_unstable_by(tenth, f32::total_cmp).1;
        upsample(&self.blocks, scene.cells.gray.size(), &mut self.motion);
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
        for y in 0..flow.blocks.height() {
            for x in 0..flow.blocks.width() {
                let block = flow.blocks.get(x, y);
                // Its middle, to a cell.
                let u = (x * CELL + CELL / 2).min(filled.width() - 1);
                let v = (y * CELL + CELL / 2).min(filled.height() - 1);
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
                let BlockShift { shift, firmness } = block;
                self.equations.push(Equations { rows, shift, firmness });
            }
        }
    }

    /// One step of least squares with weights from the residuals of `last`.
    fn solve(&self, last: &Unknowns, spread: f32) -> Option<Unknowns> {
        let mut normal = [[0.0_f32; UNKNOWNS]; UNKNOWNS];
        let mut right = [0.0_f32; UNKNOWNS];
        for e in self.equations.iter().filter(|e| e.firmness > 0.0) {
            let ratio = e.residual(last) / (3.0 * spread);
            let weight = e.firmness * ((1.0 - ratio * ratio).max(0.0).powi(2) + OUTLIER);
            for (row, shift) in e.rows.iter().zip(e.shift) {
                for i in 0..UNKNOWNS {
                    let weighted = weight * row[i];
                    right[i] += weighted * shift;
                    for j in 0..UNKNOWNS {
                        normal[i][j] += weighted * row[j];
                    }
                }
            }
        }
        let mut normal = Normal::from_fn(|i, j| f64::from(normal[i][j]));
        let ridge = RIDGE * normal.trace();
        normal += Normal::identity() * ridge;
        let right = Unknowns::from_fn(|i, _| f64::from(right[i]));
        normal.cholesky().map(|factor| factor.solve(&right))
    }

    /// Lengths of the residuals, and their spread over the firm blocks.
    fn residuals_of(&mut self, found: &Unknowns) -> f32 {
        self.residuals.clear();
        self.residuals.extend(self.equations.iter().map(|e| e.residual(found)));
        self.ranked.clear();
        let firm = self.equations.iter().zip(&self.residuals).filter(|(e, _)| e.firmness > FIRM);
        self.ranked.extend(firm.map(|(_, r)| r));
        let middle = self.ranked.len() / 2;
        RAYLEIGH * *self.ranked.select_nth_unstable_by(middle, f32::total_cmp).1
    }
}

impl Equations {
    /// Length of what is left of the shift.
    fn residual(&self, found: &Unknowns) -> f32 {
        let mut squares = 0.0;
        for (row, shift) in self.rows.iter().zip(self.shift) {
            let model: f32 = row.iter().zip(found.iter()).map(|(e, x)| e * *x as f32).sum();
            squares += (shift - model).powi(2);
        }
        squares.sqrt()
    }
}
