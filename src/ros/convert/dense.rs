//! Whole images out, and truth maps in.

use super::picture::{checked_size, rows};
use super::{ConvertError, camera_info, header, shown};
use crate::config::DepthEncoding;
use crate::image::{Image, Picture, Size};
use crate::perception::{DISPARITY_STEP, Perception};
use crate::ros::message::sensor_msgs::{self, CameraInfo, RegionOfInterest};
use crate::ros::message::std_msgs::Header;
use crate::ros::message::stereo_msgs::DisparityImage;

/// The disparity with all that turns it into depth, every field set.
///
/// A pixel without disparity has the value `min_disparity - 1`, never NaN. The
/// valid window is the part of the left image whose pixels can have a partner
/// in the right one within the searched range.
pub fn disparity_image(perception: &Perception) -> DisparityImage {
    let header = header(perception);
    let rig = &perception.rig;
    let (min_disparity, max_disparity) = (perception.min_disparity, perception.max_disparity);
    let invalid = min_disparity - 1.0;
    let values = perception.disparity.pixels().iter();
    let values = values.map(|d| if d.is_nan() { invalid } else { *d });
    DisparityImage {
        image: packed(
            header.clone(),
            perception.disparity.size(),
            "32FC1",
            values.map(f32::to_le_bytes),
        ),
        header,
        f: rig.focal_px() as f32,
        t: rig.baseline_m as f32,
        valid_window: valid_window(
            perception.disparity.size(),
            f64::from(min_disparity) + rig.disparity_offset(),
            f64::from(max_disparity) + rig.disparity_offset(),
        ),
        min_disparity,
        max_disparity,
        delta_d: DISPARITY_STEP,
    }
}

/// The columns x that have a partner x - d inside the image for some d of
/// `min..=max`, all rows; never beyond the image.
fn valid_window(size: Size, min: f64, max: f64) -> RegionOfInterest {
    let width = size.width as f64;
    let first = min.ceil().clamp(0.0, width);
    let end = (width + max.floor()).clamp(first, width);
    RegionOfInterest {
        x_offset: first as u32,
        y_offset: 0,
        height: size.height as u32,
        width: (end - first) as u32,
        do_rectify: false,
    }
}

/// The depth image (REP 118).
///
/// `32FC1` has metres, NaN unknown, +Inf too far, -Inf too near (REP 117).
/// `16UC1` has millimetres and 0 for everything else, also beyond 65.535 m.
pub fn depth_image(perception: &Perception, encoding: DepthEncoding) -> sensor_msgs::Image {
    let (size, header) = (perception.depth.size(), header(perception));
    let values = perception.depth.pixels().iter();
    match encoding {
        DepthEncoding::F32 => packed(header, size, "32FC1", values.map(|z| z.to_le_bytes())),
        DepthEncoding::U16 => {
            packed(header, size, "16UC1", values.map(|z| millimetres(*z).to_le_bytes()))
        }
    }
}

pub(super) fn millimetres(metres: f32) -> u16 {
    let rounded = (metres * 1000.0).round();
    // NaN and both infinities fail the comparison.
    if (0.0..=f32::from(u16::MAX)).contains(&rounded) { rounded as u16 } else { 0 }
}

/// The camera info of the processed left view, to which depth refers.
pub fn depth_camera_info(perception: &Perception) -> CameraInfo {
    camera_info(&perception.rig.left, header(perception))
}

/// Confidence of the disparity as `32FC1`, 0..=1.
pub fn confidence_image(perception: &Perception) -> sensor_msgs::Image {
    float_image(&perception.confidence, header(perception))
}

/// Saliency as `32FC1`, 0..=1.
pub fn saliency_image(perception: &Perception) -> sensor_msgs::Image {
    float_image(&perception.saliency(), header(perception))
}

/// Any labels as `mono16`.
pub fn label_image(labels: &Image<u16>, header: Header) -> sensor_msgs::Image {
    packed(header, labels.size(), "mono16", labels.pixels().iter().map(|v| v.to_le_bytes()))
}

/// Any numbers as `32FC1`.
pub fn float_image(image: &Image<f32>, header: Header) -> sensor_msgs::Image {
    packed(header, image.size(), "32FC1", image.pixels().iter().map(|v| v.to_le_bytes()))
}

