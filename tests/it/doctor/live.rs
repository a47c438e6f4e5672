//! The doctor on a live graph, on 127.0.0.1 only.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use rustdds::QosPolicyBuilder;
use rustdds::policy::{Durability, Reliability};
use salient_stereo::command::doctor::{Finding, Patient, Severity, examine_graph};
use salient_stereo::config::Config;
use salient_stereo::ros::environment::Environment;
use salient_stereo::ros::message::salient_stereo_msgs::SalientRegionArray;
use salient_stereo::ros::message::sensor_msgs::{CompressedImage, Image};
use salient_stereo::ros::names::Names;
use salient_stereo::ros::node::RosNode;
use salient_stereo::ros::play::{ImagePair, StereoMessages, StereoPlayer};
use salient_stereo::ros::qos;

use super::{Sent, expect, sent};
use crate::it::domain::domain;

fn environment(test: u16) -> Environment {
    Environment::localhost(domain(test))
}

fn names(node: &str) -> Names {
    Names::new("/robot", node, &[]).unwrap()
}

fn examine(environment: &Environment, seconds: f64) -> Vec<Finding> {
    let (names, config) = (names("salient_stereo"), Config::default());
    let patient = Patient { remaps: &[], names: &names, config: &config };
    examine_graph(&patient, environment, seconds, &AtomicBool::new(false)).unwrap()
}

#[test]
fn a_camera_that_works_is_found_well_and_a_conflict_beside_it_is_named() {
    let environment = environment(5);
    let mut peer = RosNode::open(names("camera"), &environment).unwrap();
    let mut player = StereoPlayer::new(&mut peer, false).unwrap();
    let offered = peer.advertise::<SalientRegionArray>("/robot/regions", &qos::output()).unwrap();
    let mut other = RosNode::open(names("viewer"), &environment).unwrap();
    let request = QosPolicyBuilder::new()
        .reliability(Reliability::Reliable { max_blocking_time: rustdds::Duration::ZERO })
        .durability(Durability::TransientLocal)
        .build();
    let wanted = other.subscribe::<SalientRegionArray>("/robot/regions", &request).unwrap();

    let done = AtomicBool::new(false);
    let findings = thread::scope(|scope| {
        scope.spawn(|| {
            for number in 0.. {
                if done.load(Ordering::Relaxed) {
                    break;
                }
                let Sent { images: [left, right], infos: [left_info, right_info] } =
                    sent(number, 12.0, 0.0);
                let images = ImagePair::Raw(left, right);
                player.publish(StereoMessages { images, left_info, right_info });
                thread::sleep(Duration::from_millis(100));
            }
        });
        let findings = examine(&environment, 4.0);
        done.store(true, Ordering::Relaxed);
        findings
    });
    drop((offered, wanted));
    expect(&findings, Severity::Well, "usable pairs: 240x120 pixels");
    expect(&findings, Severity::Well, "aligned");
    let conflict = expect(&findings, Severity::Warning, "/robot/regions: a publisher offers");
    assert!(
        conflict
            .what
            .contains("reliable, volatile, a subscription requests reliable, transient local"),
        "{conflict}"
    );
}

#[test]
fn topics_that_nobody_publishes_or_with_another_type_are_named() {
    let environment = environment(6);
    let mut peer = RosNode::open(names("camera"), &environment).unwrap();
    let elsewhere = peer.advertise::<Image>("/camera/left/image", &qos::output()).unwrap();
    let wrong =
        peer.advertise::<CompressedImage>("/robot/right/image_rect", &qos::output()).unwrap();
    let findings = examine(&environment, 3.0);
    drop((elsewhere, wrong));
    let missing = expect(&findings, Severity::Fault, "nobody publishes /robot/left/image_rect");
    assert!(missing.fix.contains("/camera/left/image"), "{missing}");
    assert!(missing.fix.contains("-r robot/left/image_rect:=TOPIC"), "{missing}");
    let wrong = expect(&findings, Severity::Fault, "/robot/right/image_rect is published as");
    assert!(wrong.fix.contains("image_transport"), "{wrong}");
}
