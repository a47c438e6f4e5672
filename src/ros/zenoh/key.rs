//! The keys under which `rmw_zenoh_cpp` publishes and under which it tells who
//! takes part.
//!
//! | key | form |
//! |---|---|
//! | data | `DOMAIN/TOPIC/TYPE/HASH` |
//! | node | `@ros2_lv/DOMAIN/SESSION/NODE/NODE/NN/ENCLAVE/NAMESPACE/NAME` |
//! | endpoint | `@ros2_lv/DOMAIN/SESSION/NODE/ENTITY/KIND/ENCLAVE/NAMESPACE/NAME/TOPIC/TYPE/HASH/QOS` |
//!
//! In the tokens `/` within a name is written `%`, and so is an empty name.

use rustdds::QosPolicies;
use rustdds::policy::{Durability, History, Reliability};
use xxhash_rust::xxh3::xxh3_128;

use crate::ros::node::{dds_type, ros_type};

const TOKENS: &str = "@ros2_lv";

/// The only node of a session.
const NODE_ID: u64 = 0;

/// What an endpoint does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Publisher,
    Subscription,
    Server,
    Client,
}

impl Kind {
    const fn code(self) -> &'static str {
        match self {
            Self::Publisher => "MP",
            Self::Subscription => "MS",
            Self::Server => "SS",
            Self::Client => "SC",
        }
    }
}

/// Where a node stands.
pub(super) struct Place {
    pub domain_id: u16,
    /// Identifier of the session.
    pub session: String,
    pub namespace: String,
    pub node: String,
}

impl Place {
    /// Matches the tokens of everybody in the domain.
    pub fn all_tokens(&self) -> String {
        format!("{TOKENS}/{}/**", self.domain_id)
    }

    pub fn node_token(&self) -> String {
        format!("{}/{NODE_ID}/NN/{}", self.node_prefix(), self.node_suffix())
    }

    pub fn entity_token(
        &self,
        entity: u64,
        kind: Kind,
        name: &str,
        type_name: &str,
        hash: &str,
        qos: Option<&QosPolicies>,
    ) -> String {
        format!(
            "{}/{entity}/{}/{}/{}/{}/{hash}/{}",
            self.node_prefix(),
            kind.code(),
            self.node_suffix(),
            mangled(name),
            dds_type(type_name),
            qos_code(qos)
        )
    }

    fn node_prefix(&self) -> String {
        format!("{TOKENS}/{}/{}/{NODE_ID}", self.domain_id, self.session)
    }

    fn node_suffix(&self) -> String {
        // No enclave.
        format!("%/{}/{}", mangled(&self.namespace), mangled(&self.node))
    }
}

/// Under which a topic's messages and a service's requests travel.
pub(super) fn data_key(domain_id: u16, name: &str, type_name: &str, hash: &str) -> String {
    format!("{domain_id}/{}/{}/{hash}", name.trim_matches('/'), dds_type(type_name))
}

fn mangled(name: &str) -> String {
    if name.is_empty() { "%".to_owned() } else { name.replace('/', "%") }
}

/// A topic's endpoint elsewhere.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Seen {
    pub kind: Kind,
    /// Identifier of its session.
    pub session: String,
    /// Full name of the topic.
    pub topic: String,
    /// ROS type.
    pub type_name: String,
}

/// What a token tells; `None` for those of nodes and services, and for keys
/// that are none.
pub(super) fn parse(token: &str) -> Option<Seen> {
    let parts: Vec<&str> = token.split('/').collect();
    let &[TOKENS, _, session, _, _, kind, _, _, _, topic, type_name, _, _] = parts.as_slice()
    else {
        return None;
    };
    let kind = match kind {
        "MP" => Kind::Publisher,
        "MS" => Kind::Subscription,
        _ => return None,
    };
    Some(Seen {
        kind,
        session: session.to_owned(),
        topic: topic.replace('%', "/"),
        type_name: ros_type(type_name),
    })
}

/// The identity of an endpoint: the 128-bit XXH3 of its token, low half first.
pub(super) fn gid(token: &str) -> [u8; 16] {
    xxh3_128(token.as_bytes()).to_le_bytes()
}

/// How many messages a subscription keeps.
pub(super) fn depth(qos: &QosPolicies) -> usize {
    match qos.history() {
        Some(History::KeepLast { depth }) => usize::try_from(depth).unwrap_or(1).max(1),
        _ => 1,
    }
}

/// `RELIABILITY:DURABILITY:HISTORY,DEPTH:DEADLINE:LIFESPAN:LIVELINESS`: what
/// equals ROS's default profile is left empty, but for the depth.
fn qos_code(qos: Option<&QosPolicies>) -> String {
    let Some(qos) = qos else { return "::,10:,:,:,,".to_owned() };
    let reliability = match qos.reliability() {
        Some(Reliability::Reliable { .. }) => "",
        _ => "2",
    };
    let durability = match qos.durability() {
        None | Some(Durability::Volatile) => "",
        Some(_) => "1",
    };
    format!("{reliability}:{durability}:,{}:,:,:,,", depth(qos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::qos;

    fn place() -> Place {
        Place {
            domain_id: 3,
            session: "aac3".into(),
            namespace: "/robot".into(),
            node: "eye".into(),
        }
    }

    #[test]
    fn keys_are_those_of_the_rmw() {
        assert_eq!(
            data_key(0, "/robot/chatter", "std_msgs/msg/String", "RIHS01_df"),
            "0/robot/chatter/std_msgs::msg::dds_::String_/RIHS01_df"
        );
        assert_eq!(place().node_token(), "@ros2_lv/3/aac3/0/0/NN/%/%robot/eye");
        let token = place().entity_token(
            7,
            Kind::Publisher,
            "/robot/regions",
            "salient_stereo_msgs/msg/SalientRegionArray",
            "RIHS01_x",
            Some(&qos::output()),
        );
        assert_eq!(
            token,
            "@ros2_lv/3/aac3/0/7/MP/%/%robot/eye/%robot%regions/\
             salient_stereo_msgs::msg::dds_::SalientRegionArray_/RIHS01_x/::,5:,:,:,,"
        );
        let root = Place { namespace: "/".into(), ..place() };
        assert!(root.node_token().ends_with("/NN/%/%/eye"));
        assert_eq!(qos_code(Some(&qos::sensor_data())), "2::,5:,:,:,,");
    }

    #[test]
    fn tokens_of_topics_are_understood_and_others_left_alone() {
        let token = "@ros2_lv/0/aac3/0/11/MS/%/%/listener/%chatter/std_msgs::msg::dds_::String_/RIHS01_d/::,7:,:,:,,";
        assert_eq!(
            parse(token),
            Some(Seen {
                kind: Kind::Subscription,
                session: "aac3".into(),
                topic: "/chatter".into(),
                type_name: "std_msgs/msg/String".into(),
            })
        );
        for other in [
            "@ros2_lv/0/aac3/0/0/NN/%/%/listener",
            "@ros2_lv/0/aac3/0/11/SS/%/%/a/%s/std_srvs::srv::dds_::Trigger_/RIHS01_d/::,7:,:,:,,",
            "@ros2_lv",
            "",
        ] {
            assert_eq!(parse(other), None, "{other}");
        }
    }

    #[test]
    fn a_gid_is_the_hash_with_its_low_half_first() {
        let hash = xxh3_128(b"key");
        assert_eq!(gid("key")[..8], (hash as u64).to_le_bytes());
        assert_eq!(gid("key")[8..], ((hash >> 64) as u64).to_le_bytes());
    }
}
