//! The node on Zenoh, over TCP on 127.0.0.1: camera and viewer are a second
//! session of our own. The peer of another make is in `interop`.

use std::sync::atomic::AtomicBool;

use salient_stereo::ros::endpoint::Client;
use salient_stereo::ros::environment::{Environment, Middleware, ZenohSettings};
use salient_stereo::ros::message::Message;
use salient_stereo::ros::message::diagnostic_msgs::DiagnosticArray;
use salient_stereo::ros::message::rcl_interfaces::*;
use salient_stereo::ros::message::salient_stereo_msgs::SalientRegionArray;
use salient_stereo::ros::message::sensor_msgs::Image;
use salient_stereo::ros::message::std_srvs::{TriggerRequest, TriggerResponse};
use salient_stereo::ros::message::stereo_msgs::DisparityImage;
use salient_stereo::ros::node::RosNode;
use salient_stereo::ros::play::{RegionsListener, StereoPlayer};
use salient_stereo::ros::qos;

use super::super::domain::{port, zenoh_overrides};
use super::{HEIGHT, PATIENCE, WIDTH, call, names, pair, small, start, wait};

/// Two environments: the first listens, the second connects to it.
fn linked(port: u16) -> [Environment; 2] {
    let environment = |overrides: String| {
        let settings = ZenohSettings { config_file: None, overrides };
        Environment { middleware: Middleware::Zenoh(settings), ..Environment::localhost(9) }
    };
    // Port 0: any that is free.
    [environment(zenoh_overrides(&[], &[port])), environment(zenoh_overrides(&[port], &[0]))]
}

#[test]
fn pairs_come_back_as_regions_and_dense_topics_over_zenoh() {
    const PAIRS: u32 = 6;
    let [here, there] = linked(port(0));
    let mut runtime = start(small(), &here);
    let mut peer = RosNode::open(names("peer"), &there).unwrap();
    assert_eq!(peer.receive_buffer_bytes(), None);
    let mut player = StereoPlayer::new(&mut peer, false).unwrap();
    let mut listener = RegionsListener::new(&mut peer, runtime.regions_topic()).unwrap();
    let disparity = peer.subscribe::<DisparityImage>("/robot/disparity", &qos::output()).unwrap();
    let diagnostics = peer.subscribe::<DiagnosticArray>("/diagnostics", &qos::output()).unwrap();
    assert!(
        player.wait_for_subscribers(PATIENCE, &AtomicBool::new(false)),
        "the node's subscriptions were not found"
    );
    wait("the node to find the peer", || {
        let graph = runtime.graph().unwrap();
        graph.subscriptions::<SalientRegionArray>("/robot/regions") == 1
            && graph.subscriptions::<DisparityImage>("/robot/disparity") == 1
            && graph.publishers("/robot/right/image_rect", Image::TYPE_NAME).0 == 1
    });
    assert_eq!(peer.graph().published_topics(SalientRegionArray::TYPE_NAME), ["/robot/regions"]);
    for number in 0..PAIRS {
        player.publish(pair(number));
        let array = listener.next(PATIENCE).unwrap();
        assert_eq!((array.width, array.height), (WIDTH as u32, HEIGHT as u32));
        assert!(!array.regions.is_empty());
        let mut image = None;
        wait("a disparity image", || {
            image = disparity.take().unwrap().or(image.take());
            image.is_some()
        });
        assert_eq!(image.unwrap().0.header.stamp, array.header.stamp);
    }
    wait("diagnostics", || diagnostics.take().unwrap().is_some());
    let totals = runtime.status().totals();
    assert_eq!((totals.paired, totals.processed), (u64::from(PAIRS), u64::from(PAIRS)));

    // The viewer leaves, and the topic that nobody hears is no longer made.
    drop(disparity);
    wait("the subscription to be gone", || {
        let graph = runtime.graph().unwrap();
        graph.subscriptions::<DisparityImage>("/robot/disparity") == 0
    });
    assert!(runtime.stop(), "the node's threads did not end");
    wait("the node to be gone", || {
        peer.graph().published_topics(SalientRegionArray::TYPE_NAME).is_empty()
    });
}

#[test]
fn services_answer_over_zenoh() {
    let [here, there] = linked(port(1));
    let mut runtime = start(small(), &here);
    let mut peer = RosNode::open(names("peer"), &there).unwrap();
    let get: Client<GetParametersRequest, GetParametersResponse> =
        peer.client("/robot/eye/get_parameters").unwrap();
    let set: Client<SetParametersRequest, SetParametersResponse> =
        peer.client("/robot/eye/set_parameters").unwrap();
    let reset: Client<TriggerRequest, TriggerResponse> = peer.client("/robot/eye/reset").unwrap();
    let value = ParameterValue { r#type: 3, double_value: 0.25, ..ParameterValue::default() };
    let parameter = Parameter { name: "saliency.threshold".into(), value };
    let results = call(&set, &SetParametersRequest { parameters: vec![parameter] }).results;
    assert!(results[0].successful, "{results:?}");
    let names = vec!["saliency.threshold".to_owned(), "nothing".to_owned()];
    let values = call(&get, &GetParametersRequest { names }).values;
    assert_eq!((values[0].double_value, values[1].r#type), (0.25, 0));
    assert!(call(&reset, &TriggerRequest::default()).success);
    assert!(runtime.stop(), "the node's threads did not end");
}
