//! The node on a real DDS network, on 127.0.0.1 only: two participants of our
//! own, one the node, one its peer. Bounded in count and time.

#[cfg(target_os = "linux")]
mod echo;
mod faults;
mod inputs;
mod lazy;
#[cfg(unix)]
mod process;
#[cfg(feature = "security")]
mod security;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::sync::atomic::AtomicBool;
use std::thread;
use std::time::{Duration, Instant};

use salient_stereo::config::Config;
use salient_stereo::ros::endpoint::Client;
use salient_stereo::ros::environment::Environment;
use salient_stereo::ros::message::Message;
use salient_stereo::ros::message::diagnostic_msgs::DiagnosticArray;
use salient_stereo::ros::message::rcl_interfaces::*;
use salient_stereo::ros::message::rosgraph_msgs::Clock;
use salient_stereo::ros::message::salient_stereo_msgs::SalientRegionArray;
use salient_stereo::ros::message::sensor_msgs::{CameraInfo, Image};
use salient_stereo::ros::message::std_msgs::Header;
use salient_stereo::ros::message::std_srvs::{TriggerRequest, TriggerResponse};
use salient_stereo::ros::message::stereo_msgs::DisparityImage;
use salient_stereo::ros::names::{Names, Remap, RemapKind};
use salient_stereo::ros::node::RosNode;
use salient_stereo::ros::params::to_ros;
use salient_stereo::ros::play::{ImagePair, RegionsListener, StereoMessages, StereoPlayer};
use salient_stereo::ros::qos;
use salient_stereo::ros::runtime::{NodeOptions, NodeRuntime};
use salient_stereo::stamp::Stamp;
use serde_json::json;

use super::domain::domain;

const WIDTH: usize = 320;
const HEIGHT: usize = 120;
const PATIENCE: Duration = Duration::from_secs(20);

fn environment(test: u16) -> Environment {
    Environment::localhost(domain(test))
}

fn names(node: &str) -> Names {
    let rule = Remap {
        node: None,
        kind: RemapKind::Any,
        from: "left/image_rect".into(),
        to: "/rig/left/rectified".into(),
    };
    Names::new("/robot", node, &[rule]).unwrap()
}

