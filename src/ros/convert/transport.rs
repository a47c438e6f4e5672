//! The compressed twins of image topics, as `image_transport` names and lays
//! them out: small enough to arrive with the socket buffers of a stock system.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use super::dense::millimetres;
use super::header;
use crate::config::DepthEncoding;
use crate::image::{Image, Size};
use crate::output::picture;
use crate::perception::Perception;
use crate::ros::message::sensor_msgs::CompressedImage;
use crate::ros::message::std_msgs::Header;

/// JPEG quality of pictures for people: at 90 a KITTI-sized overlay takes
/// 180 KB, which is too close to the 208 KB of a stock receive buffer.
const QUALITY: u8 = 80;

/// `<topic>/compressed` of colours: JPEG. Empty for an empty picture.
pub fn compressed_rgb(image: &Image<[u8; 3]>, header: Header) -> CompressedImage {
    // Fails for a picture without pixels only.
    let data = picture::jpeg(image, QUALITY).unwrap_or_default();
    CompressedImage { header, format: "rgb8; jpeg compressed bgr8".into(), data }
}

/// `saliency/image_rect/compressed`: PNG of 8 bits, 255 for saliency 1.
pub fn compressed_saliency(perception: &Perception) -> CompressedImage {
    let saliency = perception.saliency();
    let values: Vec<u8> = saliency.pixels().iter().map(|s| (s * 255.0 + 0.5) as u8).collect();
    CompressedImage {
        header: header(perception),
        format: "mono8; png compressed mono8".into(),
        data: png(&values, saliency.size(), ExtendedColorType::L8),
    }
}

/// `depth/image_rect/compressedDepth`: 12 bytes of header (kind, and the
/// numbers a and b, little endian), then a PNG of 16 bits.
///
/// With `32FC1` a sample is `q = a / Z + b`, and 0 is unknown, which is what
/// NaN and both infinities become. a and b put 1 at `far_m` and 65535 at the
/// nearest depth that the searched disparities allow, so that the step is far
/// below that of the disparity. With `16UC1` a sample is Z in millimetres.
pub fn compressed_depth(
    perception: &Perception,
    encoding: DepthEncoding,
    limits_m: [f64; 2],
) -> CompressedImage {
    let depth = &perception.depth;
    let (name, [a, b]) = match encoding {
        DepthEncoding::F32 => ("32FC1", quantisation(perception, limits_m)),
        DepthEncoding::U16 => ("16UC1", [0.0; 2]),
    };
    let sample = |z: f32| match encoding {
        // Out of range: NaN or an infinity. The cast saturates.
        DepthEncoding::F32 if !z.is_finite() || z <= 0.0 => 0,
        DepthEncoding::F32 => (a / z + b).round().max(1.0) as u16,
        DepthEncoding::U16 => millimetres(z),
    };
    // The encoder takes samples in the byte order of the machine.
    let mut samples = vec![0; 2 * depth.pixels().len()];
    for (out, &z) in samples.as_chunks_mut().0.iter_mut().zip(depth.pixels()) {
        *out = sample(z).to_ne_bytes();
    }
    let mut data = vec![0; 12];
    data[4..8].copy_from_slice(&a.to_le_bytes());
    data[8..12].copy_from_slice(&b.to_le_bytes());
    data.extend(png(&samples, depth.size(), ExtendedColorType::L16));
    let format = format!("{name}; compressedDepth png");
    CompressedImage { header: header(perception), format, data }
}

/// a and b of `q = a / Z + b`.
fn quantisation(perception: &Perception, [min_m, max_m]: [f64; 2]) -> [f32; 2] {
    let nearest = perception.rig.depth_scale() / f64::from(perception.max_disparity.max(1.0));
    // A range without extent would make a infinite.
    let near = nearest.max(min_m).max(1e-3).min(max_m / 2.0);
    let a = 65534.0 / (1.0 / near - 1.0 / max_m);
    [a as f32, (1.0 - a / max_m) as f32]
}

