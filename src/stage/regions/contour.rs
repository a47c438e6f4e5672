//! The outer boundary of a mask as a polygon.

use super::simplify::Simplify;
use crate::simd::Level;

/// Steps to the 8 neighbours, clockwise in image coordinates (y points down), from east.
const STEPS: [(isize, isize); 8] =
    [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
const WEST: u32 = 4;

/// The boundary follower with its buffers.
#[derive(Debug)]
pub struct Contour {
    boundary: Vec<[i32; 2]>,
    part: Vec<[i32; 2]>,
    met: Vec<bool>,
    simplify: Simplify,
}

impl Contour {
    /// The follower with instructions of `level`.
    pub fn new(level: Level) -> Self {
        Self {
            boundary: Vec::new(),
            part: Vec::new(),
            met: Vec::new(),
            simplify: Simplify::new(level),
        }
    }

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
                // The boundary of a hole runs the other way round and counts negative.
                let enclosed = self.follow_from(mask, width, start);
                if enclosed > most {
                    most = enclosed;
                    std::mem::swap(&mut self.boundary, &mut self.part);
                }
            }
        }
        &self.boundary
    }

    /// The boundary on which the pixel `start` lies whose northern and western
    /// neighbours are outside, into `part`. Returns twice the enclosed area
    /// (shoelace formula), positive for a boundary that runs clockwise on the screen.
    fn follow_from(&mut self, mask: &[u8], width: usize, start: usize) -> i64 {
        self.part.clear();
        let start = (start % width, start / width);
        let (mut x, mut y) = start;
        // The western neighbour is outside; the search goes clockwise from there.
        let mut from = WEST;
        let mut first_step = None;
        let mut enclosed = 0;
        loop {
            self.met[y * width + x] = true;
            let around = neighbours(mask, width, x, y);
            if around == 0 {
                self.part.push([x as i32, y as i32]);
                break;
            }
            let step = (from + around.rotate_right(from).trailing_zeros()) % 8;
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
            let (dx, dy) = STEPS[step as usize];
            enclosed += (x as isize * dy - y as isize * dx) as i64;
            x = x.wrapping_add_signed(dx);
            y = y.wrapping_add_signed(dy);
            // Go on from the last neighbour known to be outside.
            from = (step + if step.is_multiple_of(2) { 6 } else { 5 }) % 8;
        }
        enclosed
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

/// One bit for each of [`STEPS`] that leads to a pixel inside.
fn neighbours(mask: &[u8], width: usize, x: usize, y: usize) -> u8 {
    // Of a row, the pixels to the west, here, and to the east.
    let row = |y: usize| -> [bool; 3] {
        let Some(row) = mask.get(y.wrapping_mul(width)..).and_then(|rows| rows.get(..width)) else {
            return [false; 3];
        };
        match row.get(x.wrapping_sub(1)..).and_then(|row| row.first_chunk()) {
            Some(near) => near.map(|pixel: u8| pixel != 0),
            None => [x.wrapping_sub(1), x, x + 1].map(|x| row.get(x).is_some_and(|p| *p != 0)),
        }
    };
    let ([nw, n, ne], [w, _, e], [sw, s, se]) = (row(y.wrapping_sub(1)), row(y), row(y + 1));
    let inside = [e, se, s, sw, w, nw, n, ne];
    (0..).zip(inside).fold(0, |bits, (i, inside)| bits | u8::from(inside) << i)
}
