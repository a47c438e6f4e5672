//! `sensor_msgs/CompressedImage`: JPEG and PNG, told apart by their first bytes
//! because `format` is free text.

use std::io::Cursor;

use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::{ConvertError, MAX_SIDE, gray_into, rgb_into, shown};
use crate::image::{Image, Picture, Size};
use crate::ros::message::sensor_msgs::CompressedImage;

/// More pixels are not decoded: a few kilobytes of PNG can claim gigabytes.
const MAX_PIXELS: usize = 1 << 26;

/// What a decoder may take besides the pixels that it returns.
const MAX_DECODER_BYTES: u64 = 1 << 30;

/// The picture in a compressed image; 16-bit samples give their high byte,
/// transparency is dropped.
///
/// # Errors
/// When it is neither JPEG nor PNG, claims too many pixels, is damaged or cut.
pub fn compressed_picture(message: &CompressedImage) -> Result<Picture, ConvertError> {
    let mut out = Picture::default();
    compressed_picture_into(message, &mut out)?;
    Ok(out)
}

/// [`compressed_picture`] into a picture whose buffer is used again.
///
/// # Errors
/// As [`compressed_picture`]; `out` is unspecified then.
pub fn compressed_picture_into(
    message: &CompressedImage,
    out: &mut Picture,
) -> Result<(), ConvertError> {
    let file = File::open(message)?;
    let decoder = file.decoder()?;
    let size = file.size(&decoder)?;
    let read = |decoder: _, buffer: &mut [u8]| {
        ImageDecoder::read_image(decoder, buffer).map_err(|e| file.error(e.to_string()))
    };
    let color = decoder.color_type();
    match color {
        ColorType::L8 => return read(decoder, gray_into(out, size).pixels_mut()),
        ColorType::Rgb8 => {
            return read(decoder, rgb_into(out, size).pixels_mut().as_flattened_mut());
        }
        _ => {}
    }
    let mut samples = vec![0; size.area() * usize::from(color.bytes_per_pixel())];
    read(decoder, &mut samples)?;
    match color {
        ColorType::La8 => fill::<2, _>(&samples, gray_into(out, size), |p| p[0]),
        ColorType::Rgba8 => fill::<4, _>(&samples, rgb_into(out, size), |p| [p[0], p[1], p[2]]),
        ColorType::L16 => fill::<2, _>(&samples, gray_into(out, size), |p| high(p, 0)),
        ColorType::La16 => fill::<4, _>(&samples, gray_into(out, size), |p| high(p, 0)),
        ColorType::Rgb16 => {
            fill::<6, _>(&samples, rgb_into(out, size), |p| [0, 1, 2].map(|c| high(p, c)));
        }
        ColorType::Rgba16 => {
            fill::<8, _>(&samples, rgb_into(out, size), |p| [0, 1, 2].map(|c| high(p, c)));
        }
        other => return Err(file.error(format!("pixels of type {other:?} are not read"))),
    }
    Ok(())
}

/// The samples of a 16-bit gray PNG, as truth maps have them.
///
/// # Errors
/// As [`compressed_picture`], and when the pixels are not 16-bit gray.
pub fn compressed_u16(message: &CompressedImage) -> Result<Image<u16>, ConvertError> {
    let file = File::open(message)?;
    let decoder = file.decoder()?;
    let size = file.size(&decoder)?;
    let color = decoder.color_type();
    if color != ColorType::L16 {
        return Err(ConvertError::Depth { found: format!("{color:?}") });
    }
    let mut samples = vec![0; 2 * size.area()];
    decoder.read_image(&mut samples).map_err(|e| file.error(e.to_string()))?;
    let mut out = Image::new(size);
    fill::<2, _>(&samples, &mut out, |p| u16::from_ne_bytes(*p));
    Ok(out)
}

/// A compressed file in memory whose kind is known.
struct File<'a> {
    data: &'a [u8],
    format: ImageFormat,
    kind: &'static str,
}

impl<'a> File<'a> {
    fn open(message: &'a CompressedImage) -> Result<Self, ConvertError> {
        let data = &message.data[..];
        let file = if data.starts_with(&[0xff, 0xd8, 0xff]) {
            Self { data, format: ImageFormat::Jpeg, kind: "JPEG" }
        } else if data.starts_with(b"\x89PNG\r\n\x1a\n") {
            Self { data, format: ImageFormat::Png, kind: "PNG" }
        } else {
            return Err(ConvertError::Format {
                format: shown(&message.format),
                begin: data.iter().take(4).copied().collect(),
            });
        };
        // The JPEG decoder paints what is missing of a cut file gray.
        if file.format == ImageFormat::Jpeg && !jpeg_is_whole(data) {
            return Err(file.error("the file ends before its picture does".into()));
        }
        Ok(file)
    }

