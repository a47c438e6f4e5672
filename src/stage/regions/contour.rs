//! The outer boundary of a mask as a polygon.

/// Steps to the 8 neighbours, clockwise in image coordinates (y points down), from east.
const STEPS: [(isize, isize); 8] =
    [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
const WEST: usize = 4;

/// The boundary follower with its buffers.
#[derive(Debug, Default)]
pub struct Contour {
    boundary: Vec<[i32; 2]>,
    keep: Vec<bool>,
    stack: Vec<(usize, usize)>,
}

impl Contour {
    /// The outer boundary of `mask` (rows of `width` pixels, inside where not 0)
    /// through the centres of its boundary pixels, clockwise on the screen, in
    /// coordinates of the mask: border following (Moore; Suzuki and Abe 1985)
    /// over 8-connected pixels. Of a mask with several parts, the part of the
    /// first pixel in raster order. Empty for an empty mask.
    pub fn follow(&mut self, mask: &[u8], width: usize) -> &[[i32; 2]] {
        self.boundary.clear();
        let Some(first) = mask.iter().position(|&m| m != 0) else {
            return &self.boundary;
        };
        let height = mask.len() / width;
        let inside = |x: usize, y: usize| x < width && y < height && mask[y * width + x] != 0;
        let start = (first % width, first / width);
        let (mut x, mut y) = start;
        // Nothing precedes the first pixel in raster order, so its western
        // neighbour is outside; the search goes clockwise from there.
        let mut from = WEST;
        let mut first_step = None;
        loop {
            let found = (0..8).map(|k| (from + k) % 8).find(|&step| {
                let (dx, dy) = STEPS[step];
                inside(x.wrapping_add_signed(dx), y.wrapping_add_signed(dy))
            });
            let Some(step) = found else {
                self.boundary.push([x as i32, y as i32]);
                break;
            };
            // Round when the first step is about to be taken again (Jacob's
            // criterion: passing the first pixel alone is not enough).
            if (x, y) == start {
                match first_step {
                    None => first_step = Some(step),
                    Some(first_step) if first_step == step => break,
                    Some(_) => {}
                }
            }
            self.boundary.push([x as i32, y as i32]);
            x = x.wrapping_add_signed(STEPS[step].0);
            y = y.wrapping_add_signed(STEPS[step].1);
            // Go on from the last neighbour known to be outside.
            from = (step + if step.is_multiple_of(2) { 6 } else { 5 }) % 8;
        }
        &self.boundary
    }

    /// Follows the boundary, simplifies it by Douglas and Peucker (1973) so that
    /// no boundary pixel is farther than `tolerance_px` from the polygon, and
    /// writes it shifted by `origin`.
    pub fn run(
        &mut self,
        mask: &[u8],
        width: usize,
        origin: [u32; 2],
        tolerance_px: f32,
        out: &mut Vec<[f32; 2]>,
    ) {
        self.follow(mask, width);
        self.simplify(tolerance_px);
        out.clear();
        for (point, _) in self.boundary.iter().zip(&self.keep).filter(|(_, keep)| **keep) {
            out.push([point[0] as f32 + origin[0] as f32, point[1] as f32 + origin[1] as f32]);
        }
    }

    /// Marks the points to keep. A stack of its own takes the place of
    /// recursion: boundaries may have as many points as the image has pixels.
    fn simplify(&mut self, tolerance_px: f32) {
        let n = self.boundary.len();
        self.keep.clear();
        self.keep.resize(n, false);
        let Some(&start) = self.boundary.first() else { return };
        // A closed curve is cut at its first point and at the one farthest from it.
        let opposite = (0..n).max_by_key(|&i| {
            let (dx, dy) = (self.boundary[i][0] - start[0], self.boundary[i][1] - start[1]);
            (i64::from(dx).pow(2) + i64::from(dy).pow(2), std::cmp::Reverse(i))
        });
        let opposite = opposite.unwrap_or(0);
        self.keep[0] = true;
        self.keep[opposite] = true;
        let limit = f64::from(tolerance_px).powi(2);
        self.stack.clear();
        self.stack.extend([(0, opposite), (opposite, n)]);
        while let Some((from, to)) = self.stack.pop() {
            let (a, b) = (self.boundary[from], self.boundary[to % n]);
            let mut worst = (limit, None);
            for i in from + 1..to {
                let distance = squared_distance(self.boundary[i], a, b);
                if distance > worst.0 {
                    worst = (distance, Some(i));
                }
            }
            if let Some(i) = worst.1 {
                self.keep[i] = true;
                self.stack.extend([(from, i), (i, to)]);
            }
        }
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
