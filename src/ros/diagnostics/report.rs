//! The `/diagnostics` message: what is wrong, and what to do about it.

use std::time::Instant;

use super::draft::Draft;
use super::section::{alignment, ground, processing};
use super::{NodeStatus, Totals, lock};
use crate::config::Config;
use crate::ros::message::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use crate::ros::message::std_msgs::Header;
use crate::ros::node::receive_buffer_advice;
use crate::stamp::Stamp;

/// What the reporter is told about the world outside the node's threads.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// Receive buffer per socket in bytes, where known.
    pub receive_buffer_bytes: Option<usize>,
    /// Datagrams this machine has lost to full receive buffers, where known.
    pub receive_buffer_errors: Option<u64>,
    /// Input topics: full name, wanted type, publishers of this type, types of others.
    pub inputs: Vec<(String, &'static str, usize, Vec<String>)>,
}

impl Surroundings {
    /// `RcvbufErrors` of the UDP line in the text of `/proc/net/snmp`.
    pub fn receive_buffer_errors_in(snmp: &str) -> Option<u64> {
        let mut lines = snmp.lines().filter(|line| line.starts_with("Udp:"));
        let (names, values) = (lines.next()?, lines.next()?);
        let column = names.split_whitespace().position(|name| name == "RcvbufErrors")?;
        values.split_whitespace().nth(column)?.parse().ok()
    }
}

/// Makes one message per second out of what has changed since the last one.
#[derive(Debug)]
pub struct Reporter {
    node: String,
    last: Option<(Instant, Totals, Received)>,
    first_receive_buffer_errors: Option<u64>,
    levels: [u8; 4],
}

#[derive(Clone, Copy, Debug, Default)]
struct Received {
    left: u64,
    right: u64,
}

impl Reporter {
    /// A reporter for the node of this name.
    pub fn new(node: &str) -> Self {
        Self {
            node: node.to_owned(),
            last: None,
            first_receive_buffer_errors: None,
            levels: [DiagnosticStatus::OK; 4],
        }
    }