    fn decoder(&self) -> Result<impl ImageDecoder, ConvertError> {
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_SIDE as u32);
        limits.max_image_height = Some(MAX_SIDE as u32);
        limits.max_alloc = Some(MAX_DECODER_BYTES);
        let mut reader = ImageReader::with_format(Cursor::new(self.data), self.format);
        reader.limits(limits);
        reader.into_decoder().map_err(|e| self.error(e.to_string()))
    }

    /// The size, when it is one that we decode.
    fn size(&self, decoder: &impl ImageDecoder) -> Result<Size, ConvertError> {
        let (width, height) = decoder.dimensions();
        let size = Size::new(width as usize, height as usize);
        if size.is_empty() {
            return Err(self.error(format!("its size is {size}")));
        }
        if size.width > MAX_SIDE || size.height > MAX_SIDE || size.area() > MAX_PIXELS {
            return Err(ConvertError::CompressedSize { size });
        }
        Ok(size)
    }

    fn error(&self, reason: String) -> ConvertError {
        ConvertError::Compressed { kind: self.kind, len: self.data.len(), reason }
    }
}

/// True when an end marker (EOI) follows the last scan (SOS). Neither can occur
/// inside a scan, where each `ff` of the data is followed by a zero.
fn jpeg_is_whole(data: &[u8]) -> bool {
    let last = |marker: u8| data.windows(2).rposition(|pair| pair == [0xff, marker]);
    match (last(0xda), last(0xd9)) {
        (Some(scan), Some(end)) => end > scan,
        _ => false,
    }
}

/// Pixels from `N` bytes each.
fn fill<const N: usize, T: Copy + Default>(
    samples: &[u8],
    out: &mut Image<T>,
    pixel: impl Fn(&[u8; N]) -> T,
) {
    for (out, sample) in out.pixels_mut().iter_mut().zip(samples.as_chunks::<N>().0) {
        *out = pixel(sample);
    }
}

/// The high byte of 16-bit sample number `channel`, which the decoders deliver
/// in the machine's byte order.
fn high(pixel: &[u8], channel: usize) -> u8 {
    pixel[2 * channel + usize::from(cfg!(target_endian = "little"))]
}

