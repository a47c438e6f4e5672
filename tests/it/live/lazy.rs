//! Topics that exist while somebody listens: each arrives, of its frame, and
//! only when it is subscribed to.

use std::sync::atomic::AtomicBool;

use salient_stereo::image::Picture;
use salient_stereo::ros::convert::{compressed_picture, compressed_u16, picture};
use salient_stereo::ros::endpoint::Subscription;
use salient_stereo::ros::message::Message;
use salient_stereo::ros::message::sensor_msgs::{CameraInfo, CompressedImage, Image, PointCloud2};
use salient_stereo::ros::message::vision_msgs::{Detection2DArray, Detection3DArray};
use salient_stereo::ros::message::visualization_msgs::MarkerArray;
use salient_stereo::ros::node::RosNode;
use salient_stereo::ros::play::StereoPlayer;
use salient_stereo::ros::qos;

use super::{HEIGHT, PATIENCE, WIDTH, environment, names, pair, small, start, wait};

/// Every lazy topic but `disparity`, which another test has, and
/// `confidence/image_rect`, to which nobody listens here.
const TOPICS: [&str; 14] = [
    "detections_2d",
    "detections_3d",
    "markers",
    "depth/image_rect",
    "depth/camera_info",
    "depth/image_rect/compressedDepth",
    "points2",
    "saliency/image_rect",
    "saliency/image_rect/compressed",
    "regions/label_image",
    "overlay/image",
    "overlay/image/compressed",
    "disparity/image_color",
    "disparity/image_color/compressed",
];

fn listen<M: Message + 'static>(peer: &mut RosNode, topic: &str) -> Subscription<M> {
    peer.subscribe(&format!("/robot/{topic}"), &qos::reliable_input()).unwrap()
}

fn newest<M: Message + 'static>(subscription: &Subscription<M>) -> M {
    let mut newest = None;
    wait(M::TYPE_NAME, || {
        while let Ok(Some((message, _))) = subscription.take() {
            newest = Some(message);
        }
        newest.is_some()
    });
    newest.unwrap()
}

#[test]
fn every_lazy_topic_comes_to_whoever_subscribes() {
    let environment = environment(3);
    let mut runtime = start(small(), &environment);
    let mut peer = RosNode::open(names("peer"), &environment).unwrap();
    let mut player = StereoPlayer::new(&mut peer, false).unwrap();

    let detections_2d = listen::<Detection2DArray>(&mut peer, "detections_2d");
    let detections_3d = listen::<Detection3DArray>(&mut peer, "detections_3d");
    let markers = listen::<MarkerArray>(&mut peer, "markers");
    let depth = listen::<Image>(&mut peer, "depth/image_rect");
    let depth_info = listen::<CameraInfo>(&mut peer, "depth/camera_info");
    let depth_small = listen::<CompressedImage>(&mut peer, "depth/image_rect/compressedDepth");
    let cloud = listen::<PointCloud2>(&mut peer, "points2");
    let saliency = listen::<Image>(&mut peer, "saliency/image_rect");
    let saliency_small = listen::<CompressedImage>(&mut peer, "saliency/image_rect/compressed");
    let labels = listen::<Image>(&mut peer, "regions/label_image");
    let overlay = listen::<Image>(&mut peer, "overlay/image");
    let overlay_small = listen::<CompressedImage>(&mut peer, "overlay/image/compressed");
    let color = listen::<Image>(&mut peer, "disparity/image_color");
    let color_small = listen::<CompressedImage>(&mut peer, "disparity/image_color/compressed");
    assert!(player.wait_for_subscribers(PATIENCE, &AtomicBool::new(false)));
    wait("the node to find the subscriptions", || {
        let found = runtime.graph().unwrap().subscribed_topics();
        TOPICS.iter().all(|topic| found.binary_search(&format!("/robot/{topic}")).is_ok())
    });

    // The same wall again and again, until each topic has come: stock receive
    // buffers lose some of so many at once.
    let mut number = 0;
    wait("all topics", || {
        player.publish(pair(number));
        number += 1;
        std::thread::sleep(std::time::Duration::from_millis(300));
        let published = runtime.status().totals().published;
        TOPICS.iter().all(|t| published.get(&format!("/robot/{t}")).is_some_and(|n| *n >= 3))
    });

    let array = newest(&detections_2d);
    assert_eq!(array.header.frame_id, "left_optical");
    assert_eq!(array.detections.len(), newest(&detections_3d).detections.len());
    let texts = newest(&markers).markers;
    assert_eq!(texts.len(), 2 * array.detections.len(), "a box and a text each");

    let size = (WIDTH as u32, HEIGHT as u32);
    let image = newest(&depth);
    assert_eq!((image.width, image.height, image.encoding.as_str()), (size.0, size.1, "32FC1"));
    assert_eq!(newest(&depth_info).p[0], 300.0);
    let small = newest(&depth_small);
    assert_eq!(small.format, "32FC1; compressedDepth png");
    let values =
        compressed_u16(&CompressedImage { data: small.data[12..].to_vec(), ..small }).unwrap();
    assert_eq!((values.width(), values.height()), (WIDTH, HEIGHT));
    let cloud = newest(&cloud);
    assert_eq!((cloud.width, cloud.height), size);
    assert_eq!(newest(&saliency).encoding, "32FC1");
    let Picture::Gray(gray) = compressed_picture(&newest(&saliency_small)).unwrap() else {
        panic!("saliency has colours")
    };
    assert_eq!((gray.width(), gray.height()), (WIDTH, HEIGHT));
    assert_eq!(newest(&labels).encoding, "mono16");
    for (raw, jpeg) in [(&overlay, &overlay_small), (&color, &color_small)] {
        let raw = newest(raw);
        assert_eq!(raw.encoding, "rgb8");
        let Picture::Rgb(raw) = picture(&raw).unwrap() else { panic!("no colours") };
        let Picture::Rgb(jpeg) = compressed_picture(&newest(jpeg)).unwrap() else {
            panic!("no colours")
        };
        assert_eq!(raw.size(), jpeg.size());
    }

    let published = runtime.status().totals().published;
    assert!(!published.contains_key("/robot/confidence/image_rect"), "{published:?}");
    assert!(!published.contains_key("/robot/disparity"), "{published:?}");
    assert!(runtime.stop(), "the node's threads did not end");
}
