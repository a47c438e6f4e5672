//! The `.flo` format of the Middlebury flow benchmark (Baker et al. 2011):
//! magic 202021.25, width, height, then `[u, v]` row by row, all little-endian.

use std::path::Path;

use super::super::DatasetError;
use super::{bytes, claimed_size, fault, no_pixels};
use crate::image::Image;

/// First four bytes: 202021.25 as a little-endian float.
const MAGIC: [u8; 4] = *b"PIEH";
const HEADER: usize = 12;
/// Motion beyond this is unknown.
const UNKNOWN: f32 = 1e9;

/// The motion in a file, NaN where unknown.
///
/// # Errors
/// Another magic, a size that the file's length does not match.
pub fn read(path: &Path) -> Result<Image<[f32; 2]>, DatasetError> {
    let bytes = bytes(path)?;
    let Some((header, payload)) = bytes.split_at_checked(HEADER) else {
        let len = bytes.len();
        return Err(fault(path, &format!("{len} bytes are less than the header of a .flo file")));
    };
    let (words, _) = header.as_chunks::<4>();
    let &[magic, width, height] = words else { return Err(no_pixels(path)) };
    if magic != MAGIC {
        let found = f32::from_le_bytes(magic);
        return Err(fault(path, &format!("it starts with {found}, a .flo file with 202021.25")));
    }
    let [width, height] = [width, height].map(u32::from_le_bytes);
    let size = claimed_size(path, [width.into(), height.into()], 8, payload.len())?;
    let (words, _) = payload.as_chunks::<8>();
    let motion = |word: &[u8; 8]| {
        let [a, b, c, d, e, f, g, h] = *word;
        let motion = [f32::from_le_bytes([a, b, c, d]), f32::from_le_bytes([e, f, g, h])];
        // NaN fails the comparison.
        let known = motion.iter().all(|v| v.abs() <= UNKNOWN);
        if known { motion } else { [f32::NAN; 2] }
    };
    let values = words.iter().take(size.area()).map(motion).collect();
    Image::from_vec(size, values).ok_or_else(|| no_pixels(path))
}
