//! Perceptions into a bag.

use std::path::Path;

use super::write::{BagWriteError, BagWriter, Packing, Topic};
use crate::config::{Config, DepthEncoding};
use crate::image::Image;
use crate::input::Observation;
use crate::output::{Sink, picture};
use crate::perception::Perception;
use crate::ros::convert;
use crate::ros::message::foxglove_msgs::ImageAnnotations;
use crate::ros::message::salient_stereo_msgs::SalientRegionArray;
use crate::ros::message::sensor_msgs::{self, CameraInfo, CompressedImage};
use crate::ros::message::stereo_msgs::DisparityImage;
use crate::ros::message::vision_msgs::{Detection2DArray, Detection3DArray};
use crate::ros::message::visualization_msgs::MarkerArray;
use crate::stamp::Stamp;

/// Which topics a bag of results has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "one switch per topic")]
pub struct BagTopicsOut {
    /// `/regions`
    pub regions: bool,
    /// `/detections_2d`, `/detections_3d`, `/markers` and `/regions/annotations`
    pub detections: bool,
    /// `/disparity`
    pub disparity: bool,
    /// `/depth/image_rect` and `/depth/camera_info`
    pub depth: bool,
    /// `/confidence/image_rect`
    pub confidence: bool,
    /// `/saliency/image_rect`
    pub saliency: bool,
    /// `/regions/label_image`
    pub labels: bool,
    /// `/overlay/image/compressed` (JPEG)
    pub overlay: bool,
    /// `/left/image_rect`, the left view as processed, to be seen beside the results.
    pub left: bool,
}

impl Default for BagTopicsOut {
    /// All results and the overlay, without the left view, which the input has.
    fn default() -> Self {
        Self {
            regions: true,
            detections: true,
            disparity: true,
            depth: true,
            confidence: true,
            saliency: true,
            labels: true,
            overlay: true,
            left: false,
        }
    }
}

/// Writes what the pipeline yields as the messages that the node publishes,
/// under the node's topic names. Log time is the stamp of the left image, so
/// the same frames give the same bytes.
pub struct BagSink {
    bag: BagWriter,
    topics: Topics,
    masks: bool,
    depth_encoding: DepthEncoding,
    overlay: Image<[u8; 3]>,
}

struct Topics {
    regions: Option<Topic<SalientRegionArray>>,
    detections: Option<Detections>,
    disparity: Option<Topic<DisparityImage>>,
    depth: Option<(Topic<sensor_msgs::Image>, Topic<CameraInfo>)>,
    confidence: Option<Topic<sensor_msgs::Image>>,
    saliency: Option<Topic<sensor_msgs::Image>>,
    labels: Option<Topic<sensor_msgs::Image>>,
    overlay: Option<Topic<CompressedImage>>,
    left: Option<Topic<sensor_msgs::Image>>,
}

/// The regions again, in the words of other tools.
#[derive(Clone, Copy)]
struct Detections {
    flat: Topic<Detection2DArray>,
    solid: Topic<Detection3DArray>,
    markers: Topic<MarkerArray>,
    /// For the Image panel of Foxglove; the node does not publish it.
    annotations: Topic<ImageAnnotations>,
}

impl Detections {
    fn add(bag: &mut BagWriter) -> Result<Self, BagWriteError> {
        Ok(Self {
            flat: bag.topic("/detections_2d")?,
            solid: bag.topic("/detections_3d")?,
            markers: bag.topic("/markers")?,
            annotations: bag.topic("/regions/annotations")?,
        })
    }

    fn write(self, bag: &mut BagWriter, perception: &Perception) -> Result<(), BagWriteError> {
        let stamp = perception.stamp;
        bag.write(self.flat, stamp, &convert::detections_2d(perception))?;
        bag.write(self.solid, stamp, &convert::detections_3d(perception))?;
        bag.write(self.markers, stamp, &convert::markers(perception))?;
        bag.write(self.annotations, stamp, &convert::annotations(perception))
    }
}

