//! `sensor_msgs/Image` in any of its encodings to 8 bits per channel.
//!
//! Samples of 16 bits give their high byte: a camera that fills the range loses
//! nothing that matters, one that puts 12 bits into 16 looks dark. `8UC3` and
//! `8UC4` are blue, green, red as in OpenCV.

use super::encoding::{ENCODINGS, Layout};
use super::{ConvertError, MAX_SIDE, bayer, gray_into, rgb_into, shown, yuv};
use crate::image::{Picture, Size};
use crate::ros::message::sensor_msgs;

/// The picture in an image message.
///
/// # Errors
/// When size, encoding, step and payload do not make an image; the text has the
/// numbers.
pub fn picture(message: &sensor_msgs::Image) -> Result<Picture, ConvertError> {
    let mut out = Picture::default();
    picture_into(message, &mut out)?;
    Ok(out)
}

/// [`picture`] into a picture whose buffer is used again.
///
/// # Errors
/// As [`picture`]; `out` is unspecified then.
pub fn picture_into(message: &sensor_msgs::Image, out: &mut Picture) -> Result<(), ConvertError> {
    let size = checked_size(message.width, message.height)?;
    let layout = Layout::of(&message.encoding).ok_or_else(|| ConvertError::Encoding {
        encoding: shown(&message.encoding),
        known: ENCODINGS.join(" "),
    })?;
    // Of the two bytes of a wide sample, the high one.
    let high = usize::from(message.is_bigendian == 0);
    match layout {
        Layout::Gray { wide } => {
            let rows = rows(message, size, if wide { 2 } else { 1 })?;
            let gray = gray_into(out, size);
            for (y, row) in rows.enumerate() {
                narrow(row, wide.then_some(high), gray.row_mut(y));
            }
        }
        Layout::Color { wide, channels, red } => {
            let bytes = if wide { 2 } else { 1 };
            let rows = rows(message, size, channels * bytes)?;
            let rgb = rgb_into(out, size);
            let at = |channel: usize| channel * bytes + if wide { high } else { 0 };
            let (r, g, b) = (at(red), at(1), at(2 - red));
            for (y, row) in rows.enumerate() {
                let out = rgb.row_mut(y);
                // Each arm is a loop of its own for the optimiser: the pixel's
                // length must be a constant.
                match (channels, wide, red) {
                    (3, false, 0) => out.as_flattened_mut().copy_from_slice(row),
                    (3, false, _) => pick::<3>(row, [2, 1, 0], out),
                    (4, false, 0) => pick::<4>(row, [0, 1, 2], out),
                    (4, false, _) => pick::<4>(row, [2, 1, 0], out),
                    (3, true, _) => pick::<6>(row, [r, g, b], out),
                    _ => pick::<8>(row, [r, g, b], out),
                }
            }
        }
        Layout::Bayer { wide, pattern } => {
            let rows = rows(message, size, if wide { 2 } else { 1 })?;
            bayer::demosaic(rows, wide.then_some(high), pattern, rgb_into(out, size));
        }
        Layout::Packed(order) => {
            even(message, size, "width", size.width)?;
            let rows = rows(message, size, 2)?;
            let rgb = rgb_into(out, size);
            for (y, row) in rows.enumerate() {
                yuv::packed_row(row, order, rgb.row_mut(y));
            }
        }
        Layout::SemiPlanar(order) => {
            if order != yuv::SemiPlanar::Nv24 {
                even(message, size, "width", size.width)?;
                even(message, size, "height", size.height)?;
            }
            semi_planar(message, size, order, out)?;
        }
    }
    Ok(())
}

/// Width and height of a message, when there is an image of that size.
pub(super) fn checked_size(width: u32, height: u32) -> Result<Size, ConvertError> {
    let size = Size::new(width as usize, height as usize);
    if size.is_empty() || size.width > MAX_SIDE || size.height > MAX_SIDE {
        return Err(ConvertError::Size { size });
    }
    Ok(size)
}

