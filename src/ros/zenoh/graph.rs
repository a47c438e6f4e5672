//! The graph, read from the tokens of everybody.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use super::Refused;
use super::key::{Kind, Place, Seen, parse};
use crate::ros::graph::Endpoint;

/// Tokens held at most: a stranger who declares without end must not fill the
/// memory.
const MAX_TOKENS: usize = 100_000;

type Tokens = Arc<Mutex<BTreeMap<String, Seen>>>;

/// Who publishes and subscribes elsewhere.
#[derive(Clone)]
pub struct ZenohGraph {
    tokens: Tokens,
    _subscription: Arc<Subscriber<()>>,
}

impl ZenohGraph {
    /// Watches the tokens of a domain from now on.
    pub(super) fn watch(session: &Session, place: &Place) -> Result<Self, Refused> {
        let tokens = Tokens::default();
        let watched = Arc::clone(&tokens);
        let own = place.session.clone();
        let subscription = session
            .liveliness()
            .declare_subscriber(place.all_tokens())
            .history(true)
            .callback(move |sample| {
                let key = sample.key_expr().as_str();
                let mut tokens = watched.lock().unwrap_or_else(PoisonError::into_inner);
                match (sample.kind(), parse(key)) {
                    (SampleKind::Put, Some(seen)) => {
                        if seen.session != own && tokens.len() < MAX_TOKENS {
                            tokens.insert(key.to_owned(), seen);
                        }
                    }
                    (SampleKind::Put, None) => {}
                    (SampleKind::Delete, _) => drop(tokens.remove(key)),
                }
            })
            .wait()
            .map_err(|e| e.to_string())?;
        Ok(Self { tokens, _subscription: Arc::new(subscription) })
    }

    /// The subscriptions elsewhere.
    pub fn readers(&self) -> Vec<Endpoint> {
        self.endpoints(Kind::Subscription)
    }

    /// The publishers elsewhere.
    pub fn writers(&self) -> Vec<Endpoint> {
        self.endpoints(Kind::Publisher)
    }

    fn endpoints(&self, kind: Kind) -> Vec<Endpoint> {
        let tokens = self.tokens.lock().unwrap_or_else(PoisonError::into_inner);
        let seen = tokens.values().filter(|seen| seen.kind == kind);
        seen.map(|seen| Endpoint { topic: seen.topic.clone(), type_name: seen.type_name.clone() })
            .collect()
    }
}
