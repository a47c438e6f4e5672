//! The node's messages to itself: the diagnostics call once a second, the
//! services hear. What lies between is the transport, and how long it took is
//! told on `/diagnostics`.
//!
//! DDS sends them through its writer, its sockets and its reader, as those to
//! others. The name starts with `_`: ROS 2 hides such topics from `ros2 topic
//! list` and from bags of everything.

use std::sync::Arc;

use futures::stream::{BoxStream, StreamExt};
use ros2_client::Gid;

use crate::ros::diagnostics::NodeStatus;
use crate::ros::endpoint::{Publisher, Subscription};
use crate::ros::message::builtin_interfaces::Time;
use crate::ros::node::{NodeError, RosNode};
use crate::ros::qos;

/// Of the types that the node speaks anyway the smallest: the seconds are the
/// number of the call.
type Call = Time;

/// Sends the calls.
pub struct EchoCaller {
    publisher: Publisher<Call>,
    status: Arc<NodeStatus>,
}

/// Receives them.
pub struct EchoListener {
    subscription: Subscription<Call>,
    /// Another node of the same name calls on the same topic.
    own: Gid,
    status: Arc<NodeStatus>,
}

/// Both ends of the echo of `node`, which count in `status`.
///
/// # Errors
/// When the name, the publisher or the subscription is refused.
pub fn echo(
    node: &mut RosNode,
    status: &Arc<NodeStatus>,
) -> Result<(EchoCaller, EchoListener), NodeError> {
    let topic = "~/_echo";
    let topic = node.names().topic(topic).map_err(|e| NodeError::Endpoint {
        what: "publisher",
        name: topic.to_owned(),
        reason: e.to_string(),
    })?;
    // Reliable: a datagram that got lost among images is no stalled transport.
    let subscription = node.subscribe(&topic, &qos::small_output())?;
    let publisher = node.advertise(&topic, &qos::small_output())?;
    let listener = EchoListener { subscription, own: publisher.gid(), status: Arc::clone(status) };
    Ok((EchoCaller { publisher, status: Arc::clone(status) }, listener))
}

impl EchoCaller {
    /// Calls. Never waits: a call that is refused is one that does not come back.
    pub fn call(&self) {
        let Some(number) = self.status.call_echo() else { return };
        let call = Call { sec: number, nanosec: 0 };
        if let Err(error) = self.publisher.publish(call) {
            tracing::debug!("echo: {error}");
        }
    }
}

impl EchoListener {
    /// The numbers of the node's own calls as they come back.
    pub fn numbers(&self) -> BoxStream<'_, i32> {
        let own = self.own;
        let received = self.subscription.async_stream();
        let numbers = received.filter_map(move |received| async move {
            let (call, info) = received.ok()?;
            (info.publisher_gid() == own).then_some(call.sec)
        });
        numbers.boxed()
    }

    /// Counts the call of this number as heard.
    pub fn hear(&self, number: i32) {
        self.status.hear_echo(number);
    }
}