/// The rows of a message without their padding, `pixel_len` bytes per pixel.
pub(super) fn rows(
    message: &sensor_msgs::Image,
    size: Size,
    pixel_len: usize,
) -> Result<impl ExactSizeIterator<Item = &[u8]>, ConvertError> {
    let row_len = size.width * pixel_len;
    let step = message.step as usize;
    if step < row_len {
        return Err(step_error(message, size, row_len));
    }
    let expected = step * size.height;
    let payload =
        message.data.get(..expected).ok_or_else(|| payload_error(message, size, expected))?;
    Ok(payload.chunks_exact(step).map(move |row| &row[..row_len]))
}

fn step_error(message: &sensor_msgs::Image, size: Size, expected: usize) -> ConvertError {
    let step = message.step as usize;
    ConvertError::Step { step, expected, size, encoding: message.encoding.clone() }
}

fn payload_error(message: &sensor_msgs::Image, size: Size, expected: usize) -> ConvertError {
    let len = message.data.len();
    ConvertError::Payload { len, expected, size, encoding: message.encoding.clone() }
}

fn even(
    message: &sensor_msgs::Image,
    size: Size,
    side: &'static str,
    length: usize,
) -> Result<(), ConvertError> {
    if length.is_multiple_of(2) {
        return Ok(());
    }
    Err(ConvertError::OddSize { side, size, encoding: message.encoding.clone() })
}

/// A luma plane and after it a plane of interleaved chroma, both with the
/// message's step. Drivers disagree about what `step` is for these encodings,
/// so a payload of exactly the packed length is taken as packed.
fn semi_planar(
    message: &sensor_msgs::Image,
    size: Size,
    order: yuv::SemiPlanar,
    out: &mut Picture,
) -> Result<(), ConvertError> {
    let packed = order.payload_len(size.width, size.height);
    let step = if message.data.len() == packed { size.width } else { message.step as usize };
    if step < size.width {
        return Err(step_error(message, size, size.width));
    }
    let expected = order.payload_len(step, size.height);
    let Some(payload) = message.data.get(..expected) else {
        return Err(payload_error(message, size, expected));
    };
    let (luma, chroma) = payload.split_at(step * size.height);
    let rgb = rgb_into(out, size);
    for (y, row) in luma.chunks_exact(step).enumerate() {
        let chroma = order.chroma_row(chroma, step, y);
        yuv::semi_planar_row(&row[..size.width], chroma, order, rgb.row_mut(y));
    }
    Ok(())
}

/// The samples of a row as bytes; `high` is the place of the high byte when
/// they are wide.
pub(super) fn narrow(row: &[u8], high: Option<usize>, out: &mut [u8]) {
    match high {
        None => out.copy_from_slice(row),
        Some(0) => pick_one::<0>(row, out),
        Some(_) => pick_one::<1>(row, out),
    }
}

fn pick_one<const AT: usize>(row: &[u8], out: &mut [u8]) {
    for (out, sample) in out.iter_mut().zip(row.as_chunks::<2>().0) {
        *out = sample[AT];
    }
}

