//! The measures of one region.

mod sums;

use std::ops::Range;

use super::RegionSource;
use super::candidates::{Candidates, PixelBox};
use crate::camera::StereoRig;
use crate::image::Image;
use crate::perception::Region;
use crate::simd::Level;
use crate::stage::depth::{Depth, EPSILON_PX};
use sums::{Centre, Out, Sums};

/// Standard deviation of a region's disparity that more pixels do not reduce:
/// sub-pixel bias and calibration, in pixels.
const SYSTEMATIC_PX: f64 = 0.15;
/// Standard deviation of a region's image position that more pixels do not
/// reduce: where the boundary lies, in pixels.
const BOUNDARY_PX: f64 = 0.5;
/// Neighbouring pixels share their matching window: this many count as one.
const PIXELS_PER_SAMPLE: f64 = 25.0;
/// Of a thing of twice or four times as many pixels one in two or four rows is
/// looked at for its disparities, which are smooth over a matching window: but no
/// fewer rows than these.
const MOST_PIXELS: usize = 4096;
const LEAST_ROWS: usize = 8;
/// Values of which percentiles are taken, about.
const MOST_VALUES: usize = 1024;
/// Columns by which the sample of a row lies beside that of the row above: a
/// prime larger than a usual step.
const SHIFT: usize = 61;
/// Robust standard deviations within which a disparity counts for the centroid.
const INLIER_SIGMAS: f32 = 3.0;

/// What decides whether a candidate is a region, beside the region's own fields.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evidence {
    /// Mean confidence of the valid pixels in every fourth row, of low regions in more;
    /// 0 when there is none.
    pub mean_confidence: f32,
    /// Median disparity in pixels; NaN without a valid pixel.
    pub median_disparity: f32,
    /// Half the distance between the 16th and the 84th percentile of disparity
    /// in pixels (one standard deviation of a normal distribution); NaN
    /// without a valid pixel.
    pub spread: f32,
}

/// The measuring of regions, with its buffers.
#[derive(Debug)]
pub struct Measure {
    level: Level,
    depth: Depth,
    /// The bits of disparities whose depth is finite, for this f B.
    finite: (f32, Range<u32>),
    /// Bits of disparities, which are positive: they have the same order.
    sample: Vec<u32>,
    row: Vec<f32>,
}

impl Measure {
    /// The measuring with instructions of `level`, of depths within the limits of `depth`.
    pub fn new(level: Level, depth: Depth) -> Self {
        Self { level, depth, finite: (f32::NAN, 0..0), sample: Vec::new(), row: Vec::new() }
    }

    /// Fills box, mask and all measures of `region` from the pixels of `bounds`
    /// whose id is `id`. Label, track, contour and confidence are left alone.
    ///
    /// Area, mask and saliency are those of all pixels, disparity and depth those of
    /// every second row from 8192 pixels on, of every fourth from 16384 on.
    ///
    /// Depth is a falling function of disparity, so that the percentiles of the
    /// one are those of the other; they are taken of a sample of the pixels
    /// with finite depth.
    pub fn run(
        &mut self,
        id: u32,
        bounds: &PixelBox,
        candidates: &Candidates,
        source: &RegionSource<'_>,
        region: &mut Region,
    ) -> Evidence {
        let ids = &candidates.ids;
        (region.x, region.y) = (bounds.x0 as u32, bounds.y0 as u32);
        (region.width, region.height) = (bounds.width() as u32, bounds.height() as u32);

        let every = match (bounds.area / MOST_PIXELS).min(bounds.height() / LEAST_ROWS) {
            0 | 1 => 1,
            2 | 3 => 2,
            _ => 4,
        };
        // As many are left out above as below: else the position would be too high.
        let first = (bounds.height() - 1) % every / 2;
        self.collect(id, bounds, ids, source, (first, every));
        let [far, low, middle, high, near] =
            percentiles(&mut self.sample, [0.05, 0.16, 0.5, 0.84, 0.95]);
        let spread = (high - low) / 2.0;
        let scale = source.rig.depth_scale() as f32;
        [region.near_depth, region.median_depth, region.far_depth] =
            [near, middle, far].map(|d| scale / (d + EPSILON_PX));

        let known = |value: f32| if value.is_nan() { 0.0 } else { value };
        let centre = Centre {
            disparity: known(middle),
            depth: known(region.median_depth),
            u: (bounds.x0 + bounds.x1) as f32 / 2.0,
            v: (bounds.y0 + bounds.y1) as f32 / 2.0,
            tolerance: (INLIER_SIGMAS * spread).max(1.0),
            every,
            first,
            followed: candidates.followed_of(id) > 0,
            limits: self.depth,
        };
        region.mask.resize(bounds.width() * bounds.height(), 0);
        let mut out = Out { mask: &mut region.mask, row: &mut self.row };
        let sums = Sums::of(self.level, id, bounds, ids, source, &centre, &mut out);

        region.area = sums.area as u32;
        region.mean_saliency = (sums.saliency / sums.area) as f32;
        region.max_saliency = sums.max_saliency;
        region.valid_fraction = (sums.valid / sums.looked) as f32;
        // Without a single valid pixel the means are 0/0 = NaN, as they should be.
        let (mean, deviation) = mean_and_deviation(sums.disparity, sums.valid);
        region.mean_disparity = (f64::from(centre.disparity) + mean) as f32;
        region.disparity_stddev = deviation as f32;
        let (mean, deviation) = mean_and_deviation(sums.depth, sums.finite);
        region.mean_depth = (f64::from(centre.depth) + mean) as f32;
        region.depth_stddev = deviation as f32;
        locate(bounds, &centre, &sums, source.rig, region);
        Evidence {
            mean_confidence: if sums.asked > 0.0 {
                (sums.confidence / sums.asked) as f32
            } else {
                0.0
            },
            median_disparity: middle,
            spread,
        }
    }

