//! The node on the graph: topics and services with their full names, over DDS
//! or Zenoh, and what discovery knows about the others.

mod dds;

use std::collections::BTreeSet;
use std::path::PathBuf;

use ros2_client::Name;
use rustdds::QosPolicies;
use thiserror::Error;

pub use crate::ros::graph::{Graph, QosConflict};

use crate::ros::endpoint::{Client, Publisher, Server, Subscription};
use crate::ros::environment::{Environment, Middleware};
use crate::ros::message::Message;
use crate::ros::names::Names;
use crate::ros::qos::{QosOverrides, Role};
#[cfg(feature = "zenoh")]
use crate::ros::zenoh::ZenohNode;
use dds::DdsNode;

/// Receive buffer asked for each socket: two colour images of 1.4 MB arrive as
/// one burst of fragments.
pub const RECEIVE_BUFFER_BYTES: usize = 32 << 20;

/// Below this, raw images of VGA size and up get lost.
pub const SUFFICIENT_RECEIVE_BUFFER_BYTES: usize = 4 << 20;

/// What keeps a node from the graph.
#[derive(Debug, Error)]
pub enum NodeError {
    /// The participant could not be made.
    #[error("cannot join DDS domain {domain_id}: {reason}")]
    Participant {
        /// The domain.
        domain_id: u16,
        /// What the library said.
        reason: String,
    },
    /// The participant was refused with this identity and these permissions.
    #[error(
        "cannot join DDS domain {domain_id} with the security files in {}: {reason}",
        .enclave.display()
    )]
    Secured {
        /// The domain.
        domain_id: u16,
        /// The enclave's folder.
        enclave: PathBuf,
        /// What the library said.
        reason: String,
    },
    /// The Zenoh session could not be opened.
    #[cfg(feature = "zenoh")]
    #[error("cannot open a Zenoh session: {reason}")]
    Session {
        /// What the library said.
        reason: String,
    },
    /// The node could not be made.
    #[error("cannot create node '{name}': {reason}")]
    Node {
        /// Full name.
        name: String,
        /// What the library said.
        reason: String,
    },
    /// A topic or service could not be made.
    #[error("cannot create {what} '{name}': {reason}")]
    Endpoint {
        /// `subscription`, `publisher`, `service` or `client`.
        what: &'static str,
        /// Full name.
        name: String,
        /// What the library said.
        reason: String,
    },
}

/// A node on its graph.
pub struct RosNode {
    carrier: Carrier,
    names: Names,
    qos_overrides: QosOverrides,
    topics: BTreeSet<String>,
}

enum Carrier {
    Dds(Box<DdsNode>),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohNode),
}

impl RosNode {
    /// Joins the graph.
    ///
    /// # Errors
    /// When sockets or threads are refused, or the names are.
    pub fn open(names: Names, environment: &Environment) -> Result<Self, NodeError> {
        let carrier = match &environment.middleware {
            Middleware::Dds(mapping) => {
                Carrier::Dds(Box::new(DdsNode::open(&names, environment, *mapping)?))
            }
            #[cfg(feature = "zenoh")]
            Middleware::Zenoh(settings) => {
                let node = ZenohNode::open(&names, environment.domain_id, settings);
                Carrier::Zenoh(node.map_err(|reason| NodeError::Session { reason })?)
            }
        };
        Ok(Self { carrier, names, qos_overrides: QosOverrides::default(), topics: BTreeSet::new() })
    }

    /// Replaces policies of the topics that are made from now on.
    pub fn override_qos(&mut self, overrides: QosOverrides) {
        self.qos_overrides = overrides;
    }

    /// Topics named by an override that this node does not have.
    pub fn useless_qos_overrides(&self) -> BTreeSet<&str> {
        self.qos_overrides.topics().filter(|topic| !self.topics.contains(*topic)).collect()
    }

    /// The node's names.
    pub const fn names(&self) -> &Names {
        &self.names
    }

    /// Receive buffer that the kernel grants a socket of DDS, in bytes; `None`
    /// when it does not tell, and over Zenoh, which has no need of one.
    pub fn receive_buffer_bytes(&self) -> Option<usize> {
        match &self.carrier {
            Carrier::Dds(_) => dds::granted_receive_buffer(),
            #[cfg(feature = "zenoh")]
            Carrier::Zenoh(_) => None,
        }
    }

    /// What discovery knows.
    pub fn graph(&self) -> Graph {
        match &self.carrier {
            Carrier::Dds(node) => Graph::Dds(node.participant()),
            #[cfg(feature = "zenoh")]
            Carrier::Zenoh(node) => Graph::Zenoh(node.graph().clone()),
        }
    }

