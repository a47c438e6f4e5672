//! The node on the graph: participant, topics and services with their full
//! names, and what discovery knows about the others.

use std::collections::BTreeSet;
use std::net::UdpSocket;
use std::path::PathBuf;

use ros2_client::service::{Client, Server};
use ros2_client::{
    Context, CreateError, Name, Node, NodeCreateError, NodeLoggingHandle, NodeName, NodeOptions,
    Publisher, QosProfile, ServiceMapping, ServiceTypeName, Subscription,
};
use rustdds::policy::{Durability, Reliability};
use rustdds::{DomainParticipant, DomainParticipantBuilder, QosPolicies, Topic, TopicKind};
use thiserror::Error;

use crate::ros::environment::Environment;
use crate::ros::message::Message;
use crate::ros::names::Names;
use crate::ros::qos::{QosOverrides, Role};

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

/// A node with its participant.
pub struct RosNode {
    // The endpoints made by a node are taken off the graph when it is dropped,
    // so it goes before the context.
    node: Node,
    context: Context,
    names: Names,
    service_mapping: ServiceMapping,
    receive_buffer_bytes: Option<usize>,
    qos_overrides: QosOverrides,
    topics: BTreeSet<String>,
}

impl RosNode {
    /// Joins the graph.
    ///
    /// # Errors
    /// When sockets or threads are refused, or the names are.
    pub fn open(names: Names, environment: &Environment, rosout: bool) -> Result<Self, NodeError> {
        let domain_id = environment.domain_id;
        let participant_error = |reason: String| match &environment.security {
            None => NodeError::Participant { domain_id, reason },
            Some(enclave) => {
                NodeError::Secured { domain_id, enclave: enclave.folder().to_owned(), reason }
            }
        };
        let mut builder = DomainParticipantBuilder::new(domain_id)
            .socket_receive_buffer_size(RECEIVE_BUFFER_BYTES);
        if let Some(networks) = environment.only_networks() {
            builder = builder.with_only_networks(networks);
        }
        #[cfg(feature = "security")]
        if let Some(enclave) = &environment.security {
            use rustdds::DomainParticipantSecurityConfigFiles;
            builder = builder.builtin_security(
                DomainParticipantSecurityConfigFiles::with_ros_default_names(
                    enclave.folder(),
                    String::new(),
                ),
            );
        }
        let participant = builder.build().map_err(|e| participant_error(e.to_string()))?;
        let context = Context::from_domain_participant(participant)
            .map_err(|e| participant_error(e.to_string()))?;

        let node_error = |reason: String| NodeError::Node { name: names.full_name(), reason };
        let node_name = NodeName::new(names.namespace(), names.node())
            .map_err(|e| node_error(e.to_string()))?;
        let options = NodeOptions::new().enable_rosout(rosout).start_parameter_services(false);
        let node = context
            .new_node(node_name, options)
            .map_err(|e: NodeCreateError| node_error(e.to_string()))?;
        Ok(Self {
            node,
            context,
            names,
            service_mapping: environment.service_mapping,
            receive_buffer_bytes: granted_receive_buffer(),
            qos_overrides: QosOverrides::default(),
            topics: BTreeSet::new(),
        })
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

    /// Receive buffer that the kernel grants a socket, in bytes; `None` when
    /// it does not tell.
    pub const fn receive_buffer_bytes(&self) -> Option<usize> {
        self.receive_buffer_bytes
    }

    /// What discovery knows.
    pub fn graph(&self) -> Graph {
        Graph { participant: self.context.domain_participant() }
    }

    /// Writes to `/rosout`.
    pub fn logging_handle(&self) -> NodeLoggingHandle {
        self.node.logging_handle()
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
        let made = self
            .topic::<M>(topic, Role::Subscription, qos)
            .and_then(|topic| self.node.create_subscription(&topic, None));
        made.map_err(|e| endpoint_error("subscription", topic, &e))
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
        let made = self
            .topic::<M>(topic, Role::Publisher, qos)
            .and_then(|topic| self.node.create_publisher(&topic, None));
        made.map_err(|e| endpoint_error("publisher", topic, &e))
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
        let name = service_name("service", service)?;
        self.node
            .create_server(
                self.service_mapping,
                &name,
                &service_type::<Req>(),
                service_qos(),
                service_qos(),
            )
            .map_err(|e| endpoint_error("service", service, &e))
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
        let name = service_name("client", service)?;
        self.node
            .create_client(
                self.service_mapping,
                &name,
                &service_type::<Req>(),
                service_qos(),
                service_qos(),
            )
            .map_err(|e| endpoint_error("client", service, &e))
    }

    fn topic<M: Message>(
        &mut self,
        name: &str,
        role: Role,
        qos: &QosPolicies,
    ) -> Result<Topic, CreateError> {
        self.topics.insert(name.to_owned());
        Ok(self.context.domain_participant().create_topic(
            dds_topic(name),
            dds_type(M::TYPE_NAME),
            &self.qos_overrides.apply(name, role, qos),
            TopicKind::NoKey,
        )?)
    }
}

fn service_qos() -> QosProfile {
    use ros2_client::qos::History;
    QosProfile::publisher_default().history(History::KeepLast { depth: 10 })
}

fn service_name(what: &'static str, service: &str) -> Result<Name, NodeError> {
    Name::parse(service).map_err(|e| NodeError::Endpoint {
        what,
        name: service.to_owned(),
        reason: e.to_string(),
    })
}

fn service_type<Req: Message>() -> ServiceTypeName {
    // `pkg/srv/Type_Request`
    let mut parts = Req::TYPE_NAME.split('/');
    let package = parts.next().unwrap_or_default();
    let name = parts.next_back().unwrap_or_default();
    ServiceTypeName::new(package, name.strip_suffix("_Request").unwrap_or(name))
}

fn endpoint_error(what: &'static str, name: &str, error: &CreateError) -> NodeError {
    NodeError::Endpoint { what, name: name.to_owned(), reason: error.to_string() }
}

/// The DDS name of a ROS topic: `/left/image_rect` is `rt/left/image_rect`.
fn dds_topic(name: &str) -> String {
    format!("rt{name}")
}

/// The DDS name of a ROS type: `sensor_msgs/msg/Image` is `sensor_msgs::msg::dds_::Image_`.
fn dds_type(name: &str) -> String {
    match name.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => name.to_owned(),
    }
}

