//! One published topic, and whether anybody listens.

use ros2_client::WriteError;
use rustdds::QosPolicies;

use crate::ros::diagnostics::NodeStatus;
use crate::ros::endpoint::Publisher;
use crate::ros::message::Message;
use crate::ros::names::NameError;
use crate::ros::node::{NodeError, RosNode};

/// A topic that is published while it is wanted.
pub struct Topic<M: Message> {
    name: String,
    publisher: Publisher<M>,
    wanted: bool,
}

impl<M: Message> Topic<M> {
    /// Advertises `name`, which is relative to the node. Wanted at first.
    ///
    /// # Errors
    /// When the name or the publisher is refused.
    pub fn advertise(node: &mut RosNode, name: &str, qos: &QosPolicies) -> Result<Self, NodeError> {
        let full = node.names().topic(name);
        Self::advertise_full(node, full, qos)
    }

    /// Advertises the form of the image topic `name` that `transport` gives it.
    ///
    /// # Errors
    /// When the name or the publisher is refused.
    pub fn advertise_twin(
        node: &mut RosNode,
        name: &str,
        transport: &str,
        qos: &QosPolicies,
    ) -> Result<Self, NodeError> {
        let full = node.names().transport_topic(name, transport);
        Self::advertise_full(node, full, qos)
    }

    fn advertise_full(
        node: &mut RosNode,
        name: Result<String, NameError>,
        qos: &QosPolicies,
    ) -> Result<Self, NodeError> {
        let name = name.map_err(|e| NodeError::Endpoint {
            what: "publisher",
            name: e.name.clone(),
            reason: e.to_string(),
        })?;
        Ok(Self { publisher: node.advertise(&name, qos)?, name, wanted: true })
    }

    /// Publishes the message, which is not even made for nobody. Never waits:
    /// what a full send window refuses is counted and left out.
    pub fn send(&self, status: &NodeStatus, message: impl FnOnce() -> M) {
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

/// What all topics have in common, whatever they carry.
pub trait Lazy {
    /// Full name.
    fn name(&self) -> &str;

    /// True while messages are made and sent.
    fn is_wanted(&self) -> bool;

    /// Switches the topic on or off.
    fn set_wanted(&mut self, wanted: bool);
}

impl<M: Message> Lazy for Topic<M> {
    fn name(&self) -> &str {
        &self.name
    }

    fn is_wanted(&self) -> bool {
        self.wanted
    }

    fn set_wanted(&mut self, wanted: bool) {
        if wanted != self.wanted {
            let change = if wanted { "has subscribers: published" } else { "has none: left out" };
            tracing::debug!("{} {change}", self.name);
            self.wanted = wanted;
        }
    }
}
