//! Masks: which pixels of a map count.

use image::DynamicImage;

use super::super::{DatasetError, MaskCoding, MaskFile};
use super::{check_size, decode, gray, size_of};
use crate::image::Image;

/// Sets to `unknown` what the mask leaves out.
///
/// # Errors
/// When the mask cannot be read or has another size.
pub fn apply<T: Copy>(mask: &MaskFile, map: &mut Image<T>, unknown: T) -> Result<(), DatasetError> {
    let decoded = decode(&mask.path)?;
    check_size(&mask.path, size_of(&decoded), map.size())?;
    let counts: Vec<bool> = match mask.coding {
        MaskCoding::White => {
            gray(&mask.path, decoded)?.pixels().iter().map(|&value| value == 255).collect()
        }
        MaskCoding::Black => black(decoded),
    };
    for (value, counts) in map.pixels_mut().iter_mut().zip(counts) {
        if !counts {
            *value = unknown;
        }
    }
    Ok(())
}

fn black(decoded: DynamicImage) -> Vec<bool> {
    let rgb = decoded.into_rgb8();
    rgb.pixels().map(|pixel| pixel.0[..2] == [0, 0]).collect()
}
