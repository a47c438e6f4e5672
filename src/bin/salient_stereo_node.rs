//! The ROS 2 node, as `ros2 run` and launch files start it.

use std::process::ExitCode;

use salient_stereo::command::node::{NodeArgs, run_to_exit};

fn main() -> ExitCode {
    run_to_exit(&NodeArgs::of_process())
}