    /// Subscribes to the topic with this full name.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn subscribe<M: Message + 'static>(
        &mut self,
        topic: &str,
        qos: &QosPolicies,
    ) -> Result<Subscription<M>, NodeError> {
        let qos = self.qos(topic, Role::Subscription, qos);
        match &mut self.carrier {
            Carrier::Dds(node) => node.subscribe(topic, &qos).map(Subscription::Dds).map_err(text),
            #[cfg(feature = "zenoh")]
            Carrier::Zenoh(node) => node.subscribe(topic, &qos).map(Subscription::Zenoh),
        }
        .map_err(|reason| endpoint_error("subscription", topic, reason))
    }

    /// Publishes on the topic with this full name.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn advertise<M: Message>(
        &mut self,
        topic: &str,
        qos: &QosPolicies,
    ) -> Result<Publisher<M>, NodeError> {
        let qos = self.qos(topic, Role::Publisher, qos);
        match &mut self.carrier {
            Carrier::Dds(node) => node.advertise(topic, &qos).map(Publisher::Dds).map_err(text),
            #[cfg(feature = "zenoh")]
            Carrier::Zenoh(node) => node.advertise(topic, &qos).map(Publisher::Zenoh),
        }
        .map_err(|reason| endpoint_error("publisher", topic, reason))
    }

    /// Offers the service with this full name.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn serve<Req, Resp>(&mut self, service: &str) -> Result<Server<Req, Resp>, NodeError>
    where
        Req: Message + Clone + 'static,
        Resp: Message + 'static,
    {
        match &mut self.carrier {
            Carrier::Dds(node) => Name::parse(service)
                .map_err(text)
                .and_then(|name| node.serve(&name).map(Server::Dds).map_err(text)),
            #[cfg(feature = "zenoh")]
            Carrier::Zenoh(node) => node.serve(service).map(Server::Zenoh),
        }
        .map_err(|reason| endpoint_error("service", service, reason))
    }

    /// Calls the service with this full name.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn client<Req, Resp>(&mut self, service: &str) -> Result<Client<Req, Resp>, NodeError>
    where
        Req: Message + Clone + 'static,
        Resp: Message + 'static,
    {
        match &mut self.carrier {
            Carrier::Dds(node) => Name::parse(service)
                .map_err(text)
                .and_then(|name| node.client(&name).map(Client::Dds).map_err(text)),
            #[cfg(feature = "zenoh")]
            Carrier::Zenoh(node) => node.client(service).map(Client::Zenoh),
        }
        .map_err(|reason| endpoint_error("client", service, reason))
    }

    fn qos(&mut self, topic: &str, role: Role, qos: &QosPolicies) -> QosPolicies {
        self.topics.insert(topic.to_owned());
        self.qos_overrides.apply(topic, role, qos)
    }
}

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn endpoint_error(what: &'static str, name: &str, reason: String) -> NodeError {
    NodeError::Endpoint { what, name: name.to_owned(), reason }
}

/// The DDS name of a ROS type: `sensor_msgs/msg/Image` is `sensor_msgs::msg::dds_::Image_`.
/// Zenoh has it too.
pub(super) fn dds_type(name: &str) -> String {
    match name.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => name.to_owned(),
    }
}

/// The ROS name of a DDS type.
pub(super) fn ros_type(name: &str) -> String {
    name.replace("::dds_::", "/").replace("::", "/").trim_end_matches('_').to_owned()
}

/// What to do about a receive buffer of this size, when it is too small.
pub fn receive_buffer_advice(granted_bytes: usize) -> Option<String> {
    (granted_bytes < SUFFICIENT_RECEIVE_BUFFER_BYTES).then(|| {
        format!(
            "the kernel grants {granted_bytes} bytes of receive buffer per socket; raw images will be \
             lost. Run: sudo sysctl -w net.core.rmem_max={RECEIVE_BUFFER_BYTES} (now {granted_bytes}), \
             or subscribe to compressed images (image_transport:=compressed)"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_mangled_as_in_rmw() {
        assert_eq!(dds_type("sensor_msgs/msg/Image"), "sensor_msgs::msg::dds_::Image_");
        assert_eq!(ros_type("sensor_msgs::msg::dds_::Image_"), "sensor_msgs/msg/Image");
    }

    #[test]
    fn a_small_buffer_is_met_with_the_exact_line() {
        let advice = receive_buffer_advice(212_992).unwrap();
        assert!(advice.contains("sudo sysctl -w net.core.rmem_max=33554432 (now 212992)"));
        assert_eq!(receive_buffer_advice(32 << 20), None);
    }
}