/// PNG bytes, compressed quickly; empty when there is no pixel.
fn png(samples: &[u8], size: Size, color: ExtendedColorType) -> Vec<u8> {
    let mut data = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut data, CompressionType::Fast, FilterType::Adaptive);
    match encoder.write_image(samples, size.width as u32, size.height as u32, color) {
        Ok(()) => data,
        Err(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::camera::{Camera, StereoRig};
    use crate::image::Picture;
    use crate::ros::convert::{compressed_picture, compressed_u16};

    /// f B = 400, disparities up to 192: nothing is nearer than 2.08 m.
    fn perception() -> Perception {
        let size = Size::new(64, 48);
        let camera = |tx| Camera::pinhole(size, 800.0, 32.0, 24.0, tx);
        let rig = StereoRig::new(camera(0.0), camera(-400.0), 0.0).unwrap();
        let mut p = Perception::new(size, Arc::new(rig));
        p.frame_id = Arc::from("left_optical");
        (p.min_disparity, p.max_disparity) = (0.0, 192.0);
        p.depth =
            Image::from_fn(size, |x, y| 400.0 / (192.0 - 0.0625 * (y * 64 + x) as f32).max(5.0));
        p.depth.set(0, 0, f32::NAN);
        p.depth.set(1, 0, f32::INFINITY);
        p.depth.set(2, 0, f32::NEG_INFINITY);
        p
    }

    fn number(bytes: &[u8]) -> f32 {
        f32::from_le_bytes(bytes.try_into().unwrap())
    }

    fn map(message: &CompressedImage) -> Image<u16> {
        compressed_u16(&CompressedImage { data: message.data[12..].to_vec(), ..message.clone() })
            .unwrap()
    }

    #[test]
    fn inverse_depth_comes_back_finer_than_the_disparity_it_was_made_of() {
        let p = perception();
        let m = compressed_depth(&p, DepthEncoding::F32, [0.1, 80.0]);
        assert_eq!(m.format, "32FC1; compressedDepth png");
        assert_eq!(m.header.frame_id, "left_optical");
        assert_eq!(m.data[..4], [0; 4], "kind 0 is inverse depth");
        let (a, b) = (number(&m.data[4..8]), number(&m.data[8..12]));
        for (&q, &z) in map(&m).pixels().iter().zip(p.depth.pixels()) {
            if z.is_finite() {
                // As the subscriber of image_transport computes it.
                let back = a / (f32::from(q) - b);
                let error_px = (400.0 / back - 400.0 / z).abs();
                assert!(q > 0 && error_px < 1.0 / 64.0, "{z} m came back as {back} m");
            } else {
                assert_eq!(q, 0);
            }
        }
    }

    #[test]
    fn millimetres_are_stored_as_they_are() {
        let p = perception();
        let m = compressed_depth(&p, DepthEncoding::U16, [0.1, 80.0]);
        assert_eq!(m.format, "16UC1; compressedDepth png");
        assert_eq!(m.data[..12], [0; 12]);
        let values = map(&m);
        assert_eq!(values.get(0, 0), 0);
        assert_eq!(values.get(10, 10), (p.depth.get(10, 10) * 1000.0).round() as u16);
    }

    #[test]
    fn a_range_without_extent_is_survived() {
        let mut p = perception();
        p.max_disparity = 0.0;
        for limits in [[0.1, 0.2], [0.0, 0.01], [79.0, 80.0]] {
            let m = compressed_depth(&p, DepthEncoding::F32, limits);
            assert!(number(&m.data[4..8]).is_finite() && number(&m.data[8..12]).is_finite());
        }
    }

    #[test]
    fn saliency_and_pictures_are_read_back() {
        let mut p = perception();
        p.attention.set(0, 0, 1.0);
        let m = compressed_saliency(&p);
        let Picture::Gray(image) = compressed_picture(&m).unwrap() else { panic!() };
        // The last pixel of the first cell, the first one of the next cell, and far away.
        assert_eq!([0, 3, 4, 40].map(|x| image.get(x, 0)), [255, 159, 96, 0]);
        assert!(m.format.starts_with("mono8; png"));
        let flat = Image::filled(Size::new(16, 16), [200, 100, 50]);
        let m = compressed_rgb(&flat, Header::default());
        let Picture::Rgb(image) = compressed_picture(&m).unwrap() else { panic!() };
        assert!(image.get(8, 8).iter().zip([200, 100, 50]).all(|(a, b)| a.abs_diff(b) <= 4));
    }
}
