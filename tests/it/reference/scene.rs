//! The cues over a ground plane by their definitions.

use salient_stereo::image::Image;
use salient_stereo::stage::ground::{Plane, cell_centre};

/// Height of a cell over the plane, multiplied by its disparity.
fn lift(plane: &Plane, x: usize, y: usize, d: f32) -> f32 {
    let (u, v) = cell_centre(x, y);
    plane.camera_height_m * (d - plane.disparity(u, v))
}

/// Share of structure: down every column, then the mean of five side by side.
pub fn structure(disparity: &Image<f32>, plane: &Plane) -> Image<f32> {
    let (width, height) = (disparity.width(), disparity.height());
    let mut goes_on = Image::new(disparity.size());
    for x in 0..width {
        // Disparity of the surface, and how many cells may still be holes.
        let mut surface: Option<(f32, u32)> = None;
        for y in 0..height {
            let d = disparity.get(x, y);
            let limit = if y == 0 { 2.6 } else { 3.4 };
            let above = lift(plane, x, y, d) > limit * d;
            surface = match surface {
                Some((mean, _)) if (d - mean).abs() <= (0.08 * mean).max(0.6) => {
                    Some((mean + 0.3 * (d - mean), 2))
                }
                _ if above => Some((d, 2)),
                Some((mean, holes)) if d < mean && holes > 0 => Some((mean, holes - 1)),
                _ => None,
            };
            goes_on.set(x, y, if surface.is_some() { 1.0 } else { 0.0 });
        }
    }
    Image::from_fn(disparity.size(), |x, y| {
        (0..5).map(|i| goes_on.get((x + i).saturating_sub(2).min(width - 1), y)).sum::<f32>() / 5.0
    })
}

/// A surface of a column: rows from the base up.
pub struct Surface {
    x: usize,
    rows: Vec<usize>,
    mean: f32,
}

/// Upright surfaces, and the disparity with their means in it.
pub fn surfaces(disparity: &Image<f32>, plane: &Plane) -> (Vec<Surface>, Image<f32>) {
    let mut found: Vec<Surface> = Vec::new();
    for x in 0..disparity.width() {
        let mut open: Option<(Vec<usize>, f32)> = None;
        for y in (0..disparity.height()).rev() {
            let d = disparity.get(x, y);
            let height = lift(plane, x, y, d);
            let low = 0.2 * plane.scale() * d + 0.4 * plane.camera_height_m;
            let stands = d > 1.2 && height >= low && height <= 2.6 * d;
            let goes_on = open.as_ref().is_some_and(|(rows, sum)| {
                let below = disparity.get(x, rows[rows.len() - 1]);
                (d - below).abs() <= (0.05 * d).max(0.7)
                    && (d - sum / rows.len() as f32).abs() <= 0.12 * d
            });
            match &mut open {
                Some((rows, sum)) if stands && goes_on => {
                    rows.push(y);
                    *sum += d;
                }
                _ => {
                    let ended = open.take();
                    found.extend(ended.map(|(rows, sum)| Surface {
                        x,
                        mean: sum / rows.len() as f32,
                        rows,
                    }));
                    open = stands.then(|| (vec![y], d));
                }
            }
        }
        found.extend(open.map(|(rows, sum)| Surface { x, mean: sum / rows.len() as f32, rows }));
    }
    let mut smooth = disparity.clone();
    for surface in &found {
        for &y in &surface.rows {
            smooth.set(surface.x, y, surface.mean);
        }
    }
    (found, smooth)
}

/// No cell of a surface and of its foot below the mean of `cue` over the surface, and
/// a fifth of the contrast to what is above it.
pub fn even_out(
    surfaces: &[Surface],
    smooth: &Image<f32>,
    plane: &Plane,
    cue: &Image<f32>,
    out: &mut Image<f32>,
) {
    for Surface { x, rows, mean } in surfaces {
        let x = *x;
        let sum = rows.iter().map(|&y| cue.get(x, y)).reduce(|sum, c| sum + c).unwrap();
        let top = rows[rows.len() - 1];
        let height = lift(plane, x, top, *mean) / mean.max(1.2);
        let gate = (height - 0.15 * plane.scale()) * (1.0 / (0.25 * plane.scale()));
        let drop = if top > 0 { mean - smooth.get(x, top - 1) - 0.15 } else { 0.0 };
        let rise = (drop / (0.35 * mean.max(0.5))).clamp(0.0, 1.0);
        let value = (gate.clamp(0.0, 1.0) * (sum / rows.len() as f32 + 0.2 * rise)).min(1.0);
        let foot = (rows[0] + 1..smooth.height()).take_while(|&y| {
            let d = smooth.get(x, y);
            let (u, v) = cell_centre(x, y);
            let other = surfaces.iter().any(|s| s.x == x && s.rows.contains(&y));
            !other && (d - mean).abs() <= 0.08 * mean && plane.disparity(u, v) < *mean
        });
        for y in rows.iter().copied().chain(foot) {
            out.set(x, y, out.get(x, y).max(value));
        }
    }
}

/// Mean over the cells of a row up to three columns away that are as deep.
pub fn beside(disparity: &Image<f32>, map: &Image<f32>) -> Image<f64> {
    Image::from_fn(map.size(), |x, y| {
        let here = disparity.get(x, y);
        let same: Vec<f64> = (x.saturating_sub(3)..(x + 4).min(map.width()))
            .filter(|&u| (disparity.get(u, y) - here).abs() <= (0.08 * here).max(0.6))
            .map(|u| f64::from(map.get(u, y)))
            .collect();
        same.iter().sum::<f64>() / same.len() as f64
    })
}

/// Contrast to the left and the right over eight offsets.
pub fn lateral(disparity: &Image<f32>, px_per_m: f32, scale: f32) -> Image<f64> {
    Image::from_fn(disparity.size(), |x, y| {
        let d = disparity.get(x, y);
        let reach = (d * (2.5 * scale * px_per_m / 4.0)).max(4.0);
        let drop = |there: Option<usize>| {
            let there = there.filter(|&u| u < disparity.width());
            there.map_or(0.0, |u| f64::from(d) - f64::from(disparity.get(u, y)))
        };
        let (mut left, mut right) = (0.0_f64, 0.0_f64);
        for offset in [4, 6, 9, 14, 20, 30, 45, 68].into_iter().filter(|&o| o as f32 <= reach) {
            left = left.max(drop(x.checked_sub(offset)) - 0.15);
            right = right.max(drop(Some(x + offset)) - 0.15);
        }
        let sum = left.min(right) + 0.5 * left.max(right);
        (sum / (0.35 * f64::from(d).max(0.5))).min(1.0)
    })
}
