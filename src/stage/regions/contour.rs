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
    simplify: Simplify,
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
