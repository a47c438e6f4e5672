//! Bad input on live topics: each fault is counted by its reason, and the node
//! goes on.

use std::sync::atomic::AtomicBool;

use salient_stereo::ros::args::LogArgs;
use salient_stereo::ros::log;
use salient_stereo::ros::message::diagnostic_msgs::DiagnosticArray;
use salient_stereo::ros::message::rcl_interfaces::Log;
use salient_stereo::ros::message::sensor_msgs::CompressedImage;
use salient_stereo::ros::node::RosNode;
use salient_stereo::ros::play::{ImagePair, RegionsListener, StereoMessages, StereoPlayer};
use salient_stereo::ros::qos;
use salient_stereo::ros::runtime::{NodeOptions, NodeRuntime};

use super::{PATIENCE, environment, names, pair, small, wait};

#[test]
fn bad_messages_are_counted_by_reason_and_the_node_goes_on() {
    type Spoil = fn(&mut StereoMessages);

    // The one test that looks at /rosout: the log of a process has one node.
    log::init(&LogArgs { stdout: false, ..LogArgs::default() }, "robot.eye");
    let environment = environment(2);
    let mut options = NodeOptions::new(small(), names("eye"), environment.clone());
    options.rosout = true;
    let mut runtime = NodeRuntime::start(options).unwrap();
    let mut peer = RosNode::open(names("peer"), &environment).unwrap();
    let mut player = StereoPlayer::new(&mut peer, false).unwrap();
    let mut listener = RegionsListener::new(&mut peer, runtime.regions_topic()).unwrap();
    let rosout = peer.subscribe::<Log>("/rosout", &qos::reliable_input()).unwrap();
    let diagnostics = peer.subscribe::<DiagnosticArray>("/diagnostics", &qos::output()).unwrap();
    assert!(player.wait_for_subscribers(PATIENCE, &AtomicBool::new(false)));

    let mut number = 0;
    let mut offer = |player: &mut StereoPlayer, spoil: fn(&mut StereoMessages)| {
        let mut messages = pair(number);
        number += 1;
        spoil(&mut messages);
        player.publish(messages);
    };
    let faults: [(&str, Spoil); 7] = [
        ("payload is 100 bytes", |m| left(m).data.truncate(100)),
        ("unknown image encoding 'rgb7'", |m| left(m).encoding = "rgb7".into()),
        ("step is 10 bytes", |m| left(m).step = 10),
        ("left image is 320x120, right image is 320x100", |m| right(m).height = 100),
        ("baseline is zero", |m| m.right_info.p[3] = 0.0),
        ("swapped", |m| m.right_info.p[3] = 60.0),
        ("uncalibrated", |m| m.left_info.k[0] = 0.0),
    ];
    for (index, (reason, spoil)) in faults.into_iter().enumerate() {
        offer(&mut player, spoil);
        wait(reason, || runtime.status().totals().dropped.values().sum::<u64>() > index as u64);
        let dropped = runtime.status().totals().dropped;
        assert!(dropped.keys().any(|key| key.contains(reason)), "{reason}: {dropped:?}");
    }
    offer(&mut player, |_| ());
    assert!(listener.next(PATIENCE).is_some(), "the node did not recover");
    // Time jumps back, as of a bag that is played again.
    player.publish(pair(0));
    assert!(listener.next(PATIENCE).is_some(), "the node did not survive a jump back in time");

    // Another participant publishes another type on an input topic.
    let mut stranger = RosNode::open(names("stranger"), &environment).unwrap();
    let wrong =
        stranger.advertise::<CompressedImage>("/robot/right/image_rect", &qos::output()).unwrap();
    wait("the wrong type to be named", || {
        let mut named = false;
        while let Ok(Some((message, _))) = diagnostics.take() {
            named |= message.status.iter().any(|status| {
                status.message.contains(
                    "/robot/right/image_rect is published as sensor_msgs/msg/CompressedImage",
                )
            });
        }
        named
    });
    drop(wrong);

    let mut lines = Vec::new();
    wait("the log", || {
        while let Ok(Some((line, _))) = rosout.take() {
            lines.push(line);
        }
        lines.iter().any(|line| line.msg.contains("swapped"))
    });
    let line = lines.iter().find(|line| line.msg.contains("swapped")).unwrap();
    assert_eq!((line.name.as_str(), line.level), ("robot.eye", Log::WARN));
    let repeated = lines.iter().filter(|line| line.msg.contains("baseline is zero")).count();
    assert_eq!(repeated, 1, "a fault is logged once");
    assert!(runtime.stop());
}

fn left(messages: &mut StereoMessages) -> &mut salient_stereo::ros::message::sensor_msgs::Image {
    match &mut messages.images {
        ImagePair::Raw(left, _) => left,
        ImagePair::Compressed(..) => unreachable!("pair() makes raw images"),
    }
}

fn right(messages: &mut StereoMessages) -> &mut salient_stereo::ros::message::sensor_msgs::Image {
    match &mut messages.images {
        ImagePair::Raw(_, right) => right,
        ImagePair::Compressed(..) => unreachable!("pair() makes raw images"),
    }
}
