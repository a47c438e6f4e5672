//! Live topics as a door out. Nothing is converted or serialised for a topic
//! without subscribers, but for `regions`; nothing waits for a slow one.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ros2_client::{Publisher, WriteError};

use crate::config::Config;
use crate::perception::Perception;
use crate::ros::cdr;
use crate::ros::convert::{
    REGIONS_LIMIT, confidence_image, depth_camera_info, depth_image, disparity_image, fit_regions,
    header, label_image, region_array, saliency_image,
};
use crate::ros::diagnostics::NodeStatus;
use crate::ros::message::Message;
use crate::ros::message::diagnostic_msgs::DiagnosticArray;
use crate::ros::message::salient_stereo_msgs::SalientRegionArray;
use crate::ros::message::sensor_msgs::{CameraInfo, Image};
use crate::ros::message::stereo_msgs::DisparityImage;
use crate::ros::node::{Graph, NodeError, RosNode};
use crate::ros::qos;

/// How old the knowledge about subscribers may be.
const GRAPH_AGE: Duration = Duration::from_millis(200);

/// The publishers of the node.
pub struct LiveOutput {
    status: Arc<NodeStatus>,
    graph: Graph,
    looked: Option<Instant>,
    regions: Topic<SalientRegionArray>,
    disparity: Topic<DisparityImage>,
    depth: Topic<Image>,
    depth_info: Topic<CameraInfo>,
    confidence: Topic<Image>,
    saliency: Topic<Image>,
    labels: Topic<Image>,
    diagnostics: Topic<DiagnosticArray>,
    reductions: u64,
}

struct Topic<M: Message> {
    name: String,
    publisher: Publisher<M>,
    wanted: bool,
}

impl LiveOutput {
    /// Advertises all topics of the node.
    ///
    /// # Errors
    /// When a name or publisher is refused.
    pub fn advertise(node: &mut RosNode, status: Arc<NodeStatus>) -> Result<Self, NodeError> {
        let large = qos::output();
        Ok(Self {
            graph: node.graph(),
            looked: None,
            regions: topic(node, "regions", &qos::small_output())?,
            disparity: topic(node, "disparity", &large)?,
            depth: topic(node, "depth/image_rect", &large)?,
            depth_info: topic(node, "depth/camera_info", &large)?,
            confidence: topic(node, "confidence/image_rect", &large)?,
            saliency: topic(node, "saliency/image_rect", &large)?,
            labels: topic(node, "regions/label_image", &large)?,
            diagnostics: topic(node, "/diagnostics", &qos::small_output())?,
            reductions: 0,
            status,
        })
    }

    /// Full name of the `regions` topic.
    pub fn regions_topic(&self) -> &str {
        &self.regions.name
    }

    /// Publishes what was made of one frame. Never waits: what a full send
    /// window refuses is counted and left out.
    pub fn publish(&mut self, perception: &Perception, config: &Config) {
        self.look(config.lazy);
        let mut array = region_array(perception, config.regions.publish_masks);
        let reduction = fit_regions(&mut array);
        let bytes = match &reduction {
            Some(reduction) => reduction.bytes_after,
            None => cdr::encode(&array).len(),
        };
        self.status.note_regions_size(bytes, REGIONS_LIMIT);
        if let Some(reduction) = reduction {
            // Once, and then each time the number has doubled.
            self.reductions += 1;
            if self.reductions.is_power_of_two() {
                tracing::warn!("{reduction} ({} frames so far)", self.reductions);
            }
        }
        self.regions.send(&self.status, || array);
        self.disparity.send(&self.status, || disparity_image(perception));
        self.depth.send(&self.status, || depth_image(perception, config.depth.encoding));
        self.depth_info.send(&self.status, || depth_camera_info(perception));
        self.confidence.send(&self.status, || confidence_image(perception));
        self.saliency.send(&self.status, || saliency_image(perception));
        self.labels.send(&self.status, || label_image(&perception.labels, header(perception)));
    }

    /// Publishes a report on the node's health.
    pub fn publish_diagnostics(&mut self, message: DiagnosticArray) {
        self.diagnostics.send(&self.status, || message);
    }

    /// Finds out, not too often, which topics have subscribers.
    fn look(&mut self, lazy: bool) {
        if self.looked.is_some_and(|then| then.elapsed() < GRAPH_AGE) {
            return;
        }
        self.looked = Some(Instant::now());
        let subscribed = self.graph.subscribed_topics();
        let wanted = |name: &String| !lazy || subscribed.binary_search(name).is_ok();
        self.disparity.set_wanted(wanted(&self.disparity.name));
        self.depth.set_wanted(wanted(&self.depth.name));
        self.depth_info.set_wanted(wanted(&self.depth_info.name));
        self.confidence.set_wanted(wanted(&self.confidence.name));
        self.saliency.set_wanted(wanted(&self.saliency.name));
        self.labels.set_wanted(wanted(&self.labels.name));
    }
}

fn topic<M: Message>(
    node: &mut RosNode,
    name: &str,
    qos: &rustdds::QosPolicies,
) -> Result<Topic<M>, NodeError> {
    let full = node.names().topic(name).map_err(|e| NodeError::Endpoint {
        what: "publisher",
        name: name.to_owned(),
        reason: e.to_string(),
    })?;
    // Only those that `look` finds without subscribers are switched off.
    Ok(Topic { publisher: node.advertise(&full, qos)?, name: full, wanted: true })
}

impl<M: Message> Topic<M> {
    fn set_wanted(&mut self, wanted: bool) {
        if wanted != self.wanted {
            let change = if wanted { "has subscribers: published" } else { "has none: left out" };
            tracing::debug!("{} {change}", self.name);
            self.wanted = wanted;
        }
    }

    fn send(&self, status: &NodeStatus, message: impl FnOnce() -> M) {
        if !self.wanted {
            return;
        }
        match self.publisher.publish(message()) {
            Ok(()) => status.count_published(&self.name),
            Err(WriteError::WouldBlock { .. }) => status.count_would_block(),
            Err(error) => {
                status.count_publish_error();
                tracing::debug!("{}: {error}", self.name);
            }
        }
    }
}
