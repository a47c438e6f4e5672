//! The topics that exist only while somebody listens to them.

use super::topic::{Lazy, Topic};
use crate::config::Config;
use crate::image::Image;
use crate::output::picture::{self, Scale};
use crate::perception::Perception;
use crate::ros::convert::{
    compressed_depth, compressed_rgb, compressed_saliency, confidence_image, depth_camera_info,
    depth_image, detections_2d, detections_3d, disparity_image, header, label_image, markers,
    points, rgb_image, saliency_image,
};
use crate::ros::diagnostics::NodeStatus;
use crate::ros::message::sensor_msgs::{self, CameraInfo, CompressedImage, PointCloud2};
use crate::ros::message::stereo_msgs::DisparityImage;
use crate::ros::message::vision_msgs::{Detection2DArray, Detection3DArray};
use crate::ros::message::visualization_msgs::MarkerArray;
use crate::ros::node::{NodeError, RosNode};
use crate::ros::qos;

/// All topics but `regions` and `/diagnostics`.
pub struct LazyTopics {
    detections_2d: Topic<Detection2DArray>,
    detections_3d: Topic<Detection3DArray>,
    markers: Topic<MarkerArray>,
    disparity: Topic<DisparityImage>,
    depth: Topic<sensor_msgs::Image>,
    depth_compressed: Topic<CompressedImage>,
    depth_info: Topic<CameraInfo>,
    points: Topic<PointCloud2>,
    confidence: Topic<sensor_msgs::Image>,
    saliency: Topic<sensor_msgs::Image>,
    saliency_compressed: Topic<CompressedImage>,
    labels: Topic<sensor_msgs::Image>,
    overlay: Colors,
    disparity_color: Colors,
}

/// A picture for people, raw and as JPEG.
struct Colors {
    raw: Topic<sensor_msgs::Image>,
    jpeg: Topic<CompressedImage>,
    painted: Image<[u8; 3]>,
}

impl LazyTopics {
    /// Advertises them all.
    ///
    /// # Errors
    /// When a name or publisher is refused.
    pub fn advertise(node: &mut RosNode) -> Result<Self, NodeError> {
        let (large, small) = (qos::output(), qos::small_output());
        let depth = "depth/image_rect";
        let saliency = "saliency/image_rect";
        Ok(Self {
            detections_2d: Topic::advertise(node, "detections_2d", &small)?,
            detections_3d: Topic::advertise(node, "detections_3d", &small)?,
            markers: Topic::advertise(node, "markers", &small)?,
            disparity: Topic::advertise(node, "disparity", &large)?,
            depth: Topic::advertise(node, depth, &large)?,
            depth_compressed: Topic::advertise_twin(node, depth, "compressedDepth", &large)?,
            depth_info: Topic::advertise(node, "depth/camera_info", &small)?,
            points: Topic::advertise(node, "points2", &large)?,
            confidence: Topic::advertise(node, "confidence/image_rect", &large)?,
            saliency: Topic::advertise(node, saliency, &large)?,
            saliency_compressed: Topic::advertise_twin(node, saliency, "compressed", &large)?,
            labels: Topic::advertise(node, "regions/label_image", &large)?,
            overlay: Colors::advertise(node, "overlay/image")?,
            disparity_color: Colors::advertise(node, "disparity/image_color")?,
        })
    }

    /// Publishes what is wanted of one frame.
    pub fn publish(&mut self, perception: &Perception, config: &Config, status: &NodeStatus) {
        let depth = &config.depth;
        self.detections_2d.send(status, || detections_2d(perception));
        self.detections_3d.send(status, || detections_3d(perception));
        self.markers.send(status, || markers(perception));
        self.disparity.send(status, || disparity_image(perception));
        self.depth.send(status, || depth_image(perception, depth.encoding));
        self.depth_compressed
            .send(status, || compressed_depth(perception, depth.encoding, [depth.min, depth.max]));
        self.depth_info.send(status, || depth_camera_info(perception));
        self.points.send(status, || points(perception));
        self.confidence.send(status, || confidence_image(perception));
        self.saliency.send(status, || saliency_image(perception));
        self.saliency_compressed.send(status, || compressed_saliency(perception));
        self.labels.send(status, || label_image(&perception.labels, header(perception)));
        self.overlay.send(status, perception, |out| picture::regions(perception, out));
        self.disparity_color.send(status, perception, |out| {
            picture::disparity(perception, &Scale::of_disparity(perception), out);
        });
    }

    /// All of them.
    pub fn all(&mut self) -> [&mut dyn Lazy; 16] {
        [
            &mut self.detections_2d,
            &mut self.detections_3d,
            &mut self.markers,
            &mut self.disparity,
            &mut self.depth,
            &mut self.depth_compressed,
            &mut self.depth_info,
            &mut self.points,
            &mut self.confidence,
            &mut self.saliency,
            &mut self.saliency_compressed,
            &mut self.labels,
            &mut self.overlay.raw,
            &mut self.overlay.jpeg,
            &mut self.disparity_color.raw,
            &mut self.disparity_color.jpeg,
        ]
    }
}

impl Colors {
    fn advertise(node: &mut RosNode, name: &str) -> Result<Self, NodeError> {
        let qos = qos::output();
        Ok(Self {
            raw: Topic::advertise(node, name, &qos)?,
            jpeg: Topic::advertise_twin(node, name, "compressed", &qos)?,
            painted: Image::default(),
        })
    }

    /// Paints once for both forms.
    fn send(
        &mut self,
        status: &NodeStatus,
        perception: &Perception,
        paint: impl FnOnce(&mut Image<[u8; 3]>),
    ) {
        if self.raw.is_wanted() || self.jpeg.is_wanted() {
            paint(&mut self.painted);
            self.raw.send(status, || rgb_image(&self.painted, header(perception)));
            self.jpeg.send(status, || compressed_rgb(&self.painted, header(perception)));
        }
    }
}
