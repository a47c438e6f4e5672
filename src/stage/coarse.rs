//! Quarter-size disparity of the whole frame.

use rayon::prelude::*;

use crate::config::Config;
use crate::image::{Image, Size};
use crate::perception::{DISPARITY_STEP, View};
use crate::simd::prelude::*;
use crate::simd::{LANES, Level, Simd, dispatch, load};
use crate::stage::stereo::cost::Penalties;
use crate::stage::stereo::engine::{Engine, Method, Settings, Views};
use crate::stage::stereo::plan::Plan;
use crate::stage::stereo::winner::STEPS;
use crate::stage::stereo::{Matches, NO_MATCH};

/// Cells per pixel along each axis: cell `(x, y)` covers the 4x4 pixels from `(4x, 4y)`.
pub const CELL: usize = 4;

/// Neighbours that a cell needs.
const SUPPORT: u32 = 2;

/// Least rows of cells that are worth a task of their own.
const ROWS_AT_ONCE: usize = 24;

/// Cells that are looked at together.
const BLOCK: usize = 64;

/// Disparity of each cell of the frame, in pixels of the FULL-size image, as
/// `x_l - x_r` (principal points not subtracted).
#[derive(Clone, Debug, Default)]
pub struct CoarseDisparity {
    /// NaN where the left-right check fails.
    pub checked: Image<f32>,
    /// `checked` with its holes filled from the background side: no NaN
    /// (all zero when nothing matched at all).
    pub filled: Image<f32>,
}

/// The quarter-size matcher.
pub struct Coarse {
    level: Level,
    size: Size,
    engine: Engine,
    plan: Plan,
    left: Image<u8>,
    right: Image<u8>,
    matches: Matches,
    agreed: Image<f32>,
}

impl Coarse {
    /// The matcher for views of `size`.
    pub fn new(config: &Config, size: Size, level: Level) -> Self {
        let stereo = &config.stereo;
        let lo = stereo.min_disparity.max(0) as usize;
        let hi = lo + stereo.disparity_range.max(1) as usize;
        let settings = Settings {
            penalties: Penalties::of(stereo).shrunk(),
            method: Method::FourPaths,
            context: 4,
            search: lo / CELL..hi.div_ceil(CELL) + 1,
        };
        Self {
            level,
            size: size.divided_by(CELL),
            engine: Engine::new(settings, level),
            plan: Plan::default(),
            left: Image::default(),
            right: Image::default(),
            matches: Matches::default(),
            agreed: Image::default(),
        }
    }

    /// Matches two views of the size given to `new`.
    pub fn run(&mut self, left: &View, right: &View, out: &mut CoarseDisparity) {
        let level = self.level;
        rayon::join(
            || shrink(level, &left.gray, &mut self.left),
            || shrink(level, &right.gray, &mut self.right),
        );
        let search = self.engine.settings().search.clone();
        self.plan.whole(self.size, &search);
        let views =
            Views { left: &self.left, right: &self.right, mask: None, coarse: None, weight: None };
        self.engine.run(&views, &self.plan, &mut self.matches);
        check(&self.matches, &mut self.agreed);
        support(&self.agreed, &mut out.checked);
        fill(&out.checked, &mut out.filled);
    }
}

/// Mean of each cell; cells that reach beyond the image repeat its border.
pub fn shrink(level: Level, image: &Image<u8>, out: &mut Image<u8>) {
    let size = image.size();
    out.resize(size.divided_by(CELL));
    for y in 0..out.height() {
        let rows = std::array::from_fn(|i| image.row((CELL * y + i).min(size.height - 1)));
        dispatch!(level, simd => shrink_row(simd, rows, out.row_mut(y)));
    }
}

/// Cells whose pixels fill a vector.
const CELLS: usize = LANES / CELL;

#[inline(always)]
fn shrink_row<S: Simd>(simd: S, rows: [&[u8]; CELL], out: &mut [u8]) {
    let whole = rows[0].len() / LANES * CELLS;
    for (i, cells) in out[..whole].as_chunks_mut::<CELLS>().0.iter_mut().enumerate() {
        let at = i * LANES;
        // Pairs of pixels of four rows: at most 8 * 255.
        let pairs = (load(simd, rows[0], at).pairwise_widening_add()
            + load(simd, rows[1], at).pairwise_widening_add())
            + (load(simd, rows[2], at).pairwise_widening_add()
                + load(simd, rows[3], at).pairwise_widening_add());
        let sums = pairs.pairwise_widening_add().to_array();
        for (cell, sum) in cells.iter_mut().zip(sums) {
            *cell = ((sum + 8) >> 4) as u8;
        }
    }
    for (x, cell) in out.iter_mut().enumerate().skip(whole) {
        let mut sum = 8;
        for row in rows {
            for k in 0..CELL {
                sum += u16::from(row[(CELL * x + k).min(row.len() - 1)]);
            }
        }
        *cell = (sum >> 4) as u8;
    }
}

/// Keeps disparities that both views agree on to within one cell.
fn check(matches: &Matches, out: &mut Image<f32>) {
    let size = matches.left.size();
    out.resize(size);
    let pixels_per_step = CELL as f32 * DISPARITY_STEP;
    let rows = out.pixels_mut().par_chunks_exact_mut(size.width.max(1)).enumerate();
    rows.with_min_len(ROWS_AT_ONCE).for_each(|(y, out)| {
        let right = matches.right.row(y);
        for (x, (out, &d)) in out.iter_mut().zip(matches.left.row(y)).enumerate() {
            let partner = x as i32 - (i32::from(d) + STEPS / 2).div_euclid(STEPS);
            let agreed = d != NO_MATCH
                && usize::try_from(partner)
                    .ok()
                    .and_then(|x| right.get(x))
                    .is_some_and(|&r| (i32::from(d) - i32::from(r)).abs() <= STEPS);
            *out = if agreed { f32::from(d) * pixels_per_step } else { f32::NAN };
        }
    });
}

