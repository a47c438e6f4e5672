//! The node and peers of other makes, the metrics and referees. They need packages that cargo does not
//! bring, so they run only when asked for:
//!
//! ```text
//! pip install -r tests/interop/requirements.txt
//! SALIENT_STEREO_INTEROP=1 cargo test --test it interop::
//! ```
//!
//! `SALIENT_STEREO_PYTHON` names another interpreter than `python3`.

mod referee;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use salient_stereo::config::Config;
use salient_stereo::ros::NODE_NAME;
use salient_stereo::ros::environment::Environment;
use salient_stereo::ros::names::Names;
use salient_stereo::ros::node::{RosNode, receive_buffer_advice};
use salient_stereo::ros::runtime::{NodeOptions, NodeRuntime};
use serde_json::{Value, json};

/// A script of `tests/interop`; `None` unless such tests were asked for.
fn script(name: &str) -> Option<PathBuf> {
    if std::env::var_os("SALIENT_STEREO_INTEROP").is_none() {
        println!("skipped: set SALIENT_STEREO_INTEROP=1 to test with {name}");
        return None;
    }
    Some(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop").join(name))
}

fn python() -> Command {
    Command::new(std::env::var_os("SALIENT_STEREO_PYTHON").unwrap_or_else(|| "python3".into()))
}

fn domain() -> u16 {
    super::domain::domain(4)
}

fn start(domain: u16) -> NodeRuntime {
    let names = Names::new("/robot", NODE_NAME, &[]).unwrap();
    let config = Config::default().with("saliency.mode", &json!("paper")).unwrap();
    NodeRuntime::start(NodeOptions::new(config, names, Environment::localhost(domain))).unwrap()
}

/// The script as a process, on the node's domain.
fn peer(script: &Path, domain: u16, arguments: &str) -> Child {
    python()
        .arg(script)
        .args(["--domain", &domain.to_string(), "--namespace", "/robot"])
        .args(arguments.split_whitespace())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|e| panic!("{}: {e}", python().get_program().display()))
}

/// What the script printed, and its exit code.
fn outcome(peer: Child) -> (Value, Option<i32>) {
    let output = peer.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    println!("{text}{}", String::from_utf8_lossy(&output.stderr));
    (serde_json::from_str(&text).unwrap_or_default(), output.status.code())
}

// Small and slow: these are about the wire, not about load.
const SMALL: &str = "--pairs 20 --rate 4 --width 320 --height 120";

/// All of them one after the other: they share a domain and two processors.
#[test]
fn a_cyclone_peer_gets_one_region_array_per_pair() {
    let Some(script) = script("cyclone_stereo.py") else { return };
    let domain = domain();
    let small = |more: &str| peer(&script, domain, &format!("{SMALL} {more}"));

    println!("the node first, then a reliable camera");
    let mut node = start(domain);
    assert_eq!(outcome(small("--reliability reliable")).1, Some(0));
    assert_eq!(node.status().totals().paired, 20);

    println!("the camera comes again, best effort, and a viewer comes late");
    let camera = small("--reliability best_effort --start 2000 --pairs 40");
    thread::sleep(Duration::from_secs(4));
    let viewer = peer(&script, domain, "--listen 4");
    let (seen, code) = outcome(viewer);
    assert_eq!(code, Some(0), "the viewer: {seen}");
    assert_eq!(outcome(camera).1, Some(0));
    assert_eq!(node.status().totals().paired, 60);

    println!("the node goes and comes again while a camera sends");
    let camera = small("--start 3000 --pairs 60");
    thread::sleep(Duration::from_secs(6));
    assert!(node.stop());
    let mut node = start(domain);
    // What was sent while there was no node may be missing.
    let (seen, _) = outcome(camera);
    assert_eq!(seen["last_answered"], true, "{seen}");
    assert!(seen["arrays"].as_u64() >= Some(40), "{seen}");
    assert!(node.stop());

    println!("the camera first, then the node");
    let camera = small("--reliability best_effort --start 4000");
    thread::sleep(Duration::from_secs(3));
    let mut node = start(domain);
    assert_eq!(outcome(camera).1, Some(0));
    assert_eq!(node.status().totals().paired, 20);
    assert!(node.stop());

    large_images(&script, domain);
}

/// One full-HD image is larger than a receive buffer of 4 MiB, so that most are
/// lost on a busy machine: that some arrive is all that can be asked. Needs at
/// least 4 MiB: with those of a stock system nothing arrives, whatever the node
/// does.
fn large_images(script: &Path, domain: u16) {
    let names = Names::new("/", "probe", &[]).unwrap();
    let probe = RosNode::open(names, &Environment::localhost(domain)).unwrap();
    if let Some(advice) = probe.receive_buffer_bytes().and_then(receive_buffer_advice) {
        println!("skipped: {advice}");
        return;
    }
    drop(probe);
    let mut node = start(domain);
    for (size, pairs, at_least) in [
        ("--width 1242 --height 375 --rate 5", 20, 20),
        ("--width 1920 --height 1080 --rate 1", 10, 1),
    ] {
        let before = node.status().totals().paired;
        let start = 1000 * pairs;
        let run = format!("{size} --pairs {pairs} --start {start} --reliability best_effort");
        let (seen, _) = outcome(peer(script, domain, &run));
        let paired = node.status().totals().paired - before;
        assert!(paired >= at_least, "{paired} of {pairs} pairs arrived: {seen}");
    }
    assert!(node.stop());
}
