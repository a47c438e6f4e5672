//! Disparity maps.

use std::path::Path;

use image::DynamicImage;

use super::super::{DatasetError, DisparityCoding};
use super::{decode, fault, gray, hdf5, no_pixels, pfm, size_of};
use crate::image::Image;

/// The disparity `x_l - x_r` in pixels that a file holds, NaN where unknown.
///
/// # Errors
/// When the file cannot be read or holds something else.
pub fn read(path: &Path, coding: DisparityCoding) -> Result<Image<f32>, DatasetError> {
    match coding {
        DisparityCoding::Fixed16 => fixed16(path),
        DisparityCoding::Fixed8 { levels_per_px } => fixed8(path, levels_per_px),
        DisparityCoding::Pfm => pfm::read(path),
        DisparityCoding::Sintel => sintel(path),
        DisparityCoding::Spring => {
            let map = hdf5::every_second::<1>(path, "disparity")?;
            let values = map.pixels().iter().map(|[d]| *d).collect();
            Image::from_vec(map.size(), values).ok_or_else(|| no_pixels(path))
        }
    }
}

fn fixed16(path: &Path) -> Result<Image<f32>, DatasetError> {
    let decoded = decode(path)?;
    let size = size_of(&decoded);
    let DynamicImage::ImageLuma16(coded) = decoded else {
        let found = decoded.color();
        return Err(fault(path, &format!("16-bit gray is needed for disparity, not {found:?}")));
    };
    let values = coded.into_raw();
    let values = values.into_iter().map(|v| if v == 0 { f32::NAN } else { f32::from(v) / 256.0 });
    Image::from_vec(size, values.collect()).ok_or_else(|| no_pixels(path))
}

fn fixed8(path: &Path, levels_per_px: f32) -> Result<Image<f32>, DatasetError> {
    let coded = gray(path, decode(path)?)?;
    let value = |v: &u8| if *v == 0 { f32::NAN } else { f32::from(*v) / levels_per_px };
    let values = coded.pixels().iter().map(value).collect();
    Image::from_vec(coded.size(), values).ok_or_else(|| no_pixels(path))
}

fn sintel(path: &Path) -> Result<Image<f32>, DatasetError> {
    let decoded = decode(path)?;
    let size = size_of(&decoded);
    let DynamicImage::ImageRgb8(coded) = decoded else {
        let found = decoded.color();
        return Err(fault(path, &format!("8-bit RGB is needed for disparity, not {found:?}")));
    };
    let value =
        |[r, g, b]: [u8; 3]| f32::from(r) * 4.0 + f32::from(g) / 64.0 + f32::from(b) / 16384.0;
    let values = coded.pixels().map(|pixel| value(pixel.0)).collect();
    Image::from_vec(size, values).ok_or_else(|| no_pixels(path))
}
