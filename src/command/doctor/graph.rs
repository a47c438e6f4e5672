//! The doctor's look at the live graph: it subscribes as the node would, under
//! a name of its own, and listens for a while.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use futures::channel::oneshot;

use super::bag::losses;
use super::check::FrameCheck;
use super::finding::Finding;
use crate::config::Config;
use crate::input::Tally;
use crate::input::live::{FrameBuilder, LiveInput, Topic};
use crate::mailbox::{Mailbox, Taken};
use crate::ros::diagnostics::{NodeStatus, Surroundings};
use crate::ros::environment::Environment;
use crate::ros::names::{Names, Remap, RemapKind};
use crate::ros::node::{Graph, RosNode, SUFFICIENT_RECEIVE_BUFFER_BYTES, receive_buffer_advice};
use crate::ros::params::ParameterStore;
use crate::ros::runtime::RuntimeError;

/// Name on the graph while listening.
const NAME: &str = "salient_stereo_doctor";

/// The node as it is, or would be, started.
pub struct Patient<'a> {
    /// Its remap rules.
    pub remaps: &'a [Remap],
    /// Its names under them.
    pub names: &'a Names,
    /// Its parameters.
    pub config: &'a Config,
}

/// Listens for `seconds`, or until `stop` is set, and says what is wrong.
///
/// # Errors
/// When the graph cannot be joined.
pub fn examine_graph(
    patient: &Patient<'_>,
    environment: &Environment,
    seconds: f64,
    stop: &AtomicBool,
) -> Result<Vec<Finding>, RuntimeError> {
    let rules: Vec<Remap> =
        patient.remaps.iter().filter(|rule| rule.kind != RemapKind::Node).cloned().collect();
    let names = Names::new(patient.names.namespace(), NAME, &rules)
        .map_err(crate::input::live::LiveInputError::Name)?;
    let mut node = RosNode::open(names, environment)?;
    let input = LiveInput::subscribe(&mut node, patient.config)?;
    let topics = input.topics().to_vec();
    let graph = node.graph();
    let lost_before = lost_datagrams();

    let store = ParameterStore::new(patient.config.clone());
    let status = NodeStatus::default();
    let pairs = Mailbox::new(1);
    let mut check = FrameCheck::new(patient.config);
    let mut tally = Tally::default();
    let (stop_input, input_stopped) = oneshot::channel();
    thread::scope(|scope| {
        scope.spawn(|| input.run(&store, &pairs, &status, input_stopped));
        let mut frames = FrameBuilder::default();
        let deadline = Instant::now() + Duration::from_secs_f64(seconds);
        while Instant::now() < deadline && !stop.load(Ordering::Relaxed) {
            let Taken::Item(arrived) = pairs.take(Duration::from_millis(50)) else { continue };
            match frames.frame(&arrived.pair, patient.config.calibration.baseline_override) {
                Ok(frame) => check.take(&frame),
                Err(error) => tally.skip(error.to_string()),
            }
        }
        drop(stop_input);
    });

    let mut findings: Vec<Finding> =
        environment.notes.iter().map(|note| Finding::warning(note, "")).collect();
    for (reason, count) in status.totals().dropped {
        *tally.skipped.entry(reason).or_default() += count;
    }
    let received = status.received().unwrap_or_default();
    findings.extend(buffers(&node, lost_before, check.frames()));
    findings.extend(publishers(&graph, &topics));
    if received == [0, 0] && topics.iter().all(|t| graph.publishers(&t.name, t.type_name).0 > 0) {
        findings.push(Finding::fault(
            format!("{} publishers are known, but no image came in {seconds} s", topics.len()),
            "check that the publishers send, that the receive buffers are large enough, and that no firewall is between (ros2 multicast receive)",
        ));
    } else if received != [0, 0] {
        let [left, right] = received.map(|count| count as f64 / seconds);
        findings
            .push(Finding::well(format!("left images at {left:.1} Hz, right at {right:.1} Hz")));
        findings.extend(losses(&tally, status.explain_pairing(), check.frames()));
    }
    findings.extend(check.findings());
    findings.extend(graph.qos_conflicts().into_iter().map(|conflict| {
        Finding::warning(
            conflict.to_string(),
            "give the subscription the publisher's reliability and durability (ros2 topic echo --qos-reliability best_effort --qos-durability volatile)",
        )
    }));
    Ok(findings)
}

fn lost_datagrams() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/net/snmp").ok()?;
    Surroundings::receive_buffer_errors_in(&text)
}

fn buffers(node: &RosNode, lost_before: Option<u64>, frames: usize) -> Vec<Finding> {
    let mut findings = Vec::new();
    if let Some(bytes) = node.receive_buffer_bytes() {
        findings.push(match receive_buffer_advice(bytes) {
            Some(advice) if frames == 0 => Finding::fault(advice, ""),
            Some(advice) => Finding::warning(advice, ""),
            None => Finding::well(format!(
                "receive buffers of {bytes} bytes ({SUFFICIENT_RECEIVE_BUFFER_BYTES} are enough)"
            )),
        });
    }
    let lost = lost_before.zip(lost_datagrams()).map_or(0, |(old, new)| new.saturating_sub(old));
    if lost > 0 {
        findings.push(Finding::warning(
            format!("{lost} datagrams were lost to full receive buffers on this machine meanwhile"),
            "raise net.core.rmem_max (config/dds/60-salient-stereo.conf), or subscribe to compressed images",
        ));
    }
    findings
}

fn publishers(graph: &Graph, topics: &[Topic]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for Topic { name, type_name } in topics {
        let (publishers, others) = graph.publishers(name, type_name);
        if let Some(other) = others.first() {
            findings.push(Finding::fault(
                format!("{name} is published as {other}, wanted is {type_name}"),
                "remap the topic (-r from:=to), or set image_transport to what is published",
            ));
        } else if publishers == 0 {
            let there = graph.published_topics(type_name);
            let listed = if there.is_empty() { "none".to_owned() } else { there.join(", ") };
            findings.push(Finding::fault(
                format!("nobody publishes {name} ({type_name})"),
                format!(
                    "start the camera, or remap (-r {}:=TOPIC); published with this type: {listed}",
                    name.trim_start_matches('/')
                ),
            ));
        }
    }
    findings
}
