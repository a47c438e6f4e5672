//! A camera and viewer on Zenoh that was written from `rmw_zenoh`'s design alone.

use std::process::Stdio;

use salient_stereo::config::Config;
use salient_stereo::ros::NODE_NAME;
use salient_stereo::ros::environment::{Environment, Middleware, ZenohSettings};
use salient_stereo::ros::message::Message;
use salient_stereo::ros::message::salient_stereo_msgs::SalientRegionArray;
use salient_stereo::ros::names::Names;
use salient_stereo::ros::runtime::{NodeOptions, NodeRuntime};
use salient_stereo::ros::schema;
use serde_json::json;

use super::super::domain::{port, zenoh_overrides};
use super::{outcome, python, script};

#[test]
fn a_zenoh_peer_gets_one_region_array_per_pair() {
    const DOMAIN: u16 = 11;
    let Some(script) = script("zenoh_stereo.py") else { return };
    let port = port(2);
    let overrides = zenoh_overrides(&[], &[port]);
    let environment = Environment {
        middleware: Middleware::Zenoh(ZenohSettings { config_file: None, overrides }),
        ..Environment::localhost(DOMAIN)
    };
    let names = Names::new("/robot", NODE_NAME, &[]).unwrap();
    let config = Config::default().with("stereo.disparity_range", &json!(64)).unwrap();
    let mut node = NodeRuntime::start(NodeOptions::new(config, names, environment)).unwrap();
    let peer = python()
        .arg(script)
        .args(["--endpoint", &format!("tcp/127.0.0.1:{port}"), "--domain", &DOMAIN.to_string()])
        .args(["--pairs", "10", "--rate", "4"])
        .args(["--listen", "disparity=stereo_msgs::msg::dds_::DisparityImage_"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (seen, code) = outcome(peer);
    assert_eq!(code, Some(0), "{seen}");
    assert_eq!(seen["well_formed"], true, "{seen}");
    assert_eq!(seen["node_token"], true, "{seen}");
    assert_eq!(seen["messages"], json!({"regions": 10, "disparity": 10}), "{seen}");
    assert_eq!(seen["sequence"], json!((1..=10).collect::<Vec<_>>()), "{seen}");
    let hash = schema::type_hash(SalientRegionArray::TYPE_NAME);
    let regions = "salient_stereo_msgs::msg::dds_::SalientRegionArray_";
    assert_eq!(seen["hashes"][regions].as_str(), hash.as_deref(), "{seen}");
    assert!(node.stop());
}
