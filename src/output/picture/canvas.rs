//! Lines, boxes, tints and labels on an RGB image; everything is clipped.

use super::font::{GLYPH_HEIGHT, GLYPH_WIDTH, glyph};
use super::mix;
use crate::image::Image;
use crate::perception::Region;

/// A rectangle that may reach outside the image.
#[derive(Clone, Copy)]
struct Plate {
    x: i64,
    y: i64,
    width: i64,
    height: i64,
}

impl Plate {
    fn overlaps(&self, other: &Self) -> bool {
        self.x < other.x + other.width
            && other.x < self.x + self.width
            && self.y < other.y + other.height
            && other.y < self.y + self.height
    }
}

/// An image to draw on.
pub struct Canvas<'a> {
    image: &'a mut Image<[u8; 3]>,
    plates: Vec<Plate>,
    /// Side of one font pixel, and width of lines.
    unit: i64,
}

impl<'a> Canvas<'a> {
    /// A canvas over `image`; letters and lines grow with its width.
    pub fn new(image: &'a mut Image<[u8; 3]>) -> Self {
        let unit = (image.width() as i64 / 420).clamp(1, 6);
        Self { image, plates: Vec::new(), unit }
    }

    /// Mixes `share`/255 of `color` into the pixels of the region's mask.
    pub fn tint_mask(&mut self, region: &Region, color: [u8; 3], share: u8) {
        let width = region.width as usize;
        if width == 0 {
            return;
        }
        for (dy, row) in region.mask.chunks_exact(width).enumerate() {
            for (dx, _) in row.iter().enumerate().filter(|(_, m)| **m != 0) {
                let (x, y) = (i64::from(region.x) + dx as i64, i64::from(region.y) + dy as i64);
                self.blend(x, y, color, share);
            }
        }
    }

    /// The closed line through `points`.
    pub fn polygon(&mut self, points: &[[f32; 2]], color: [u8; 3]) {
        let next = points.iter().cycle().skip(1);
        for (from, to) in points.iter().zip(next) {
            self.line(*from, *to, color);
        }
    }

    /// A straight line, `unit` wide.
    fn line(&mut self, from: [f32; 2], to: [f32; 2], color: [u8; 3]) {
        if [from, to].iter().flatten().any(|v| !v.is_finite() || v.abs() > 1e5) {
            return;
        }
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let steps = dx.abs().max(dy.abs()).ceil().max(1.0);
        for i in 0..=steps as i64 {
            let t = i as f32 / steps;
            let (x, y) = (from[0] + dx * t, from[1] + dy * t);
            self.fill(
                Plate {
                    x: x.round() as i64 - (self.unit - 1) / 2,
                    y: y.round() as i64 - (self.unit - 1) / 2,
                    width: self.unit,
                    height: self.unit,
                },
                color,
            );
        }
    }

    /// The region's box, one pixel wide.
    pub fn frame(&mut self, region: &Region, color: [u8; 3]) {
        let (x, y) = (i64::from(region.x), i64::from(region.y));
        let (width, height) = (i64::from(region.width), i64::from(region.height));
        for plate in [
            Plate { x, y, width, height: 1 },
            Plate { x, y: y + height - 1, width, height: 1 },
            Plate { x, y, width: 1, height },
            Plate { x: x + width - 1, y, width: 1, height },
        ] {
            self.fill(plate, color);
        }
    }

    /// A label beside the region's box: above it where there is room, else
    /// below or inside, and clear of the labels that are there already; none
    /// where there is no such place.
    pub fn label(&mut self, region: &Region, text: &str, color: [u8; 3]) {
        let pad = self.unit * 2;
        let letters = text.chars().count() as i64;
        let width = letters * (GLYPH_WIDTH as i64 + 1) * self.unit + 2 * pad - self.unit;
        let height = GLYPH_HEIGHT as i64 * self.unit + 2 * pad;
        let (columns, rows) = (self.image.width() as i64, self.image.height() as i64);
        let x = i64::from(region.x).min(columns - width).max(0);
        let (top, bottom) = (i64::from(region.y), i64::from(region.y) + i64::from(region.height));
        let at = |y| Plate { x, y, width, height };
        let places = [at(top - height), at(bottom), at(top + 1), at(top - 2 * height - 1)];
        let free = places
            .into_iter()
            .filter(|p| p.y >= 0 && p.y + p.height <= rows)
            .find(|p| !self.plates.iter().any(|other| other.overlaps(p)));
        // In a crowd a label on another one could not be read, and would hide
        // one of higher priority.
        let Some(plate) = free else { return };
        self.plates.push(plate);
        self.fill(plate, color);
        self.text(plate.x + pad, plate.y + pad, text, [10, 12, 16]);
    }

    /// Text whose first letter has its upper left corner at `(x, y)`.
    pub fn text(&mut self, x: i64, y: i64, text: &str, color: [u8; 3]) {
        let unit = self.unit;
        for (i, letter) in text.chars().enumerate() {
            let left = x + i as i64 * (GLYPH_WIDTH as i64 + 1) * unit;
            for (row, bits) in glyph(letter).into_iter().enumerate() {
                for column in 0..GLYPH_WIDTH {
                    if bits >> (GLYPH_WIDTH - 1 - column) & 1 == 1 {
                        let (x, y) = (left + column as i64 * unit, y + row as i64 * unit);
                        self.fill(Plate { x, y, width: unit, height: unit }, color);
                    }
                }
            }
        }
    }

    fn fill(&mut self, plate: Plate, color: [u8; 3]) {
        let x0 = plate.x.clamp(0, self.image.width() as i64) as usize;
        let x1 = (plate.x + plate.width).clamp(0, self.image.width() as i64) as usize;
        let y0 = plate.y.clamp(0, self.image.height() as i64) as usize;
        let y1 = (plate.y + plate.height).clamp(0, self.image.height() as i64) as usize;
        if x0 >= x1 {
            return;
        }
        for y in y0..y1 {
            self.image.row_mut(y)[x0..x1].fill(color);
        }
    }

    fn blend(&mut self, x: i64, y: i64, color: [u8; 3], share: u8) {
        let (width, height) = (self.image.width() as i64, self.image.height() as i64);
        if (0..width).contains(&x) && (0..height).contains(&y) {
            let (x, y) = (x as usize, y as usize);
            self.image.set(x, y, mix(self.image.get(x, y), color, share));
        }
    }
}
