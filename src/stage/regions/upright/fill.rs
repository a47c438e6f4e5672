//! Holes of the disparity, filled by what looks alike beside them.

use crate::image::{Image, Size};
use crate::simd::{Simd, f32x16, padded, prelude::*};

/// Pixels to each side, above and below among which the nearest disparity is looked for:
/// more of them gain nothing.
const REACH: usize = 2;
/// What a pixel of distance counts in levels of brightness, and how much a hole may
/// differ from where its disparity comes from, the distance counted in: by 20 next to
/// it, by 10 across a pixel. With twice as much fewer outlines on rendered streets are right.
const PER_PX: f32 = 10.0;
const MOST: f32 = 30.0;

/// Pixels that are looked at together.
const LANES: usize = 16;

/// What the pixels from `(x, y)` on take if they are holes of the `disparity` (NaN): of the
/// nearest disparities to the left and right, above and below, within two pixels, that
/// whose pixel is most like them (difference in brightness, and 10 for each pixel of
/// distance), if this is no more than 30; of equals the smaller one; else NaN.
///
/// Outlines of things are made with it: what is hardly textured has holes that belong
/// to it. What is published keeps them.
#[inline(always)]
pub fn fill<S: Simd>(
    simd: S,
    disparity: &Image<f32>,
    gray: &Image<u8>,
    (x, y): (usize, usize),
) -> f32x16<S> {
    let Size { width, height } = disparity.size();
    let mut best = Best {
        here: brightness(simd, gray.row(y), x, 0),
        // Between whole numbers: as good as this is nothing.
        least: f32x16::splat(simd, MOST + 0.5),
        found: f32x16::splat(simd, f32::NAN),
    };
    let inside = x >= REACH
        && x + LANES + REACH <= width
        && (REACH..height.saturating_sub(REACH)).contains(&y);
    if inside {
        // Nearly all of them: nothing is asked of each of the eight.
        let (row, look) = (disparity.row(y), gray.row(y));
        best.weigh(&Look::at(simd, row, look, x - 1), &Look::at(simd, row, look, x - 2));
        best.weigh(&Look::at(simd, row, look, x + 1), &Look::at(simd, row, look, x + 2));
        let near = Look::at(simd, disparity.row(y - 1), gray.row(y - 1), x);
        best.weigh(&near, &Look::at(simd, disparity.row(y - 2), gray.row(y - 2), x));
        let near = Look::at(simd, disparity.row(y + 1), gray.row(y + 1), x);
        best.weigh(&near, &Look::at(simd, disparity.row(y + 2), gray.row(y + 2), x));
    } else {
        for (across, down) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
            let near = Look::near_edge(simd, disparity, gray, (x, y), (across, down));
            let far = Look::near_edge(simd, disparity, gray, (x, y), (2 * across, 2 * down));
            best.weigh(&near, &far);
        }
    }
    best.found
}

/// What is to one side of pixels at one distance.
struct Look<S: Simd> {
    disparity: f32x16<S>,
    brightness: f32x16<S>,
}

impl<S: Simd> Look<S> {
    /// In a row of both, from column `x` on, all of it inside.
    #[inline(always)]
    fn at(simd: S, disparity: &[f32], gray: &[u8], x: usize) -> Self {
        Self {
            disparity: f32x16::from_slice(simd, &disparity[x..x + LANES]),
            brightness: brightness(simd, &gray[x..x + LANES], 0, 0),
        }
    }

    /// The same `across` and `down` from `(x, y)`, wherever that is.
    #[inline(always)]
    fn near_edge(
        simd: S,
        disparity: &Image<f32>,
        gray: &Image<u8>,
        (x, y): (usize, usize),
        (across, down): (isize, isize),
    ) -> Self {
        let (mut row, mut look) = (&[][..], &[][..]);
        if let Some(y) = y.checked_add_signed(down)
            && y < disparity.height()
        {
            (row, look) = (disparity.row(y), gray.row(y));
        }
        Self {
            disparity: shifted(simd, row, x, across),
            brightness: brightness(simd, look, x, across),
        }
    }

    /// How unlike that is, `px` away, what looks like `here`.
    #[inline(always)]
    fn unlike(&self, here: f32x16<S>, px: f32) -> f32x16<S> {
        (self.brightness - here).abs() + PER_PX * px
    }
}

/// What pixels take.
struct Best<S: Simd> {
    here: f32x16<S>,
    /// How unlike that is.
    least: f32x16<S>,
    found: f32x16<S>,
}

impl<S: Simd> Best<S> {
    /// Takes the nearest disparity to one side into account, of pixels next to these and of
    /// those behind them.
    #[inline(always)]
    fn weigh(&mut self, near: &Look<S>, far: &Look<S>) {
        let never = f32x16::splat(self.here.simd, f32::INFINITY);
        let is_far = far.disparity.simd_eq(far.disparity);
        let behind = is_far.select(far.unlike(self.here, 2.0), never);
        let is_near = near.disparity.simd_eq(near.disparity);
        let unlike = is_near.select(near.unlike(self.here, 1.0), behind);
        let nearest = is_near.select(near.disparity, far.disparity);
        let better =
            unlike.simd_lt(self.least) | (unlike.simd_eq(self.least) & nearest.simd_lt(self.found));
        self.least = better.select(unlike, self.least);
        self.found = better.select(nearest, self.found);
    }
}

