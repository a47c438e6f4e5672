//! Between messages and the nouns of the core: bad data ends here.
//!
//! | from | to | function |
//! |---|---|---|
//! | `Image` | [`Picture`] | [`picture()`], [`picture_into`] |
//! | `CompressedImage` | [`Picture`] | [`compressed_picture`], [`compressed_picture_into`] |
//! | one [`Picture`] of both views | two | [`split_side_by_side`], [`split_side_by_side_into`] |
//! | `Image`, `CompressedImage` of numbers | `Image<f32>`, `Image<u16>` | [`floats`], [`labels`], [`compressed_u16`] |
//! | two `CameraInfo` | [`StereoRig`] | [`rig`] |
//! | [`Camera`] | `CameraInfo` | [`camera_info`] |
//! | [`Perception`] | messages | [`region_array`], [`detections_2d`], [`markers`], [`annotations`], [`disparity_image`], [`depth_image`], [`points()`], [`compressed_depth`], … |
//!
//! [`StereoRig`]: crate::camera::StereoRig
//! [`Camera`]: crate::camera::Camera

mod annotation;
mod bayer;
mod calibration;
mod compressed;
mod dense;
mod detection;
mod encoding;
mod fit;
mod marker;
mod picture;
mod points;
mod region;
mod transport;
mod yuv;

use thiserror::Error;

pub use annotation::annotations;
pub use calibration::{camera, camera_info, rig};
pub use compressed::{compressed_picture, compressed_picture_into, compressed_u16};
pub use dense::{
    confidence_image, depth_camera_info, depth_image, disparity_image, float_image, floats,
    label_image, labels, picture_image, rgb_image, saliency_image,
};
pub use detection::{CLASS_ID, detections_2d, detections_3d};
pub use encoding::ENCODINGS;
pub use fit::{REGIONS_LIMIT, Reduction, fit_regions};
pub use marker::markers;
pub use picture::{picture, picture_into};
pub use points::points;
pub use region::region_array;
pub use transport::{compressed_depth, compressed_rgb, compressed_saliency};

use crate::image::{Image, Picture, Size};
use crate::perception::Perception;
use crate::ros::message::std_msgs::Header;

/// Largest width and height that is taken for an image.
pub const MAX_SIDE: usize = 16384;

/// Image data that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ConvertError {
    /// Fewer bytes than the fields of the message promise.
    #[error("image payload is {len} bytes, {expected} expected for {size} {encoding}")]
    Payload {
        /// Bytes there are.
        len: usize,
        /// Bytes there should be.
        expected: usize,
        /// Size in the message.
        size: Size,
        /// Encoding in the message.
        encoding: String,
    },
    /// Rows that do not fit into the distance between them.
    #[error("image step is {step} bytes, but a row of {size} {encoding} has {expected}")]
    Step {
        /// Step in the message.
        step: usize,
        /// Bytes of one row.
        expected: usize,
        /// Size in the message.
        size: Size,
        /// Encoding in the message.
        encoding: String,
    },
    /// An encoding that we do not read here.
    #[error("unknown image encoding '{encoding}'; known are {known}")]
    Encoding {
        /// Encoding in the message.
        encoding: String,
        /// What would have been taken.
        known: String,
    },
    /// No pixels, or too many.
    #[error("image size is {size}: each side must be 1 to 16384 pixels")]
    Size {
        /// Size in the message.
        size: Size,
    },
    /// Chroma that does not divide the image.
    #[error("{encoding} needs an even {side}, but the image is {size}")]
    OddSize {
        /// `width` or `height`.
        side: &'static str,
        /// Size in the message.
        size: Size,
        /// Encoding in the message.
        encoding: String,
    },
    /// Compressed data of a kind that we do not read.
    #[error(
        "compressed image is neither JPEG nor PNG: format says '{format}', data begins with {begin:02x?}"
    )]
    Format {
        /// Format in the message.
        format: String,
        /// The first bytes.
        begin: Vec<u8>,
    },
    /// A compressed image that claims more pixels than we decode.
    #[error("compressed image claims {size}: at most 16384 a side and 67108864 pixels are decoded")]
    CompressedSize {
        /// Size in the file.
        size: Size,
    },
    /// A compressed image that cannot be decoded.
    #[error("{kind} of {len} bytes cannot be decoded: {reason}")]
    Compressed {
        /// `JPEG` or `PNG`.
        kind: &'static str,
        /// Bytes of the file.
        len: usize,
        /// What the decoder says.
        reason: String,
    },
    /// An image of other pixels than wanted.
    #[error("the PNG holds {found} pixels, 16-bit gray expected")]
    Depth {
        /// What it holds.
        found: String,
    },
    /// One image of two views that has no middle.
    #[error("a side-by-side image needs an even width, but it is {size}")]
    SideBySide {
        /// Size of the image.
        size: Size,
    },
    /// Two views of different size.
    #[error("left image is {left}, right image is {right}: a stereo pair has one size")]
    SizesDiffer {
        /// Size of the left image.
        left: Size,
        /// Size of the right image.
        right: Size,
    },
}

