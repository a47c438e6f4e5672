//! Image files of data sets.

pub mod disparity;
pub mod flo;
pub mod flow;
pub mod hdf5;
pub mod indexed;
pub mod mask;
pub mod objects;
pub mod pfm;

use std::fs;
use std::io::Cursor;
use std::path::Path;

use image::{ColorType, DynamicImage, ImageReader, Limits};

use super::DatasetError;
use crate::image::{Image, Picture, Size};

/// Largest width and height.
pub const MAX_SIDE: u32 = 16384;
/// Largest file, and most bytes that decoding may take.
pub const MAX_BYTES: u64 = 1 << 30;

/// The picture in a PNG, JPEG or PNM file: gray when the file is, else RGB.
///
/// # Errors
/// When the file cannot be read or decoded.
pub fn picture(path: &Path) -> Result<Picture, DatasetError> {
    let decoded = decode(path)?;
    let size = size_of(&decoded);
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
        _ => Err(no_pixels(path)),
    }
}

/// An image file of any pixel format, within the limits.
pub fn decode(path: &Path) -> Result<DynamicImage, DatasetError> {
    let io = |source| DatasetError::Io { path: path.to_owned(), source };
    let bytes = bytes(path)?;
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(io)?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    reader.decode().map_err(|e| fault(path, &e.to_string()))
}

/// Width and height of an image file, from its header.
pub fn dimensions(path: &Path) -> Result<(u32, u32), DatasetError> {
    let io = |source| DatasetError::Io { path: path.to_owned(), source };
    let reader = ImageReader::open(path).map_err(io)?.with_guessed_format().map_err(io)?;
    reader.into_dimensions().map_err(|e| fault(path, &e.to_string()))
}

/// The content of a file of limited length.
pub fn bytes(path: &Path) -> Result<Vec<u8>, DatasetError> {
    let io = |source| DatasetError::Io { path: path.to_owned(), source };
    let len = fs::metadata(path).map_err(io)?.len();
    if len > MAX_BYTES {
        return Err(fault(path, &format!("{len} bytes are too many for an image")));
    }
    fs::read(path).map_err(io)
}

/// The values of an image of gray pixels, which may be stored as gray, as
/// colours that are all gray, or as a palette of such.
pub fn gray(path: &Path, decoded: DynamicImage) -> Result<Image<u8>, DatasetError> {
    let size = size_of(&decoded);
    let values = match decoded {
        DynamicImage::ImageLuma8(gray) => gray.into_raw(),
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            let bytes = decoded.into_rgb8().into_raw();
            let (pixels, _) = bytes.as_chunks::<3>();
            if let Some([r, g, b]) = pixels.iter().find(|[r, g, b]| r != g || g != b) {
                return Err(fault(path, &format!("gray is needed, not colours like {r} {g} {b}")));
            }
            pixels.iter().map(|[value, ..]| *value).collect()
        }
        other => {
            let found = other.color();
            return Err(fault(path, &format!("8-bit gray is needed, not {found:?}")));
        }
    };
    Image::from_vec(size, values).ok_or_else(|| no_pixels(path))
}

/// The size that a header claims for pixels of `bytes_per_pixel`, unless it is
/// beyond what is taken or what the `available` bytes can hold.
pub fn claimed_size(
    path: &Path,
    [width, height]: [u64; 2],
    bytes_per_pixel: u64,
    available: usize,
) -> Result<Size, DatasetError> {
    let side = 1..=u64::from(MAX_SIDE);
    if !side.contains(&width) || !side.contains(&height) {
        let fault_text =
            format!("its header says {width}x{height}; sides of 1 to {MAX_SIDE} pixels are taken");
        return Err(fault(path, &fault_text));
    }
    let needed = width * height * bytes_per_pixel;
    if needed > available as u64 {
        let fault_text =
            format!("{width}x{height} pixels take {needed} bytes, but {available} are there");
        return Err(fault(path, &fault_text));
    }
    Ok(Size::new(width as usize, height as usize))
}

/// Refuses what is not of the size of the left image.
pub fn check_size(path: &Path, found: Size, left: Size) -> Result<(), DatasetError> {
    if found == left {
        return Ok(());
    }
    Err(DatasetError::SizesDiffer { path: path.to_owned(), found, left })
}

pub fn size_of(decoded: &DynamicImage) -> Size {
    Size::new(decoded.width() as usize, decoded.height() as usize)
}

pub fn fault(path: &Path, fault: &str) -> DatasetError {
    DatasetError::Image { path: path.to_owned(), fault: fault.to_owned() }
}

pub fn no_pixels(path: &Path) -> DatasetError {
    fault(path, "it has no pixels")
}
