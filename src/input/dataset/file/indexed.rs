//! PNG files whose pixels are indices: what decoders turn into colours is here
//! the number of an object.

use std::io::Cursor;
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use super::super::DatasetError;
use super::{MAX_BYTES, bytes, claimed_size, fault, no_pixels};
use crate::image::Image;

/// The indices of a palette image, or `None` when the file has no palette.
///
/// # Errors
/// When the file cannot be read or decoded.
pub fn read(path: &Path) -> Result<Option<Image<u8>>, DatasetError> {
    let failed = |e: png::DecodingError| fault(path, &e.to_string());
    let limits = Limits { bytes: MAX_BYTES as usize };
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes(path)?), limits);
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(failed)?;
    let info = reader.info();
    if info.color_type != ColorType::Indexed {
        return Ok(None);
    }
    let (width, height) = (info.width, info.height);
    let bits = match info.bit_depth {
        BitDepth::One => 1,
        BitDepth::Two => 2,
        BitDepth::Four => 4,
        BitDepth::Eight | BitDepth::Sixteen => 8,
    };
    // Compressed pixels may take few bytes: only the sides are checked.
    let size = claimed_size(path, [width.into(), height.into()], 1, MAX_BYTES as usize)?;
    let mut packed = vec![0; reader.output_buffer_size().ok_or_else(|| no_pixels(path))?];
    reader.next_frame(&mut packed).map_err(failed)?;
    let line = reader.output_line_size(width).ok_or_else(|| no_pixels(path))?;
    let per_byte = 8 / bits;
    let index = |row: &[u8], x: usize| {
        // The leftmost pixel has the highest bits.
        let shift = 8 - bits * (x % per_byte + 1);
        (row[x / per_byte] >> shift) & (u8::MAX >> (8 - bits))
    };
    let rows = packed.chunks_exact(line.max(1)).take(size.height);
    let indices = rows.flat_map(|row| (0..size.width).map(move |x| index(row, x))).collect();
    Image::from_vec(size, indices).map(Some).ok_or_else(|| no_pixels(path))
}
