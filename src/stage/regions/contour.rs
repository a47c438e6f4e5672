//! The outer boundary of a mask as a polygon.

use super::simplify::Simplify;

/// Steps to the 8 neighbours, clockwise in image coordinates (y points down), from east.
const STEPS: [(isize, isize); 8] =
    [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
const WEST: usize = 4;

/// The boundary follower with its buffers.
#[derive(Debug, Default)]
pub struct Contour {
    boundary: Vec<[i32; 2]>,
    part: Vec<[i32; 2]>,
    met: Vec<bool>,
    simplify: Simplify,
}

impl Contour {
    /// The outer boundary of the largest part of `mask` (rows of `width` pixels,
    /// inside where not 0) through the centres of its boundary pixels, clockwise
    /// on the screen, in coordinates of the mask: border following (Moore;
    /// Suzuki and Abe 1985) over 8-connected pixels. The largest part is the one
    /// whose boundary encloses most. Empty for an empty mask.
    pub fn follow(&mut self, mask: &[u8], width: usize) -> &[[i32; 2]] {
        self.boundary.clear();
        self.met.clear();
        self.met.resize(mask.len(), false);
        let mut most = i64::MIN;
        for (y, row) in mask.chunks_exact(width.max(1)).enumerate() {
            let mut from = 0;
            while let Some(x) = next_western_end(row, from) {
                from = x + 1;
                let start = y * width + x;
                if self.met[start] || !is_upper_end(mask, width, start) {
                    continue;
                }
                self.follow_from(mask, width, start);
                // The boundary of a hole runs the other way round and counts negative.
                let enclosed = doubled_area(&self.part);
                if enclosed > most {
                    most = enclosed;
                    std::mem::swap(&mut self.boundary, &mut self.part);
                }
            }
        }
        &self.boundary
    }

    /// The boundary on which the pixel `start` lies whose northern and western
    /// neighbours are outside, into `part`.
    fn follow_from(&mut self, mask: &[u8], width: usize, start: usize) {
        self.part.clear();
        let height = mask.len() / width;
        let inside = |x: usize, y: usize| x < width && y < height && mask[y * width + x] != 0;
        let start = (start % width, start / width);
        let (mut x, mut y) = start;
        // The western neighbour is outside; the search goes clockwise from there.
        let mut from = WEST;
        let mut first_step = None;
        loop {
            self.met[y * width + x] = true;
            let found = (0..8).map(|k| (from + k) % 8).find(|&step| {
                let (dx, dy) = STEPS[step];
                inside(x.wrapping_add_signed(dx), y.wrapping_add_signed(dy))
            });
            let Some(step) = found else {
                self.part.push([x as i32, y as i32]);
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
            self.part.push([x as i32, y as i32]);
            x = x.wrapping_add_signed(STEPS[step].0);
            y = y.wrapping_add_signed(STEPS[step].1);
            // Go on from the last neighbour known to be outside.
            from = (step + if step.is_multiple_of(2) { 6 } else { 5 }) % 8;
        }
    }

    /// Follows the boundary, simplifies it so that no boundary pixel is farther
    /// than `tolerance_px` from the polygon, and writes it shifted by `origin`.
    pub fn run(
        &mut self,
        mask: &[u8],
        width: usize,
        origin: [u32; 2],
        tolerance_px: f32,
        out: &mut Vec<[f32; 2]>,
    ) {
        self.follow(mask, width);
        let keep = self.simplify.run(&self.boundary, tolerance_px);
        out.clear();
        for (point, _) in self.boundary.iter().zip(keep).filter(|(_, keep)| **keep) {
            out.push([point[0] as f32 + origin[0] as f32, point[1] as f32 + origin[1] as f32]);
        }
    }
}

/// The first pixel from column `from` of a row on whose western neighbour is outside.
fn next_western_end(row: &[u8], from: usize) -> Option<usize> {
    let word = |x: usize| row[x..].first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
    let mut x = from;
    while x < row.len() {
        let west = x.checked_sub(1);
        if row[x] != 0 && west.is_none_or(|west| row[west] == 0) {
            return Some(x);
        }
        let ends = west.and_then(|west| Some(word(x)? & !word(west)?));
        x += match (west, ends) {
            // Many pixels at once of which each is outside or follows one inside.
            (Some(west), Some(0)) if follows(&row[west..]) => GROUP,
            (_, Some(0)) => 8,
            (_, Some(ends)) => (ends.trailing_zeros() as usize / 8).max(1),
            (_, None) => 1,
        };
    }
    None
}

/// Pixels that are looked at together.
const GROUP: usize = 64;

/// Whether each of as many pixels from the second on is outside or follows one inside.
fn follows(row: &[u8]) -> bool {
    let (Some(west), Some(here)) = (row.first_chunk::<GROUP>(), row.get(1..=GROUP)) else {
        return false;
    };
    west.iter().zip(here).fold(0, |ends, (west, here)| ends | (here & !west)) == 0
}

/// True where the neighbours to the west and to the north are all outside, as
/// they are at the first pixel of every part.
fn is_upper_end(mask: &[u8], width: usize, at: usize) -> bool {
    let (x, y) = (at % width, at / width);
    let outside = |x: usize, y: usize| x >= width || mask[y * width + x] == 0;
    (x == 0 || outside(x - 1, y))
        && (y == 0
            || (outside(x, y - 1) && outside(x + 1, y - 1) && (x == 0 || outside(x - 1, y - 1))))
}

/// Twice the enclosed area (shoelace formula), positive for a polygon that runs
/// clockwise on the screen.
fn doubled_area(polygon: &[[i32; 2]]) -> i64 {
    let next = polygon.iter().cycle().skip(1);
    let cross = |(a, b): (&[i32; 2], &[i32; 2])| {
        i64::from(a[0]) * i64::from(b[1]) - i64::from(b[0]) * i64::from(a[1])
    };
    polygon.iter().zip(next).map(cross).sum()
}
