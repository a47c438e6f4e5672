//! The ROS 2 node, as `ros2 run` and launch files start it.

use std::process::ExitCode;

use salient_stereo::command::node::{NodeArgs, run};

fn main() -> ExitCode {
    run(&NodeArgs::of_process()).unwrap_or_else(|error| {
        eprintln!("salient_stereo_node: {error}");
        ExitCode::from(if error.is_usage() { 2 } else { 1 })
    })
}