/// The ROS name of a DDS type.
fn ros_type(name: &str) -> String {
    name.replace("::dds_::", "/").replace("::", "/").trim_end_matches('_').to_owned()
}

/// What discovery knows about the endpoints of other nodes.
#[derive(Clone)]
pub struct Graph {
    participant: DomainParticipant,
}

impl Graph {
    /// Subscriptions of the topic with this full name and type, elsewhere.
    pub fn subscriptions<M: Message>(&self, topic: &str) -> usize {
        let (topic, kind) = (dds_topic(topic), dds_type(M::TYPE_NAME));
        let is_it = |t: &String, k: &String| *t == topic && *k == kind;
        let readers = self.participant.discovered_readers();
        readers
            .iter()
            .map(|reader| &reader.subscription_topic_data)
            .filter(|data| is_it(data.topic_name(), data.type_name()))
            .count()
    }

    /// The full names of all topics with subscriptions elsewhere, each as often
    /// as it has one, sorted.
    pub fn subscribed_topics(&self) -> Vec<String> {
        let mut topics: Vec<String> = self
            .participant
            .discovered_readers()
            .iter()
            .filter_map(|r| {
                Some(r.subscription_topic_data.topic_name().strip_prefix("rt")?.to_owned())
            })
            .collect();
        topics.sort_unstable();
        topics
    }

    /// Publishers elsewhere of the topic with this full name: how many have
    /// the type, and the ROS types of the others.
    pub fn publishers(&self, topic: &str, type_name: &str) -> (usize, Vec<String>) {
        let (topic, kind) = (dds_topic(topic), dds_type(type_name));
        let (mut matching, mut others) = (0, Vec::new());
        for writer in self.participant.discovered_writers() {
            let data = &writer.publication_topic_data;
            if data.topic_name == topic {
                if data.type_name == kind {
                    matching += 1;
                } else {
                    others.push(ros_type(&data.type_name));
                }
            }
        }
        (matching, others)
    }

