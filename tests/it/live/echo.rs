//! The node's messages to itself, which need a network that is not loopback:
//! these tests run once more in a network namespace that they make.

use std::process::Command;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use futures::{FutureExt, StreamExt};
use salient_stereo::config::Config;
use salient_stereo::ros::diagnostics::{NodeStatus, Reporter, Surroundings};
use salient_stereo::ros::echo::echo;
use salient_stereo::ros::environment::Environment;
use salient_stereo::ros::message::builtin_interfaces::Time;
use salient_stereo::ros::message::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use salient_stereo::ros::node::RosNode;
use salient_stereo::ros::qos;
use salient_stereo::stamp::Stamp;

use super::{names, small, start, wait};

const ROUND_TRIP: &str = "echo over the transport (ms)";
const MISSING: &str = "echoes missing";

/// Set inside the namespace.
const INSIDE: &str = "SALIENT_STEREO_IN_NAMESPACE";

/// An interface with multicast that leads nowhere; then the test again.
const SCRIPT: &str = r#"
{
    ip link set lo up && ip link add v0 type veth peer name v1 &&
    ip addr add 10.9.0.1/24 dev v0 && ip link set v0 up && ip link set v1 up &&
    ip route add default dev v0
} || exit 77
exec "$0" --exact "$1" --nocapture
"#;

/// Runs the body of `test` where nothing leaves the machine; skips it aloud
/// where namespaces are not to be had.
fn in_namespace(test: &str, body: impl FnOnce(Environment)) {
    if std::env::var_os(INSIDE).is_some() {
        return body(Environment { localhost: false, ..Environment::localhost(1) });
    }
    let test = format!("{}::{test}", module_path!().split_once("::").unwrap().1);
    let run = Command::new("unshare")
        .args(["--user", "--map-root-user", "--net", "sh", "-c", SCRIPT])
        .arg(std::env::current_exe().unwrap())
        .arg(&test)
        .env(INSIDE, "1")
        .output();
    let texts = |run: &std::process::Output| {
        format!("{}{}", String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr))
    };
    match run {
        Ok(run) if matches!(run.status.code(), Some(0 | 101)) => {
            assert!(run.status.success(), "{}", texts(&run));
            assert!(texts(&run).contains("1 passed"), "{test} was not found: {}", texts(&run));
        }
        Ok(run) => eprintln!("skipped, no network namespace: {}", texts(&run)),
        Err(error) => eprintln!("skipped, no network namespace: unshare: {error}"),
    }
}

/// The transport's status.
fn transport(array: &DiagnosticArray) -> &DiagnosticStatus {
    array.status.iter().find(|status| status.name.ends_with(": Transport")).unwrap()
}

fn value<'a>(status: &'a DiagnosticStatus, key: &str) -> Option<&'a str> {
    status.values.iter().find(|value| value.key == key).map(|value| value.value.as_str())
}

#[test]
fn the_node_hears_itself_and_says_so_when_it_no_longer_does() {
    in_namespace("the_node_hears_itself_and_says_so_when_it_no_longer_does", |environment| {
        let mut config = small();
        // A clock that stands still is not the echo's.
        config.use_sim_time = true;
        let mut runtime = start(config, &environment);
        let mut peer = RosNode::open(names("peer"), &environment).unwrap();
        let diagnostics =
            peer.subscribe::<DiagnosticArray>("/diagnostics", &qos::reliable_input()).unwrap();
        let latest = || {
            let mut latest = None;
            while let Ok(Some((array, _))) = diagnostics.take() {
                latest = Some(transport(&array).clone());
            }
            latest
        };
        let mut heard = 0;
        wait("echoes", || {
            if let Some(status) = latest() {
                println!("{:?} {:?}", value(&status, ROUND_TRIP), value(&status, MISSING));
                let round_trip = value(&status, ROUND_TRIP).map(|ms| ms.parse::<f64>().unwrap());
                let well =
                    round_trip.is_some_and(|ms| ms > 0.0) && value(&status, MISSING) == Some("0");
                heard = if well { heard + 1 } else { 0 };
            }
            heard == 3
        });
        // Between two participants of one machine loopback remains.
        let gone = Command::new("ip").args(["addr", "flush", "dev", "v0"]).status().unwrap();
        assert!(gone.success());
        wait("a warning", || {
            latest().is_some_and(|status| {
                println!("{} {}", status.level, status.message);
                status.message.contains("did not come back")
            })
        });
        assert!(runtime.stop(), "the node's threads did not end");
    });
}

#[test]
fn the_echo_of_a_node_of_the_same_name_is_not_its_own() {
    in_namespace("the_echo_of_a_node_of_the_same_name_is_not_its_own", |environment| {
        let [mut here, mut there] =
            [(); 2].map(|()| RosNode::open(names("twin"), &environment).unwrap());
        let status = Arc::new(NodeStatus::default());
        let twins_status = Arc::new(NodeStatus::default());
        let (caller, listener) = echo(&mut here, &status).unwrap();
        let (_silent, twin) = echo(&mut there, &twins_status).unwrap();
        let witness = there.subscribe::<Time>("/robot/twin/_echo", &qos::small_output()).unwrap();
        let mut own = listener.numbers();
        let mut twins = twin.numbers();
        let (mut heard, mut overheard) = (false, false);
        wait("a call to reach both", || {
            // The twin waits for the same numbers and sends nothing.
            twins_status.call_echo();
            caller.call();
            thread::sleep(Duration::from_millis(200));
            while let Some(Some(number)) = own.next().now_or_never() {
                listener.hear(number);
                heard = true;
            }
            overheard |= witness.take().unwrap().is_some();
            while let Some(Some(number)) = twins.next().now_or_never() {
                twin.hear(number);
            }
            heard && overheard
        });
        let round_trip = |status: &NodeStatus| {
            let around = Surroundings::default();
            let array = Reporter::new("n").report(Stamp(1), status, &Config::default(), &around);
            value(transport(&array), ROUND_TRIP).map(str::to_owned)
        };
        assert!(round_trip(&status).is_some());
        assert_eq!(round_trip(&twins_status), None);
    });
}
