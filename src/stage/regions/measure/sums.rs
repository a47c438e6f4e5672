//! Sums over the pixels of one region, sixteen at a time.

use crate::image::Image;
use crate::simd::{Level, Simd, dispatch, f32x16, mask8x16, padded, prelude::*, u8x16, u32x16};
use crate::stage::coarse::CELL;
use crate::stage::depth::Depth;
use crate::stage::regions::RegionSource;
use crate::stage::regions::candidates::PixelBox;
use crate::stage::saliency::upsample::Rows;

/// Pixels that are added at once, whatever the level: the order of the
/// additions, and so the last bit of a sum, is the same everywhere.
const LANES: usize = 16;
/// Rows whose sums are kept in single precision.
const ROWS: usize = 32;
/// One in so many rows is asked for its confidence, in a region that is at least
/// eight times as high.
const ASKED: usize = 4;

const _: () = assert!(ROWS.is_multiple_of(ASKED));

/// Where things are about: sums of differences from here keep their precision
/// in few bits.
#[derive(Clone, Copy, Debug)]
pub struct Centre {
    /// Disparity in pixels.
    pub disparity: f32,
    /// Depth in metres.
    pub depth: f32,
    /// Column.
    pub u: f32,
    /// Row.
    pub v: f32,
    /// Largest difference from `disparity` of a pixel that counts for the position.
    pub tolerance: f32,
    /// Of all measures of disparity one in so many rows is looked at, a divisor of
    /// 32, and the first of them.
    pub every: usize,
    pub first: usize,
    /// Whether the upper part was not matched but followed in the image.
    pub followed: bool,
    /// What depths are finite.
    pub limits: Depth,
}

/// Sums over the pixels of a region; d, z, u and v are differences from the [`Centre`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    /// Number of pixels; of those in the rows that were looked at, and of them of
    /// those with disparity, with finite depth, and of those that count for the position.
    pub area: f64,
    pub looked: f64,
    pub valid: f64,
    pub finite: f64,
    pub inliers: f64,
    /// Over all pixels.
    pub saliency: f64,
    pub max_saliency: f32,
    /// Over those with disparity in the rows that are asked, and their number.
    pub confidence: f64,
    pub asked: f64,
    /// Over those with disparity.
    pub disparity: [f64; 2],
    /// Over those with finite depth: z and z².
    pub depth: [f64; 2],
    /// Over those that count for the position: (u, u²), (v, v²), (d, d²).
    pub place: [[f64; 2]; 3],
    /// Over the same: Z, u Z, v Z, with the depth Z itself.
    pub weighted: [f64; 3],
}

/// What is written beside the sums.
pub struct Out<'a> {
    /// The mask.
    pub mask: &'a mut [u8],
    /// A buffer: one row of saliency.
    pub row: &'a mut Vec<f32>,
}

impl Sums {
    /// Of the pixels in `bounds` whose id is `id`; their mask of `bounds` (255
    /// inside, else 0) is written to the mask of `out`, row by row.
    pub fn of(
        level: Level,
        id: u32,
        bounds: &PixelBox,
        ids: &Image<u32>,
        source: &RegionSource<'_>,
        centre: &Centre,
        out: &mut Out<'_>,
    ) -> Self {
        let mut sums = Self::default();
        let asked = (bounds.height() / (ROWS / ASKED)).clamp(1, ASKED);
        for upper in (bounds.y0..bounds.y1).step_by(ROWS) {
            let rows = PixelBox { y0: upper, y1: (upper + ROWS).min(bounds.y1), ..*bounds };
            let at = (upper - bounds.y0) * bounds.width();
            let mask = &mut out.mask[at..at + rows.height() * rows.width()];
            dispatch!(level, simd => {
                sums.add_mask(simd, id, &rows, ids, source.attention, (mask, out.row));
                sums.add_confidence(simd, id, &rows, ids, source, asked);
                sums.add(simd, id, &rows, ids, source, centre);
            });
        }
        sums
    }

    /// Writes the mask and adds up what [`upsample`](crate::stage::saliency::upsample()) makes
    /// of the attention per cell: those are few and at hand, the pixels were
    /// written long ago.
    #[inline(always)]
    fn add_mask<S: Simd>(
        &mut self,
        simd: S,
        id: u32,
        rows: &PixelBox,
        ids: &Image<u32>,
        attention: &Image<f32>,
        (mask, row): (&mut [u8], &mut Vec<f32>),
    ) {
        let zero = f32x16::splat(simd, 0.0);
        let own = u32x16::splat(simd, id);
        let (set, unset) = (u8x16::splat(simd, 255), u8x16::splat(simd, 0));
        let [mut sum, mut most] = [zero; 2];
        let mut area = 0;
        let cells = rows.x0 / CELL..rows.x1.div_ceil(CELL);
        row.resize(attention.width() * CELL, 0.0);
        for (y, mask) in (rows.y0..rows.y1).zip(mask.chunks_exact_mut(rows.width())) {
            let ids = ids.row(y);
            Rows::at(attention, y).spread(simd, cells.clone(), row);
            for (x, mask) in (rows.x0..).step_by(LANES).zip(mask.chunks_mut(LANES)) {
                // Beyond the box there is no pixel of this id.
                let at: u32x16<S> = padded(simd, ids, x, 0);
                let inside = at.simd_eq(own);
                let bits = inside.to_bitmask();
                area += bits.count_ones();
                if let Some(mask) = mask.first_chunk_mut::<LANES>() {
                    mask8x16::from_bitmask(simd, bits).select(set, unset).store_array(mask);
                } else {
                    for (i, mask) in mask.iter_mut().enumerate() {
                        *mask = if bits >> i & 1 == 1 { 255 } else { 0 };
                    }
                }
                let s = inside.select(padded(simd, row, x, 0.0), zero);
                sum += s;
                most = most.max(s);
            }
        }
        self.area += f64::from(area);
        self.saliency += total(sum);
        for value in most.as_slice() {
            self.max_saliency = self.max_saliency.max(*value);
        }
    }

