//! Topics and services over Zenoh.

use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use futures::stream::{self, Stream};
use ros2_client::{Gid, MessageInfo, ReadError, ReadResult, RmwRequestId, WriteError, WriteResult};
use zenoh::handlers::{FifoChannelHandler, RingChannelHandler};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::query::{ConsolidationMode, Query, QueryTarget, Queryable, Reply};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::wire::Attachment;
use crate::ros::cdr;
use crate::ros::message::Message;

/// What every endpoint has.
pub(super) struct Declared {
    /// The key of its data.
    pub key: String,
    /// Its identity.
    pub gid: [u8; 16],
    /// Keeps it on the graph.
    pub _token: Arc<LivelinessToken>,
    /// Keeps the session open.
    pub session: Session,
}

/// A publisher.
pub struct ZenohPublisher<M> {
    publisher: Publisher<'static>,
    sent: AtomicI64,
    declared: Declared,
    message: PhantomData<fn() -> M>,
}

impl<M: Message> ZenohPublisher<M> {
    pub(super) const fn new(publisher: Publisher<'static>, declared: Declared) -> Self {
        Self { publisher, sent: AtomicI64::new(0), declared, message: PhantomData }
    }

    /// Publishes. What a congested link cannot take is dropped by the library,
    /// which does not tell.
    ///
    /// # Errors
    /// When the session is closed.
    pub fn publish(&self, message: M) -> WriteResult<(), M> {
        let sequence = self.sent.fetch_add(1, Ordering::Relaxed) + 1;
        let attachment = Attachment::now(sequence, self.declared.gid).to_bytes();
        self.publisher
            .put(cdr::encode(&message))
            .attachment(attachment.as_slice())
            .wait()
            .map_err(|e| WriteError::Middleware { reason: e.to_string(), data: message })
    }

    /// The identity that travels with each of its messages.
    pub fn gid(&self) -> Gid {
        self.declared.gid.into()
    }
}

/// A subscription.
pub struct ZenohSubscription<M> {
    subscriber: Subscriber<RingChannelHandler<Sample>>,
    _declared: Declared,
    message: PhantomData<fn() -> M>,
}

impl<M: Message> ZenohSubscription<M> {
    pub(super) const fn new(
        subscriber: Subscriber<RingChannelHandler<Sample>>,
        declared: Declared,
    ) -> Self {
        Self { subscriber, _declared: declared, message: PhantomData }
    }

    /// The oldest message that waits.
    ///
    /// # Errors
    /// When it cannot be decoded.
    pub fn take(&self) -> ReadResult<Option<(M, MessageInfo)>> {
        self.subscriber.try_recv().map_err(|_| ReadError::Closed)?.as_ref().map(decoded).transpose()
    }

    /// All messages to come.
    pub fn stream(&self) -> impl Stream<Item = ReadResult<(M, MessageInfo)>> + Send + '_ {
        stream::unfold(&self.subscriber, |subscriber| async move {
            let sample = subscriber.recv_async().await.ok()?;
            Some((decoded(&sample), subscriber))
        })
    }
}

fn decoded<M: Message>(sample: &Sample) -> ReadResult<(M, MessageInfo)> {
    let message = read(&sample.payload().to_bytes())?;
    let info = sample.attachment().and_then(|bytes| Attachment::from_bytes(&bytes.to_bytes()));
    let nothing = || MessageInfo::new(None, None, 0, Gid::ZERO, None);
    Ok((message, info.map_or_else(nothing, Attachment::info)))
}

fn read<M: Message>(bytes: &[u8]) -> ReadResult<M> {
    cdr::decode(bytes).map_err(|e| ReadError::Deserialization { reason: e.to_string() })
}

/// A service.
pub struct ZenohServer<Req, Resp> {
    queryable: Queryable<RingChannelHandler<Query>>,
    open: Mutex<BTreeMap<RmwRequestId, Query>>,
    _declared: Declared,
    messages: PhantomData<fn(Req) -> Resp>,
}

