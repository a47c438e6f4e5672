//! Live topics as a door out. Nothing is converted or serialised for a topic
//! without subscribers, but for `regions`; nothing waits for a slow one.

mod lazy;
mod topic;

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::config::Config;
use crate::perception::Perception;
use crate::ros::cdr;
use crate::ros::convert::{REGIONS_LIMIT, fit_regions, region_array};
use crate::ros::diagnostics::NodeStatus;
use crate::ros::message::diagnostic_msgs::DiagnosticArray;
use crate::ros::message::salient_stereo_msgs::SalientRegionArray;
use crate::ros::node::{Graph, NodeError, RosNode};
use crate::ros::qos;
use lazy::LazyTopics;
use topic::{Lazy, Topic};

/// How old the knowledge about subscribers may be.
const GRAPH_AGE: Duration = Duration::from_millis(200);

/// The publishers of the node.
pub struct LiveOutput {
    status: Arc<NodeStatus>,
    graph: Graph,
    looked: Option<Instant>,
    regions: Topic<SalientRegionArray>,
    lazy: LazyTopics,
    diagnostics: Topic<DiagnosticArray>,
    reductions: u64,
}

impl LiveOutput {
    /// Advertises all topics of the node.
    ///
    /// # Errors
    /// When a name or publisher is refused.
    pub fn advertise(node: &mut RosNode, status: Arc<NodeStatus>) -> Result<Self, NodeError> {
        Ok(Self {
            graph: node.graph(),
            looked: None,
            regions: Topic::advertise(node, "regions", &qos::small_output())?,
            lazy: LazyTopics::advertise(node)?,
            diagnostics: Topic::advertise(node, "/diagnostics", &qos::small_output())?,
            reductions: 0,
            status,
        })
    }

    /// Full name of the `regions` topic.
    pub fn regions_topic(&self) -> &str {
        self.regions.name()
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
        self.lazy.publish(perception, config, &self.status);
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
        for topic in self.lazy.all() {
            let found = subscribed.binary_search_by(|name| name.as_str().cmp(topic.name()));
            topic.set_wanted(!lazy || found.is_ok());
        }
    }
}
