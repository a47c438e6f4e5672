//! The other ways in, each through a real node: compressed images, both views
//! in one image, and raw images that the node rectifies itself.

use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::{Duration, Instant};

use salient_stereo::config::Config;
use salient_stereo::image::{Image as Pixels, Size};
use salient_stereo::ros::convert::compressed_rgb;
use salient_stereo::ros::environment::Environment;
use salient_stereo::ros::message::salient_stereo_msgs::SalientRegionArray;
use salient_stereo::ros::message::sensor_msgs::{CameraInfo, Image};
use salient_stereo::ros::node::RosNode;
use salient_stereo::ros::play::{ImagePair, RegionsListener, StereoMessages, StereoPlayer};
use salient_stereo::ros::qos;
use salient_stereo::stamp::Stamp;
use serde_json::{Value, json};

use super::{HEIGHT, PATIENCE, WIDTH, environment, names, pair, small, start};

fn with(parameter: &str, value: impl Into<Value>) -> Config {
    small().with(parameter, &value.into()).unwrap()
}

/// The box of `pair` stands out, and where it should be.
fn check(array: &SalientRegionArray, number: u32) {
    assert_eq!(Stamp::from(array.header.stamp), pair(number).stamp());
    assert_eq!(array.header.frame_id, "left_optical");
    assert_eq!((array.width, array.height), (WIDTH as u32, HEIGHT as u32));
    // 300 px x 0.2 m / 30 px.
    let found = array.regions.iter().any(|r| (r.median_depth - 2.0).abs() < 0.1);
    assert!(found, "{:?}", array.regions.iter().map(|r| r.median_depth).collect::<Vec<_>>());
}

fn raw(messages: &StereoMessages) -> (&Image, &Image) {
    match &messages.images {
        ImagePair::Raw(left, right) => (left, right),
        ImagePair::Compressed(..) => unreachable!("pair() makes raw images"),
    }
}

#[test]
fn compressed_images_are_read_beside_their_raw_names() {
    let environment = environment(8);
    let mut runtime = start(with("image_transport", "compressed"), &environment);
    let mut peer = RosNode::open(names("peer"), &environment).unwrap();
    let mut player = StereoPlayer::new(&mut peer, true).unwrap();
    let mut listener = RegionsListener::new(&mut peer, runtime.regions_topic()).unwrap();
    assert!(player.wait_for_subscribers(PATIENCE, &AtomicBool::new(false)));
    for number in 0..3 {
        let mut messages = pair(number);
        let (left, right) = raw(&messages);
        let [left, right] = [left, right].map(|image| {
            let pixels: Vec<[u8; 3]> = image.data.as_chunks().0.to_vec();
            let pixels = Pixels::from_vec(Size::new(WIDTH, HEIGHT), pixels).unwrap();
            compressed_rgb(&pixels, image.header.clone())
        });
        messages.images = ImagePair::Compressed(left, right);
        player.publish(messages);
        check(&listener.next(PATIENCE).expect("no regions"), number);
    }
    assert!(runtime.stop());
}

/// Publishes `images` and both camera infos on these topics of `/robot` until
/// the node answers.
fn answer(
    environment: &Environment,
    config: Config,
    topics: &[&str],
    images: &[Image],
) -> SalientRegionArray {
    let mut runtime = start(config, environment);
    let mut peer = RosNode::open(names("peer"), environment).unwrap();
    let full = |topic: &str| format!("/robot/{topic}");
    let cameras: Vec<_> = topics
        .iter()
        .map(|topic| peer.advertise::<Image>(&full(topic), &qos::output()).unwrap())
        .collect();
    let infos = ["left/camera_info", "right/camera_info"]
        .map(|topic| peer.advertise::<CameraInfo>(&full(topic), &qos::output()).unwrap());
    let mut listener = RegionsListener::new(&mut peer, runtime.regions_topic()).unwrap();
    let deadline = Instant::now() + PATIENCE;
    let StereoMessages { left_info, right_info, .. } = pair(0);
    let array = loop {
        assert!(Instant::now() < deadline, "no regions from {topics:?}");
        // Until discovery is complete messages get lost.
        infos[0].publish(left_info.clone()).unwrap();
        infos[1].publish(right_info.clone()).unwrap();
        for (camera, image) in cameras.iter().zip(images) {
            camera.publish(image.clone()).unwrap();
        }
        if let Some(array) = listener.next(Duration::from_millis(500)) {
            break array;
        }
        thread::sleep(Duration::from_millis(50));
    };
    assert!(runtime.stop());
    array
}

#[test]
fn one_image_with_both_views_is_split_in_the_middle() {
    let messages = pair(0);
    let (left, right) = raw(&messages);
    let mut both = Image { width: 2 * left.width, data: Vec::new(), ..left.clone() };
    // Rows with padding, as some drivers send them.
    both.step = 2 * left.step + 10;
    let rows = left.data.chunks(3 * WIDTH).zip(right.data.chunks(3 * WIDTH));
    for (left, right) in rows {
        both.data.extend(left.iter().chain(right).chain(&[7; 10]));
    }
    let config = with("input", "side_by_side");
    check(&answer(&environment(9), config, &["image_raw"], &[both]), 0);
}

#[test]
fn raw_images_are_rectified_when_so_asked() {
    let messages = pair(0);
    let (left, right) = raw(&messages);
    // As another camera sends its colours; without distortion they stay as they are.
    let bgr = [left, right].map(|image| {
        let mut image = Image { encoding: "bgr8".into(), ..image.clone() };
        image.data.as_chunks_mut::<3>().0.iter_mut().for_each(|pixel| pixel.reverse());
        image
    });
    let topics = ["left/image_raw", "right/image_raw"];
    check(&answer(&environment(10), with("rectify", json!(true)), &topics, &bgr), 0);
}