/// The one size of a stereo pair.
///
/// # Errors
/// When the sizes differ.
pub fn common_size(left: &Picture, right: &Picture) -> Result<Size, ConvertError> {
    let (left, right) = (left.size(), right.size());
    if left == right { Ok(left) } else { Err(ConvertError::SizesDiffer { left, right }) }
}

/// The header of everything made from one frame: stamp and frame of the left image.
pub fn header(perception: &Perception) -> Header {
    Header { stamp: perception.stamp.into(), frame_id: perception.frame_id.as_ref().to_owned() }
}

/// The left and the right half of an image that holds both views.
///
/// # Errors
/// When the width is odd.
pub fn split_side_by_side(both: &Picture) -> Result<(Picture, Picture), ConvertError> {
    let (mut left, mut right) = (Picture::default(), Picture::default());
    split_side_by_side_into(both, &mut left, &mut right)?;
    Ok((left, right))
}

/// [`split_side_by_side`] into pictures whose buffers are used again.
///
/// # Errors
/// When the width is odd.
pub fn split_side_by_side_into(
    both: &Picture,
    left: &mut Picture,
    right: &mut Picture,
) -> Result<(), ConvertError> {
    let size = both.size();
    if !size.width.is_multiple_of(2) {
        return Err(ConvertError::SideBySide { size });
    }
    let half = Size::new(size.width / 2, size.height);
    match both {
        Picture::Gray(both) => split(both, gray_into(left, half), gray_into(right, half)),
        Picture::Rgb(both) => split(both, rgb_into(left, half), rgb_into(right, half)),
    }
    Ok(())
}

fn split<T: Copy + Default>(both: &Image<T>, left: &mut Image<T>, right: &mut Image<T>) {
    for y in 0..both.height() {
        let (l, r) = both.row(y).split_at(both.width() / 2);
        left.row_mut(y).copy_from_slice(l);
        right.row_mut(y).copy_from_slice(r);
    }
}

/// Makes `picture` a gray image of `size`, in its old buffer where it can.
fn gray_into(picture: &mut Picture, size: Size) -> &mut Image<u8> {
    if !matches!(picture, Picture::Gray(_)) {
        *picture = Picture::Gray(Image::default());
    }
    match picture {
        Picture::Gray(image) => {
            image.resize(size);
            image
        }
        Picture::Rgb(_) => unreachable!("made gray two lines above"),
    }
}

/// Makes `picture` a colour image of `size`, in its old buffer where it can.
fn rgb_into(picture: &mut Picture, size: Size) -> &mut Image<[u8; 3]> {
    if !matches!(picture, Picture::Rgb(_)) {
        *picture = Picture::Rgb(Image::default());
    }
    match picture {
        Picture::Rgb(image) => {
            image.resize(size);
            image
        }
        Picture::Gray(_) => unreachable!("made rgb two lines above"),
    }
}

/// Text from a message as it may stand in an error: short and printable.
fn shown(text: &str) -> String {
    const LIMIT: usize = 64;
    let mut shown: String = text.chars().take(LIMIT).flat_map(char::escape_debug).collect();
    if text.chars().nth(LIMIT).is_some() {
        shown.push('…');
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn side_by_side_is_split_in_the_middle() {
        let both = Image::from_fn(Size::new(6, 2), |x, y| (10 * y + x) as u8);
        let (left, right) = split_side_by_side(&Picture::Gray(both)).unwrap();
        let expected =
            |data: [u8; 6]| Picture::Gray(Image::from_vec(Size::new(3, 2), data.to_vec()).unwrap());
        assert_eq!(left, expected([0, 1, 2, 10, 11, 12]));
        assert_eq!(right, expected([3, 4, 5, 13, 14, 15]));
        let both = Image::from_fn(Size::new(4, 1), |x, _| [x as u8; 3]);
        let (_, right) = split_side_by_side(&Picture::Rgb(both)).unwrap();
        assert_eq!(
            right,
            Picture::Rgb(Image::from_vec(Size::new(2, 1), vec![[2; 3], [3; 3]]).unwrap())
        );
    }

    #[test]
    fn an_odd_side_by_side_image_is_refused() {
        let error = split_side_by_side(&Picture::Gray(Image::new(Size::new(5, 2)))).unwrap_err();
        assert_eq!(error.to_string(), "a side-by-side image needs an even width, but it is 5x2");
    }

    #[test]
    fn pictures_of_different_size_are_no_pair() {
        let (a, b) = (Image::<u8>::new(Size::new(4, 2)), Image::<u8>::new(Size::new(4, 3)));
        let error = common_size(&Picture::Gray(a.clone()), &Picture::Gray(b)).unwrap_err();
        assert!(error.to_string().contains("left image is 4x2, right image is 4x3"), "{error}");
        let size = common_size(&Picture::Gray(a.clone()), &Picture::Gray(a)).unwrap();
        assert_eq!(size, Size::new(4, 2));
    }

    #[test]
    fn text_from_messages_is_made_harmless() {
        assert_eq!(shown("a\nb"), "a\\nb");
        assert_eq!(shown(&"x".repeat(1000)).chars().count(), 65);
    }
}
