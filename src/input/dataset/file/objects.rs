//! Maps of object ids.

use std::path::Path;

use image::DynamicImage;

use super::super::{DatasetError, ObjectCoding};
use super::{decode, gray, indexed, no_pixels, size_of};
use crate::image::Image;

/// Gray value above which a pixel of a mask belongs to the object, as the
/// field's evaluation programs take it.
const THRESHOLD: u8 = 128;

/// Index of what belongs to no object and no background in DAVIS 2017 (its
/// evaluation takes it for background), and the gray of the one object of 2016.
const WHITE: u8 = 255;

/// The object ids that a file holds, 0 is background.
///
/// # Errors
/// When the file cannot be read or holds something else.
pub fn read(path: &Path, coding: ObjectCoding) -> Result<Image<u16>, DatasetError> {
    match coding {
        ObjectCoding::Ids => ids(path),
        ObjectCoding::Indexed => {
            if let Some(indices) = indexed::read(path)? {
                return widened(
                    path,
                    &indices,
                    |index| if index == WHITE { 0 } else { index.into() },
                );
            }
            let values = gray(path, decode(path)?)?;
            widened(path, &values, |value| if value == WHITE { 1 } else { value.into() })
        }
        ObjectCoding::Mask => {
            let values = gray(path, decode(path)?)?;
            widened(path, &values, |value| u16::from(value > THRESHOLD))
        }
    }
}

fn ids(path: &Path) -> Result<Image<u16>, DatasetError> {
    let decoded = decode(path)?;
    let size = size_of(&decoded);
    if let DynamicImage::ImageLuma16(ids) = decoded {
        return Image::from_vec(size, ids.into_raw()).ok_or_else(|| no_pixels(path));
    }
    widened(path, &gray(path, decoded)?, u16::from)
}

fn widened(
    path: &Path,
    values: &Image<u8>,
    id: impl Fn(u8) -> u16,
) -> Result<Image<u16>, DatasetError> {
    let ids = values.pixels().iter().map(|&value| id(value)).collect();
    Image::from_vec(values.size(), ids).ok_or_else(|| no_pixels(path))
}
