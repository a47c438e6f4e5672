//! The ends of topics and services, over DDS or Zenoh.

// There are a few dozen in a process, and none is moved about.
#![allow(clippy::large_enum_variant)]

use futures::stream::{BoxStream, StreamExt};
use ros2_client::{Gid, MessageInfo, ReadResult, RmwRequestId, WriteResult, dds};

use crate::ros::message::Message;
#[cfg(feature = "zenoh")]
use crate::ros::zenoh::{ZenohClient, ZenohPublisher, ZenohServer, ZenohSubscription};

/// Publishes on one topic.
pub enum Publisher<M: Message> {
    /// Over DDS.
    Dds(dds::Publisher<M>),
    /// Over Zenoh.
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohPublisher<M>),
}

impl<M: Message> Publisher<M> {
    /// Publishes. Never waits for subscribers.
    ///
    /// # Errors
    /// When a reliable window of DDS is full (`WouldBlock`), or the transport
    /// has ended.
    pub fn publish(&self, message: M) -> WriteResult<(), M> {
        match self {
            Self::Dds(publisher) => publisher.publish(message),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(publisher) => publisher.publish(message),
        }
    }

    /// The identity that travels with each of its messages.
    pub fn gid(&self) -> Gid {
        match self {
            Self::Dds(publisher) => publisher.gid(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(publisher) => publisher.gid(),
        }
    }
}

/// Receives from one topic.
pub enum Subscription<M: Message + 'static> {
    /// Over DDS.
    Dds(dds::Subscription<M>),
    /// Over Zenoh.
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohSubscription<M>),
}

impl<M: Message + 'static> Subscription<M> {
    /// The next message, if one has come.
    ///
    /// # Errors
    /// When it cannot be decoded.
    pub fn take(&self) -> ReadResult<Option<(M, MessageInfo)>> {
        match self {
            Self::Dds(subscription) => subscription.take(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(subscription) => subscription.take(),
        }
    }
}

impl<M: Message + Send + Sync + 'static> Subscription<M> {
    /// All messages to come.
    pub fn async_stream(&self) -> BoxStream<'_, ReadResult<(M, MessageInfo)>> {
        match self {
            Self::Dds(subscription) => subscription.async_stream().boxed(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(subscription) => subscription.stream().boxed(),
        }
    }
}

/// Answers the requests of one service.
pub enum Server<Req, Resp>
where
    Req: Message + 'static,
    Resp: Message + 'static,
{
    /// Over DDS.
    Dds(dds::Server<Req, Resp>),
    /// Over Zenoh.
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohServer<Req, Resp>),
}

impl<Req, Resp> Server<Req, Resp>
where
    Req: Message + Send + Sync + 'static,
    Resp: Message + Send + Sync + 'static,
{
    /// All requests to come.
    pub fn receive_request_stream(&self) -> BoxStream<'_, ReadResult<(RmwRequestId, Req)>> {
        match self {
            Self::Dds(server) => server.receive_request_stream().boxed(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(server) => server.requests().boxed(),
        }
    }

    /// Answers one.
    ///
    /// # Errors
    /// When the transport refuses.
    pub fn send_response(&self, id: RmwRequestId, response: Resp) -> WriteResult<(), ()> {
        match self {
            Self::Dds(server) => server.send_response(id, response),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(server) => server.respond(id, &response),
        }
    }
}

/// Calls one service.
pub enum Client<Req, Resp>
where
    Req: Message + 'static,
    Resp: Message + 'static,
{
    /// Over DDS.
    Dds(dds::Client<Req, Resp>),
    /// Over Zenoh.
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohClient<Req, Resp>),
}

impl<Req, Resp> Client<Req, Resp>
where
    Req: Message + Clone + 'static,
    Resp: Message + 'static,
{
    /// Asks.
    ///
    /// # Errors
    /// When the transport refuses.
    pub fn send_request(&self, request: Req) -> WriteResult<RmwRequestId, ()> {
        match self {
            Self::Dds(client) => client.send_request(request),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(client) => client.send_request(&request),
        }
    }

    /// The next answer, if one has come.
    ///
    /// # Errors
    /// When it cannot be decoded.
    pub fn receive_response(&self) -> ReadResult<Option<(RmwRequestId, Resp)>> {
        match self {
            Self::Dds(client) => client.receive_response(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(client) => client.receive_response(),
        }
    }
}
