//! The measures of one region.

use super::RegionSource;
use super::components::PixelBox;
use crate::camera::StereoRig;
use crate::image::Image;
use crate::perception::Region;

/// Standard deviation of a region's disparity that more pixels do not reduce:
/// sub-pixel bias and calibration, in pixels.
const SYSTEMATIC_PX: f64 = 0.15;
/// Standard deviation of a region's image position that more pixels do not
/// reduce: where the boundary lies, in pixels.
const BOUNDARY_PX: f64 = 0.5;
/// Neighbouring pixels share their matching window: this many count as one.
const PIXELS_PER_SAMPLE: f64 = 25.0;
/// Values of which percentiles are taken.
const MOST_VALUES: usize = 4096;
/// Robust standard deviations within which a disparity counts for the centroid.
const INLIER_SIGMAS: f32 = 3.0;

/// What decides whether a candidate is a region, beside the region's own fields.
#[derive(Clone, Copy, Debug)]
pub struct Evidence {
    /// Mean confidence of the valid pixels; 0 when there is none.
    pub mean_confidence: f32,
    /// Median disparity in pixels; NaN without a valid pixel.
    pub median_disparity: f32,
    /// Half the distance between the 16th and the 84th percentile of disparity
    /// in pixels (one standard deviation of a normal distribution); NaN
    /// without a valid pixel.
    pub spread: f32,
}

/// The measuring of regions, with its buffers.
#[derive(Debug, Default)]
pub struct Measure {
    disparities: Vec<f32>,
    depths: Vec<f32>,
}

impl Measure {
    /// Fills box, mask and all measures of `region` from the pixels of `bounds`
    /// whose id is `id`. Label, track, contour and confidence are left alone.
    pub fn run(
        &mut self,
        id: u32,
        bounds: &PixelBox,
        ids: &Image<u32>,
        source: &RegionSource<'_>,
        region: &mut Region,
    ) -> Evidence {
        (region.x, region.y) = (bounds.x0 as u32, bounds.y0 as u32);
        (region.width, region.height) = (bounds.width() as u32, bounds.height() as u32);
        region.mask.clear();
        self.disparities.clear();
        self.depths.clear();

        let (mut area, mut saliency, mut max_saliency) = (0_u32, 0.0_f64, 0.0_f32);
        let (mut confidence, mut disparity, mut disparity_squares) = (0.0_f64, 0.0_f64, 0.0_f64);
        let (mut depth, mut depth_squares) = (0.0_f64, 0.0_f64);
        for y in bounds.y0..bounds.y1 {
            let columns = bounds.x0..bounds.x1;
            let ids = &ids.row(y)[columns.clone()];
            region.mask.extend(ids.iter().map(|&at| if at == id { 255 } else { 0 }));
            let seen = source.saliency.row(y)[columns.clone()]
                .iter()
                .zip(&source.confidence.row(y)[columns.clone()]);
            let found = source.disparity.row(y)[columns.clone()]
                .iter()
                .zip(&source.depth.row(y)[columns.clone()]);
            for (&at, ((&s, &c), (&d, &z))) in ids.iter().zip(seen.zip(found)) {
                if at != id {
                    continue;
                }
                area += 1;
                saliency += f64::from(s);
                max_saliency = max_saliency.max(s);
                if !d.is_nan() {
                    let d_wide = f64::from(d);
                    confidence += f64::from(c);
                    disparity += d_wide;
                    disparity_squares += d_wide * d_wide;
                    self.disparities.push(d);
                }
                if z.is_finite() {
                    let z_wide = f64::from(z);
                    depth += z_wide;
                    depth_squares += z_wide * z_wide;
                    self.depths.push(z);
                }
            }
        }

        let valid = self.disparities.len() as f64;
        region.area = area;
        region.mean_saliency = (saliency / f64::from(area)) as f32;
        region.max_saliency = max_saliency;
        region.valid_fraction = (valid / f64::from(area)) as f32;
        // Without a single valid pixel the means are 0/0 = NaN, as they should be.
        let (mean, deviation) = mean_and_deviation(disparity, disparity_squares, valid);
        (region.mean_disparity, region.disparity_stddev) = (mean as f32, deviation as f32);
        let (mean, deviation) = mean_and_deviation(depth, depth_squares, self.depths.len() as f64);
        (region.mean_depth, region.depth_stddev) = (mean as f32, deviation as f32);

        thin(&mut self.depths);
        thin(&mut self.disparities);
        let [near, median, far] = percentiles(&mut self.depths, [0.05, 0.5, 0.95]);
        (region.near_depth, region.median_depth, region.far_depth) = (near, median, far);
        let [low, middle, high] = percentiles(&mut self.disparities, [0.16, 0.5, 0.84]);
        let spread = (high - low) / 2.0;
        locate(bounds, id, ids, source, middle, spread, region);
        Evidence {
            mean_confidence: if valid > 0.0 { (confidence / valid) as f32 } else { 0.0 },
            median_disparity: middle,
            spread,
        }
    }
}