    /// The message for `stamp`. What has become worse is logged too.
    pub fn report(
        &mut self,
        stamp: Stamp,
        status: &NodeStatus,
        config: &Config,
        around: &Surroundings,
    ) -> DiagnosticArray {
        let now = Instant::now();
        let totals = status.totals();
        let state = lock(&status.input).clone();
        let received = state.as_ref().map_or(Received::default(), |state| Received {
            left: state.counts.left.received,
            right: state.counts.right.received,
        });
        let (seconds, before, received_before) = match &self.last {
            Some((then, totals, received)) => {
                (now.duration_since(*then).as_secs_f64(), totals.clone(), *received)
            }
            None => {
                (status.started.elapsed().as_secs_f64(), Totals::default(), Received::default())
            }
        };
        let rate = |new: u64, old: u64| {
            format!("{:.2}", new.saturating_sub(old) as f64 / seconds.max(1e-3))
        };

        // Input.
        let mut input = Draft::new();
        let silent = status.since_last_pair();
        if silent.as_secs_f64() > config.input_timeout {
            input.say(
                DiagnosticStatus::ERROR,
                format_args!("no stereo pair for {:.1} s", silent.as_secs_f64()),
            );
        }
        for (topic, type_name, publishers, others) in &around.inputs {
            if let Some(other) = others.first() {
                input.say(
                    DiagnosticStatus::ERROR,
                    format_args!("{topic} is published as {other}, wanted is {type_name}: remap it or set image_transport"),
                );
            } else if *publishers == 0 && silent.as_secs_f64() > config.input_timeout {
                input.say(DiagnosticStatus::ERROR, format_args!("nobody publishes {topic}"));
            }
        }
        if let Some(text) = status.explain_pairing() {
            input.say(DiagnosticStatus::WARN, text);
        }
        if totals.dropped.values().sum::<u64>() > before.dropped.values().sum() {
            input.say_again(DiagnosticStatus::WARN, "frames were dropped, see the reasons below");
        }
        input.value("pairs", totals.paired);
        input.value("pair rate (Hz)", rate(totals.paired, before.paired));
        input.value("left rate (Hz)", rate(received.left, received_before.left));
        input.value("right rate (Hz)", rate(received.right, received_before.right));
        if let Some(state) = &state {
            input.value("left images", received.left);
            input.value("right images", received.right);
            input.value("left without pair", state.counts.left.lost());
            input.value("right without pair", state.counts.right.lost());
            input.value("pairs waiting for camera info", state.waiting_for_info);
            input.value("jumps back in time", state.counts.jumps);
        }
        input.value("pairs replaced by a newer one", totals.displaced);
        for (reason, count) in &totals.dropped {
            input.value(format!("dropped: {reason}"), count);
        }
        for (topic, _, publishers, _) in &around.inputs {
            input.value(format!("publishers of {topic}"), publishers);
        }

        // Calibration.
        let mut calibration = Draft::new();
        match &*lock(&status.calibration) {
            None => {
                // Before the first image there is nothing to calibrate.
                let missing = match state.as_ref().map(|s| s.has_info) {
                    None | Some([true, true]) => None,
                    Some([false, true]) => Some("images come, but no left camera info"),
                    Some([true, false]) => Some("images come, but no right camera info"),
                    Some([false, false]) => Some("images come, but no camera info"),
                };
                if let Some(missing) = missing {
                    calibration.say(DiagnosticStatus::WARN, missing);
                }
            }
            Some(Ok(text)) => calibration.value("rig", text),
            Some(Err(text)) => calibration.say_again(DiagnosticStatus::ERROR, text),
        }
        if let Some(found) = status.alignment() {
            alignment(&found, config.rectify, &mut calibration);
        }

        // Processing.
        let work = std::mem::take(&mut *lock(&status.work));
        let mut processing = processing(&work);
        processing.value("frames", totals.processed);
        processing.value("frame rate (Hz)", rate(totals.processed, before.processed));
        processing.value("regions", totals.regions);
        let latency = std::mem::take(&mut *lock(&status.latency));
        if latency.results > 0 {
            let mean = latency.sum_ms / f64::from(latency.results);
            processing.value("latency from pair to regions (ms)", format_args!("{mean:.2}"));
            processing.value("longest latency (ms)", format_args!("{:.2}", latency.longest_ms));
            processing.value(
                "longest latency beyond the stages (ms)",
                format_args!("{:.2}", latency.longest_beyond_ms),
            );
        }
        processing.value("ground", ground(lock(&status.ground).as_ref()));

        // Transport.
        let mut transport = Draft::new();
        if let Some(bytes) = around.receive_buffer_bytes {
            transport.value("receive buffer (bytes)", bytes);
            if let Some(advice) = receive_buffer_advice(bytes) {
                transport.say_again(DiagnosticStatus::WARN, advice);
            }
        }
        if let Some(errors) = around.receive_buffer_errors {
            let first = *self.first_receive_buffer_errors.get_or_insert(errors);
            transport.value(
                "datagrams lost to full receive buffers on this machine (RcvbufErrors)",
                errors.saturating_sub(first),
            );
        }
        if totals.would_block > before.would_block {
            transport.say(
                DiagnosticStatus::WARN,
                "a subscriber is too slow: messages were not published",
            );
        }
        if totals.oversized > before.oversized {
            transport.say(
                DiagnosticStatus::WARN,
                format_args!(
                    "regions messages of up to {} bytes may not arrive with small receive buffers: lower regions.max_count, raise regions.contour_tolerance or switch regions.publish_masks off",
                    totals.largest_regions_bytes
                ),
            );
        }
        lock(&status.echo).report(now, &mut transport);
        transport.value("not published: subscriber too slow", totals.would_block);
        transport.value("not published: other errors", totals.publish_errors);
        transport.value("results replaced by a newer one", totals.output_displaced);
        transport.value("largest regions message (bytes)", totals.largest_regions_bytes);
        for (topic, count) in &totals.published {
            transport.value(format!("published on {topic}"), count);
        }

        self.last = Some((now, totals, received));
        let drafts = [
            ("Input", input),
            ("Calibration", calibration),
            ("Processing", processing),
            ("Transport", transport),
        ];
        let mut message = DiagnosticArray {
            header: Header { stamp: stamp.into(), frame_id: String::new() },
            status: Vec::with_capacity(drafts.len()),
        };
        for (level, (name, draft)) in self.levels.iter_mut().zip(drafts) {
            if draft.level > *level && !draft.news.is_empty() {
                tracing::warn!("{name}: {}", draft.news);
            }
            *level = draft.level;
            message.status.push(DiagnosticStatus {
                level: draft.level,
                name: format!("{}: {name}", self.node),
                message: if draft.message.is_empty() { "OK".to_owned() } else { draft.message },
                hardware_id: "stereo camera".to_owned(),
                values: draft.values,
            });
        }
        message
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metric::Epipolar;
    use crate::stage::ground::{Footing, GroundState, Plane};

    fn status<'a>(message: &'a DiagnosticArray, name: &str) -> &'a DiagnosticStatus {
        message.status.iter().find(|s| s.name.ends_with(name)).unwrap()
    }

    #[test]
    fn the_kernel_counter_is_found_by_its_column() {
        let text = "Ip: Forwarding\nIp: 1\nUdp: InDatagrams NoPorts InErrors OutDatagrams RcvbufErrors SndbufErrors\nUdp: 10 2 3 40 57 0\nUdpLite: RcvbufErrors\nUdpLite: 1\n";
        assert_eq!(Surroundings::receive_buffer_errors_in(text), Some(57));
        assert_eq!(Surroundings::receive_buffer_errors_in("Udp: A\n"), None);
    }

    #[test]
    fn silence_wrong_types_and_small_buffers_are_named() {
        let node_status = NodeStatus::default();
        let mut reporter = Reporter::new("salient_stereo");
        let config = Config { input_timeout: 0.0, ..Config::default() };
        let around = Surroundings {
            receive_buffer_bytes: Some(212_992),
            receive_buffer_errors: Some(5),
            inputs: vec![
                ("/left/image_rect".into(), "sensor_msgs/msg/Image", 0, vec![]),
                (
                    "/right/image_rect".into(),
                    "sensor_msgs/msg/Image",
                    0,
                    vec!["sensor_msgs/msg/CompressedImage".into()],
                ),
            ],
        };
        let message = reporter.report(Stamp(1), &node_status, &config, &around);
        let input = status(&message, "Input");
        assert_eq!(input.level, DiagnosticStatus::ERROR);
        for part in ["no stereo pair", "nobody publishes /left/image_rect", "CompressedImage"] {
            assert!(input.message.contains(part), "{}", input.message);
        }
        assert!(status(&message, "Transport").message.contains("sysctl -w net.core.rmem_max"));
    }

    #[test]
    fn drops_are_counted_by_reason_and_reasons_are_bounded() {
        let node_status = NodeStatus::default();
        for i in 0..100 {
            node_status.drop_frame(format!("reason {i}"));
        }
        node_status.drop_frame("reason 1".into());
        let totals = node_status.totals();
        assert!(totals.dropped.len() <= 33);
        assert_eq!((totals.dropped["reason 1"], totals.dropped.values().sum::<u64>()), (2, 101));
        let message = Reporter::new("n").report(
            Stamp(1),
            &node_status,
            &Config::default(),
            &Surroundings::default(),
        );
        let input = status(&message, "Input");
        assert_eq!(input.level, DiagnosticStatus::WARN);
        assert!(input.values.iter().any(|v| v.key == "dropped: reason 1" && v.value == "2"));
    }

    #[test]
    fn rows_that_are_apart_are_a_warning_unless_it_was_one_bad_measurement() {
        let found =
            |error_px| Epipolar { offset_px: error_px, error_px, disparity_px: 9.0, points: 30 };
        let node_status = NodeStatus::default();
        let mut reporter = Reporter::new("n");
        let mut level = || {
            let around = Surroundings::default();
            let message = reporter.report(Stamp(1), &node_status, &Config::default(), &around);
            let calibration = status(&message, "Calibration");
            (calibration.level, calibration.message.clone())
        };
        for error in [0.2, 0.3, 5.0] {
            node_status.note_alignment(found(error));
        }
        assert_eq!(level().0, DiagnosticStatus::OK);
        for _ in 0..5 {
            node_status.note_alignment(found(1.4));
        }
        let (level, message) = level();
        assert_eq!(level, DiagnosticStatus::WARN);
        assert!(message.contains("1.4 px apart (median of 30 points)"), "{message}");
    }

    #[test]
    fn latency_and_ground_are_told_of_the_last_second() {
        let node_status = NodeStatus::default();
        let mut reporter = Reporter::new("n");
        let mut values = || {
            let around = Surroundings::default();
            let message = reporter.report(Stamp(1), &node_status, &Config::default(), &around);
            let values = status(&message, "Processing").values.clone();
            move |key: &str| values.iter().find(|v| v.key == key).map(|v| v.value.clone())
        };
        node_status.note_latency(10.0, 8.0);
        node_status.note_latency(20.0, 19.5);
        let first = values();
        assert_eq!(first("latency from pair to regions (ms)").unwrap(), "15.00");
        assert_eq!(first("longest latency (ms)").unwrap(), "20.00");
        assert_eq!(first("longest latency beyond the stages (ms)").unwrap(), "2.00");
        assert_eq!(first("ground").unwrap(), "not looked for");
        let plane = Plane { a: 0.1, b: 0.0, c: 0.0, camera_height_m: 1.65, distance_m: 12.0 };
        node_status.note_ground(Some(Footing { state: GroundState::Measured, plane: Some(plane) }));
        let second = values();
        assert_eq!(second("latency from pair to regions (ms)"), None);
        assert_eq!(second("ground").unwrap(), "plane, camera 1.65 m above it");
        node_status.note_ground(Some(Footing::default()));
        assert_eq!(values()("ground").unwrap(), "no plane");
    }

    #[test]
    fn a_calibration_fault_is_an_error_and_news_once() {
        let node_status = NodeStatus::default();
        assert!(node_status.set_calibration(Err("the baseline is zero".into())));
        assert!(!node_status.set_calibration(Err("the baseline is zero".into())));
        let message = Reporter::new("n").report(
            Stamp(1),
            &node_status,
            &Config::default(),
            &Surroundings::default(),
        );
        assert_eq!(status(&message, "Calibration").level, DiagnosticStatus::ERROR);
        assert!(node_status.set_calibration(Ok("f 400 px, B 0.5 m".into())));
    }
}