    /// Disparities of pixels with finite depth: of all, or in large regions of
    /// every n-th in a row, another one in each of the rows that are looked at.
    fn collect(
        &mut self,
        id: u32,
        bounds: &PixelBox,
        ids: &Image<u32>,
        source: &RegionSource<'_>,
        (first, every): (usize, usize),
    ) {
        let step = (bounds.area / every).div_ceil(MOST_VALUES).max(1);
        self.sample.resize(bounds.height().div_ceil(every) * bounds.width().div_ceil(step), 0);
        let scale = source.rig.depth_scale() as f32;
        if self.finite.0 != scale {
            self.finite = (scale, self.depth.finite_bits(scale));
        }
        let Range { start, end } = self.finite.1;
        let (finite, mut n) = (end.saturating_sub(start), 0);
        for (row, y) in (bounds.y0 + first..bounds.y1).step_by(every).enumerate() {
            let (d, ids) = (source.disparity.row(y), ids.row(y));
            let from = bounds.x0 + row * SHIFT % step;
            for x in (from..bounds.x1).step_by(step) {
                // What does not count is written over: nobody can foresee what does.
                let bits = d[x].to_bits();
                self.sample[n] = bits;
                n += usize::from((ids[x] == id) & (bits.wrapping_sub(start) < finite));
            }
        }
        self.sample.truncate(n);
    }
}

/// Position with covariance, and extent.
///
/// The centroid is that of the pixels with finite depth whose disparity lies
/// within three robust standard deviations (at least 1 px) of the median; of a post
/// that was followed beyond them it is at the middle of its height. With
/// u, v the mean pixel and d the disparity of the mean depth, the covariance is
/// J diag(σu², σv², σd²) Jᵀ, where J = ∂(X, Y, Z)/∂(u, v, d) of
/// Z = fB/d, X = (u − cx) Z/fx, Y = (v − cy) Z/fy, and each σ² is a systematic
/// part plus the pixels' variance over the number of independent samples.
fn locate(bounds: &PixelBox, centre: &Centre, sums: &Sums, rig: &StereoRig, region: &mut Region) {
    region.position = [f64::NAN; 3];
    region.position_covariance = [f64::NAN; 9];
    region.extent = [f64::NAN; 3];
    region.velocity = [f64::NAN; 3];
    let n = sums.inliers;
    if n == 0.0 {
        return;
    }
    let lens = Lens::new(rig);
    // Rows that were not looked at shared the windows of those that were.
    let samples = (n * centre.every as f64 / PIXELS_PER_SAMPLE).max(1.0);
    let systematic = [BOUNDARY_PX, BOUNDARY_PX, SYSTEMATIC_PX];
    let variance: [f64; 3] = std::array::from_fn(|i| {
        let (_, deviation) = mean_and_deviation(sums.place[i], n);
        systematic[i].powi(2) + deviation.powi(2) / samples
    });
    let (u, v) = (f64::from(centre.u), f64::from(centre.v));
    let [z, uz, vz] = sums.weighted;
    // What was followed beyond what was matched stands upright: its middle is the box's.
    let middle = if centre.followed { v } else { v + vz / z };
    region.position = lens.point(u + uz / z, middle, z / n);
    let [[u1, _], [v1, _], _] = sums.place;
    region.position_covariance =
        lens.covariance(u + u1 / n, v + v1 / n, region.position[2], variance);

    let z = f64::from(region.median_depth);
    region.extent = [
        bounds.width() as f64 * z / lens.fx,
        bounds.height() as f64 * z / lens.fy,
        f64::from(region.far_depth - region.near_depth),
    ];
}

