//! Preprocessing by its definitions.

use nalgebra::Vector2;
use salient_stereo::camera::Camera;
use salient_stereo::image::{Image, Size};

/// Value at `(x, y)`, the nearest one beyond the edge.
fn at(image: &Image<u8>, x: usize, y: usize, dx: isize, dy: isize) -> i32 {
    i32::from(image.get_clamped(x as isize + dx, y as isize + dy))
}

/// One channel of a colour image.
pub fn channel(image: &Image<[u8; 3]>, c: usize) -> Image<u8> {
    Image::from_fn(image.size(), |x, y| image.get(x, y)[c])
}

/// (|Sobel x| + |Sobel y|) / 8.
pub fn gradient(gray: &Image<u8>) -> Image<u8> {
    let weights = [(-1, 1), (0, 2), (1, 1)];
    Image::from_fn(gray.size(), |x, y| {
        let (mut gx, mut gy) = (0, 0);
        for (k, w) in weights {
            gx += w * (at(gray, x, y, 1, k) - at(gray, x, y, -1, k));
            gy += w * (at(gray, x, y, k, 1) - at(gray, x, y, k, -1));
        }
        ((gx.abs() + gy.abs()) / 8) as u8
    })
}

fn nine(image: &Image<u8>, x: usize, y: usize) -> Vec<i32> {
    (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| at(image, x, y, dx, dy))).collect()
}

/// The fifth of nine sorted values.
pub fn median3(image: &Image<u8>) -> Image<u8> {
    Image::from_fn(image.size(), |x, y| {
        let mut values = nine(image, x, y);
        values.sort_unstable();
        values[4] as u8
    })
}

/// Weights 1 2 1 along both axes.
pub fn gaussian3(image: &Image<u8>) -> Image<u8> {
    let weights = [1, 2, 1, 2, 4, 2, 1, 2, 1];
    Image::from_fn(image.size(), |x, y| {
        let sum: i32 = nine(image, x, y).iter().zip(weights).map(|(v, w)| v * w).sum();
        ((sum + 8) / 16) as u8
    })
}

/// Rounded mean over the pixels of each cell that the image has.
pub fn box_mean(image: &Image<u8>, factor: usize, size: Size) -> Image<u8> {
    Image::from_fn(size, |x, y| {
        let (mut sum, mut count) = (0_usize, 0);
        for v in y * factor..((y + 1) * factor).min(image.height()) {
            for u in x * factor..((x + 1) * factor).min(image.width()) {
                sum += usize::from(image.get(u, v));
                count += 1;
            }
        }
        ((sum + count / 2) / count) as u8
    })
}

/// Where each rectified pixel lies in the raw image.
pub fn raw_positions(camera: &Camera) -> Vec<Vector2<f64>> {
    let to_ray = camera.rectified_to_ray().unwrap();
    let Size { width, height } = camera.size;
    (0..width * height)
        .map(|i| camera.raw_pixel(&to_ray, (i % width) as f64, (i / width) as f64))
        .collect()
}

/// Bilinear value at a position of the raw image; `None` outside of it.
pub fn bilinear(raw: &Image<u8>, at: Vector2<f64>) -> Option<f64> {
    let last = Vector2::new((raw.width() - 1) as f64, (raw.height() - 1) as f64);
    if at.x < 0.0 || at.y < 0.0 || at.x > last.x || at.y > last.y {
        return None;
    }
    let (x, y) = (at.x.floor(), at.y.floor());
    let (fx, fy) = (at.x - x, at.y - y);
    let value = |dx: isize, dy: isize| f64::from(raw.get_clamped(x as isize + dx, y as isize + dy));
    let upper = value(0, 0) * (1.0 - fx) + value(1, 0) * fx;
    let lower = value(0, 1) * (1.0 - fx) + value(1, 1) * fx;
    Some(upper * (1.0 - fy) + lower * fy)
}

/// Contrast-limited adaptive equalisation with real weights.
pub fn clahe(gray: &Image<u8>) -> Image<u8> {
    let size = gray.size();
    let tile = (size.width.div_ceil(8), size.height.div_ceil(8));
    let tiles = (size.width.div_ceil(tile.0), size.height.div_ceil(tile.1));
    let curve = |tx: usize, ty: usize| -> Vec<f64> {
        let mut histogram = [0_usize; 256];
        let mut area = 0;
        for y in (ty * tile.1..(ty + 1) * tile.1).filter(|&y| y < size.height) {
            for x in (tx * tile.0..(tx + 1) * tile.0).filter(|&x| x < size.width) {
                histogram[usize::from(gray.get(x, y))] += 1;
                area += 1;
            }
        }
        let limit = (2 * area / 256).max(1);
        let excess: usize = histogram.iter().map(|&n| n.saturating_sub(limit)).sum();
        let mut given = 0;
        let mut sum = 0;
        (0..256)
            .map(|i| {
                // The excess is given back evenly, in whole counts.
                let due = excess / 256 * (i + 1) + (excess % 256) * (i + 1) / 256;
                sum += histogram[i].min(limit) + due - given;
                given = due;
                (sum as f64 * 255.0 / area as f64).round()
            })
            .collect()
    };
    let curves: Vec<Vec<f64>> =
        (0..tiles.0 * tiles.1).map(|i| curve(i % tiles.0, i / tiles.0)).collect();
    let place = |x: usize, tile: usize, tiles: usize| {
        let at = ((x as f64 + 0.5) / tile as f64 - 0.5).clamp(0.0, (tiles - 1) as f64);
        let first = at.floor() as usize;
        (first, (first + 1).min(tiles - 1), at - at.floor())
    };
    Image::from_fn(size, |x, y| {
        let (l, r, fx) = place(x, tile.0, tiles.0);
        let (u, d, fy) = place(y, tile.1, tiles.1);
        let v = usize::from(gray.get(x, y));
        let value = |tx: usize, ty: usize| curves[ty * tiles.0 + tx][v];
        let upper = value(l, u) * (1.0 - fx) + value(r, u) * fx;
        let lower = value(l, d) * (1.0 - fx) + value(r, d) * fx;
        (upper * (1.0 - fy) + lower * fy).round() as u8
    })
}