/// The values `by` columns beside those from column `x` on; NaN beyond the row.
#[inline(always)]
fn shifted<S: Simd>(simd: S, row: &[f32], x: usize, by: isize) -> f32x16<S> {
    match x.checked_add_signed(by) {
        Some(x) => padded(simd, row, x, f32::NAN),
        None => f32x16::from_fn(simd, |i| {
            (x + i).checked_add_signed(by).and_then(|x| row.get(x)).copied().unwrap_or(f32::NAN)
        }),
    }
}

/// The same of brightness; any value beyond the row.
#[inline(always)]
fn brightness<S: Simd>(simd: S, row: &[u8], x: usize, by: isize) -> f32x16<S> {
    let mut values = [0.0; LANES];
    match x.checked_add_signed(by).and_then(|x| row.get(x..)?.first_chunk::<LANES>()) {
        Some(bytes) => {
            for i in 0..LANES {
                values[i] = f32::from(bytes[i]);
            }
        }
        None => {
            for (i, value) in values.iter_mut().enumerate() {
                let byte = (x + i).checked_add_signed(by).and_then(|x| row.get(x));
                *value = byte.map_or(0.0, |byte| f32::from(*byte));
            }
        }
    }
    f32x16::load_array(simd, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{self, dispatch};

    /// Holds every pixel of every group of sixteen, from every column on, against `plain`.
    fn assert_plain(disparity: &Image<f32>, gray: &Image<u8>) {
        let Size { width, height } = disparity.size();
        for level in simd::available() {
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let mut group = [0.0; LANES];
                dispatch!(level, simd => {
                    fill(simd, disparity, gray, (x, y)).store_slice(&mut group);
                });
                for (u, found) in (x..width).zip(group) {
                    let expected = plain(disparity, gray, u, y);
                    assert_eq!(found.to_bits(), expected.to_bits(), "({u}, {y}) from {x}");
                }
            }
        }
    }

    /// As the words say it.
    fn plain(disparity: &Image<f32>, gray: &Image<u8>, x: usize, y: usize) -> f32 {
        let at = |u: isize, v: isize| {
            let (u, v) = (usize::try_from(u).ok()?, usize::try_from(v).ok()?);
            (u < gray.width() && v < gray.height()).then(|| (disparity.get(u, v), gray.get(u, v)))
        };
        let (x, y) = (x as isize, y as isize);
        let (_, look) = at(x, y).unwrap();
        let nearest = |(across, down): (isize, isize)| {
            let (step, (d, other)) = (1..=2)
                .filter_map(|step| Some((step, at(x + step * across, y + step * down)?)))
                .find(|(_, (d, _))| !d.is_nan())?;
            Some((u32::from(look.abs_diff(other)) + 10 * step as u32, d))
        };
        let around = [(-1, 0), (1, 0), (0, -1), (0, 1)].into_iter().filter_map(nearest);
        let alike = around.filter(|(unlike, _)| *unlike <= 30);
        let best = alike.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        best.map_or(f32::NAN, |(_, d)| d)
    }

    #[test]
    fn a_pixel_takes_the_nearest_that_is_alike() {
        let sizes = [(1, 1), (2, 3), (1, 9), (17, 5), (40, 12)];
        for (size, holes) in sizes.into_iter().flat_map(|size| [(size, 3), (size, 7)]) {
            let mut state = 11_u64;
            let mut next = |below: u64| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 40) % below
            };
            let size = Size::new(size.0, size.1);
            let disparity = Image::from_fn(size, |_, _| {
                if next(10) < holes { f32::NAN } else { next(4) as f32 / 4.0 + 8.0 }
            });
            let gray = Image::from_fn(size, |_, _| 100 + next(40) as u8);
            assert_plain(&disparity, &gray);
        }
    }

    #[test]
    fn large_holes_and_those_that_look_otherwise_stay() {
        let size = Size::new(24, 1);
        let disparity = Image::from_fn(size, |x, _| if x < 8 { 5.0 } else { f32::NAN });
        // Edge of what looks alike, and of what takes its disparity.
        let look = |at: usize| Image::from_fn(size, move |x, _| if x < at { 90 } else { 130 });
        for (edge, last) in [(24, 10), (9, 9), (8, 8)] {
            let gray = look(edge);
            assert_plain(&disparity, &gray);
            let filled = |x: usize| plain(&disparity, &gray, x, 0);
            assert!((0..last).all(|x| filled(x) == 5.0) && (last..24).all(|x| filled(x).is_nan()));
        }
    }
}