/// The pinhole of the rectified left camera.
struct Lens {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    depth_scale: f64,
}

impl Lens {
    fn new(rig: &StereoRig) -> Self {
        let (cx, cy) = rig.principal_point();
        Self { fx: rig.focal_px(), fy: rig.focal_y_px(), cx, cy, depth_scale: rig.depth_scale() }
    }

    fn point(&self, u: f64, v: f64, z: f64) -> [f64; 3] {
        [(u - self.cx) * z / self.fx, (v - self.cy) * z / self.fy, z]
    }

    /// J diag(variance) Jᵀ at pixel (u, v) and depth z; row-major.
    fn covariance(&self, u: f64, v: f64, z: f64, variance: [f64; 3]) -> [f64; 9] {
        // ∂Z/∂d = −fB/d² = −Z²/(fB), and X, Y are proportional to Z.
        let dz = -z * z / self.depth_scale;
        let (rx, ry) = ((u - self.cx) / self.fx, (v - self.cy) / self.fy);
        let jacobian = [[z / self.fx, 0.0, rx * dz], [0.0, z / self.fy, ry * dz], [0.0, 0.0, dz]];
        std::array::from_fn(|i| {
            let (row, column) = (jacobian[i / 3], jacobian[i % 3]);
            (0..3).map(|k| row[k] * variance[k] * column[k]).sum()
        })
    }
}

/// Mean and standard deviation (of the whole, not of a sample) from the sums of
/// `n` values and of their squares.
fn mean_and_deviation([sum, squares]: [f64; 2], n: f64) -> (f64, f64) {
    let mean = sum / n;
    let variance = squares / n - mean * mean;
    // `max` would turn NaN into 0.
    (mean, if variance < 0.0 { 0.0 } else { variance.sqrt() })
}

/// Ascending percentiles, each interpolated between its two neighbours; NaN
/// when there is no value. Values are given by their bits and are positive. Reorders
/// them, in linear time: the middle percentile parts them first, so that each of the
/// others is looked for among half of them or fewer.
fn percentiles<const N: usize>(values: &mut [u32], parts: [f32; N]) -> [f32; N] {
    let Some(last) = values.len().checked_sub(1) else { return [f32::NAN; N] };
    let ranks = parts.map(|part| part * last as f32);
    let places = ranks.map(|rank| (rank as usize).min(last));
    let middle = N / 2;
    // The values at a place and at the next one.
    let mut found = [[0; 2]; N];
    found[middle] = pair_at(values, places[middle], None);
    for i in (0..middle).rev() {
        let end = places[i + 1];
        found[i] = if places[i] == end {
            found[i + 1]
        } else {
            pair_at(&mut values[..end], places[i], Some(found[i + 1][0]))
        };
    }
    for i in middle + 1..N {
        let before = places[i - 1];
        found[i] = if places[i] == before {
            found[i - 1]
        } else {
            pair_at(&mut values[before + 1..], places[i] - before - 1, None)
        };
    }
    std::array::from_fn(|i| {
        let [low, high] = found[i].map(f32::from_bits);
        low + (high - low) * (ranks[i] - places[i] as f32)
    })
}

/// The value that comes to `place` when they are in order, and the one behind it: `next`
/// after the last one, or itself once more.
fn pair_at(values: &mut [u32], place: usize, next: Option<u32>) -> [u32; 2] {
    let (_, low, rest) = values.select_nth_unstable(place);
    [*low, rest.iter().copied().min().or(next).unwrap_or(*low)]
}