/// Drops cells that fewer than [`SUPPORT`] of the eight around them bear out to
/// within one cell: mere chance matches stand alone, while even a thin thing
/// goes on above and below.
fn support(agreed: &Image<f32>, out: &mut Image<f32>) {
    let (width, height) = (agreed.width(), agreed.height());
    out.copy_from(agreed);
    if width < 3 || height < 3 {
        return;
    }
    let rows = out.pixels_mut().par_chunks_exact_mut(width).enumerate();
    rows.with_min_len(ROWS_AT_ONCE).for_each(|(y, out)| {
        let nowhere = &agreed.row(y)[..0];
        let above = if y > 0 { agreed.row(y - 1) } else { nowhere };
        let below = if y + 1 < height { agreed.row(y + 1) } else { nowhere };
        support_row(above, agreed.row(y), below, out);
    });
}

/// One row of it; nothing is above or below where that row is empty. The first
/// and the last cell stay as they are.
fn support_row(above: &[f32], here: &[f32], below: &[f32], out: &mut [f32]) {
    let inner = here.len() - 2;
    let near = |a: f32, b: f32| u32::from((a - b).abs() <= CELL as f32);
    let centres = &here[1..=inner];
    let mut counts = [0_u32; BLOCK];
    for x in (0..inner).step_by(BLOCK) {
        let n = BLOCK.min(inner - x);
        let centres = &centres[x..x + n];
        let counts = &mut counts[..n];
        counts.fill(0);
        for (row, offsets) in [(above, &[0, 1, 2][..]), (here, &[0, 2]), (below, &[0, 1, 2])] {
            for offset in offsets {
                let others = row.get(x + offset..x + offset + n).unwrap_or_default();
                for ((count, &d), &other) in counts.iter_mut().zip(centres).zip(others) {
                    // False where either is NaN.
                    *count += near(d, other);
                }
            }
        }
        for ((out, &d), &count) in out[1 + x..].iter_mut().zip(centres).zip(&*counts) {
            *out = if count < SUPPORT { f32::NAN } else { d };
        }
    }
}

/// Fills holes along the rows with the smaller disparity of the two
/// neighbours: what is hidden from one view lies behind. Rows without any
/// disparity take those of the nearest row above, else below.
fn fill(checked: &Image<f32>, out: &mut Image<f32>) {
    out.copy_from(checked);
    let height = out.height();
    let mut known = None;
    for y in 0..height {
        if !fill_row(out.row_mut(y)) {
            continue;
        }
        match known {
            None => (0..y).for_each(|above| copy_row(out, y, above)),
            Some(last) => (last + 1..y).for_each(|between| copy_row(out, last, between)),
        }
        known = Some(y);
    }
    match known {
        None => out.fill(0.0),
        Some(last) => (last + 1..height).for_each(|below| copy_row(out, last, below)),
    }
}

fn copy_row(image: &mut Image<f32>, from: usize, to: usize) {
    let width = image.width();
    image.pixels_mut().copy_within(from * width..(from + 1) * width, to * width);
}

/// Fills the holes (NaN) of one row with the smaller of their two neighbours;
/// false when there is nothing to fill from.
pub(crate) fn fill_row(row: &mut [f32]) -> bool {
    let mut x = 0;
    let mut left = None;
    while x < row.len() {
        if !row[x].is_nan() {
            left = Some(row[x]);
            x += 1;
            continue;
        }
        let end = row[x..].iter().position(|d| !d.is_nan()).map(|i| x + i);
        let right = end.map(|end| row[end]);
        let value = match (left, right) {
            (Some(a), Some(b)) => a.min(b),
            (Some(a), None) | (None, Some(a)) => a,
            (None, None) => return false,
        };
        let end = end.unwrap_or(row.len());
        row[x..end].fill(value);
        x = end;
    }
    left.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_needs_two_neighbours_that_agree() {
        // As the words say it, without blocks or rows apart.
        let plain = |image: &Image<f32>, x: usize, y: usize| {
            let d = image.get(x, y);
            if image.height() < 3 || image.width() < 3 || x == 0 || x + 1 == image.width() {
                return d;
            }
            let near =
                |v: usize, u: usize| (u, v) != (x, y) && (image.get(u, v) - d).abs() <= CELL as f32;
            let rows = y.saturating_sub(1)..(y + 2).min(image.height());
            let count = rows.flat_map(|v| (x - 1..x + 2).map(move |u| (v, u)));
            let count = count.filter(|&(v, u)| near(v, u)).count();
            if count < 2 { f32::NAN } else { d }
        };
        for size in [Size::new(1, 1), Size::new(3, 3), Size::new(70, 5), Size::new(131, 9)] {
            let mut state = 7_u64;
            let image = Image::from_fn(size, |_, _| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let value = (state >> 40) % 24;
                if value < 4 { f32::NAN } else { value as f32 }
            });
            let mut found = Image::default();
            support(&image, &mut found);
            for y in 0..size.height {
                for x in 0..size.width {
                    let (found, expected) = (found.get(x, y), plain(&image, x, y));
                    assert_eq!(found.to_bits(), expected.to_bits(), "({x}, {y}) of {size}");
                }
            }
        }
    }
}
