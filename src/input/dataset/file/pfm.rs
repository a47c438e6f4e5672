//! Portable float maps: `Pf`, width and height, a scale whose sign tells the
//! byte order (negative: little-endian), then rows of floats, the lowest first.

use std::path::Path;

use super::super::DatasetError;
use super::{bytes, claimed_size, fault, no_pixels};
use crate::image::Image;

/// Longest header that is looked at.
const MAX_HEADER: usize = 128;

/// The disparity in a file with one channel; what is not finite is unknown (NaN).
///
/// # Errors
/// Another header, a size that the file's length does not match.
pub fn read(path: &Path) -> Result<Image<f32>, DatasetError> {
    let bytes = bytes(path)?;
    let mut start = 0;
    let mut token = |what: &str| {
        token(&bytes, &mut start)
            .ok_or_else(|| fault(path, &format!("its PFM header ends before the {what}")))
    };
    let magic = token("magic")?;
    if magic != "Pf" {
        let shown: String = magic.chars().take(8).collect();
        return Err(fault(
            path,
            &format!("it starts with {shown:?}, a PFM of one channel with Pf"),
        ));
    }
    let (width, height) = (token("width")?, token("height")?);
    let sides = width.parse().ok().zip(height.parse().ok());
    let Some((width, height)) = sides else {
        return Err(fault(path, &format!("its PFM header says a size of {width} x {height}")));
    };
    let scale = token("scale")?;
    let Some(scale) = scale.parse::<f32>().ok().filter(|s| s.is_finite() && *s != 0.0) else {
        return Err(fault(path, &format!("its PFM header says a scale of {scale}")));
    };
    let payload = bytes.get(start..).unwrap_or_default();
    let size = claimed_size(path, [width, height], 4, payload.len())?;
    let (words, _) = payload.as_chunks::<4>();
    let value = |word: [u8; 4]| {
        let d = if scale < 0.0 { f32::from_le_bytes(word) } else { f32::from_be_bytes(word) };
        if d.is_finite() { d } else { f32::NAN }
    };
    let rows = words[..size.area()].chunks_exact(size.width).rev();
    let values = rows.flatten().map(|word| value(*word)).collect();
    Image::from_vec(size, values).ok_or_else(|| no_pixels(path))
}

/// The next word of the header and the one byte of white space after it.
fn token<'a>(bytes: &'a [u8], start: &mut usize) -> Option<&'a str> {
    let header = bytes.get(*start..bytes.len().min(MAX_HEADER))?;
    let blank = header.iter().take_while(|b| b.is_ascii_whitespace()).count();
    let len = header[blank..].iter().position(u8::is_ascii_whitespace)?;
    let word = &header[blank..blank + len];
    *start += blank + len + 1;
    str::from_utf8(word).ok()
}
