//! Polygons with fewer points.

/// The simplification with its buffers. A stack of its own takes the place of
/// recursion: boundaries may have as many points as the image has pixels.
#[derive(Debug, Default)]
pub struct Simplify {
    keep: Vec<bool>,
    stack: Vec<(usize, usize)>,
}

impl Simplify {
    /// Which points of a closed polygon to keep so that no other one is farther
    /// than `tolerance_px` from the new outline (Ramer 1972, Douglas and Peucker
    /// 1973).
    pub fn run(&mut self, points: &[[i32; 2]], tolerance_px: f32) -> &[bool] {
        let n = points.len();
        self.keep.clear();
        self.keep.resize(n, false);
        let Some(&start) = points.first() else { return &self.keep };
        // A closed curve is cut at its first point and at the one farthest from it.
        let opposite = (0..n).max_by_key(|&i| {
            let (dx, dy) = (points[i][0] - start[0], points[i][1] - start[1]);
            (i64::from(dx).pow(2) + i64::from(dy).pow(2), std::cmp::Reverse(i))
        });
        let opposite = opposite.unwrap_or(0);
        self.keep[0] = true;
        self.keep[opposite] = true;
        let limit = f64::from(tolerance_px).powi(2);
        self.stack.clear();
        self.stack.extend([(0, opposite), (opposite, n)]);
        while let Some((from, to)) = self.stack.pop() {
            let line = Line::new(points[from], points[to % n]);
            let mut worst = (0, from);
            for (i, &point) in (from + 1..).zip(points.get(from + 1..to).unwrap_or_default()) {
                let distance = line.scaled_distance(point);
                if distance > worst.0 {
                    worst = (distance, i);
                }
            }
            if worst.0 as f64 > limit * line.scale as f64 {
                let i = worst.1;
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

/// A segment between two points.
struct Line {
    from: [i64; 2],
    along: [i64; 2],
    /// Its squared length, or 1 where it has none.
    scale: i64,
}

impl Line {
    fn new(from: [i32; 2], to: [i32; 2]) -> Self {
        let (from, to) = (from.map(i64::from), to.map(i64::from));
        let [x, y] = [to[0] - from[0], to[1] - from[1]];
        Self { from, along: [x, y], scale: (x * x + y * y).max(1) }
    }

    /// Squared distance of a point from the segment, square pixels, times the
    /// scale: whole numbers, so that nothing is divided.
    fn scaled_distance(&self, point: [i32; 2]) -> i64 {
        let [x, y] = [i64::from(point[0]) - self.from[0], i64::from(point[1]) - self.from[1]];
        let [bx, by] = self.along;
        let along = x * bx + y * by;
        if along <= 0 {
            (x * x + y * y).saturating_mul(self.scale)
        } else if along >= self.scale {
            ((x - bx).pow(2) + (y - by).pow(2)).saturating_mul(self.scale)
        } else {
            (x * by - y * bx).saturating_pow(2)
        }
    }
}
