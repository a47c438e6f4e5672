//! The nearest of many pixels, exactly.

use crate::image::{Image, Size};

/// The nearest site of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Nearest {
    /// Squared Euclidean distance in pixels.
    pub squared: u64,
    /// Position of the site in row order.
    pub index: usize,
}

/// A parabola of the lower envelope: best from column `start` on.
#[derive(Clone, Copy)]
struct Piece {
    start: i64,
    x: i64,
    y: usize,
    /// Squared distance to the site along the column.
    height: i64,
}

/// The nearest site of every pixel (Felzenszwalb and Huttenlocher 2012, in
/// integers): first along the columns, then along the rows as the lower
/// envelope of parabolas. Among equally near sites the leftmost wins, then the
/// upper one. `None` without sites.
pub fn nearest(size: Size, is_site: impl Fn(usize, usize) -> bool) -> Option<Image<Nearest>> {
    let in_column = nearest_in_column(size, is_site)?;
    let mut out = Image::new(size);
    let mut envelope: Vec<Piece> = Vec::with_capacity(size.width);
    for y in 0..size.height {
        envelope.clear();
        for (x, site) in in_column.row(y).iter().enumerate() {
            let Some(site) = *site else { continue };
            let height = y.abs_diff(site) as i64;
            let mut piece =
                Piece { start: i64::MIN, x: x as i64, y: site, height: height * height };
            while let Some(last) = envelope.last() {
                let rise = piece.height + piece.x * piece.x - last.height - last.x * last.x;
                // The first column where the new one is strictly nearer.
                piece.start = rise.div_euclid(2 * (piece.x - last.x)) + 1;
                if piece.start > last.start {
                    break;
                }
                envelope.pop();
            }
            envelope.push(piece);
        }
        let mut pieces = envelope.iter().peekable();
        let Some(mut piece) = pieces.next() else { continue };
        for (x, out) in out.row_mut(y).iter_mut().enumerate() {
            while let Some(next) = pieces.next_if(|next| next.start <= x as i64) {
                piece = next;
            }
            let across = x as i64 - piece.x;
            *out = Nearest {
                squared: (across * across + piece.height) as u64,
                index: piece.y * size.width + piece.x as usize,
            };
        }
    }
    Some(out)
}

/// Row of the nearest site in the same column, the upper one of two.
fn nearest_in_column(
    size: Size,
    is_site: impl Fn(usize, usize) -> bool,
) -> Option<Image<Option<usize>>> {
    let mut out = Image::new(size);
    let mut above = vec![None; size.width];
    for y in 0..size.height {
        for (x, (out, above)) in out.row_mut(y).iter_mut().zip(&mut above).enumerate() {
            if is_site(x, y) {
                *above = Some(y);
            }
            *out = *above;
        }
    }
    let mut below = vec![None; size.width];
    let mut any = false;
    for y in (0..size.height).rev() {
        for (out, below) in out.row_mut(y).iter_mut().zip(&mut below) {
            if *out == Some(y) {
                *below = Some(y);
                any = true;
            }
            *out = match (*out, *below) {
                (Some(above), Some(below)) if below - y < y - above => Some(below),
                (None, below) => below,
                (above, _) => above,
            };
        }
    }
    any.then_some(out)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// By trying every site.
    fn slow(size: Size, sites: &[bool], x: usize, y: usize) -> Nearest {
        let all = (0..size.area()).filter(|i| sites[*i]).map(|index| {
            let (sx, sy) = (index % size.width, index / size.width);
            let squared = (x.abs_diff(sx).pow(2) + y.abs_diff(sy).pow(2)) as u64;
            ((squared, sx, sy), Nearest { squared, index })
        });
        all.min_by_key(|(order, _)| *order).unwrap().1
    }

    #[test]
    fn there_is_no_nearest_of_none() {
        assert_eq!(nearest(Size::new(3, 2), |_, _| false), None);
        assert_eq!(nearest(Size::default(), |_, _| true), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]
        #[test]
        fn no_site_is_nearer(
            width in 1_usize..14,
            height in 1_usize..14,
            rarity in 1_u8..40,
            noise in prop::collection::vec(any::<u8>(), 13 * 13),
        ) {
            let size = Size::new(width, height);
            let sites: Vec<bool> = noise[..size.area()].iter().map(|n| n % rarity == 0).collect();
            let found = nearest(size, |x, y| sites[y * width + x]);
            prop_assert_eq!(found.is_some(), sites.contains(&true));
            if let Some(found) = found {
                for y in 0..height {
                    for x in 0..width {
                        prop_assert_eq!(found.get(x, y), slow(size, &sites, x, y), "at {},{}", x, y);
                    }
                }
            }
        }
    }
}