/// Three of the `N` bytes of each pixel.
fn pick<const N: usize>(row: &[u8], [r, g, b]: [usize; 3], out: &mut [[u8; 3]]) {
    for (out, pixel) in out.iter_mut().zip(row.as_chunks::<N>().0) {
        *out = [pixel[r], pixel[g], pixel[b]];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    /// A message of `width` x `height` whose rows are padded with 0xee.
    fn message(
        encoding: &str,
        width: u32,
        height: u32,
        rows: &[&[u8]],
        padding: usize,
    ) -> sensor_msgs::Image {
        let mut data = Vec::new();
        for row in rows {
            data.extend_from_slice(row);
            data.extend(std::iter::repeat_n(0xee, padding));
        }
        sensor_msgs::Image {
            width,
            height,
            encoding: encoding.into(),
            step: (rows[0].len() + padding) as u32,
            data,
            ..Default::default()
        }
    }

    fn gray(width: usize, height: usize, data: &[u8]) -> Picture {
        Picture::Gray(Image::from_vec(Size::new(width, height), data.to_vec()).unwrap())
    }

    fn rgb(width: usize, height: usize, data: &[[u8; 3]]) -> Picture {
        Picture::Rgb(Image::from_vec(Size::new(width, height), data.to_vec()).unwrap())
    }

    #[test]
    fn gray_encodings() {
        for padding in [0, 3] {
            for encoding in ["mono8", "8UC1"] {
                let m = message(encoding, 3, 2, &[&[1, 2, 3], &[4, 5, 6]], padding);
                assert_eq!(picture(&m).unwrap(), gray(3, 2, &[1, 2, 3, 4, 5, 6]), "{encoding}");
            }
            for encoding in ["mono16", "16UC1"] {
                let mut m = message(encoding, 2, 2, &[&[1, 2, 3, 4], &[5, 6, 7, 8]], padding);
                assert_eq!(picture(&m).unwrap(), gray(2, 2, &[2, 4, 6, 8]), "{encoding}");
                m.is_bigendian = 1;
                assert_eq!(picture(&m).unwrap(), gray(2, 2, &[1, 3, 5, 7]), "{encoding}");
            }
        }
    }

    #[test]
    fn color_encodings_of_8_bits() {
        let expected = rgb(2, 1, &[[10, 20, 30], [40, 50, 60]]);
        for (encoding, row) in [
            ("rgb8", &[10, 20, 30, 40, 50, 60][..]),
            ("bgr8", &[30, 20, 10, 60, 50, 40]),
            ("8UC3", &[30, 20, 10, 60, 50, 40]),
            ("rgba8", &[10, 20, 30, 9, 40, 50, 60, 9]),
            ("bgra8", &[30, 20, 10, 9, 60, 50, 40, 9]),
            ("8UC4", &[30, 20, 10, 9, 60, 50, 40, 9]),
        ] {
            for padding in [0, 5] {
                let m = message(encoding, 2, 1, &[row], padding);
                assert_eq!(picture(&m).unwrap(), expected, "{encoding} padding {padding}");
            }
        }
    }

    #[test]
    fn color_encodings_of_16_bits_in_both_byte_orders() {
        for (encoding, channels) in [
            ("rgb16", &[10, 20, 30][..]),
            ("bgr16", &[30, 20, 10]),
            ("rgba16", &[10, 20, 30, 99]),
            ("bgra16", &[30, 20, 10, 99]),
        ] {
            for big in [false, true] {
                let pixel: Vec<u8> =
                    channels.iter().flat_map(|&c| if big { [c, 7] } else { [7, c] }).collect();
                let mut m = message(encoding, 1, 2, &[&pixel, &pixel], 1);
                m.is_bigendian = u8::from(big);
                assert_eq!(picture(&m).unwrap(), rgb(1, 2, &[[10, 20, 30]; 2]), "{encoding} {big}");
            }
        }
    }

    #[test]
    fn yuv_encodings_know_their_chroma() {
        // Y 81, U 90, V 240 is the red of ITU-R BT.601: 255, 0, 0 within rounding.
        let (y, u, v) = (81, 90, 240);
        let cases: [(&str, &[&[u8]]); 7] = [
            ("uyvy", &[&[u, y, v, y], &[u, y, v, y]]),
            ("yuv422", &[&[u, y, v, y], &[u, y, v, y]]),
            ("yuyv", &[&[y, u, y, v], &[y, u, y, v]]),
            ("yuv422_yuy2", &[&[y, u, y, v], &[y, u, y, v]]),
            ("nv12", &[&[y, y], &[y, y], &[u, v]]),
            ("nv21", &[&[y, y], &[y, y], &[v, u]]),
            ("nv24", &[&[y, y], &[y, y], &[u, v], &[u, v], &[u, v], &[u, v]]),
        ];
        for (encoding, rows) in cases {
            for padding in [0, 4] {
                // Chroma of nv24 fills two steps a row, so it cannot be padded here.
                if encoding == "nv24" && padding > 0 {
                    continue;
                }
                let m = message(encoding, 2, 2, rows, padding);
                let Picture::Rgb(image) = picture(&m).unwrap() else { panic!("{encoding}") };
                for [r, g, b] in image.pixels() {
                    assert!(*r >= 254 && *g <= 1 && *b <= 1, "{encoding}: {r} {g} {b}");
                }
            }
        }
    }

    #[test]
    fn semi_planar_payloads_with_another_idea_of_step_are_read() {
        for step in [2, 3, 4] {
            let mut m = message("nv12", 2, 2, &[&[81, 81], &[81, 81], &[90, 240]], 0);
            m.step = step;
            let Picture::Rgb(image) = picture(&m).unwrap() else { panic!() };
            assert!(image.get(1, 1)[0] >= 254, "{step}");
        }
    }

    #[test]
    fn an_unknown_encoding_is_refused_with_the_known_ones() {
        for encoding in ["", "rgb", "bayer_", "bayer_rggb", "bayer_rgbg8", "32FC1", "bayer_rggb32"]
        {
            let mut m = message("mono8", 1, 1, &[&[0]], 0);
            m.encoding = encoding.into();
            let text = picture(&m).unwrap_err().to_string();
            assert!(text.contains(&format!("'{encoding}'")) && text.contains("nv24"), "{text}");
        }
    }

    #[test]
    fn a_short_payload_is_refused_with_the_numbers() {
        let mut m = message("rgb8", 1242, 375, &[&[0; 12]], 0);
        m.step = 3726;
        assert_eq!(
            picture(&m).unwrap_err().to_string(),
            "image payload is 12 bytes, 1397250 expected for 1242x375 rgb8"
        );
        for encoding in ENCODINGS {
            let m = sensor_msgs::Image {
                width: 16,
                height: 8,
                step: 128,
                encoding: encoding.into(),
                data: vec![0; 1023],
                ..Default::default()
            };
            let error = picture(&m).unwrap_err();
            assert!(
                matches!(error, ConvertError::Payload { len: 1023, .. }),
                "{encoding}: {error}"
            );
        }
    }

    #[test]
    fn a_step_shorter_than_a_row_is_refused() {
        let mut m = message("bgr8", 4, 2, &[&[0; 12], &[0; 12]], 0);
        m.step = 11;
        assert_eq!(
            picture(&m).unwrap_err().to_string(),
            "image step is 11 bytes, but a row of 4x2 bgr8 has 12"
        );
        m.step = 0;
        assert!(matches!(picture(&m), Err(ConvertError::Step { step: 0, .. })));
        m.encoding = "nv12".into();
        assert!(matches!(picture(&m), Err(ConvertError::Step { expected: 4, .. })));
    }

    #[test]
    fn empty_and_absurd_sizes_are_refused() {
        for (width, height) in
            [(0, 0), (0, 3), (3, 0), (16385, 1), (1, 16385), (u32::MAX, u32::MAX)]
        {
            let m = sensor_msgs::Image {
                width,
                height,
                step: u32::MAX,
                encoding: "mono8".into(),
                ..Default::default()
            };
            let error = picture(&m).unwrap_err();
            assert!(error.to_string().contains(&format!("{width}x{height}")), "{error}");
        }
    }

    #[test]
    fn chroma_needs_even_sizes() {
        for (encoding, width, height, side) in [
            ("uyvy", 3, 2, "width"),
            ("yuyv", 3, 2, "width"),
            ("nv12", 2, 3, "height"),
            ("nv21", 3, 2, "width"),
        ] {
            let m = message(encoding, width, height, &[&[0; 64], &[0; 64], &[0; 64], &[0; 64]], 0);
            let text = picture(&m).unwrap_err().to_string();
            assert!(text.contains(encoding) && text.contains(side), "{text}");
        }
        let m = message("nv24", 3, 1, &[&[0; 9]], 0);
        assert!(picture(&m).is_ok());
    }

    #[test]
    fn the_buffer_is_used_again_and_the_form_may_change() {
        let color = message("bgr8", 8, 8, &[&[1; 24][..]; 8], 0);
        let mut out = Picture::default();
        picture_into(&color, &mut out).unwrap();
        let Picture::Rgb(image) = &out else { panic!() };
        let buffer = image.pixels().as_ptr();
        picture_into(&color, &mut out).unwrap();
        let Picture::Rgb(image) = &out else { panic!() };
        assert_eq!(image.pixels().as_ptr(), buffer);
        picture_into(&message("mono8", 2, 1, &[&[1, 2]], 0), &mut out).unwrap();
        assert_eq!(out, gray(2, 1, &[1, 2]));
    }
}