impl<Req: Message, Resp: Message> ZenohServer<Req, Resp> {
    pub(super) const fn new(
        queryable: Queryable<RingChannelHandler<Query>>,
        declared: Declared,
    ) -> Self {
        let open = Mutex::new(BTreeMap::new());
        Self { queryable, open, _declared: declared, messages: PhantomData }
    }

    /// All requests to come.
    pub fn requests(&self) -> impl Stream<Item = ReadResult<(RmwRequestId, Req)>> + Send + '_ {
        stream::unfold(self, |server| async move {
            let query = server.queryable.recv_async().await.ok()?;
            Some((server.accept(query), server))
        })
    }

    fn accept(&self, query: Query) -> ReadResult<(RmwRequestId, Req)> {
        let attachment = query.attachment().ok_or(ReadError::Malformed)?;
        let id = Attachment::from_bytes(&attachment.to_bytes())
            .ok_or(ReadError::Malformed)?
            .request_id();
        let request = read(&query.payload().ok_or(ReadError::Malformed)?.to_bytes())?;
        self.open.lock().unwrap_or_else(PoisonError::into_inner).insert(id, query);
        Ok((id, request))
    }

    /// Answers a request once.
    ///
    /// # Errors
    /// When it was answered already, or the session is closed.
    pub fn respond(&self, id: RmwRequestId, response: &Resp) -> WriteResult<(), ()> {
        let query = self.open.lock().unwrap_or_else(PoisonError::into_inner).remove(&id);
        let failed = |reason: String| WriteError::Middleware { reason, data: () };
        let query = query.ok_or_else(|| failed("no such request".to_owned()))?;
        let attachment = Attachment::now(id.sequence_number, id.writer_gid.to_bytes16());
        query
            .reply(query.key_expr().clone(), cdr::encode(response))
            .attachment(attachment.to_bytes().as_slice())
            .wait()
            .map_err(|e| failed(e.to_string()))
    }
}

/// The other end of a service.
pub struct ZenohClient<Req, Resp> {
    declared: Declared,
    sent: AtomicI64,
    waiting: Mutex<BTreeMap<RmwRequestId, FifoChannelHandler<Reply>>>,
    messages: PhantomData<fn(Req) -> Resp>,
}

impl<Req: Message, Resp: Message> ZenohClient<Req, Resp> {
    pub(super) const fn new(declared: Declared) -> Self {
        let waiting = Mutex::new(BTreeMap::new());
        Self { declared, sent: AtomicI64::new(0), waiting, messages: PhantomData }
    }

    /// Asks.
    ///
    /// # Errors
    /// When the session is closed.
    pub fn send_request(&self, request: &Req) -> WriteResult<RmwRequestId, ()> {
        let sequence = self.sent.fetch_add(1, Ordering::Relaxed) + 1;
        let attachment = Attachment::now(sequence, self.declared.gid);
        let replies = self
            .declared
            .session
            .get(&self.declared.key)
            .payload(cdr::encode(request))
            .attachment(attachment.to_bytes().as_slice())
            .target(QueryTarget::AllComplete)
            .consolidation(ConsolidationMode::None)
            .wait()
            .map_err(|e| WriteError::Middleware { reason: e.to_string(), data: () })?;
        let id = attachment.request_id();
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner).insert(id, replies);
        Ok(id)
    }

    /// An answer that has come.
    ///
    /// # Errors
    /// When it cannot be decoded.
    pub fn receive_response(&self) -> ReadResult<Option<(RmwRequestId, Resp)>> {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let mut found = None;
        // A request whose replies have ended is forgotten.
        waiting.retain(|id, replies| {
            if found.is_some() {
                return true;
            }
            match replies.try_recv() {
                Ok(Some(reply)) => {
                    found = reply.into_result().ok().map(|sample| (*id, sample));
                    false
                }
                Ok(None) => true,
                Err(_) => false,
            }
        });
        drop(waiting);
        found.map(|(id, sample)| Ok((id, read(&sample.payload().to_bytes())?))).transpose()
    }
}