/// Position with covariance, and extent.
///
/// The centroid is that of the pixels with finite depth whose disparity lies
/// within three robust standard deviations (at least 1 px) of the median. With
/// u, v the mean pixel and d the disparity of the mean depth, the covariance is
/// J diag(σu², σv², σd²) Jᵀ, where J = ∂(X, Y, Z)/∂(u, v, d) of
/// Z = fB/d, X = (u − cx) Z/fx, Y = (v − cy) Z/fy, and each σ² is a systematic
/// part plus the pixels' variance over the number of independent samples.
fn locate(
    bounds: &PixelBox,
    id: u32,
    ids: &Image<u32>,
    source: &RegionSource<'_>,
    median: f32,
    spread: f32,
    region: &mut Region,
) {
    region.position = [f64::NAN; 3];
    region.position_covariance = [f64::NAN; 9];
    region.extent = [f64::NAN; 3];
    region.velocity = [f64::NAN; 3];
    let tolerance = (INLIER_SIGMAS * spread).max(1.0);
    let lens = Lens::new(source.rig);

    let mut n = 0.0_f64;
    // Sums of u, v, d, of their squares, and of Z, uZ and vZ.
    let (mut sum, mut squares) = ([0.0_f64; 3], [0.0_f64; 3]);
    let (mut z_sum, mut uz_sum, mut vz_sum) = (0.0_f64, 0.0_f64, 0.0_f64);
    for y in bounds.y0..bounds.y1 {
        let columns = bounds.x0..bounds.x1;
        let row = ids.row(y)[columns.clone()]
            .iter()
            .zip(&source.disparity.row(y)[columns.clone()])
            .zip(&source.depth.row(y)[columns.clone()]);
        let (mut row_n, mut row_z, v) = (0.0_f64, 0.0_f64, y as f64);
        for (x, ((&at, &d), &z)) in columns.zip(row) {
            if at != id || !z.is_finite() || (d - median).abs() > tolerance {
                continue;
            }
            let (u, d, z) = (x as f64, f64::from(d), f64::from(z));
            row_n += 1.0;
            row_z += z;
            uz_sum += u * z;
            sum[0] += u;
            sum[2] += d;
            squares[0] += u * u;
            squares[2] += d * d;
        }
        n += row_n;
        z_sum += row_z;
        vz_sum += v * row_z;
        sum[1] += v * row_n;
        squares[1] += v * v * row_n;
    }
    if n == 0.0 {
        return;
    }
    let samples = (n / PIXELS_PER_SAMPLE).max(1.0);
    let systematic = [BOUNDARY_PX, BOUNDARY_PX, SYSTEMATIC_PX];
    let variance: [f64; 3] = std::array::from_fn(|i| {
        let spread = (squares[i] / n - (sum[i] / n).powi(2)).max(0.0);
        systematic[i].powi(2) + spread / samples
    });
    region.position = lens.point(uz_sum / z_sum, vz_sum / z_sum, z_sum / n);
    region.position_covariance =
        lens.covariance(sum[0] / n, sum[1] / n, region.position[2], variance);

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

/// Mean and standard deviation (of the whole, not of a sample) from sums.
fn mean_and_deviation(sum: f64, squares: f64, n: f64) -> (f64, f64) {
    let mean = sum / n;
    let variance = squares / n - mean * mean;
    // `max` would turn NaN into 0.
    (mean, if variance < 0.0 { 0.0 } else { variance.sqrt() })
}

/// Keeps every n-th value of many: percentiles need no more.
fn thin(values: &mut Vec<f32>) {
    let step = values.len().div_ceil(MOST_VALUES).max(1);
    for (to, from) in (0..values.len()).step_by(step).enumerate() {
        values[to] = values[from];
    }
    values.truncate(values.len().div_ceil(step));
}

/// Three ascending percentiles, each interpolated between its two neighbours;
/// NaN when there is no value. Reorders the values, in linear time.
fn percentiles(values: &mut [f32], parts: [f32; 3]) -> [f32; 3] {
    let mut from = 0;
    parts.map(|part| {
        if values.is_empty() {
            return f32::NAN;
        }
        let rank = part * (values.len() - 1) as f32;
        let index = (rank as usize).min(values.len() - 1).max(from);
        // What lies before `from` is already no larger than the rest.
        let (_, low, rest) = values[from..].select_nth_unstable_by(index - from, f32::total_cmp);
        let low = *low;
        let high = rest.iter().copied().reduce(f32::min).unwrap_or(low);
        from = index;
        low + (high - low) * (rank - index as f32)
    })
}
