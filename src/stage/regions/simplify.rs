//! Polygons with fewer points.

use crate::simd::{Level, dispatch};

/// Points whose distances are reckoned side by side.
const LANES: usize = 16;

/// The simplification with its buffers. A stack of its own takes the place of
/// recursion: boundaries may have as many points as the image has pixels.
#[derive(Debug)]
pub struct Simplify {
    level: Level,
    keep: Vec<bool>,
    stack: Vec<(usize, usize)>,
}

impl Simplify {
    /// The simplification with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self { level, keep: Vec::new(), stack: Vec::new() }
    }

    /// Which points of a closed polygon to keep so that no other one is farther
    /// than `tolerance_px` from the new outline (Ramer 1972, Douglas and Peucker
    /// 1973).
    pub fn run(&mut self, points: &[[i32; 2]], tolerance_px: f32) -> &[bool] {
        let n = points.len();
        self.keep.clear();
        self.keep.resize(n, false);
        let Some(&start) = points.first() else { return &self.keep };
        // A closed curve is cut at its first point and at the one farthest from it.
        let (_, opposite) = Line::new(start, start).farthest(self.level, points);
        self.keep[0] = true;
        self.keep[opposite] = true;
        let limit = f64::from(tolerance_px).powi(2);
        self.stack.clear();
        self.stack.extend([(0, opposite), (opposite, n)]);
        while let Some((from, to)) = self.stack.pop() {
            let line = Line::new(points[from], points[to % n]);
            let between = points.get(from + 1..to).unwrap_or_default();
            let (distance, at) = line.farthest(self.level, between);
            if distance > limit * line.scale {
                let i = from + 1 + at;
                self.keep[i] = true;
                self.stack.extend([(from, i), (i, to)]);
            }
        }
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

/// A segment between two points. Whole numbers, in a form that vectors multiply:
/// exact for images with a diagonal of up to 9700 pixels.
struct Line {
    from: [f64; 2],
    along: [f64; 2],
    /// Its squared length, or 1 where it has none.
    scale: f64,
}

impl Line {
    fn new(from: [i32; 2], to: [i32; 2]) -> Self {
        let (from, to) = (from.map(f64::from), to.map(f64::from));
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        Self { from, along: [x, y], scale: (x * x + y * y).max(1.0) }
    }

    /// The largest squared distance of `points` from the segment, square pixels,
    /// times the scale, and the first of them that has it; (0, 0) without any.
    fn farthest(&self, level: Level, points: &[[i32; 2]]) -> (f64, usize) {
        dispatch!(level, _simd => self.farthest_of(points))
    }

    #[inline(always)]
    fn farthest_of(&self, points: &[[i32; 2]]) -> (f64, usize) {
        let mut worst = (0.0, 0);
        let (groups, rest) = points.as_chunks::<LANES>();
        for (group, points) in groups.iter().enumerate() {
            let mut distances = [0.0; LANES];
            for i in 0..LANES {
                distances[i] = self.scaled_distance(points[i]);
            }
            let mut farther = false;
            for distance in distances {
                farther |= distance > worst.0;
            }
            if farther {
                take_farthest(&distances, group * LANES, &mut worst);
            }
        }
        for (i, point) in (groups.len() * LANES..).zip(rest) {
            take_farthest(&[self.scaled_distance(*point)], i, &mut worst);
        }
        worst
    }

    /// Squared distance of a point from the segment, square pixels, times the
    /// scale, so that nothing is divided.
    #[inline(always)]
    fn scaled_distance(&self, point: [i32; 2]) -> f64 {
        let [x, y] = [f64::from(point[0]) - self.from[0], f64::from(point[1]) - self.from[1]];
        let [bx, by] = self.along;
        let along = x * bx + y * by;
        let before = (x * x + y * y) * self.scale;
        let behind = ((x - bx) * (x - bx) + (y - by) * (y - by)) * self.scale;
        let beside = (x * by - y * bx) * (x * by - y * bx);
        let end = if along <= 0.0 { before } else { behind };
        if along > 0.0 && along < self.scale { beside } else { end }
    }
}

/// Puts the first of the largest `distances`, whose points begin at `first`, in
/// the place of a smaller one.
#[inline(always)]
fn take_farthest(distances: &[f64], first: usize, worst: &mut (f64, usize)) {
    for (i, &distance) in (first..).zip(distances) {
        if distance > worst.0 {
            *worst = (distance, i);
        }
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
