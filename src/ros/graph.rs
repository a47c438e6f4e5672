//! What discovery knows about the endpoints of other nodes.

use rustdds::policy::{Durability, Reliability};
use rustdds::{DomainParticipant, QosPolicies};

use crate::ros::message::Message;
use crate::ros::node::ros_type;
#[cfg(feature = "zenoh")]
use crate::ros::zenoh::ZenohGraph;

/// Who publishes and subscribes, on other nodes.
#[derive(Clone)]
pub enum Graph {
    /// As DDS discovery has it.
    Dds(DomainParticipant),
    /// As the liveliness tokens of Zenoh have it.
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohGraph),
}

/// A publisher or subscription of a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// Full name.
    pub topic: String,
    /// As `sensor_msgs/msg/Image`.
    pub type_name: String,
}

impl Graph {
    fn readers(&self) -> Vec<Endpoint> {
        match self {
            Self::Dds(participant) => participant
                .discovered_readers()
                .iter()
                .map(|reader| &reader.subscription_topic_data)
                .filter_map(|data| dds_endpoint(data.topic_name(), data.type_name()))
                .collect(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(graph) => graph.readers(),
        }
    }

    fn writers(&self) -> Vec<Endpoint> {
        match self {
            Self::Dds(participant) => participant
                .discovered_writers()
                .iter()
                .map(|writer| &writer.publication_topic_data)
                .filter_map(|data| dds_endpoint(&data.topic_name, &data.type_name))
                .collect(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(graph) => graph.writers(),
        }
    }

    /// Subscriptions of the topic with this full name and type, elsewhere.
    pub fn subscriptions<M: Message>(&self, topic: &str) -> usize {
        let readers = self.readers();
        readers.iter().filter(|r| r.topic == topic && r.type_name == M::TYPE_NAME).count()
    }

    /// The full names of all topics with subscriptions elsewhere, each as often
    /// as it has one, sorted.
    pub fn subscribed_topics(&self) -> Vec<String> {
        let mut topics: Vec<String> = self.readers().into_iter().map(|r| r.topic).collect();
        topics.sort_unstable();
        topics
    }

    /// Publishers elsewhere of the topic with this full name: how many have
    /// the type, and the ROS types of the others.
    pub fn publishers(&self, topic: &str, type_name: &str) -> (usize, Vec<String>) {
        let types = self.writers().into_iter().filter(|w| w.topic == topic).map(|w| w.type_name);
        let (matching, others): (Vec<_>, Vec<_>) = types.partition(|found| found == type_name);
        (matching.len(), others)
    }

    /// The full names of all topics that others publish with this type, sorted.
    pub fn published_topics(&self, type_name: &str) -> Vec<String> {
        let writers = self.writers().into_iter().filter(|writer| writer.type_name == type_name);
        let mut topics: Vec<String> = writers.map(|writer| writer.topic).collect();
        topics.sort_unstable();
        topics.dedup();
        topics
    }

    /// Publishers and subscriptions of others that name one topic and type and
    /// still do not fit, because a subscription requests what is not offered.
    /// Zenoh matches them all.
    pub fn qos_conflicts(&self) -> Vec<QosConflict> {
        match self {
            Self::Dds(participant) => dds_conflicts(participant),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(_) => Vec::new(),
        }
    }
}

/// `None` for what is no topic of ROS: services, and what other programs have.
fn dds_endpoint(topic: &str, type_name: &str) -> Option<Endpoint> {
    let topic = topic.strip_prefix("rt")?.to_owned();
    Some(Endpoint { topic, type_name: ros_type(type_name) })
}

fn dds_conflicts(participant: &DomainParticipant) -> Vec<QosConflict> {
    let (writers, readers) = (participant.discovered_writers(), participant.discovered_readers());
    let mut conflicts = Vec::new();
    for writer in &writers {
        let offer = &writer.publication_topic_data;
        let Some(topic) = offer.topic_name.strip_prefix("rt/") else { continue };
        let offered = offer.qos();
        for reader in &readers {
            let request = &reader.subscription_topic_data;
            if *request.topic_name() != offer.topic_name || *request.type_name() != offer.type_name
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
