//! Live topics as a door in: subscriptions, pairing, and one mailbox in which
//! the newest pair wins.

mod frame;

use std::sync::Arc;
use std::time::Instant;

use futures::channel::oneshot;
use futures::future::{Either, select};
use futures::stream::{BoxStream, SelectAll, StreamExt};
use ros2_client::ReadResult;
use thiserror::Error;

pub use frame::{FrameBuilder, FrameError};

use crate::config::{Config, ImageTransport, Input};
use crate::mailbox::Mailbox;
use crate::ros::calibration::{CalibrationFileError, camera_info_from_url};
use crate::ros::diagnostics::{InputState, NodeStatus};
use crate::ros::endpoint::Subscription;
use crate::ros::message::Message;
use crate::ros::message::sensor_msgs::{CameraInfo, CompressedImage, Image};
use crate::ros::names::NameError;
use crate::ros::node::{NodeError, RosNode};
use crate::ros::params::ParameterStore;
use crate::ros::qos;
use crate::stamp::Stamp;
use crate::sync::{Pair, Settings, Side, Synchronizer};

/// What keeps the door shut.
#[derive(Debug, Error)]
pub enum LiveInputError {
    /// A subscription was refused.
    #[error(transparent)]
    Node(#[from] NodeError),
    /// A topic's name is not allowed.
    #[error(transparent)]
    Name(#[from] NameError),
    /// `camera_info.left_url` or `camera_info.right_url`.
    #[error("camera_info.{side}_url: {source}")]
    Calibration {
        /// `left` or `right`.
        side: &'static str,
        /// Why.
        source: CalibrationFileError,
    },
}

/// An image as it travels.
#[derive(Clone, Debug)]
pub enum ImageMessage {
    /// `sensor_msgs/Image`
    Raw(Image),
    /// `sensor_msgs/CompressedImage`
    Compressed(CompressedImage),
}

impl ImageMessage {
    fn stamp(&self) -> Stamp {
        match self {
            Self::Raw(image) => image.header.stamp.into(),
            Self::Compressed(image) => image.header.stamp.into(),
        }
    }
}

/// Two images of one instant, not decoded yet, with their camera infos.
pub type LivePair = Pair<ImageMessage, Arc<CameraInfo>>;

/// A pair and when it was complete.
#[derive(Debug)]
pub struct ArrivedPair {
    /// The pair.
    pub pair: LivePair,
    /// When its last message came.
    pub at: Instant,
}

/// One topic of the input, for diagnostics.
#[derive(Clone, Debug)]
pub struct Topic {
    /// Full name.
    pub name: String,
    /// Type name.
    pub type_name: &'static str,
}

enum Images {
    Raw(Subscription<Image>),
    Compressed(Subscription<CompressedImage>),
}

/// The subscriptions of the node.
pub struct LiveInput {
    left: Images,
    right: Option<Images>,
    left_info: Infos,
    right_info: Infos,
    topics: Vec<Topic>,
}

enum Infos {
    Topic(Box<Subscription<CameraInfo>>),
    File(Arc<CameraInfo>),
}

enum Arrival {
    Image(Side, ReadResult<ImageMessage>),
    Info(Side, ReadResult<Box<CameraInfo>>),
}

impl LiveInput {
    /// Subscribes to what `config` asks for.
    ///
    /// # Errors
    /// When a name or subscription is refused, or a calibration file is not readable.
    pub fn subscribe(node: &mut RosNode, config: &Config) -> Result<Self, LiveInputError> {
        let mut topics = Vec::new();
        let kind = if config.rectify { "image_raw" } else { "image_rect" };
        let (left, right) = match config.input {
            Input::TwoTopics => (
                images(node, &format!("left/{kind}"), config.image_transport, &mut topics)?,
                Some(images(node, &format!("right/{kind}"), config.image_transport, &mut topics)?),
            ),
            Input::SideBySide => {
                (images(node, "image_raw", config.image_transport, &mut topics)?, None)
            }
        };
        let urls = &config.camera_info;
        let left_info = infos(node, Side::Left, &urls.left_url, &mut topics)?;
        let right_info = infos(node, Side::Right, &urls.right_url, &mut topics)?;
        Ok(Self { left, right, left_info, right_info, topics })
    }

    /// The topics subscribed to.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Receives and pairs until `stop` is sent or dropped.
    pub fn run(
        self,
        store: &ParameterStore,
        mailbox: &Mailbox<ArrivedPair>,
        status: &NodeStatus,
        stop: oneshot::Receiver<()>,
    ) {
        futures::executor::block_on(self.receive(store, mailbox, status, stop));
        mailbox.close();
    }

    async fn receive(
        &self,
        store: &ParameterStore,
        mailbox: &Mailbox<ArrivedPair>,
        status: &NodeStatus,
        mut stop: oneshot::Receiver<()>,
    ) {
        let mut arrivals: SelectAll<BoxStream<'_, Arrival>> = SelectAll::new();
        arrivals.push(self.left.stream(Side::Left));
        if let Some(right) = &self.right {
            arrivals.push(right.stream(Side::Right));
        }
        let mut sync = Synchronizer::new(Settings::new(&store.config()));
        for (side, infos) in [(Side::Left, &self.left_info), (Side::Right, &self.right_info)] {
            match infos {
                Infos::Topic(topic) => arrivals.push(
                    topic
                        .async_stream()
                        .map(move |received| {
                            Arrival::Info(side, received.map(|(info, _)| Box::new(info)))
                        })
                        .boxed(),
                ),
                Infos::File(info) => sync.fix_info(side, Arc::clone(info)),
            }
        }
        let mut generation = store.generation();
        // The camera infos last seen: equal ones are shared, so that whoever
        // builds the rig sees by the pointer that nothing has changed.
        let mut shared: [Option<Arc<CameraInfo>>; 2] = [None, None];
        loop {
            let Either::Right((Some(arrival), unused)) = select(stop, arrivals.next()).await else {
                return;
            };
            stop = unused;
            if store.generation() != generation {
                generation = store.generation();
                sync.set(Settings::new(&store.config()));
            }
            match arrival {
                Arrival::Image(side, Ok(image)) => {
                    status.note_arrival();
                    sync.push(side, image.stamp(), image);
                }
                Arrival::Info(side, Ok(info)) => {
                    let stamp = info.header.stamp.into();
                    sync.push_info(side, stamp, share(&mut shared[side as usize], *info));
                }
                Arrival::Image(side, Err(error)) => {
                    status.drop_frame(format!("{} image not decodable: {error}", side.name()));
                }
                Arrival::Info(side, Err(error)) => {
                    status
                        .drop_frame(format!("{} camera info not decodable: {error}", side.name()));
                }
            }
            while let Some(pair) = sync.pop() {
                status.note_pair();
                if mailbox.put(ArrivedPair { pair, at: Instant::now() }).is_some() {
                    status.count_displaced();
                }
            }
            status.set_input(InputState {
                counts: *sync.counts(),
                waiting_for_info: sync.waiting_for_info(),
                has_info: [sync.has_info(Side::Left), sync.has_info(Side::Right)],
                explanation_settings: sync.settings().clone(),
                since: Instant::now(),
            });
        }
    }
}

impl Images {
    fn stream(&self, side: Side) -> BoxStream<'_, Arrival> {
        match self {
            Self::Raw(topic) => topic
                .async_stream()
                .map(move |received| {
                    Arrival::Image(side, received.map(|(image, _)| ImageMessage::Raw(image)))
                })
                .boxed(),
            Self::Compressed(topic) => topic
                .async_stream()
                .map(move |received| {
                    Arrival::Image(side, received.map(|(image, _)| ImageMessage::Compressed(image)))
                })
                .boxed(),
        }
    }
}

fn images(
    node: &mut RosNode,
    name: &str,
    transport: ImageTransport,
    topics: &mut Vec<Topic>,
) -> Result<Images, LiveInputError> {
    Ok(match transport {
        ImageTransport::Raw => {
            let topic = node.names().topic(name)?;
            Images::Raw(listed(node, topic, topics)?)
        }
        ImageTransport::Compressed => {
            let topic = node.names().transport_topic(name, "compressed")?;
            Images::Compressed(listed(node, topic, topics)?)
        }
    })
}

fn infos(
    node: &mut RosNode,
    side: Side,
    url: &str,
    topics: &mut Vec<Topic>,
) -> Result<Infos, LiveInputError> {
    if url.is_empty() {
        let topic = node.names().topic(&format!("{}/camera_info", side.name()))?;
        return Ok(Infos::Topic(Box::new(listed(node, topic, topics)?)));
    }
    let info = camera_info_from_url(url)
        .map_err(|source| LiveInputError::Calibration { side: side.name(), source })?;
    Ok(Infos::File(Arc::new(info)))
}

fn listed<M: Message + 'static>(
    node: &mut RosNode,
    name: String,
    topics: &mut Vec<Topic>,
) -> Result<Subscription<M>, NodeError> {
    let subscription = node.subscribe(&name, &qos::sensor_data())?;
    topics.push(Topic { name, type_name: M::TYPE_NAME });
    Ok(subscription)
}

/// `info`, or the one seen before when it says the same but for its stamp.
fn share(seen: &mut Option<Arc<CameraInfo>>, mut info: CameraInfo) -> Arc<CameraInfo> {
    if let Some(seen) = seen {
        info.header.stamp = seen.header.stamp;
        if **seen == info {
            return Arc::clone(seen);
        }
    }
    let info = Arc::new(info);
    *seen = Some(Arc::clone(&info));
    info
}
