//! Rendered scenes as messages and as bags: images, calibration and truth.

use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};
use thiserror::Error;

use super::bag::{BagWriteError, BagWriter, Topic};
use super::picture::{self, PictureError};
use crate::image::{Image, Picture, Size};
use crate::input::synthetic::{LEFT_FRAME_ID, RIGHT_FRAME_ID, SceneKind, SyntheticScene};
use crate::input::{Observation, Truth};
use crate::ros::convert;
use crate::ros::message::builtin_interfaces::Time;
use crate::ros::message::sensor_msgs::{CameraInfo, CompressedImage};
use crate::ros::message::std_msgs::Header;
use crate::stamp::Stamp;

/// Steps per pixel of the written disparity; 0 is unknown.
const DISPARITY_SCALE: f32 = 256.0;

/// Why a scene could not be written.
#[derive(Debug, Error)]
pub enum SceneWriteError {
    /// The bag.
    #[error(transparent)]
    Bag(#[from] BagWriteError),
    /// An image.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A map of the truth.
    #[error("cannot encode the {what} of {size} as PNG: {source}")]
    Truth {
        /// Which map.
        what: &'static str,
        /// Its size.
        size: Size,
        /// What the encoder said.
        source: ImageError,
    },
}

/// One rendered pair as the messages of its bag.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneMessages {
    /// Acquisition time of all of them.
    pub stamp: Stamp,
    /// `/left/camera_info`, `/right/camera_info`
    pub infos: [CameraInfo; 2],
    /// `/left/image_rect/compressed`, `/right/image_rect/compressed`
    pub images: [CompressedImage; 2],
    /// `/truth/disparity/compressed`: 16-bit PNG, 256 per pixel, 0 unknown.
    pub disparity: CompressedImage,
    /// `/truth/objects/compressed`: 8-bit PNG of ids, 0 background.
    pub objects: CompressedImage,
}

/// JPEG quality that keeps a shipped bag below 8 MiB.
const fn quality(kind: SceneKind) -> u8 {
    match kind {
        SceneKind::Street => 80,
        SceneKind::Tabletop => 93,
    }
}

impl SceneMessages {
    /// The messages of frame `index`.
    ///
    /// # Errors
    /// When an image cannot be encoded.
    pub fn render(scene: &SyntheticScene, index: usize) -> Result<Self, SceneWriteError> {
        let Observation { frame, truth } = scene.observation(index);
        let Truth { disparity, objects, .. } = truth.unwrap_or_default();
        let header = |frame_id: &str| Header {
            stamp: Time { sec: frame.stamp.sec(), nanosec: frame.stamp.nanosec() },
            frame_id: frame_id.to_owned(),
        };
        let jpeg = |picture: &Picture, frame_id| {
            let data = match picture {
                Picture::Rgb(image) => picture::jpeg(image, quality(scene.kind()))?,
                Picture::Gray(image) => picture::jpeg_gray(image, quality(scene.kind()))?,
            };
            let format = "rgb8; jpeg compressed bgr8".to_owned();
            Ok::<_, SceneWriteError>(CompressedImage { header: header(frame_id), format, data })
        };
        Ok(Self {
            stamp: frame.stamp,
            infos: [
                convert::camera_info(&frame.rig.left, header(LEFT_FRAME_ID)),
                convert::camera_info(&frame.rig.right, header(RIGHT_FRAME_ID)),
            ],
            images: [jpeg(&frame.left, LEFT_FRAME_ID)?, jpeg(&frame.right, RIGHT_FRAME_ID)?],
            disparity: CompressedImage {
                header: header(LEFT_FRAME_ID),
                format: "16UC1; png compressed ".to_owned(),
                data: disparity_png(&disparity.unwrap_or_default())?,
            },
            objects: CompressedImage {
                header: header(LEFT_FRAME_ID),
                format: "mono8; png compressed mono8".to_owned(),
                data: objects_png(&objects.unwrap_or_default())?,
            },
        })
    }
}

fn disparity_png(disparity: &Image<f32>) -> Result<Vec<u8>, SceneWriteError> {
    // Casts saturate, and NaN becomes 0, which means unknown. The encoder
    // takes samples in the byte order of the machine.
    let values: Vec<u8> = disparity
        .pixels()
        .iter()
        .flat_map(|d| ((d * DISPARITY_SCALE + 0.5) as u16).to_ne_bytes())
        .collect();
    png("true disparity", &values, disparity.size(), ExtendedColorType::L16)
}

fn objects_png(objects: &Image<u16>) -> Result<Vec<u8>, SceneWriteError> {
    // The scenes have fewer than 256 objects.
    let values: Vec<u8> = objects.pixels().iter().map(|id| (*id).min(255) as u8).collect();
    png("true objects", &values, objects.size(), ExtendedColorType::L8)
}

fn png(
    what: &'static str,
    values: &[u8],
    size: Size,
    color: ExtendedColorType,
) -> Result<Vec<u8>, SceneWriteError> {
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
        .write_image(values, size.width as u32, size.height as u32, color)
        .map_err(|source| SceneWriteError::Truth { what, size, source })?;
    Ok(bytes)
}

/// A bag of rendered pairs under construction.
pub struct SceneBag {
    bag: BagWriter,
    infos: [Topic<CameraInfo>; 2],
    images: [Topic<CompressedImage>; 2],
    disparity: Topic<CompressedImage>,
    objects: Topic<CompressedImage>,
}

impl SceneBag {
    /// A bag at `path`: a single file when it ends in `.mcap`, else a folder.
    ///
    /// # Errors
    /// When file or folder cannot be made.
    pub fn create(path: &Path) -> Result<Self, SceneWriteError> {
        let mut bag = BagWriter::create(path)?;
        Ok(Self {
            infos: [bag.topic("/left/camera_info")?, bag.topic("/right/camera_info")?],
            images: [
                bag.topic("/left/image_rect/compressed")?,
                bag.topic("/right/image_rect/compressed")?,
            ],
            disparity: bag.topic("/truth/disparity/compressed")?,
            objects: bag.topic("/truth/objects/compressed")?,
            bag,
        })
    }

    /// Adds one pair.
    ///
    /// # Errors
    /// On a failed write.
    pub fn write(&mut self, pair: &SceneMessages) -> Result<(), SceneWriteError> {
        let Self { bag, infos, images, disparity, objects } = self;
        for (topic, info) in infos.iter().zip(&pair.infos) {
            bag.write(*topic, pair.stamp, info)?;
        }
        for (topic, image) in images.iter().zip(&pair.images) {
            bag.write(*topic, pair.stamp, image)?;
        }
        bag.write(*disparity, pair.stamp, &pair.disparity)?;
        bag.write(*objects, pair.stamp, &pair.objects)?;
        Ok(())
    }

    /// Completes the bag.
    ///
    /// # Errors
    /// On a failed write.
    pub fn finish(mut self) -> Result<(), SceneWriteError> {
        Ok(self.bag.finish()?)
    }
}