/// Colours as `rgb8`.
pub fn rgb_image(image: &Image<[u8; 3]>, header: Header) -> sensor_msgs::Image {
    packed(header, image.size(), "rgb8", image.pixels().iter().copied())
}

/// A picture as `mono8` or `rgb8`.
pub fn picture_image(picture: &Picture, header: Header) -> sensor_msgs::Image {
    match picture {
        Picture::Gray(image) => {
            packed(header, image.size(), "mono8", image.pixels().iter().map(|v| [*v]))
        }
        Picture::Rgb(image) => rgb_image(image, header),
    }
}

/// A little-endian message without padding, from the `N` bytes of each pixel.
fn packed<const N: usize>(
    header: Header,
    size: Size,
    encoding: &str,
    pixels: impl Iterator<Item = [u8; N]>,
) -> sensor_msgs::Image {
    let mut data = vec![0; size.area() * N];
    for (out, pixel) in data.as_chunks_mut::<N>().0.iter_mut().zip(pixels) {
        *out = pixel;
    }
    sensor_msgs::Image {
        header,
        height: size.height as u32,
        width: size.width as u32,
        encoding: encoding.into(),
        is_bigendian: 0,
        step: (size.width * N) as u32,
        data,
    }
}

/// The numbers of a `32FC1` image.
///
/// # Errors
/// When it is of another encoding, or size, step and payload do not fit.
pub fn floats(message: &sensor_msgs::Image) -> Result<Image<f32>, ConvertError> {
    let from = if message.is_bigendian == 0 { f32::from_le_bytes } else { f32::from_be_bytes };
    unpacked(message, &["32FC1"], from)
}

/// The numbers of a `mono16` or `16UC1` image.
///
/// # Errors
/// When it is of another encoding, or size, step and payload do not fit.
pub fn labels(message: &sensor_msgs::Image) -> Result<Image<u16>, ConvertError> {
    let from = if message.is_bigendian == 0 { u16::from_le_bytes } else { u16::from_be_bytes };
    unpacked(message, &["mono16", "16UC1"], from)
}

