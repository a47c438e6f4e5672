//! Motion maps.

use std::path::Path;

use image::DynamicImage;

use super::super::{DatasetError, FlowCoding};
use super::{decode, fault, flo, hdf5, no_pixels, size_of};
use crate::image::Image;

/// The motion `[dx, dy]` in pixels that a file holds, NaN where unknown.
///
/// # Errors
/// When the file cannot be read or holds something else.
pub fn read(path: &Path, coding: FlowCoding) -> Result<Image<[f32; 2]>, DatasetError> {
    match coding {
        FlowCoding::Fixed16 => fixed16(path),
        FlowCoding::Flo => flo::read(path),
        FlowCoding::Spring => hdf5::every_second(path, "flow"),
    }
}

fn fixed16(path: &Path) -> Result<Image<[f32; 2]>, DatasetError> {
    let decoded = decode(path)?;
    let size = size_of(&decoded);
    let DynamicImage::ImageRgb16(coded) = decoded else {
        let found = decoded.color();
        return Err(fault(path, &format!("16-bit RGB is needed for motion, not {found:?}")));
    };
    let motion = |[u, v, valid]: [u16; 3]| {
        let pixels = |value: u16| (f32::from(value) - 32768.0) / 64.0;
        if valid == 0 { [f32::NAN; 2] } else { [pixels(u), pixels(v)] }
    };
    let values = coded.pixels().map(|pixel| motion(pixel.0)).collect();
    Image::from_vec(size, values).ok_or_else(|| no_pixels(path))
}