    /// The full names of all topics that others publish with this type, sorted.
    pub fn published_topics(&self, type_name: &str) -> Vec<String> {
        let kind = dds_type(type_name);
        let writers = self.participant.discovered_writers();
        let data = writers.iter().map(|writer| &writer.publication_topic_data);
        let mut topics: Vec<String> = data
            .filter(|data| data.type_name == kind)
            .filter_map(|data| Some(data.topic_name.strip_prefix("rt")?.to_owned()))
            .collect();
        topics.sort_unstable();
        topics.dedup();
        topics
    }

    /// Publishers and subscriptions of others that name one topic and type and
    /// still do not fit, because a subscription requests what is not offered.
    pub fn qos_conflicts(&self) -> Vec<QosConflict> {
        let (writers, readers) =
            (self.participant.discovered_writers(), self.participant.discovered_readers());
        let mut conflicts = Vec::new();
        for writer in &writers {
            let offer = &writer.publication_topic_data;
            let Some(topic) = offer.topic_name.strip_prefix("rt/") else { continue };
            let offered = offer.qos();
            for reader in &readers {
                let request = &reader.subscription_topic_data;
                if *request.topic_name() != offer.topic_name
                    || *request.type_name() != offer.type_name
                {
                    continue;
                }
                let requested = request.qos();
                if offered.compliance_failure_wrt(&requested).is_some() {
                    conflicts.push(QosConflict {
                        topic: format!("/{topic}"),
                        offered: qos_text(&offered),
                        requested: qos_text(&requested),
                    });
                }
            }
        }
        conflicts.sort_unstable();
        conflicts.dedup();
        conflicts
    }
}

/// A publisher and a subscription of one topic that cannot be matched.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct QosConflict {
    /// Full name of the topic.
    pub topic: String,
    /// What the publisher offers.
    pub offered: String,
    /// What the subscription requests.
    pub requested: String,
}

impl std::fmt::Display for QosConflict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { topic, offered, requested } = self;
        write!(
            f,
            "{topic}: a publisher offers {offered}, a subscription requests {requested}: nothing arrives"
        )
    }
}

/// The two policies that ROS 2 users set, in ROS 2 terms.
fn qos_text(qos: &QosPolicies) -> String {
    let reliability = match qos.reliability() {
        Some(Reliability::Reliable { .. }) => "reliable",
        _ => "best effort",
    };
    let durability = match qos.durability() {
        None | Some(Durability::Volatile) => "volatile",
        Some(_) => "transient local",
    };
    format!("{reliability}, {durability}")
}

/// What the kernel makes of the wanted receive buffer, measured on a socket of
/// our own.
fn granted_receive_buffer() -> Option<usize> {
    let socket = UdpSocket::bind(("127.0.0.1", 0)).ok()?;
    let socket = socket2::SockRef::from(&socket);
    socket.set_recv_buffer_size(RECEIVE_BUFFER_BYTES).ok()?;
    let reported = socket.recv_buffer_size().ok()?;
    // Linux reports twice the size, the second half for its book-keeping.
    Some(if cfg!(target_os = "linux") { reported / 2 } else { reported })
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
    use crate::ros::message::rcl_interfaces::SetParametersAtomicallyRequest;

    #[test]
    fn names_are_mangled_as_in_rmw() {
        assert_eq!(dds_topic("/left/image_rect"), "rt/left/image_rect");
        assert_eq!(dds_type("sensor_msgs/msg/Image"), "sensor_msgs::msg::dds_::Image_");
        assert_eq!(ros_type("sensor_msgs::msg::dds_::Image_"), "sensor_msgs/msg/Image");
        let service = service_type::<SetParametersAtomicallyRequest>();
        assert_eq!(service.package_name(), "rcl_interfaces");
        assert_eq!(service.type_name(), "SetParametersAtomically");
    }

    #[test]
    fn a_small_buffer_is_met_with_the_exact_line() {
        let advice = receive_buffer_advice(212_992).unwrap();
        assert!(advice.contains("sudo sysctl -w net.core.rmem_max=33554432 (now 212992)"));
        assert_eq!(receive_buffer_advice(32 << 20), None);
    }
}
