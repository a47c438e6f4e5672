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
            let (a, b) = (points[from], points[to % n]);
            let mut worst = (limit, None);
            for (i, &point) in points.iter().enumerate().take(to).skip(from + 1) {
                let distance = squared_distance(point, a, b);
                if distance > worst.0 {
                    worst = (distance, Some(i));
                }
            }
            if let Some(i) = worst.1 {
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

/// Squared distance of a point from a segment, square pixels.
fn squared_distance(p: [i32; 2], a: [i32; 2], b: [i32; 2]) -> f64 {
    let (px, py) = (f64::from(p[0] - a[0]), f64::from(p[1] - a[1]));
    let (bx, by) = (f64::from(b[0] - a[0]), f64::from(b[1] - a[1]));
    let length = bx * bx + by * by;
    let along = px * bx + py * by;
    if along <= 0.0 || length == 0.0 {
        return px * px + py * py;
    }
    if along >= length {
        return (px - bx).powi(2) + (py - by).powi(2);
    }
    (px * by - py * bx).powi(2) / length
}