impl BagSink {
    /// A bag at `path`: a single file when it ends in `.mcap`, else a folder.
    ///
    /// # Errors
    /// When file or folder cannot be made.
    pub fn create(
        path: &Path,
        config: &Config,
        wanted: BagTopicsOut,
    ) -> Result<Self, BagWriteError> {
        let mut bag = BagWriter::create_packed(path, Packing::Zstd)?;
        let topics = Topics::add(&mut bag, wanted)?;
        Ok(Self {
            bag,
            topics,
            masks: config.regions.publish_masks,
            depth_encoding: config.depth.encoding,
            overlay: Image::default(),
        })
    }

    /// The `.mcap` file.
    pub fn file(&self) -> &Path {
        self.bag.file()
    }
}

impl Topics {
    fn add(bag: &mut BagWriter, wanted: BagTopicsOut) -> Result<Self, BagWriteError> {
        // A topic that is not wanted is not announced either.
        let image = |bag: &mut BagWriter, wanted: bool, name: &str| {
            wanted.then(|| bag.topic::<sensor_msgs::Image>(name)).transpose()
        };
        Ok(Self {
            regions: wanted.regions.then(|| bag.topic("/regions")).transpose()?,
            detections: wanted.detections.then(|| Detections::add(bag)).transpose()?,
            disparity: wanted.disparity.then(|| bag.topic("/disparity")).transpose()?,
            depth: match image(bag, wanted.depth, "/depth/image_rect")? {
                Some(depth) => Some((depth, bag.topic("/depth/camera_info")?)),
                None => None,
            },
            confidence: image(bag, wanted.confidence, "/confidence/image_rect")?,
            saliency: image(bag, wanted.saliency, "/saliency/image_rect")?,
            labels: image(bag, wanted.labels, "/regions/label_image")?,
            overlay: wanted.overlay.then(|| bag.topic("/overlay/image/compressed")).transpose()?,
            left: image(bag, wanted.left, "/left/image_rect")?,
        })
    }
}

/// Writes the message when the topic is wanted.
fn put<T: crate::ros::message::Message>(
    bag: &mut BagWriter,
    topic: Option<Topic<T>>,
    stamp: Stamp,
    message: impl FnOnce() -> T,
) -> Result<(), BagWriteError> {
    topic.map_or(Ok(()), |topic| bag.write(topic, stamp, &message()))
}

impl Sink for BagSink {
    type Error = BagWriteError;

    fn write(
        &mut self,
        _observation: &Observation,
        perception: &Perception,
    ) -> Result<(), BagWriteError> {
        let Self { bag, topics, overlay, .. } = self;
        let stamp = perception.stamp;
        let header = || convert::header(perception);
        put(bag, topics.left, stamp, || convert::rgb_image(&perception.left.rgb, header()))?;
        put(bag, topics.regions, stamp, || {
            let mut array = convert::region_array(perception, self.masks);
            // As on the wire, where larger ones would not arrive.
            convert::fit_regions(&mut array);
            array
        })?;
        if let Some(detections) = topics.detections {
            detections.write(bag, perception)?;
        }
        put(bag, topics.disparity, stamp, || convert::disparity_image(perception))?;
        let (depth, info) = topics.depth.unzip();
        put(bag, depth, stamp, || convert::depth_image(perception, self.depth_encoding))?;
        put(bag, info, stamp, || convert::depth_camera_info(perception))?;
        put(bag, topics.confidence, stamp, || convert::confidence_image(perception))?;
        put(bag, topics.saliency, stamp, || convert::saliency_image(perception))?;
        put(bag, topics.labels, stamp, || convert::label_image(&perception.labels, header()))?;
        if topics.overlay.is_some() {
            picture::regions(perception, overlay);
            put(bag, topics.overlay, stamp, || convert::compressed_rgb(overlay, header()))?;
        }
        bag.flush()
    }

    fn finish(&mut self) -> Result<(), BagWriteError> {
        self.bag.finish()
    }
}
