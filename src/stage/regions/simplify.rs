//! Polygons with fewer points.

use std::cmp::Ordering;

use crate::simd::{Level, Simd, dispatch, i32x16, mask32x16, prelude::*};

/// Points whose distances are reckoned side by side.
const LANES: usize = 16;

/// The simplification with its buffers. A stack of its own takes the place of
/// recursion: boundaries may have as many points as the image has pixels.
#[derive(Debug)]
pub struct Simplify {
    level: Level,
    points: Points,
    keep: Vec<bool>,
    stack: Vec<(usize, usize)>,
}

impl Simplify {
    /// The simplification with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self { level, points: Points::default(), keep: Vec::new(), stack: Vec::new() }
    }

    /// Which points of a closed polygon to keep so that no other one is farther
    /// than `tolerance_px` from the new outline (Ramer 1972, Douglas and Peucker
    /// 1973).
    pub fn run(&mut self, points: &[[i32; 2]], tolerance_px: f32) -> &[bool] {
        let n = points.len();
        self.keep.clear();
        self.keep.resize(n, false);
        if n == 0 {
            return &self.keep;
        }
        self.points.take(points);
        let Self { level, points, keep, stack } = self;
        dispatch!(*level, simd => {
            // A closed curve is cut at its first point and at the one farthest from it.
            let opposite = points.farthest(simd, 0, n, 0, 0.0).unwrap_or(0);
            keep[0] = true;
            keep[opposite] = true;
            let limit = f64::from(tolerance_px).powi(2);
            stack.clear();
            stack.extend([(0, opposite), (opposite, n)]);
            while let Some((from, to)) = stack.pop() {
                if let Some(i) = points.farthest(simd, from, to, to % n, limit) {
                    keep[i] = true;
                    stack.extend([(from, i), (i, to)]);
                }
            }
        });
        // Two points enclose nothing: a mask as thin as a line keeps a third.
        if n > 2
            && self.keep.iter().filter(|keep| **keep).count() == 2
            && let Some(third) = self.keep.iter_mut().find(|keep| !**keep)
        {
            *third = true;
        }
        &self.keep
    }
}

/// Columns and rows of points, and room for a whole group behind the last one.
#[derive(Debug, Default)]
struct Points {
    x: Vec<i32>,
    y: Vec<i32>,
}

impl Points {
    fn take(&mut self, points: &[[i32; 2]]) {
        for (axis, out) in [&mut self.x, &mut self.y].into_iter().enumerate() {
            out.clear();
            out.extend(points.iter().map(|point| point[axis]));
            out.resize(points.len() + LANES, 0);
        }
    }

    /// The first of those between `from` and `to` that are farthest from the segment from
    /// point `from` to point `end`, if that is farther than the root of `limit`, in square
    /// pixels.
    ///
    /// All is whole numbers, exact for images with a diagonal of up to 32767 pixels: none is
    /// larger than [`crate::ros::convert::MAX_SIDE`] allows.
    #[inline(always)]
    fn farthest<S: Simd>(
        &self,
        simd: S,
        from: usize,
        to: usize,
        end: usize,
        limit: f64,
    ) -> Option<usize> {
        let (x0, y0) = (self.x[from], self.y[from]);
        let (bx, by) = (self.x[end] - x0, self.y[end] - y0);
        let length = bx * bx + by * by;
        let zero = i32x16::splat(simd, 0);
        let mut at = i32x16::from_fn(simd, |i| (from + 1 + i) as i32);
        // The points beside the segment by the area of the triangle with it, doubled, and
        // those beyond its ends by the square of the distance from there.
        let [mut beside, mut beyond] = [Farthest { most: zero, at }; 2];
        for start in (from + 1..to).step_by(LANES) {
            let x = i32x16::from_slice(simd, &self.x[start..start + LANES]) - x0;
            let y = i32x16::from_slice(simd, &self.y[start..start + LANES]) - y0;
            let (along, across) = (x * bx + y * by, x * by - y * bx);
            let before = x * x + y * y;
            let behind = before - along - along + length;
            let inside = at.simd_lt(to as i32);
            let is_beside = along.simd_gt(0) & along.simd_lt(length);
            let ends = along.simd_le(0).select(before, behind);
            beside.take(inside & is_beside, across.max(zero - across), at);
            beyond.take(inside & !is_beside, ends, at);
            at += LANES as i32;
        }
        // Distances are multiplied by the segment's length, or 1 where it has none, so that
        // nothing is divided.
        let scale = i64::from(length.max(1));
        let ((area, first), (square, second)) = (beside.of_all(), beyond.of_all());
        let (beside, beyond) = (area * area, square * scale);
        let (most, farthest) = match beside.cmp(&beyond) {
            Ordering::Greater => (beside, first),
            Ordering::Less => (beyond, second),
            Ordering::Equal => (beside, first.min(second)),
        };
        (most as f64 > limit * scale as f64).then_some(farthest as usize)
    }
}

