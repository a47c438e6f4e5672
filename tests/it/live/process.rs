//! The node as a process: its arguments, its log, its end.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::{PATIENCE, domain};

/// Kills what a failed test leaves behind.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

fn node(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_salient_stereo_node"));
    command
        .args(arguments)
        .env("ROS_DOMAIN_ID", domain(7).to_string())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        .env_remove("RUST_LOG")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

#[test]
fn signals_end_the_node_cleanly_with_its_counts() {
    for signal in ["-TERM", "-INT"] {
        let arguments = ["--ros-args", "-r", "__ns:=/robot", "-r", "__node:=eye", "--"];
        let mut running = Running(node(&arguments).spawn().unwrap());
        let mut log = BufReader::new(running.0.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains("/robot/eye on domain") {
            line.clear();
            assert!(log.read_line(&mut line).unwrap() > 0, "the node ended by itself");
        }
        assert!(line.starts_with("[INFO] ["), "{line}");
        assert!(line.contains("[robot.eye]: ") && line.contains("this machine only"), "{line}");
        let id = running.0.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().unwrap().success());
        let deadline = Instant::now() + PATIENCE;
        let status = loop {
            if let Some(status) = running.0.try_wait().unwrap() {
                break status;
            }
            assert!(Instant::now() < deadline, "{signal} was not heard");
            thread::sleep(Duration::from_millis(10));
        };
        let mut rest = String::new();
        log.read_to_string(&mut rest).unwrap();
        assert!(status.success(), "{signal}: {status} {rest}");
        assert!(rest.contains("0 pairs, 0 frames processed"), "{rest}");
    }
}

#[test]
fn wrong_arguments_and_parameters_end_in_a_usage_error_that_names_them() {
    for (arguments, named) in [
        (&["--ros-args", "-p", "saliency.threshold:=1.5"][..], "[0, 1]"),
        (&["--ros-args", "-p", "no.such.parameter:=1"], "no.such.parameter"),
        (&["--ros-args", "--params-file", "/no/such/file.yaml"], "/no/such/file.yaml"),
        (&["--ros-args", "-r", "__ns:=robot eye"], "robot eye"),
    ] {
        let run = node(arguments).output().unwrap();
        let text = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{arguments:?}: {text}");
        assert!(text.contains(named), "{arguments:?}: {text}");
    }
}
