//! The commands: pairings of a source and sinks, and the process's exit code.

pub mod bench;
pub mod demo;
pub mod doctor;
pub mod evaluate;
pub mod export_bag;
pub mod install_ament;
pub mod node;
mod print;
pub mod render;
pub mod replay;
mod settings;
mod summary;
mod watch;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use thiserror::Error;

pub use settings::Settings;

use crate::ros::args::{LogArgs, Severity};
use crate::ros::log;

/// Which things in view matter, and how far they are: saliency-guided stereo for ROS 2.
///
/// Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but frames were lost or skipped.
#[derive(Debug, Parser)]
#[command(name = "salient_stereo", version, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the real node on a bag that ships with the project, and show what it sees.
    Demo(demo::DemoArgs),
    /// Run the ROS 2 node (as `ros2 run salient_stereo salient_stereo_node` does).
    Node(node::NodeArgs),
    /// Run a bag through the pipeline, without a network, to an output bag and a report.
    Replay(replay::ReplayArgs),
    /// Say what is wrong with a bag, or with the live graph, and how to mend it.
    Doctor(doctor::DoctorArgs),
    /// Write a scene of a data set, or a pair of images, as a ROS 2 bag.
    ExportBag(export_bag::ExportBagArgs),
    /// Write an ament overlay, so that `ros2 run` and `ros2 launch` find the node.
    InstallAment(install_ament::InstallAmentArgs),
    /// Measure milliseconds per stage.
    Bench(bench::BenchArgs),
    /// Measure methods on data with truth, and make the tables.
    Evaluate(Box<evaluate::EvaluateArgs>),
    /// Render one of the project's own scenes as a bag with truth topics.
    Render(render::RenderArgs),
}

/// Why a command did not do its work.
#[derive(Debug, Error)]
pub enum CommandError {
    /// Wrong arguments, parameters or parameter files: exit code 2.
    #[error("{0}")]
    Usage(String),
    /// Anything else: exit code 1.
    #[error("{0}")]
    Failed(#[source] Box<dyn std::error::Error + Send + Sync>),
}

impl CommandError {
    /// A failure from any error.
    pub fn failed(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::Failed(error.into())
    }
}

/// How a command ended that did its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Everything went through.
    Done,
    /// Frames were lost or skipped on the way; what and why was printed.
    DoneWithLosses,
}

/// Runs the command and turns its end into an exit code.
pub fn run(cli: Cli) -> ExitCode {
    if !matches!(cli.command, Command::Node(_)) {
        // These commands print their results themselves: the log is for what is wrong.
        log::init(&LogArgs { level: Some(Severity::Warn), ..LogArgs::default() }, "salient_stereo");
    }
    let result = match cli.command {
        Command::Demo(args) => demo::run(&args),
        Command::Node(args) => return node::run_to_exit(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Doctor(args) => doctor::run(&args),
        Command::ExportBag(args) => export_bag::run(&args),
        Command::InstallAment(args) => install_ament::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Render(args) => render::run(&args).map(|()| Outcome::Done).map_err(|e| {
            if e.is_usage() { CommandError::Usage(e.to_string()) } else { CommandError::failed(e) }
        }),
    };
    conclude(result)
}

/// Prints an error and gives the exit code.
pub fn conclude(result: Result<Outcome, CommandError>) -> ExitCode {
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::DoneWithLosses) => ExitCode::from(3),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(if matches!(error, CommandError::Usage(_)) { 2 } else { 1 })
        }
    }
}
