//! A node on DDS.

use std::net::UdpSocket;

use ros2_client::dds::{
    Client, Context, Node, NodeCreateError, Publisher, Server, ServiceMapping, Subscription,
};
use ros2_client::{CreateError, Name, NodeName, NodeOptions, QosProfile, ServiceTypeName};
use rustdds::{DomainParticipant, DomainParticipantBuilder, QosPolicies, Topic, TopicKind};

use super::{NodeError, RECEIVE_BUFFER_BYTES, dds_type};
use crate::ros::environment::Environment;
use crate::ros::message::Message;
use crate::ros::names::Names;

/// A node with its participant.
pub(super) struct DdsNode {
    // The endpoints made by a node are taken off the graph when it is dropped,
    // so it goes before the context.
    node: Node,
    context: Context,
    service_mapping: ServiceMapping,
}

impl DdsNode {
    /// Joins the graph.
    pub fn open(
        names: &Names,
        environment: &Environment,
        service_mapping: ServiceMapping,
    ) -> Result<Self, NodeError> {
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
        // Its log and its parameter services are not those of rclcpp.
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let node = context
            .new_node(node_name, options)
            .map_err(|e: NodeCreateError| node_error(e.to_string()))?;
        Ok(Self { node, context, service_mapping })
    }

    /// The participant, which knows the graph.
    pub fn participant(&self) -> DomainParticipant {
        self.context.domain_participant()
    }

    /// Subscribes to the topic with this full name.
    pub fn subscribe<M: Message + 'static>(
        &mut self,
        topic: &str,
        qos: &QosPolicies,
    ) -> Result<Subscription<M>, CreateError> {
        let topic = self.topic::<M>(topic, qos)?;
        self.node.create_subscription(&topic, None)
    }

    /// Publishes on the topic with this full name.
    pub fn advertise<M: Message>(
        &mut self,
        topic: &str,
        qos: &QosPolicies,
    ) -> Result<Publisher<M>, CreateError> {
        let topic = self.topic::<M>(topic, qos)?;
        self.node.create_publisher(&topic, None)
    }

    /// Offers the service with this name.
    pub fn serve<Req, Resp>(&mut self, name: &Name) -> Result<Server<Req, Resp>, CreateError>
    where
        Req: Message + Clone + 'static,
        Resp: Message + 'static,
    {
        let (mapping, kind) = (self.service_mapping, service_type::<Req>());
        self.node.create_server(mapping, name, &kind, service_qos(), service_qos())
    }

    /// Calls the service with this name.
    pub fn client<Req, Resp>(&mut self, name: &Name) -> Result<Client<Req, Resp>, CreateError>
    where
        Req: Message + Clone + 'static,
        Resp: Message + 'static,
    {
        let (mapping, kind) = (self.service_mapping, service_type::<Req>());
        self.node.create_client(mapping, name, &kind, service_qos(), service_qos())
    }

    fn topic<M: Message>(&self, name: &str, qos: &QosPolicies) -> Result<Topic, CreateError> {
        Ok(self.participant().create_topic(
            dds_topic(name),
            dds_type(M::TYPE_NAME),
            qos,
            TopicKind::NoKey,
        )?)
    }
}

fn service_qos() -> QosProfile {
    use ros2_client::qos::History;
    QosProfile::publisher_default().history(History::KeepLast { depth: 10 })
}

fn service_type<Req: Message>() -> ServiceTypeName {
    // `pkg/srv/Type_Request`
    let mut parts = Req::TYPE_NAME.split('/');
    let package = parts.next().unwrap_or_default();
    let name = parts.next_back().unwrap_or_default();
    ServiceTypeName::new(package, name.strip_suffix("_Request").unwrap_or(name))
}

/// The DDS name of a ROS topic: `/left/image_rect` is `rt/left/image_rect`.
fn dds_topic(name: &str) -> String {
    format!("rt{name}")
}

/// What the kernel makes of the wanted receive buffer, measured on a socket of
/// our own.
pub(super) fn granted_receive_buffer() -> Option<usize> {
    let socket = UdpSocket::bind(("127.0.0.1", 0)).ok()?;
    let socket = socket2::SockRef::from(&socket);
    socket.set_recv_buffer_size(RECEIVE_BUFFER_BYTES).ok()?;
    let reported = socket.recv_buffer_size().ok()?;
    // Linux reports twice the size, the second half for its book-keeping.
    Some(if cfg!(target_os = "linux") { reported / 2 } else { reported })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::message::rcl_interfaces::SetParametersAtomicallyRequest;

    #[test]
    fn names_are_mangled_as_in_rmw() {
        assert_eq!(dds_topic("/left/image_rect"), "rt/left/image_rect");
        let service = service_type::<SetParametersAtomicallyRequest>();
        assert_eq!(service.package_name(), "rcl_interfaces");
        assert_eq!(service.type_name(), "SetParametersAtomically");
    }
}
