//! Bilinear demosaicing of Bayer patterns.

use super::picture::narrow;
use crate::image::Image;

/// Which colour the four pixels of a tile have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pattern {
    /// The first row has red, not blue.
    red_first: bool,
    /// The first row begins with green.
    green_first: bool,
}

impl Pattern {
    /// The pattern by the colours of its tile in row order, as `rggb`.
    pub fn from_name(name: &str) -> Option<Self> {
        let (red_first, green_first) = match name {
            "rggb" => (true, false),
            "bggr" => (false, false),
            "gbrg" => (false, true),
            "grbg" => (true, true),
            _ => return None,
        };
        Some(Self { red_first, green_first })
    }
}

/// One row of samples with one mirrored sample on each side.
///
/// The sample beyond the border is the one two steps inside, which has the same
/// colour; an image of one column or row repeats itself.
#[derive(Default)]
struct Padded(Vec<u8>);

impl Padded {
    fn fill(&mut self, row: &[u8], high: Option<usize>, width: usize) {
        self.0.resize(width + 2, 0);
        narrow(row, high, &mut self.0[1..=width]);
        self.0[0] = self.0[2.min(width)];
        self.0[width + 1] = self.0[width.saturating_sub(1).max(1)];
    }
}

/// Colours of a Bayer image: each missing colour is the mean of its two or four
/// nearest samples. `high` is the place of the high byte of wide samples.
///
/// `rows` has as many rows as `out`, and at least one.
pub fn demosaic<'a>(
    rows: impl ExactSizeIterator<Item = &'a [u8]>,
    high: Option<usize>,
    pattern: Pattern,
    out: &mut Image<[u8; 3]>,
) {
    let (width, height) = (out.width(), out.height());
    let mut rows = rows;
    let [mut above, mut here, mut below] =
        [Padded::default(), Padded::default(), Padded::default()];
    let Some(first) = rows.next() else { return };
    here.fill(first, high, width);
    match rows.next() {
        Some(second) => below.fill(second, high, width),
        None => below.0.clone_from(&here.0),
    }
    above.0.clone_from(&below.0);
    for y in 0..height {
        let red_row = pattern.red_first == (y % 2 == 0);
        let green_first = pattern.green_first == (y % 2 == 0);
        let lines = [&above.0[..], &here.0[..], &below.0[..]];
        // Each arm is a loop of its own, free of decisions.
        match (red_row, green_first) {
            (true, true) => demosaic_row::<true, true>(lines, out.row_mut(y)),
            (true, false) => demosaic_row::<true, false>(lines, out.row_mut(y)),
            (false, true) => demosaic_row::<false, true>(lines, out.row_mut(y)),
            (false, false) => demosaic_row::<false, false>(lines, out.row_mut(y)),
        }
        std::mem::swap(&mut above, &mut here);
        std::mem::swap(&mut here, &mut below);
        match rows.next() {
            Some(row) => below.fill(row, high, width),
            // The row below the last one mirrors the one above it.
            None => below.0.clone_from(&above.0),
        }
    }
}

fn demosaic_row<const RED_ROW: bool, const GREEN_FIRST: bool>(
    [above, here, below]: [&[u8]; 3],
    out: &mut [[u8; 3]],
) {
    for (x, pixel) in out.iter_mut().enumerate() {
        let at = |line: &[u8], dx: usize| u16::from(line[x + dx]);
        let cross = at(above, 1) + at(below, 1) + at(here, 0) + at(here, 2);
        let diagonal = at(above, 0) + at(above, 2) + at(below, 0) + at(below, 2);
        let green_here = (x % 2 == 0) == GREEN_FIRST;
        // `own` is the colour that this row has besides green.
        let (own, green, other) = if green_here {
            (
                (at(here, 0) + at(here, 2)).div_ceil(2),
                at(here, 1),
                (at(above, 1) + at(below, 1)).div_ceil(2),
            )
        } else {
            (at(here, 1), (cross + 2) / 4, (diagonal + 2) / 4)
        };
        let (red, blue) = if RED_ROW { (own, other) } else { (other, own) };
        *pixel = [red as u8, green as u8, blue as u8];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Size;

    /// Samples of a colour image through a pattern.
    fn mosaic(image: &Image<[u8; 3]>, pattern: &str) -> Vec<Vec<u8>> {
        let channel = |x: usize, y: usize| match pattern.as_bytes()[2 * (y % 2) + x % 2] {
            b'r' => 0,
            b'g' => 1,
            _ => 2,
        };
        (0..image.height())
            .map(|y| (0..image.width()).map(|x| image.get(x, y)[channel(x, y)]).collect())
            .collect()
    }

    fn run(rows: &[Vec<u8>], high: Option<usize>, pattern: &str, size: Size) -> Image<[u8; 3]> {
        let mut out = Image::new(size);
        let rows = rows.iter().map(Vec::as_slice);
        demosaic(rows, high, Pattern::from_name(pattern).unwrap(), &mut out);
        out
    }

    #[test]
    fn a_flat_colour_comes_back_for_every_pattern_and_size() {
        for pattern in ["rggb", "bggr", "gbrg", "grbg"] {
            for size in [Size::new(2, 2), Size::new(5, 3), Size::new(8, 7)] {
                let flat = Image::filled(size, [200, 100, 50]);
                assert_eq!(run(&mosaic(&flat, pattern), None, pattern, size), flat, "{pattern}");
            }
        }
    }

    #[test]
    fn a_slope_comes_back_inside_and_samples_stay_as_they_are() {
        let size = Size::new(8, 6);
        let slope = Image::from_fn(size, |x, y| {
            [(10 * x + 4 * y) as u8, (100 + 2 * x + 8 * y) as u8, (250 - 6 * x - 10 * y) as u8]
        });
        for pattern in ["rggb", "bggr", "gbrg", "grbg"] {
            let rows = mosaic(&slope, pattern);
            let out = run(&rows, None, pattern, size);
            for y in 1..size.height - 1 {
                for x in 1..size.width - 1 {
                    assert_eq!(out.get(x, y), slope.get(x, y), "{pattern} {x} {y}");
                }
            }
            for (y, row) in rows.iter().enumerate() {
                for (x, sample) in row.iter().enumerate() {
                    assert!(out.get(x, y).contains(sample), "{pattern} {x} {y}");
                }
            }
        }
    }

    #[test]
    fn wide_samples_give_their_high_byte() {
        let size = Size::new(4, 4);
        let flat = Image::filled(size, [200, 100, 50]);
        for big in [false, true] {
            let rows: Vec<Vec<u8>> = mosaic(&flat, "grbg")
                .iter()
                .map(|row| row.iter().flat_map(|&s| if big { [s, 3] } else { [3, s] }).collect())
                .collect();
            assert_eq!(run(&rows, Some(usize::from(!big)), "grbg", size), flat);
        }
    }

    #[test]
    fn one_pixel_wide_images_do_not_panic() {
        for size in [Size::new(1, 1), Size::new(1, 4), Size::new(4, 1)] {
            let flat = Image::filled(size, [9; 3]);
            assert_eq!(run(&mosaic(&flat, "rggb"), None, "rggb", size), flat);
        }
    }
}