/// The largest values so far in each lane, which are not negative, and where they were first.
#[derive(Clone, Copy)]
struct Farthest<S: Simd> {
    most: i32x16<S>,
    at: i32x16<S>,
}

impl<S: Simd> Farthest<S> {
    #[inline(always)]
    fn take(&mut self, which: mask32x16<S>, values: i32x16<S>, at: i32x16<S>) {
        let larger = which & values.simd_gt(self.most);
        self.most = larger.select(values, self.most);
        self.at = larger.select(at, self.at);
    }

    /// The largest value of all lanes, and where it was first.
    #[inline(always)]
    fn of_all(&self) -> (i64, i32) {
        let most = self.most.reduce_max();
        let last = i32x16::splat(self.most.simd, i32::MAX);
        let at = self.most.simd_eq(most).select(self.at, last).reduce_min();
        (i64::from(most), at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd;

    /// Squared distance of a point from a segment, times the segment's squared length
    /// (or 1).
    fn distance(point: [i32; 2], from: [i32; 2], to: [i32; 2]) -> i64 {
        let part = |a: [i32; 2], b: [i32; 2]| [0, 1].map(|i| i64::from(a[i] - b[i]));
        let dot = |a: [i64; 2], b: [i64; 2]| a[0] * b[0] + a[1] * b[1];
        let (p, along) = (part(point, from), part(to, from));
        let scale = dot(along, along).max(1);
        let q = part(point, to);
        match dot(p, along) {
            ..=0 => dot(p, p) * scale,
            at if at >= scale => dot(q, q) * scale,
            _ => (p[0] * along[1] - p[1] * along[0]).pow(2),
        }
    }

    fn part(points: &[[i32; 2]], from: usize, to: usize, limit: i64, keep: &mut [bool]) {
        let (a, b) = (points[from], points[to % points.len()]);
        let farthest = (from + 1..to)
            .map(|i| (distance(points[i], a, b), std::cmp::Reverse(i)))
            .max()
            .map(|(distance, at)| (distance, at.0));
        let [x, y] = [0, 1].map(|i| i64::from(b[i] - a[i]));
        if let Some((distance, i)) = farthest.filter(|f| f.0 > limit * (x * x + y * y).max(1)) {
            assert!(distance > 0);
            keep[i] = true;
            part(points, from, i, limit, keep);
            part(points, i, to, limit, keep);
        }
    }

    #[test]
    fn long_outlines_are_simplified_alike_at_every_level() {
        for n in [1, 2, 3, 15, 16, 17, 18, 40, 500, 9001] {
            // A curve with waves, bends back and corners.
            let points: Vec<[i32; 2]> = (0..n)
                .map(|i| {
                    let t = i as f64 / n as f64 * std::f64::consts::TAU;
                    let radius = 600.0 + 90.0 * (7.0 * t).sin() + 25.0 * (61.0 * t).cos();
                    let bend = t + 0.2 * (31.0 * t).sin();
                    [bend.cos(), bend.sin()].map(|unit| (700.0 + radius * unit).round() as i32)
                })
                .collect();
            for tolerance in [0, 1, 3, 40] {
                let mut keep = vec![false; n];
                let start = points[0];
                let far = |i: &usize| (distance(points[*i], start, start), std::cmp::Reverse(*i));
                let opposite = (0..n).max_by_key(far).unwrap_or(0);
                (keep[0], keep[opposite]) = (true, true);
                let limit = i64::from(tolerance * tolerance);
                part(&points, 0, opposite, limit, &mut keep);
                part(&points, opposite, n, limit, &mut keep);
                if n > 2 && keep.iter().filter(|keep| **keep).count() == 2 {
                    *keep.iter_mut().find(|keep| !**keep).unwrap() = true;
                }
                for level in simd::available() {
                    let mut simplify = Simplify::new(level);
                    let found = simplify.run(&points, tolerance as f32);
                    assert_eq!(found, keep, "{n} points, {tolerance} px, {level:?}");
                }
            }
        }
    }
}
