//! The other side of the node: publishes stereo pairs as a camera driver or
//! `ros2 bag play` would, and listens to the regions.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ros2_client::WriteError;
use thiserror::Error;

use crate::ros::endpoint::{Publisher, Subscription};
use crate::ros::message::Message;
use crate::ros::message::salient_stereo_msgs::SalientRegionArray;
use crate::ros::message::sensor_msgs::{CameraInfo, CompressedImage, Image};
use crate::ros::names::NameError;
use crate::ros::node::{Graph, NodeError, RosNode};
use crate::ros::qos;
use crate::stamp::Stamp;

/// From knowing a subscriber to being matched with it, on both sides: discovery
/// tells of the first, nothing of the second.
const SETTLING: Duration = Duration::from_millis(500);

/// What keeps a player from playing.
#[derive(Debug, Error)]
pub enum PlayError {
    /// A publisher or subscription was refused.
    #[error(transparent)]
    Node(#[from] NodeError),
    /// A topic's name is not allowed.
    #[error(transparent)]
    Name(#[from] NameError),
}

/// Both images of a pair as they travel.
#[derive(Clone, Debug)]
pub enum ImagePair {
    /// `sensor_msgs/Image`: left, right.
    Raw(Image, Image),
    /// `sensor_msgs/CompressedImage`: left, right.
    Compressed(CompressedImage, CompressedImage),
}

/// Everything that is published for one instant.
#[derive(Clone, Debug)]
pub struct StereoMessages {
    /// The images.
    pub images: ImagePair,
    /// Left calibration.
    pub left_info: CameraInfo,
    /// Right calibration.
    pub right_info: CameraInfo,
}

impl StereoMessages {
    /// Stamp of the left image.
    pub fn stamp(&self) -> Stamp {
        match &self.images {
            ImagePair::Raw(left, _) => left.header.stamp.into(),
            ImagePair::Compressed(left, _) => left.header.stamp.into(),
        }
    }
}

/// Publishes stereo pairs.
pub struct StereoPlayer {
    graph: Graph,
    images: Publishers,
    infos: [Option<Publisher<CameraInfo>>; 2],
    topics: Vec<(String, &'static str)>,
    refused: u64,
}

enum Publishers {
    Raw([Publisher<Image>; 2]),
    Compressed([Publisher<CompressedImage>; 2]),
}

impl StereoPlayer {
    /// Advertises `left/image_rect`, `right/image_rect` (with `/compressed`
    /// when so wanted) and the camera infos under the names of `node`.
    ///
    /// # Errors
    /// When the graph refuses.
    pub fn new(node: &mut RosNode, compressed: bool) -> Result<Self, PlayError> {
        Self::with_infos(node, compressed, [true; 2])
    }

    /// As [`StereoPlayer::new`], with the camera infos of these sides only: to a
    /// node that has calibration files nobody sends them.
    ///
    /// # Errors
    /// When the graph refuses.
    pub fn with_infos(
        node: &mut RosNode,
        compressed: bool,
        wanted: [bool; 2],
    ) -> Result<Self, PlayError> {
        let mut topics = Vec::new();
        let (left, right) = ("left/image_rect", "right/image_rect");
        let images = if compressed {
            let name = |topic| node.names().transport_topic(topic, "compressed");
            let names = [name(left)?, name(right)?];
            Publishers::Compressed(two(node, names, &mut topics)?)
        } else {
            let names = [node.names().topic(left)?, node.names().topic(right)?];
            Publishers::Raw(two(node, names, &mut topics)?)
        };
        let mut infos = [None, None];
        for ((slot, side), wanted) in infos.iter_mut().zip(["left", "right"]).zip(wanted) {
            if wanted {
                let name = node.names().topic(&format!("{side}/camera_info"))?;
                *slot = Some(node.advertise(&name, &qos::output())?);
                topics.push((name, CameraInfo::TYPE_NAME));
            }
        }
        Ok(Self { graph: node.graph(), images, infos, topics, refused: 0 })
    }

    /// Waits until every topic has a subscriber, and a moment longer for the
    /// others to have found us too; false when time runs out.
    pub fn wait_for_subscribers(&self, patience: Duration, stop: &AtomicBool) -> bool {
        let deadline = Instant::now() + patience;
        while Instant::now() < deadline && !stop.load(Ordering::Relaxed) {
            let subscribed = self.graph.subscribed_topics();
            if self.topics.iter().all(|(name, _)| subscribed.binary_search(name).is_ok()) {
                thread::sleep(SETTLING);
                return true;
            }
            thread::sleep(Duration::from_millis(20));
        }
        false
    }

    /// Publishes one pair: the camera infos first, so that the pair is complete
    /// when its images arrive.
    pub fn publish(&mut self, messages: StereoMessages) {
        let StereoMessages { images, left_info, right_info } = messages;
        for (publisher, info) in self.infos.iter().zip([left_info, right_info]) {
            self.refused += publisher.as_ref().map_or(0, |publisher| refused(publisher, info));
        }
        self.refused += match (&self.images, images) {
            (Publishers::Raw([l, r]), ImagePair::Raw(left, right)) => {
                refused(l, left) + refused(r, right)
            }
            (Publishers::Compressed([l, r]), ImagePair::Compressed(left, right)) => {
                refused(l, left) + refused(r, right)
            }
            // The other transport than advertised: nobody could hear it.
            _ => 2,
        };
    }

    /// Publishes pairs at the pace of their stamps, `rate` times as fast, until
    /// they end or `stop` is set; `sent` is told after each. Returns how many
    /// were published.
    pub fn play(
        &mut self,
        pairs: impl IntoIterator<Item = StereoMessages>,
        rate: f64,
        stop: &AtomicBool,
        mut sent: impl FnMut(u64, Stamp),
    ) -> u64 {
        let start = Instant::now();
        let mut first = None;
        let mut count = 0;
        for pair in pairs {
            let stamp = pair.stamp();
            let after = stamp.seconds_since(*first.get_or_insert(stamp)) / rate;
            let due = start + Duration::try_from_secs_f64(after).unwrap_or_default();
            while !stop.load(Ordering::Relaxed) {
                let left = due.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    break;
                }
                // Short sleeps, so that a stop is heard in long gaps too.
                thread::sleep(left.min(Duration::from_millis(50)));
            }
            if stop.load(Ordering::Relaxed) {
                break;
            }
            self.publish(pair);
            count += 1;
            sent(count, stamp);
        }
        count
    }

    /// Messages that could not be published.
    pub const fn refused(&self) -> u64 {
        self.refused
    }
}

fn two<M: Message>(
    node: &mut RosNode,
    names: [String; 2],
    topics: &mut Vec<(String, &'static str)>,
) -> Result<[Publisher<M>; 2], NodeError> {
    let [left, right] = names;
    let made = [node.advertise(&left, &qos::output())?, node.advertise(&right, &qos::output())?];
    topics.extend([(left, M::TYPE_NAME), (right, M::TYPE_NAME)]);
    Ok(made)
}

fn refused<M: Message>(publisher: &Publisher<M>, message: M) -> u64 {
    match publisher.publish(message) {
        Ok(()) => 0,
        Err(WriteError::WouldBlock { .. }) => 1,
        Err(error) => {
            tracing::warn!("{}: {error}", M::TYPE_NAME);
            1
        }
    }
}

/// Listens to a `regions` topic.
pub struct RegionsListener {
    subscription: Subscription<SalientRegionArray>,
    undecodable: u64,
}

impl RegionsListener {
    /// Subscribes, reliably, to the topic with this full name.
    ///
    /// # Errors
    /// When the graph refuses.
    pub fn new(node: &mut RosNode, topic: &str) -> Result<Self, NodeError> {
        let subscription = node.subscribe(topic, &qos::reliable_input())?;
        Ok(Self { subscription, undecodable: 0 })
    }

    /// The next array, waited for until `patience` has run out.
    pub fn next(&mut self, patience: Duration) -> Option<SalientRegionArray> {
        let deadline = Instant::now() + patience;
        loop {
            match self.subscription.take() {
                Ok(Some((array, _))) => return Some(array),
                Ok(None) if Instant::now() >= deadline => return None,
                Ok(None) => thread::sleep(Duration::from_millis(2)),
                Err(error) => {
                    self.undecodable += 1;
                    tracing::warn!("regions: {error}");
                }
            }
        }
    }

    /// Arrays that could not be decoded.
    pub const fn undecodable(&self) -> u64 {
        self.undecodable
    }
}
