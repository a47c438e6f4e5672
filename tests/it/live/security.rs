//! DDS security: node and camera with identities of one keystore understand
//! each other, and somebody without one hears and says nothing.

mod keystore;

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use keystore::Keystore;
use salient_stereo::ros::environment::{Environment, EnvironmentError};
use salient_stereo::ros::message::Message;
use salient_stereo::ros::message::salient_stereo_msgs::SalientRegionArray;
use salient_stereo::ros::message::sensor_msgs::Image;
use salient_stereo::ros::node::RosNode;
use salient_stereo::ros::play::{ImagePair, RegionsListener, StereoMessages, StereoPlayer};
use salient_stereo::ros::qos;

use super::{PATIENCE, environment, names, pair, small, start, wait};

const REGIONS: &str = "/robot/regions";

/// A pair in gray: each image is one datagram.
fn gray(number: u32) -> StereoMessages {
    let mut messages = pair(number);
    if let ImagePair::Raw(left, right) = &mut messages.images {
        for image in [left, right] {
            image.encoding = "mono8".into();
            image.step = image.width;
            image.data = image.data.chunks(3).map(|rgb| rgb[0] / 2 + rgb[1] / 2).collect();
        }
    }
    messages
}

/// What a process finds with these variables, on the domain of `base`.
fn secured(
    base: &Environment,
    keystore: &Keystore,
    enclave: &str,
) -> Result<Environment, EnvironmentError> {
    let variable = |name: &'static str| {
        Some(match name {
            "ROS_DOMAIN_ID" => base.domain_id.to_string(),
            "ROS_AUTOMATIC_DISCOVERY_RANGE" => "LOCALHOST".to_owned(),
            "ROS_SECURITY_ENABLE" => "true".to_owned(),
            "ROS_SECURITY_STRATEGY" => "Enforce".to_owned(),
            "ROS_SECURITY_KEYSTORE" => keystore.path().display().to_string(),
            _ => return None,
        })
    };
    Environment::from_variables(variable, Some(enclave))
}

#[test]
fn only_members_of_the_keystore_are_heard_and_served() {
    const PAIRS: u32 = 5;
    let open = environment(11);
    let keystore = Keystore::new(open.domain_id);
    keystore.add_enclave("/robot/eye");
    keystore.add_enclave("/robot/camera");
    let mut runtime = start(small(), &secured(&open, &keystore, "/robot/eye").unwrap());

    // The outsider is there first and asks for everything.
    let mut outsider = RosNode::open(names("outsider"), &open).unwrap();
    let overheard =
        outsider.subscribe::<SalientRegionArray>(REGIONS, &qos::reliable_input()).unwrap();
    let mut intruder = StereoPlayer::new(&mut outsider, false).unwrap();

    let camera = secured(&open, &keystore, "/robot/camera").unwrap();
    let mut camera = RosNode::open(names("camera"), &camera).unwrap();
    let mut player = StereoPlayer::new(&mut camera, false).unwrap();
    let mut listener = RegionsListener::new(&mut camera, runtime.regions_topic()).unwrap();
    assert!(
        player.wait_for_subscribers(PATIENCE, &AtomicBool::new(false)),
        "node and camera did not authenticate each other"
    );
    wait("the node to find the camera", || {
        let graph = runtime.graph().unwrap();
        graph.subscriptions::<SalientRegionArray>(REGIONS) > 0
            && graph.publishers("/robot/right/image_rect", Image::TYPE_NAME).0 > 0
    });
    let mut answered = 0;
    let mut number = 0;
    // Keys are exchanged per topic, and only then data passes.
    while answered < PAIRS {
        assert!(number < 20 * PAIRS, "{answered} of {number} pairs were answered");
        intruder.publish(gray(1000 + number));
        player.publish(gray(number));
        number += 1;
        while let Some(array) = listener.next(Duration::from_millis(300)) {
            assert!(array.header.stamp.sec < 100, "the intruder's pair was processed");
            answered += 1;
        }
    }
    let graph = runtime.graph().unwrap();
    assert_eq!(graph.subscriptions::<SalientRegionArray>(REGIONS), 1, "the camera's alone");
    assert_eq!(graph.publishers("/robot/right/image_rect", Image::TYPE_NAME).0, 1);
    assert!(overheard.take().unwrap().is_none(), "regions reached somebody without identity");
    assert_eq!(outsider.graph().published_topics(SalientRegionArray::TYPE_NAME), [""; 0]);
    assert!(runtime.stop(), "the node's threads did not end");
}

#[test]
fn an_identity_without_permissions_does_not_start() {
    let open = environment(11);
    // Valid in another domain only.
    let keystore = Keystore::new(open.domain_id + 1);
    keystore.add_enclave("/robot/eye");
    let environment = secured(&open, &keystore, "/robot/eye").unwrap();
    let error = RosNode::open(names("eye"), &environment).err().unwrap().to_string();
    assert!(error.contains("security") && error.contains("/robot/eye"), "{error}");
    assert!(secured(&open, &keystore, "/robot/nose").is_err());
}