#[cfg(test)]
mod tests {
    use image::codecs::jpeg::JpegEncoder;
    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType, ImageEncoder};

    use super::*;

    fn png(bytes: &[u8], width: u32, height: u32, color: ExtendedColorType) -> Vec<u8> {
        let mut out = Vec::new();
        PngEncoder::new(&mut out).write_image(bytes, width, height, color).unwrap();
        out
    }

    fn jpeg(bytes: &[u8], width: u32, height: u32, color: ExtendedColorType) -> Vec<u8> {
        let mut out = Vec::new();
        JpegEncoder::new_with_quality(&mut out, 95)
            .write_image(bytes, width, height, color)
            .unwrap();
        out
    }

    fn message(format: &str, data: Vec<u8>) -> CompressedImage {
        CompressedImage { format: format.into(), data, ..Default::default() }
    }

    fn wide(values: &[u16]) -> Vec<u8> {
        values.iter().flat_map(|v| v.to_ne_bytes()).collect()
    }

    #[test]
    fn every_kind_of_png_is_read() {
        let size = Size::new(2, 1);
        let gray = Picture::Gray(Image::from_vec(size, vec![10, 40]).unwrap());
        let rgb = Picture::Rgb(Image::from_vec(size, vec![[10, 20, 30], [40, 50, 60]]).unwrap());
        let w = |values: &[u8]| {
            wide(&values.iter().map(|v| u16::from(*v) << 8 | 7).collect::<Vec<_>>())
        };
        let cases = [
            (vec![10, 40], ExtendedColorType::L8, &gray),
            (vec![10, 9, 40, 9], ExtendedColorType::La8, &gray),
            (vec![10, 20, 30, 40, 50, 60], ExtendedColorType::Rgb8, &rgb),
            (vec![10, 20, 30, 9, 40, 50, 60, 9], ExtendedColorType::Rgba8, &rgb),
            (w(&[10, 40]), ExtendedColorType::L16, &gray),
            (w(&[10, 9, 40, 9]), ExtendedColorType::La16, &gray),
            (w(&[10, 20, 30, 40, 50, 60]), ExtendedColorType::Rgb16, &rgb),
            (w(&[10, 20, 30, 9, 40, 50, 60, 9]), ExtendedColorType::Rgba16, &rgb),
        ];
        for (bytes, color, expected) in cases {
            let m = message("png", png(&bytes, 2, 1, color));
            assert_eq!(&compressed_picture(&m).unwrap(), expected, "{color:?}");
        }
    }

    #[test]
    fn jpegs_are_read_also_when_the_format_lies() {
        let m = message("png", jpeg(&[120; 16 * 8 * 3], 16, 8, ExtendedColorType::Rgb8));
        let Picture::Rgb(image) = compressed_picture(&m).unwrap() else { panic!() };
        assert_eq!(image.size(), Size::new(16, 8));
        assert!(image.pixels().iter().flatten().all(|v| v.abs_diff(120) <= 2));
        let m = message("", jpeg(&[77; 16 * 8], 16, 8, ExtendedColorType::L8));
        let Picture::Gray(image) = compressed_picture(&m).unwrap() else { panic!() };
        assert!(image.pixels().iter().all(|v| v.abs_diff(77) <= 2));
    }

    #[test]
    fn sixteen_bit_maps_keep_all_bits() {
        let m = message("png", png(&wide(&[1, 65535, 256]), 3, 1, ExtendedColorType::L16));
        assert_eq!(compressed_u16(&m).unwrap().pixels(), [1, 65535, 256]);
        let m = message("png", png(&[1, 2, 3], 3, 1, ExtendedColorType::L8));
        let text = compressed_u16(&m).unwrap_err().to_string();
        assert!(text.contains("L8"), "{text}");
    }

    #[test]
    fn what_is_neither_is_refused_with_its_first_bytes() {
        let m = message("h264\n", vec![0, 0, 0, 1, 0x67]);
        assert_eq!(
            compressed_picture(&m).unwrap_err().to_string(),
            "compressed image is neither JPEG nor PNG: format says 'h264\\n', data begins with [00, 00, 00, 01]"
        );
        assert!(compressed_picture(&message("jpeg", Vec::new())).is_err());
    }

    #[test]
    fn every_cut_is_an_error() {
        let noise: Vec<u8> =
            (0..32 * 24 * 3_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        for (kind, data) in [
            ("PNG", png(&noise, 32, 24, ExtendedColorType::Rgb8)),
            ("JPEG", jpeg(&noise, 32, 24, ExtendedColorType::Rgb8)),
        ] {
            assert!(compressed_picture(&message("", data.clone())).is_ok(), "{kind}");
            // Behind the pixels of a PNG stands only its end chunk of 12 bytes.
            let whole = if kind == "PNG" { data.len() - 16 } else { data.len() };
            for len in (0..whole).step_by(7) {
                let cut = message("", data[..len].to_vec());
                assert!(compressed_picture(&cut).is_err(), "{kind} cut at {len}");
            }
        }
    }

    #[test]
    fn damage_never_panics() {
        let noise: Vec<u8> =
            (0..16 * 16 * 3_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        for data in [
            png(&noise, 16, 16, ExtendedColorType::Rgb8),
            jpeg(&noise, 16, 16, ExtendedColorType::Rgb8),
        ] {
            for at in 0..data.len() {
                let mut damaged = data.clone();
                damaged[at] ^= 0x55;
                let _ = compressed_picture(&message("", damaged));
            }
        }
    }

    #[test]
    fn a_claim_of_too_many_pixels_is_refused_before_decoding() {
        let mut data = png(&[0; 4], 2, 2, ExtendedColorType::L8);
        for (width, height) in [(16384_u32, 16384_u32), (100_000, 2), (0, 2)] {
            data[16..20].copy_from_slice(&width.to_be_bytes());
            data[20..24].copy_from_slice(&height.to_be_bytes());
            let crc = crc32(&data[12..29]);
            data[29..33].copy_from_slice(&crc.to_be_bytes());
            let error = compressed_picture(&message("", data.clone())).unwrap_err();
            if width == 16384 {
                assert_eq!(error, ConvertError::CompressedSize { size: Size::new(16384, 16384) });
            }
        }
    }

    fn crc32(bytes: &[u8]) -> u32 {
        let mut crc = u32::MAX;
        for byte in bytes {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
            }
        }
        !crc
    }
}
