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
/// Chains that are matched, from above: KITTI frames have 16 to 35, and many more are a façade.
const MOST_CHAINS: usize = 1000;
/// Attention for a pole, at least: it stands out on both sides, but where attention is
/// scarce cars and people come first.
const ATTENTION: f32 = 0.4;
/// Confidence of a pole's disparity: so much at least, more by the part by which it costs less
/// than at any other disparity, and so much at most. Of 868 poles on nine rendered streets 69 %
/// of the pixels are right within 3 px or 5 % at a part of .2, 90 % at .46, 95 % at .75.
const LEAST_CONFIDENCE: f32 = 0.6;
const PER_PART: f32 = 0.65;
const MOST_CONFIDENCE: f32 = 0.94;

/// By how many pixels what is nearer or farther than something of this disparity differs.
fn apart(disparity: f32) -> f32 {
    f32::max(1.0, 0.1 * disparity)
}

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
    /// Probability that this is right within 3 px or 5 %.
    pub confidence: f32,
}

impl Pole {
    /// Whether what is at one of its pixels is nearer; NaN is not.
    pub fn is_hidden_by(&self, disparity: f32) -> bool {
        disparity > self.disparity + apart(self.disparity)
    }

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
    /// Disparities searched, `x_l - x_r` in pixels.
    search: Range<usize>,
    /// Nearest and farthest depth that counts, metres.
    depth_m: [f64; 2],
    min_confidence: f32,
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
        let start = stereo.min_disparity.max(0) as usize;
        Self {
            level,
            search: start..start + stereo.disparity_range.max(1) as usize,
            depth_m: [config.depth.min, config.depth.max],
            min_confidence: config.min_confidence as f32,
            left: Image::default(),
            right: Image::default(),
            ridges: Ridges::new(level),
            chains: Chains::default(),
            lines: Lines::new(level),
            list: Vec::new(),
        }
    }

    /// Finds the poles on `plane`, the nearest first; none without a plane. A pole shows in at
    /// least forty rows above the horizon or a little below. A line on a wall without texture
    /// is taken for one too: such a wall looks as far away as the sky.
    pub fn find(&mut self, left: &View, right: &View, rig: &StereoRig, plane: Option<&Plane>) {
        self.list.clear();
        let Some(plane) = plane.filter(|plane| plane.a > 0.0) else { return };
        let horizon = -(plane.c + plane.b * left.gray.width() as f32 / 2.0) / plane.a;
        let upper = ((horizon.max(0.0) / ROWS as f32) as usize).saturating_add(BELOW);
        shrink(self.level, &left.gray, &mut self.left);
        shrink(self.level, &right.gray, &mut self.right);
        self.ridges.find(&self.left, upper);
        self.chains.find(&self.ridges);
        let end = self.search.end.min(self.left.width());
        let search = self.search.start.min(end)..end;
        let views = Views { bands: [&self.left, &self.right], plane, rig, search };
        let [near_m, far_m] = self.depth_m;
        for chain in self.chains.iter().take(MOST_CHAINS) {
            let Some(pole) = self.lines.measure(chain, &views) else { continue };
            let depth_m = rig.depth_scale() / f64::from(pole.disparity);
            if (near_m..=far_m).contains(&depth_m) && pole.confidence >= self.min_confidence {
                self.list.push(pole);
            }
        }
        self.list.sort_unstable_by(|a, b| {
            b.disparity.total_cmp(&a.disparity).then(a.column.total_cmp(&b.column))
        });
    }

    /// Keeps the nearest `count` of them.
    pub fn truncate(&mut self, count: usize) {
        self.list.truncate(count);
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
            for y in pole.rows.clone() {
                for x in pole.columns(y, width) {
                    if matched.get(x, y) != 0 && !pole.is_hidden_by(disparity.get(x, y)) {
                        disparity.set(x, y, pole.disparity);
                        confidence.set(x, y, pole.confidence);
                    }
                }
            }
        }
    }
}