fn unpacked<const N: usize, T: Copy + Default>(
    message: &sensor_msgs::Image,
    encodings: &[&str],
    from: impl Fn([u8; N]) -> T,
) -> Result<Image<T>, ConvertError> {
    if !encodings.contains(&message.encoding.as_str()) {
        return Err(ConvertError::Encoding {
            encoding: shown(&message.encoding),
            known: encodings.join(" "),
        });
    }
    let size = checked_size(message.width, message.height)?;
    let rows = rows(message, size, N)?;
    let mut image = Image::new(size);
    for (y, row) in rows.enumerate() {
        for (out, bytes) in image.row_mut(y).iter_mut().zip(row.as_chunks::<N>().0) {
            *out = from(*bytes);
        }
    }
    Ok(image)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::camera::{Camera, StereoRig};
    use crate::ros::convert::picture;
    use crate::stamp::Stamp;

    fn perception() -> Perception {
        let size = Size::new(3, 2);
        let camera = |cx, tx| Camera::pinhole(size, 400.0, cx, 1.0, tx);
        let rig = StereoRig::new(camera(2.5, 0.0), camera(1.0, -100.0), 0.0).unwrap();
        let mut p = Perception::new(size, Arc::new(rig));
        p.stamp = Stamp(1_500_000_000);
        p.frame_id = Arc::from("left_optical");
        (p.min_disparity, p.max_disparity) = (0.5, 63.5);
        p.disparity.set(1, 0, 12.25);
        p.depth = Image::from_vec(
            size,
            vec![1.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 70.0, 0.0004],
        )
        .unwrap();
        p.attention.set(0, 0, 0.25);
        p.confidence.set(2, 1, 0.75);
        p
    }

    #[test]
    fn every_field_of_the_disparity_image_is_set() {
        let p = perception();
        let m = disparity_image(&p);
        assert_eq!((m.header.stamp.sec, m.header.stamp.nanosec), (1, 500_000_000));
        assert_eq!(m.header.frame_id, "left_optical");
        assert_eq!(m.image.header, m.header);
        assert_eq!(
            (m.image.encoding.as_str(), m.image.step, m.image.is_bigendian),
            ("32FC1", 12, 0)
        );
        assert_eq!((m.f, m.t), (400.0, 0.25));
        assert_eq!((m.min_disparity, m.max_disparity, m.delta_d), (0.5, 63.5, DISPARITY_STEP));
        let values = floats(&m.image).unwrap();
        assert_eq!(values.get(1, 0), 12.25);
        assert_eq!(values.get(0, 0), -0.5, "invalid is min_disparity - 1");
        assert!(values.pixels().iter().all(|v| v.is_finite()));
        // cx_l - cx_r = 1.5: the smallest shift in pixels is 2.
        let expected = RegionOfInterest { x_offset: 2, width: 1, height: 2, ..Default::default() };
        assert_eq!(m.valid_window, expected);
    }

    #[test]
    fn the_valid_window_stays_inside_the_image() {
        let size = Size::new(100, 10);
        for min in [-300.0, -50.5, 0.0, 7.25, 99.0, 250.0] {
            for range in [0.0, 16.0, 192.0] {
                let w = valid_window(size, min, min + range);
                assert!(w.x_offset + w.width <= 100 && w.height == 10, "{min} {range} {w:?}");
                for x in 0..100_u32 {
                    let inside = x >= w.x_offset && x < w.x_offset + w.width;
                    let (low, high) = (f64::from(x) - min - range, f64::from(x) - min);
                    let possible = high >= 0.0 && low <= 99.0;
                    assert_eq!(inside, possible, "{min} {range} {x} {w:?}");
                }
            }
        }
    }

    #[test]
    fn depth_in_metres_keeps_what_rep_117_says() {
        let m = depth_image(&perception(), DepthEncoding::F32);
        assert_eq!(m.encoding, "32FC1");
        let z = floats(&m).unwrap();
        assert_eq!(z.get(0, 0), 1.5);
        assert!(z.get(1, 0).is_nan());
        assert_eq!((z.get(2, 0), z.get(0, 1)), (f32::INFINITY, f32::NEG_INFINITY));
    }

    #[test]
    fn depth_in_millimetres_has_zero_for_unknown() {
        let m = depth_image(&perception(), DepthEncoding::U16);
        assert_eq!(m.encoding, "16UC1");
        assert_eq!(labels(&m).unwrap().pixels(), [1500, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn depth_comes_with_the_processed_camera() {
        let info = depth_camera_info(&perception());
        assert_eq!((info.width, info.height, info.p[0]), (3, 2, 400.0));
        assert_eq!(info.header.frame_id, "left_optical");
    }

    #[test]
    fn maps_and_pictures_keep_their_values() {
        let p = perception();
        assert_eq!(floats(&saliency_image(&p)).unwrap(), p.saliency());
        assert_eq!(floats(&confidence_image(&p)).unwrap(), p.confidence);
        let image = Image::from_fn(Size::new(3, 2), |x, y| (300 * x + y) as u16);
        let m = label_image(&image, Header::default());
        assert_eq!((m.encoding.as_str(), m.step), ("mono16", 6));
        assert_eq!(labels(&m).unwrap(), image);
        for p in [
            Picture::Gray(Image::from_fn(Size::new(5, 3), |x, y| (x * y) as u8)),
            Picture::Rgb(Image::from_fn(Size::new(5, 3), |x, y| [x as u8, y as u8, 9])),
        ] {
            assert_eq!(picture(&picture_image(&p, Header::default())).unwrap(), p);
        }
    }

    #[test]
    fn big_endian_maps_and_padding_are_read() {
        let m = sensor_msgs::Image {
            width: 1,
            height: 2,
            step: 3,
            encoding: "16UC1".into(),
            is_bigendian: 1,
            data: vec![1, 2, 99, 3, 4, 99],
            ..Default::default()
        };
        assert_eq!(labels(&m).unwrap().pixels(), [0x0102, 0x0304]);
    }

    #[test]
    fn maps_of_another_encoding_or_length_are_refused() {
        let mut m = saliency_image(&perception());
        let text = labels(&m).unwrap_err().to_string();
        assert!(text.contains("'32FC1'") && text.contains("mono16 16UC1"), "{text}");
        m.data.pop();
        assert!(matches!(floats(&m), Err(ConvertError::Payload { len: 23, expected: 24, .. })));
    }
}