/// A noise wall 10 px of disparity away, with a box of 30 px before it.
fn pair(number: u32) -> StereoMessages {
    let noise = |x: usize, y: usize| {
        let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        (h >> 24) as u8
    };
    let stamp = Stamp(1_000_000_000 + i64::from(number) * 100_000_000);
    let header = Header { stamp: stamp.into(), frame_id: "left_optical".into() };
    let image = |shifted: bool| {
        let mut data = Vec::with_capacity(3 * WIDTH * HEIGHT);
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let near = x + if shifted { 30 } else { 0 };
                let inside = (140..190).contains(&near) && (40..90).contains(&y);
                let v = if inside {
                    noise(near + 5000, y)
                } else {
                    noise(x + if shifted { 10 } else { 0 }, y) / 2
                };
                data.extend(if inside { [v, v / 4, v / 4] } else { [v / 2, v, v / 2] });
            }
        }
        Image {
            header: header.clone(),
            height: HEIGHT as u32,
            width: WIDTH as u32,
            encoding: "rgb8".into(),
            is_bigendian: 0,
            step: 3 * WIDTH as u32,
            data,
        }
    };
    let info = |tx: f64| CameraInfo {
        header: header.clone(),
        height: HEIGHT as u32,
        width: WIDTH as u32,
        distortion_model: "plumb_bob".into(),
        d: vec![0.0; 5],
        k: [300.0, 0.0, 160.0, 0.0, 300.0, 60.0, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [300.0, 0.0, 160.0, tx, 0.0, 300.0, 60.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    };
    StereoMessages {
        images: ImagePair::Raw(image(false), image(true)),
        left_info: info(0.0),
        right_info: info(-60.0),
    }
}

fn small() -> Config {
    Config::default()
        .with_all([("stereo.disparity_range", json!(64)), ("regions.min_area", json!(50))])
        .unwrap()
}

fn start(config: Config, environment: &Environment) -> NodeRuntime {
    let mut options = NodeOptions::new(config, names("eye"), environment.clone());
    options.rosout = false;
    NodeRuntime::start(options).unwrap()
}

#[test]
fn every_pair_comes_back_as_one_region_array() {
    const PAIRS: u32 = 12;
    let environment = environment(0);
    let mut runtime = start(small(), &environment);
    let mut peer = RosNode::open(names("peer"), &environment).unwrap();
    let mut player = StereoPlayer::new(&mut peer, false).unwrap();
    let mut listener = RegionsListener::new(&mut peer, runtime.regions_topic()).unwrap();
    let disparity = peer.subscribe::<DisparityImage>("/robot/disparity", &qos::output()).unwrap();
    let diagnostics = peer.subscribe::<DiagnosticArray>("/diagnostics", &qos::output()).unwrap();
    let stop = AtomicBool::new(false);
    assert!(
        player.wait_for_subscribers(PATIENCE, &stop),
        "the node's subscriptions were not found"
    );
    wait("the node to find the subscriptions", || {
        let graph = runtime.graph().unwrap();
        graph.subscriptions::<SalientRegionArray>("/robot/regions") > 0
            && graph.subscriptions::<DisparityImage>("/robot/disparity") > 0
            && graph.publishers("/robot/right/image_rect", Image::TYPE_NAME).0 > 0
    });
    // Discovery is known on both sides now; matching follows at once.
    thread::sleep(Duration::from_millis(300));

    let mut disparities = Vec::new();
    let mut arrays = Vec::new();
    for number in 0..PAIRS {
        // One by one: a machine under load must not displace pairs here.
        player.publish(pair(number));
        arrays.extend(listener.next(PATIENCE));
        while let Ok(Some((image, _))) = disparity.take() {
            disparities.push(image);
        }
    }
    assert_eq!(player.refused(), 0);
    let stamps: Vec<Stamp> = arrays.iter().map(|a| Stamp::from(a.header.stamp)).collect();
    let wanted: Vec<Stamp> =
        (0..PAIRS).map(|n| Stamp(1_000_000_000 + i64::from(n) * 100_000_000)).collect();
    assert_eq!(stamps, wanted);
    assert!(arrays.iter().all(|a| (a.width, a.height) == (WIDTH as u32, HEIGHT as u32)));
    assert!(arrays.iter().all(|a| a.header.frame_id == "left_optical"));

    wait("a disparity image", || {
        while let Ok(Some((image, _))) = disparity.take() {
            disparities.push(image);
        }
        !disparities.is_empty()
    });
    assert!((disparities[0].t - 0.2).abs() < 1e-6, "baseline {}", disparities[0].t);

    // The first message may come before the first frame.
    let mut text = String::new();
    wait("diagnostics of a frame", || {
        while let Ok(Some((array, _))) = diagnostics.take() {
            text = format!("{array:?}");
        }
        ["eye: Input", "pairs", "receive buffer (bytes)", "stereo (ms)", "epipolar error (px)"]
            .iter()
            .all(|key| text.contains(key))
    });

    let totals = runtime.status().totals();
    assert_eq!((totals.paired, totals.processed), (u64::from(PAIRS), u64::from(PAIRS)));
    assert_eq!(totals.published["/robot/regions"], u64::from(PAIRS));
    assert!(!totals.published.contains_key("/robot/confidence/image_rect"), "lazy: {totals:?}");
    assert!(runtime.stop(), "the node's threads did not end");
}

#[test]
fn parameters_are_listed_described_set_and_refused() {
    let environment = environment(1);
    let mut config = small();
    config.use_sim_time = true;
    let mut runtime = start(config, &environment);
    let mut peer = RosNode::open(names("peer"), &environment).unwrap();
    let service = |name: &str| format!("/robot/eye/{name}");

    let list: Client<ListParametersRequest, ListParametersResponse> =
        peer.client(&service("list_parameters")).unwrap();
    let get: Client<GetParametersRequest, GetParametersResponse> =
        peer.client(&service("get_parameters")).unwrap();
    let types: Client<GetParameterTypesRequest, GetParameterTypesResponse> =
        peer.client(&service("get_parameter_types")).unwrap();
    let set: Client<SetParametersRequest, SetParametersResponse> =
        peer.client(&service("set_parameters")).unwrap();
    let set_all: Client<SetParametersAtomicallyRequest, SetParametersAtomicallyResponse> =
        peer.client(&service("set_parameters_atomically")).unwrap();
    let describe: Client<DescribeParametersRequest, DescribeParametersResponse> =
        peer.client(&service("describe_parameters")).unwrap();
    let reset: Client<TriggerRequest, TriggerResponse> = peer.client(&service("reset")).unwrap();
    let events =
        peer.subscribe::<ParameterEvent>("/parameter_events", &qos::parameter_events()).unwrap();
    let clock = peer.advertise::<Clock>("/clock", &qos::output()).unwrap();

    let names = call(&list, &ListParametersRequest::default()).result.names;
    assert_eq!(names.len(), Config::default().flatten().len());

    let values = call(
        &get,
        &GetParametersRequest { names: vec!["stereo.disparity_range".into(), "nothing".into()] },
    )
    .values;
    assert_eq!((values[0].integer_value, values[1].r#type), (64, 0));

    let types = call(
        &types,
        &GetParameterTypesRequest {
            names: vec!["lazy".into(), "depth.max".into(), "saliency.mode".into()],
        },
    )
    .types;
    assert_eq!(types, [1, 3, 4]);

    let described = call(
        &describe,
        &DescribeParametersRequest { names: vec!["saliency.threshold".into(), "threads".into()] },
    )
    .descriptors;
    assert_eq!(described[0].floating_point_range[0].to_value, 1.0);
    assert!(described[0].description.contains("interest") && described[1].read_only);

    let parameter = |name: &str, value| Parameter { name: name.into(), value: to_ros(&value) };
    // Simulated time stamps the event.
    wait("/clock to be heard", || {
        let _ = clock.publish(Clock { clock: Stamp(7_000_000_000).into() });
        thread::sleep(Duration::from_millis(50));
        runtime.time() == Stamp(7_000_000_000)
    });
    let results = call(
        &set,
        &SetParametersRequest {
            parameters: vec![
                parameter("saliency.threshold", json!(0.25)),
                parameter("saliency.threshold", json!(1.5)),
                parameter("threads", json!(1)),
                parameter("no.such", json!(1)),
            ],
        },
    )
    .results;
    let outcome: Vec<bool> = results.iter().map(|r| r.successful).collect();
    assert_eq!(outcome, [true, false, false, false], "{results:?}");
    assert!(results[1].reason.contains("[0, 1]") && results[2].reason.contains("start"));
    assert_eq!(runtime.parameters().config().saliency.threshold, 0.25);

    let mut event = None;
    wait("a parameter event", || {
        while let Ok(Some((message, _))) = events.take() {
            if !message.changed_parameters.is_empty() {
                event = Some(message);
            }
        }
        event.is_some()
    });
    let event = event.unwrap();
    assert_eq!((event.node.as_str(), event.stamp.sec), ("/robot/eye", 7));
    assert_eq!(event.changed_parameters[0].name, "saliency.threshold");

    let result = call(
        &set_all,
        &SetParametersAtomicallyRequest {
            parameters: vec![
                parameter("depth.max", json!(5.0)),
                parameter("depth.min", json!(6.0)),
            ],
        },
    )
    .result;
    assert!(!result.successful && result.reason.contains("depth.min"), "{result:?}");
    assert_eq!(runtime.parameters().config().depth.max, Config::default().depth.max);

    assert!(call(&reset, &TriggerRequest::default()).success);
    assert!(runtime.stop(), "the node's threads did not end");
}

fn wait(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !done() {
        assert!(Instant::now() < deadline, "waited in vain for {what}");
        thread::sleep(Duration::from_millis(10));
    }
}

/// Sends the request until the answer comes: before discovery is complete on
/// both sides, requests and responses get lost.
fn call<Req, Resp>(client: &Client<Req, Resp>, request: &Req) -> Resp
where
    Req: Message + Clone + 'static,
    Resp: Message + 'static,
{
    let deadline = Instant::now() + PATIENCE;
    while Instant::now() < deadline {
        let id = client.send_request(request.clone()).unwrap();
        let resend = Instant::now() + Duration::from_millis(500);
        while Instant::now() < resend {
            match client.receive_response() {
                Ok(Some((answered, response))) if answered == id => return response,
                Ok(_) => thread::sleep(Duration::from_millis(5)),
                Err(error) => panic!("{error}"),
            }
        }
    }
    panic!("{} was not answered", Req::TYPE_NAME);
}
