//! The node on Zenoh, as `rmw_zenoh_cpp` of ROS 2 Jazzy speaks it: each topic
//! is a key that ends with the type's RIHS01 hash, each message a CDR payload
//! with an attachment, each service a queryable, and whoever takes part declares
//! a liveliness token in which the graph can read its name, type and quality
//! of service.
//!
//! `ros2_client` has a Zenoh backend too. It knows the hashes of a few types
//! only and puts zeros in place of the others, so that no ROS node would
//! receive what we publish; and its queues hold 256 messages, which is 400 MB
//! of images.

mod endpoint;
mod graph;
mod key;
mod wire;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rustdds::QosPolicies;
use zenoh::liveliness::LivelinessToken;
use zenoh::{Config, Session, Wait};

pub use endpoint::{ZenohClient, ZenohPublisher, ZenohServer, ZenohSubscription};
pub use graph::ZenohGraph;

use crate::ros::environment::ZenohSettings;
use crate::ros::message::Message;
use crate::ros::names::Names;
use crate::ros::schema;
use endpoint::Declared;
use key::{Kind, Place};

/// Requests that wait to be answered, per service.
const REQUESTS: usize = 10;

/// A node on a session of its own.
pub struct ZenohNode {
    // The token and the graph's subscription end before the session does.
    _token: LivelinessToken,
    graph: ZenohGraph,
    place: Place,
    next_entity: AtomicU64,
    session: Session,
}

/// What went wrong, in the words of the library.
type Refused = String;

impl ZenohNode {
    /// Opens a session and joins the graph. Needs no router or peer to be
    /// there: the session looks for them as long as it lives.
    ///
    /// # Errors
    /// When the configuration is malformed or a socket is refused.
    pub fn open(names: &Names, domain_id: u16, settings: &ZenohSettings) -> Result<Self, Refused> {
        let session = zenoh::open(config(settings)?).wait().map_err(text)?;
        let place = Place {
            domain_id,
            session: session.zid().to_string(),
            namespace: names.namespace().to_owned(),
            node: names.node().to_owned(),
        };
        let token = session.liveliness().declare_token(place.node_token()).wait().map_err(text)?;
        let graph = ZenohGraph::watch(&session, &place)?;
        Ok(Self { _token: token, graph, place, next_entity: AtomicU64::new(1), session })
    }

    /// What the others' tokens tell.
    pub const fn graph(&self) -> &ZenohGraph {
        &self.graph
    }

    /// Publishes on the topic with this full name.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn advertise<M: Message>(
        &self,
        topic: &str,
        qos: &QosPolicies,
    ) -> Result<ZenohPublisher<M>, Refused> {
        let entity = self.entity(Kind::Publisher, topic, M::TYPE_NAME, Some(qos))?;
        let publisher = self.session.declare_publisher(entity.key.clone()).wait().map_err(text)?;
        Ok(ZenohPublisher::new(publisher, self.announce(entity)?))
    }

    /// Subscribes to the topic with this full name. Of what is not taken in
    /// time the newest messages are kept, as many as the history is deep.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn subscribe<M: Message>(
        &self,
        topic: &str,
        qos: &QosPolicies,
    ) -> Result<ZenohSubscription<M>, Refused> {
        let entity = self.entity(Kind::Subscription, topic, M::TYPE_NAME, Some(qos))?;
        let queue = zenoh::handlers::RingChannel::new(key::depth(qos));
        let subscriber = self.session.declare_subscriber(entity.key.clone()).with(queue).wait();
        Ok(ZenohSubscription::new(subscriber.map_err(text)?, self.announce(entity)?))
    }

    /// Offers the service with this full name.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn serve<Req: Message, Resp: Message>(
        &self,
        service: &str,
    ) -> Result<ZenohServer<Req, Resp>, Refused> {
        let entity = self.entity(Kind::Server, service, service_type::<Req>(), None)?;
        let queue = zenoh::handlers::RingChannel::new(REQUESTS);
        let queryable = self.session.declare_queryable(entity.key.clone()).complete(true);
        let queryable = queryable.with(queue).wait().map_err(text)?;
        Ok(ZenohServer::new(queryable, self.announce(entity)?))
    }

    /// Calls the service with this full name.
    ///
    /// # Errors
    /// When the library refuses.
    pub fn client<Req: Message, Resp: Message>(
        &self,
        service: &str,
    ) -> Result<ZenohClient<Req, Resp>, Refused> {
        let entity = self.entity(Kind::Client, service, service_type::<Req>(), None)?;
        Ok(ZenohClient::new(self.announce(entity)?))
    }

    /// Names an endpoint.
    fn entity(
        &self,
        kind: Kind,
        name: &str,
        type_name: &str,
        qos: Option<&QosPolicies>,
    ) -> Result<Entity, Refused> {
        let hash = schema::type_hash(type_name)
            .ok_or_else(|| format!("the definition of {type_name} is not known"))?;
        let number = self.next_entity.fetch_add(1, Ordering::Relaxed);
        let token = self.place.entity_token(number, kind, name, type_name, &hash, qos);
        Ok(Entity { key: key::data_key(self.place.domain_id, name, type_name, &hash), token })
    }

    /// Declares the token of an endpoint. It comes behind the endpoint's own
    /// declaration: whoever sees a subscription on the graph may write to it.
    fn announce(&self, Entity { key, token }: Entity) -> Result<Declared, Refused> {
        let gid = key::gid(&token);
        let token = self.session.liveliness().declare_token(token).wait().map_err(text)?;
        Ok(Declared { key, gid, _token: Arc::new(token), session: self.session.clone() })
    }
}

