//! Poles: thin upright things, matched as whole lines.
//!
//! The post of a lamp or of a sign is about as wide as a pixel of the shrunk views that tell
//! what matters, and narrower than a matching window. But it is long: over a hundred rows
//! its disparity shows to a third of a pixel.

pub mod band;
mod chain;
mod cost;
mod line;

use std::ops::Range;

use crate::camera::StereoRig;
use crate::config::Config;
use crate::image::Image;
use crate::perception::View;
use crate::simd::Level;
use crate::stage::coarse::CELL;
use crate::stage::ground::Plane;
use band::{ROWS, Ridges, shrink};
use chain::Chains;
use cost::Views;
use line::Lines;

/// Bands below the horizon in which poles are looked for: what is higher than the camera
/// reaches above it, and below are the fences, wheels and shadows.
const BELOW: usize = 3;
/// Attention for a pole: it stands out on both sides.
const ATTENTION: f32 = 0.55;
/// What is nearer or farther than a pole differs by these pixels and parts.
const APART_PX: f32 = 1.0;
const APART_PART: f32 = 0.1;

/// A pole before something farther away.
#[derive(Clone, Debug, PartialEq)]
pub struct Pole {
    /// Left side at the upper edge of the image, pixels; pixel x reaches from x to x + 1.
    pub column: f32,
    /// Columns by which it moves from row to row.
    pub lean: f32,
    /// Width in pixels.
    pub width: f32,
    /// Its rows.
    pub rows: Range<usize>,
    /// Its disparity, pixels (`cx_l - cx_r` subtracted).
    pub disparity: f32,
    /// By which part it costs less than at any other disparity.
    pub certainty: f32,
}

impl Pole {
    /// Its pixels in row `y` of an image that is `width` wide.
    pub fn columns(&self, y: usize, width: usize) -> Range<usize> {
        let left = self.column + self.lean * (y as f32 + 0.5);
        let end = ((left + self.width).round().max(0.0) as usize).min(width);
        (left.round().max(0.0) as usize).min(end)..end
    }
}

/// The finder of poles, with its buffers.
#[derive(Debug)]
pub struct Poles {
    level: Level,
    end: usize,
    left: Image<f32>,
    right: Image<f32>,
    ridges: Ridges,
    chains: Chains,
    lines: Lines,
    list: Vec<Pole>,
}

impl Poles {
    /// The finder with instructions of `level`.
    pub fn new(config: &Config, level: Level) -> Self {
        let stereo = &config.stereo;
        let end = stereo.min_disparity.max(0) + stereo.disparity_range.max(1);
        Self {
            level,
            end: usize::try_from(end).unwrap_or(1),
            left: Image::default(),
            right: Image::default(),
            ridges: Ridges::new(level),
            chains: Chains::default(),
            lines: Lines::new(level),
            list: Vec::new(),
        }
    }

    /// Finds the poles on `plane`, the nearest first; none without a plane.
    pub fn find(&mut self, left: &View, right: &View, rig: &StereoRig, plane: Option<&Plane>) {
        self.list.clear();
        let Some(plane) = plane.filter(|plane| plane.a > 0.0) else { return };
        let horizon = -(plane.c + plane.b * left.gray.width() as f32 / 2.0) / plane.a;
        let upper = (horizon.max(0.0) / ROWS as f32) as usize + BELOW;
        shrink(self.level, &left.gray, &mut self.left);
        shrink(self.level, &right.gray, &mut self.right);
        self.ridges.find(&self.left, upper);
        self.chains.find(&self.ridges);
        let end = self.end.min(self.left.width());
        let views = Views { bands: [&self.left, &self.right], plane, rig, end };
        for chain in self.chains.iter() {
            self.list.extend(self.lines.measure(chain, &views));
        }
        self.list.sort_unstable_by(|a, b| {
            b.disparity.total_cmp(&a.disparity).then(a.column.total_cmp(&b.column))
        });
    }

    /// The poles of the last run.
    pub fn list(&self) -> &[Pole] {
        &self.list
    }

    /// Raises the attention of the cells that they cover, in an image so many pixels wide.
    pub fn raise(&self, attention: &mut Image<f32>, width: usize) {
        for pole in &self.list {
            for y in pole.rows.clone().step_by(CELL) {
                let columns = pole.columns(y, width);
                if columns.is_empty() || y / CELL >= attention.height() {
                    continue;
                }
                let row = attention.row_mut(y / CELL);
                let end = ((columns.end - 1) / CELL + 1).min(row.len());
                for cell in &mut row[(columns.start / CELL).min(end)..end] {
                    *cell = cell.max(ATTENTION);
                }
            }
        }
    }

    /// Gives their pixels, where `matched`, their disparity; what is nearer stays.
    pub fn paint(
        &self,
        matched: &Image<u8>,
        disparity: &mut Image<f32>,
        confidence: &mut Image<f32>,
    ) {
        let width = disparity.width();
        for pole in &self.list {
            let nearest = pole.disparity + APART_PX.max(APART_PART * pole.disparity);
            for y in pole.rows.clone() {
                for x in pole.columns(y, width) {
                    let known = disparity.get(x, y);
                    let free = known.is_nan() || known <= nearest;
                    if matched.get(x, y) != 0 && free {
                        disparity.set(x, y, pole.disparity);
                        confidence.set(x, y, pole.certainty);
                    }
                }
            }
        }
    }
}
