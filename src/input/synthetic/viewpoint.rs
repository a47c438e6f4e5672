//! A pinhole camera in the world: its rays, and which parts its tiles can see.

use super::grid::{Cells, Raster};
use super::part::{Part, Pose};
use super::shape::{Ray, Vec3};
use crate::image::Size;

/// Edge of the tiles that share a list of parts, in pixels.
pub const TILE: usize = 8;

/// Depth at which boxes that reach behind the camera are cut off.
const NEAR: f64 = 0.05;

/// One camera at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Viewpoint {
    /// Optical frame in the world: x right, y down, z forward.
    pub pose: Pose,
    /// Focal length in pixels.
    pub focal: f64,
    /// Principal point in pixels; pixel centres are whole numbers.
    pub centre: (f64, f64),
    /// Size of the picture.
    pub size: Size,
}

impl Viewpoint {
    /// The ray through `(x, y)`. Its parameter is the depth.
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let direction =
            Vec3::new((x - self.centre.0) / self.focal, (y - self.centre.1) / self.focal, 1.0);
        Ray { origin: self.pose.position, direction: self.pose.rotation * direction }
    }

    /// The parts that each tile of [`TILE`] pixels can see.
    pub fn tiles(&self, parts: &[Part]) -> Raster {
        let columns = self.size.width.div_ceil(TILE);
        let rows = self.size.height.div_ceil(TILE);
        // Near parts first: they rule out what is behind them.
        let eye = self.pose.position;
        let mut order: Vec<(f64, usize)> =
            parts.iter().enumerate().map(|(index, part)| (part.distance(eye), index)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let cells: Vec<(u16, Cells)> = order
            .iter()
            .map(|(_, index)| (*index, &parts[*index]))
            .filter_map(|(index, part)| {
                let (low, high) = self.extent(part)?;
                let range = |low: f64, high: f64, count: usize| {
                    // Samples lie up to half a pixel around the centre.
                    let first = ((low - 1.0) / TILE as f64).floor();
                    let last = ((high + 1.0) / TILE as f64).floor();
                    let end = count as f64 - 1.0;
                    (last >= 0.0 && first <= end)
                        .then(|| (first.max(0.0) as usize, last.min(end) as usize))
                };
                Some((
                    u16::try_from(index).ok()?,
                    Cells { x: range(low.0, high.0, columns)?, y: range(low.1, high.1, rows)? },
                ))
            })
            .collect();
        Raster::new(columns, rows, &cells)
    }

    /// Box in the picture around what is in front of the camera.
    fn extent(&self, part: &Part) -> Option<((f64, f64), (f64, f64))> {
        let corners = part.corners().map(|p| self.pose.local(p));
        let mut low = (f64::INFINITY, f64::INFINITY);
        let mut high = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let mut include = |p: Vec3| {
            let x = self.focal * p.x / p.z + self.centre.0;
            let y = self.focal * p.y / p.z + self.centre.1;
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x), high.1.max(y));
        };
        for (i, a) in corners.iter().enumerate() {
            if a.z >= NEAR {
                include(*a);
            }
            for bit in [1, 2, 4] {
                let b = &corners[i | bit];
                if (a.z < NEAR) != (b.z < NEAR) {
                    include(a + (b - a) * ((NEAR - a.z) / (b.z - a.z)));
                }
            }
        }
        (low.0 <= high.0).then_some((low, high))
    }
}