/// What an endpoint is called.
struct Entity {
    /// The key of its data.
    key: String,
    /// The key of its token.
    token: String,
}

/// `pkg/srv/Type` of `pkg/srv/Type_Request`.
fn service_type<Req: Message>() -> &'static str {
    Req::TYPE_NAME.strip_suffix("_Request").unwrap_or(Req::TYPE_NAME)
}

// By value, to be handed to `map_err`.
#[allow(clippy::needless_pass_by_value)]
fn text(error: zenoh::Error) -> Refused {
    error.to_string()
}

/// As `rmw_zenoh_cpp` configures a session: a file, or the default of ROS (a
/// peer on this machine, introduced to the others by the router on port 7447),
/// and the overrides upon it.
fn config(settings: &ZenohSettings) -> Result<Config, Refused> {
    let mut config = if let Some(file) = &settings.config_file {
        Config::from_file(file)
            .map_err(|e| format!("ZENOH_SESSION_CONFIG_URI={}: {e}", file.display()))?
    } else {
        let mut config = Config::default();
        for (key, value) in [
            ("mode", "\"peer\""),
            ("connect/endpoints", "[\"tcp/localhost:7447\"]"),
            ("listen/endpoints", "[\"tcp/127.0.0.1:0\"]"),
            ("scouting/multicast/enabled", "false"),
        ] {
            config.insert_json5(key, value).map_err(text)?;
        }
        config
    };
    for entry in settings.overrides.split(';').map(str::trim).filter(|e| !e.is_empty()) {
        let (key, value) = entry
            .split_once('=')
            .ok_or_else(|| format!("ZENOH_CONFIG_OVERRIDE: '{entry}' is not KEY=VALUE"))?;
        config
            .insert_json5(key.trim(), value.trim())
            .map_err(|e| format!("ZENOH_CONFIG_OVERRIDE: {entry}: {e}"))?;
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_are_laid_upon_the_default_of_ros() {
        let settings = |overrides: &str| ZenohSettings {
            overrides: overrides.to_owned(),
            ..ZenohSettings::default()
        };
        let read = |config: &Config, key: &str| config.get_json(key).unwrap();
        let default = config(&settings("")).unwrap();
        assert_eq!(read(&default, "connect/endpoints"), r#"["tcp/localhost:7447"]"#);
        assert_eq!(read(&default, "scouting/multicast/enabled"), "false");
        let changed = config(&settings(r#"mode="client"; connect/endpoints=["tcp/base:7447"];"#));
        let changed = changed.unwrap();
        assert_eq!(read(&changed, "mode"), r#""client""#);
        assert_eq!(read(&changed, "connect/endpoints"), r#"["tcp/base:7447"]"#);
        for bad in ["mode", "no/such/key=1", "mode=\"flying\""] {
            let error = config(&settings(bad)).unwrap_err();
            assert!(error.contains("ZENOH_CONFIG_OVERRIDE") && error.contains(bad), "{error}");
        }
    }
}