    /// Of some rows: it is only asked whether the mean is very low.
    #[inline(always)]
    fn add_confidence<S: Simd>(
        &mut self,
        simd: S,
        id: u32,
        rows: &PixelBox,
        ids: &Image<u32>,
        source: &RegionSource<'_>,
        every: usize,
    ) {
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let own = u32x16::splat(simd, id);
        let [mut sum, mut asked] = [zero; 2];
        for y in (rows.y0..rows.y1).step_by(every) {
            let (ids, d) = (ids.row(y), source.disparity.row(y));
            let confidence = source.confidence.row(y);
            for x in (rows.x0..rows.x1).step_by(LANES) {
                let at: u32x16<S> = padded(simd, ids, x, 0);
                let inside = at.simd_eq(own);
                if !inside.any_true() {
                    continue;
                }
                let d: f32x16<S> = padded(simd, d, x, 0.0);
                let known = inside & d.simd_eq(d);
                sum += known.select(padded(simd, confidence, x, 0.0), zero);
                asked += known.select(one, zero);
            }
        }
        self.confidence += total(sum);
        self.asked += total(asked);
    }

    /// Of one in so many rows.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        id: u32,
        rows: &PixelBox,
        ids: &Image<u32>,
        source: &RegionSource<'_>,
        centre: &Centre,
    ) {
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let most = f32x16::splat(simd, f32::MAX);
        let own = u32x16::splat(simd, id);
        let [mut looked, mut valid, mut finite, mut inliers] = [zero; 4];
        let [mut d1, mut d2, mut z1, mut z2] = [zero; 4];
        let [mut u1, mut u2, mut v1, mut v2, mut e1, mut e2] = [zero; 6];
        let [mut w, mut uw, mut vw] = [zero; 3];
        let lane = f32x16::from_fn(simd, |i| i as f32);
        let depth_scale = source.rig.depth_scale() as f32;
        for y in (rows.y0 + centre.first..rows.y1).step_by(centre.every) {
            let v = f32x16::splat(simd, y as f32 - centre.v);
            let (d_row, id_row) = (source.disparity.row(y), ids.row(y));
            for x in (rows.x0..rows.x1).step_by(LANES) {
                let at: u32x16<S> = padded(simd, id_row, x, 0);
                let inside = at.simd_eq(own);
                if inside.to_bitmask() == 0 {
                    continue;
                }
                let d: f32x16<S> = padded(simd, d_row, x, 0.0);
                let z = centre.limits.of_lanes(simd, d, depth_scale);
                looked += inside.select(one, zero);

                let known = inside & d.simd_eq(d);
                let d = known.select(d - centre.disparity, zero);
                valid += known.select(one, zero);
                d1 += d;
                d2 += d * d;

                let near = inside & z.abs().simd_le(most);
                let dz = near.select(z - centre.depth, zero);
                finite += near.select(one, zero);
                z1 += dz;
                z2 += dz * dz;

                let counts = near & d.abs().simd_le(f32x16::splat(simd, centre.tolerance));
                let z = counts.select(z, zero);
                let n = counts.select(one, zero);
                let u = n * (lane + (x as f32 - centre.u));
                let d = n * d;
                inliers += n;
                u1 += u;
                u2 += u * u;
                v1 += n * v;
                v2 += n * v * v;
                e1 += d;
                e2 += d * d;
                w += z;
                uw += u * z;
                vw += v * z;
            }
        }
        self.looked += total(looked);
        self.valid += total(valid);
        self.finite += total(finite);
        self.inliers += total(inliers);
        add(&mut self.disparity, [d1, d2]);
        add(&mut self.depth, [z1, z2]);
        add(&mut self.place[0], [u1, u2]);
        add(&mut self.place[1], [v1, v2]);
        add(&mut self.place[2], [e1, e2]);
        add(&mut self.weighted, [w, uw, vw]);
    }
}

#[inline(always)]
fn total<S: Simd>(lanes: f32x16<S>) -> f64 {
    lanes.as_slice().iter().map(|v| f64::from(*v)).sum()
}

#[inline(always)]
fn add<S: Simd, const N: usize>(sums: &mut [f64; N], lanes: [f32x16<S>; N]) {
    for (sum, lanes) in sums.iter_mut().zip(lanes) {
        *sum += total(lanes);
    }
}
