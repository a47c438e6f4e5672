//! Image files of data sets.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use image::{ColorType, DynamicImage, ImageReader, Limits};

use super::DatasetError;
use crate::image::{Image, Picture, Size};

/// Largest width and height.
const MAX_SIDE: u32 = 16384;
/// Largest file, and most bytes that decoding may take.
const MAX_BYTES: u64 = 1 << 30;

/// The picture in a PNG, JPEG or PNM file: gray when the file is, else RGB.
///
/// # Errors
/// When the file cannot be read or decoded.
pub fn picture(path: &Path) -> Result<Picture, DatasetError> {
    let decoded = decode(path)?;
    let size = Size::new(decoded.width() as usize, decoded.height() as usize);
    let gray = matches!(
        decoded.color(),
        ColorType::L8 | ColorType::L16 | ColorType::La8 | ColorType::La16
    );
    let picture = if gray {
        Image::from_vec(size, decoded.into_luma8().into_raw()).map(Picture::Gray)
    } else {
        let bytes = decoded.into_rgb8().into_raw();
        let (pixels, _) = bytes.as_chunks::<3>();
        Image::from_vec(size, pixels.to_vec()).map(Picture::Rgb)
    };
    match picture {
        Some(picture) if !size.is_empty() => Ok(picture),
        _ => Err(fault(path, "it has no pixels")),
    }
}

/// The disparity in a 16-bit gray PNG: value / 256 pixels, NaN for 0.
///
/// # Errors
/// When the file cannot be read or holds other pixels.
pub fn disparity(path: &Path) -> Result<Image<f32>, DatasetError> {
    let decoded = decode(path)?;
    let size = Size::new(decoded.width() as usize, decoded.height() as usize);
    let DynamicImage::ImageLuma16(coded) = decoded else {
        let found = decoded.color();
        return Err(fault(path, &format!("16-bit gray is needed for disparity, not {found:?}")));
    };
    let values = coded.into_raw();
    let values = values.into_iter().map(|v| if v == 0 { f32::NAN } else { f32::from(v) / 256.0 });
    Image::from_vec(size, values.collect()).ok_or_else(|| fault(path, "it has no pixels"))
}

fn decode(path: &Path) -> Result<DynamicImage, DatasetError> {
    let io = |source| DatasetError::Io { path: path.to_owned(), source };
    let len = fs::metadata(path).map_err(io)?.len();
    if len > MAX_BYTES {
        return Err(fault(path, &format!("{len} bytes are too many for an image")));
    }
    let bytes = fs::read(path).map_err(io)?;
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(io)?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    reader.decode().map_err(|e| fault(path, &e.to_string()))
}

fn fault(path: &Path, fault: &str) -> DatasetError {
    DatasetError::Image { path: path.to_owned(), fault: fault.to_owned() }
}
