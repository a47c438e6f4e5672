//! Any source of frames as a bag of images, camera infos and truth.

use std::io::Cursor;
use std::path::Path;

use image::{ImageBuffer, ImageFormat, Luma};
use thiserror::Error;

use super::write::{BagWriteError, BagWriter, Topic};
use crate::image::Image;
use crate::input::{FrameSource, Observation};
use crate::ros::convert;
use crate::ros::message::sensor_msgs::{self, CameraInfo, CompressedImage};
use crate::ros::message::std_msgs::Header;
use crate::stamp::Stamp;

const LEFT_FRAME: &str = "left_optical";
const RIGHT_FRAME: &str = "right_optical";

/// What can go wrong on the way from a source into a bag.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The source failed.
    #[error("{0}")]
    Source(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The bag cannot be written.
    #[error(transparent)]
    Bag(#[from] BagWriteError),
    /// Truth that cannot be put into a PNG.
    #[error("the truth of frame {stamp} cannot be written as PNG: {reason}")]
    Truth {
        /// Stamp of the frame.
        stamp: Stamp,
        /// What the encoder says.
        reason: String,
    },
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exported {
    /// Pairs.
    pub pairs: u64,
    /// Disparity maps.
    pub disparities: u64,
    /// Maps of object ids.
    pub objects: u64,
}

/// Writes all frames of `source` as rectified stereo images (`left/image_rect`,
/// `right/image_rect`, raw), camera infos and, where the source knows it, truth
/// (`truth/disparity/compressed`, `truth/objects/compressed`) into a bag at `path`.
///
/// `watch` is called after each pair; the bag is finished early, and whole,
/// when it returns false.
///
/// # Errors
/// When the source fails or the bag cannot be written.
pub fn export_bag<S: FrameSource>(
    source: &mut S,
    path: &Path,
    mut watch: impl FnMut(&S) -> bool,
) -> Result<Exported, ExportError> {
    let mut export = Export::create(path)?;
    let mut outcome = Ok(());
    loop {
        match source.next_observation() {
            Ok(Some(observation)) => outcome = export.write(&observation),
            Ok(None) => break,
            Err(e) => outcome = Err(ExportError::Source(Box::new(e))),
        }
        if outcome.is_err() || !watch(source) {
            break;
        }
    }
    // What was written stays readable, whatever stopped it.
    let finished = export.bag.finish();
    outcome?;
    finished?;
    Ok(export.exported)
}

struct Export {
    bag: BagWriter,
    images: [Topic<sensor_msgs::Image>; 2],
    infos: [Topic<CameraInfo>; 2],
    disparity: Option<Topic<CompressedImage>>,
    objects: Option<Topic<CompressedImage>>,
    exported: Exported,
}

impl Export {
    fn create(path: &Path) -> Result<Self, ExportError> {
        let mut bag = BagWriter::create(path)?;
        let images = [bag.topic("/left/image_rect")?, bag.topic("/right/image_rect")?];
        let infos = [bag.topic("/left/camera_info")?, bag.topic("/right/camera_info")?];
        let exported = Exported::default();
        Ok(Self { bag, images, infos, disparity: None, objects: None, exported })
    }

    fn write(&mut self, observation: &Observation) -> Result<(), ExportError> {
        let frame = &observation.frame;
        let sides = [
            (&frame.left, &frame.rig.left, frame.stamp, LEFT_FRAME),
            (&frame.right, &frame.rig.right, frame.right_stamp, RIGHT_FRAME),
        ];
        for (side, (picture, camera, stamp, frame_id)) in sides.into_iter().enumerate() {
            let header = Header { stamp: stamp.into(), frame_id: frame_id.to_owned() };
            let image = convert::picture_image(picture, header.clone());
            self.bag.write(self.images[side], stamp, &image)?;
            self.bag.write(self.infos[side], stamp, &convert::camera_info(camera, header))?;
        }
        self.exported.pairs += 1;
        let truth = observation.truth.as_ref();
        if let Some(disparity) = truth.and_then(|truth| truth.disparity.as_ref()) {
            self.write_disparity(frame.stamp, disparity)?;
        }
        if let Some(objects) = truth.and_then(|truth| truth.objects.as_ref()) {
            self.write_objects(frame.stamp, objects)?;
        }
        Ok(self.bag.flush()?)
    }

    fn write_disparity(&mut self, stamp: Stamp, map: &Image<f32>) -> Result<(), ExportError> {
        let topic = match self.disparity {
            Some(topic) => topic,
            None => *self.disparity.insert(self.bag.topic("/truth/disparity/compressed")?),
        };
        let coded = map.pixels().iter().map(|&d| coded_disparity(d)).collect();
        self.bag.write(topic, stamp, &truth_message(stamp, map, coded)?)?;
        self.exported.disparities += 1;
        Ok(())
    }

    fn write_objects(&mut self, stamp: Stamp, map: &Image<u16>) -> Result<(), ExportError> {
        let topic = match self.objects {
            Some(topic) => topic,
            None => *self.objects.insert(self.bag.topic("/truth/objects/compressed")?),
        };
        let ids = map.pixels().to_vec();
        self.bag.write(topic, stamp, &truth_message(stamp, map, ids)?)?;
        self.exported.objects += 1;
        Ok(())
    }
}

/// Disparity as KITTI codes it: 256 times, 0 for unknown. What does not fit in
/// 16 bits (256 pixels and more, or not positive) is unknown.
fn coded_disparity(d: f32) -> u16 {
    let coded = (d * 256.0).round();
    // NaN fails the comparison.
    if (1.0..=f32::from(u16::MAX)).contains(&coded) { coded as u16 } else { 0 }
}

fn truth_message<T>(
    stamp: Stamp,
    map: &Image<T>,
    values: Vec<u16>,
) -> Result<CompressedImage, ExportError> {
    let failed = |reason: String| ExportError::Truth { stamp, reason };
    let (width, height) = (map.width() as u32, map.height() as u32);
    let picture = ImageBuffer::<Luma<u16>, _>::from_raw(width, height, values)
        .ok_or_else(|| failed("it has another number of pixels".to_owned()))?;
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).map_err(|e| failed(e.to_string()))?;
    Ok(CompressedImage {
        header: Header { stamp: stamp.into(), frame_id: LEFT_FRAME.to_owned() },
        format: "16UC1; png compressed".to_owned(),
        data: bytes.into_inner(),
    })
}
