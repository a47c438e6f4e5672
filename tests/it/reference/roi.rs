//! Regions of interest by their definitions.

use salient_stereo::image::{Image, Size};
use salient_stereo::simd;
use salient_stereo::stage::roi::bits::BitMask;

use super::window;

/// A mask as one flag per pixel.
pub type Mask = Image<bool>;

/// The same in bits.
pub fn bits(mask: &Mask) -> BitMask {
    let map = Image::from_fn(mask.size(), |x, y| f32::from(u8::from(mask.get(x, y))));
    let mut bits = BitMask::default();
    bits.set_from(simd::detect(), &map, 0.5);
    bits
}

/// Set where any pixel within `radius` is set.
pub fn dilate(mask: &Mask, radius: usize) -> Mask {
    Image::from_fn(mask.size(), |x, y| {
        window(mask.size(), x, y, radius).into_iter().any(|(u, v)| mask.get(u, v))
    })
}

/// Set where every pixel within `radius` is set.
pub fn erode(mask: &Mask, radius: usize) -> Mask {
    Image::from_fn(mask.size(), |x, y| {
        window(mask.size(), x, y, radius).into_iter().all(|(u, v)| mask.get(u, v))
    })
}

/// Set pixels of each 4x4 cell.
pub fn counts(mask: &Mask) -> Image<u8> {
    Image::from_fn(mask.size().divided_by(4), |cx, cy| {
        let mut count = 0;
        for y in 4 * cy..(4 * cy + 4).min(mask.height()) {
            for x in 4 * cx..(4 * cx + 4).min(mask.width()) {
                count += u8::from(mask.get(x, y));
            }
        }
        count
    })
}

/// `mask` less components of touching cells that hold fewer than `least` set
/// pixels, by flood fill.
pub fn without_small(mask: &Mask, least: u32) -> Mask {
    let counts = counts(mask);
    let Size { width, height } = counts.size();
    let mut seen = Image::filled(counts.size(), false);
    let mut keep = Image::filled(counts.size(), false);
    for start in 0..width * height {
        let start = (start % width, start / width);
        if seen.get(start.0, start.1) || counts.get(start.0, start.1) == 0 {
            continue;
        }
        let mut members = vec![start];
        seen.set(start.0, start.1, true);
        let mut next = 0;
        while next < members.len() {
            let (x, y) = members[next];
            next += 1;
            for (u, v) in window(counts.size(), x, y, 1) {
                if !seen.get(u, v) && counts.get(u, v) > 0 {
                    seen.set(u, v, true);
                    members.push((u, v));
                }
            }
        }
        let area: u32 = members.iter().map(|&(x, y)| u32::from(counts.get(x, y))).sum();
        for (x, y) in members {
            keep.set(x, y, area >= least);
        }
    }
    Image::from_fn(mask.size(), |x, y| mask.get(x, y) && keep.get(x / 4, y / 4))
}

/// The largest between-class variance over all ways to cut 256 bins, times the
/// square of the number of values.
pub fn best_cut(map: &Image<f32>) -> f64 {
    (1..256).map(|edge| cut_variance(map, edge as f32 / 256.0)).fold(0.0, f64::max)
}

/// Between-class variance when cut at `threshold`, values rounded down to bins.
pub fn cut_variance(map: &Image<f32>, threshold: f32) -> f64 {
    let bin = |value: f32| f64::from((value * 256.0) as u8);
    let (above, below): (Vec<f32>, Vec<f32>) =
        map.pixels().iter().partition(|&&value| value >= threshold);
    if above.is_empty() || below.is_empty() {
        return 0.0;
    }
    let mean = |values: &[f32]| values.iter().map(|&v| bin(v)).sum::<f64>() / values.len() as f64;
    above.len() as f64 * below.len() as f64 * (mean(&above) - mean(&below)).powi(2)
}
