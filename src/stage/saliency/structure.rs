//! What is higher than any thing: walls, trees, whatever goes on above.

use crate::image::Image;
use crate::simd::{Level, dispatch};
use crate::stage::ground::{Plane, cell_centre};

/// Height above the ground in metres over which a surface is no thing's.
const TALL_M: f32 = 3.4;
/// What the image's upper edge cuts above this height goes on, for all one knows.
const CUT_M: f32 = 2.6;
/// Largest distance of a cell from its surface: pixels, and in parts of its disparity.
const SAME_PX: f32 = 0.6;
const SAME_PART: f32 = 0.08;
/// Share of the next cell in the surface's running disparity.
const RENEWAL: f32 = 0.3;
/// Cells in a row that may be farther away than the surface (a window, a
/// mismatch) without ending it, and one.
const LIVES: f32 = 3.0;
/// Cells on either side that are asked as well.
const REACH: usize = 2;

/// The share of structure, with its buffers.
#[derive(Debug)]
pub struct Structure {
    level: Level,
    /// Per column: disparity of the surface that comes down from above, and how
    /// much it still takes to end it (0: there is none).
    mean: Vec<f32>,
    lives: Vec<f32>,
    /// One row of zeros and ones, with its ends repeated.
    row: Vec<f32>,
}

impl Structure {
    /// The cue at this SIMD level.
    pub fn new(level: Level) -> Self {
        Self { level, mean: Vec::new(), lives: Vec::new(), row: Vec::new() }
    }

    /// Share of structure, 0..=1: the mean over five cells side by side of
    /// whether a cell's surface goes on, up its column, to more than 3.4 m above
    /// the ground. A surface stands upright: its cells have one disparity. A
    /// thing in front of it has a larger one, and ends it.
    ///
    /// `disparity` (full-size pixels, `cx_l - cx_r` subtracted) has no NaN.
    pub fn run(&mut self, disparity: &Image<f32>, plane: &Plane, out: &mut Image<f32>) {
        let width = disparity.width();
        out.resize(disparity.size());
        for buffer in [&mut self.mean, &mut self.lives] {
            buffer.clear();
            buffer.resize(width, 0.0);
        }
        self.row.resize(width + 2 * REACH, 0.0);
        let Self { level, mean, lives, row } = self;
        dispatch!(*level, _simd => {
            for y in 0..disparity.height() {
                let row = &mut row[..width + 2 * REACH];
                let above = Above { plane, y, limit_m: if y == 0 { CUT_M } else { TALL_M } };
                descend(&above, disparity.row(y), mean, lives, &mut row[REACH..]);
                let first = row[REACH];
                row[..REACH].fill(first);
                let last = row[width + REACH - 1];
                row[width + REACH..].fill(last);
                average(row, out.row_mut(y));
            }
        });
    }
}

/// What is higher than a limit, in one row.
struct Above<'a> {
    plane: &'a Plane,
    y: usize,
    limit_m: f32,
}

/// One row further down: 1 where a surface from above the limit is still there.
#[inline(always)]
fn descend(
    above: &Above<'_>,
    disparity: &[f32],
    mean: &mut [f32],
    lives: &mut [f32],
    out: &mut [f32],
) {
    let Above { plane, y, limit_m } = above;
    let cells = disparity.iter().zip(mean).zip(lives).zip(out);
    for (x, (((&d, mean), lives), out)) in cells.enumerate() {
        let (u, v) = cell_centre(x, *y);
        // The height is over the limit, multiplied by d.
        let above = plane.camera_height_m * (d - plane.disparity(u, v)) > limit_m * d;
        let step = d - *mean;
        let same = *lives > 0.0 && step.abs() <= (SAME_PART * *mean).max(SAME_PX);
        let hole = if step < 0.0 { (*lives - 1.0).max(0.0) } else { 0.0 };
        *lives = if above || same { LIVES } else { hole };
        let other = if above { d } else { *mean };
        *mean = if same { *mean + RENEWAL * step } else { other };
        *out = if *lives > 0.0 { 1.0 } else { 0.0 };
    }
}

/// Means over [`REACH`] cells to either side.
#[inline(always)]
fn average(row: &[f32], out: &mut [f32]) {
    for (out, window) in out.iter_mut().zip(row.windows(2 * REACH + 1)) {
        *out = window.iter().sum::<f32>() / (2 * REACH + 1) as f32;
    }
}
