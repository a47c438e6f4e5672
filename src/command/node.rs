//! `node`: the ROS 2 node in the foreground, until a signal ends it.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use thiserror::Error;

use crate::command::print::say;
use crate::config::Config;
use crate::ros::NODE_NAME;
use crate::ros::args::{ArgsError, RosArgs};
use crate::ros::environment::{Environment, EnvironmentError};
use crate::ros::log;
use crate::ros::runtime::{NodeOptions, NodeRuntime, RuntimeError};

const HELP: &str = "\
The salient_stereo node: stereo images in, salient regions with their distance out.

Usage: salient_stereo_node [--ros-args ARGUMENTS… [--]]

  -r, --remap FROM:=TO          rename a topic, a service, __ns or __node
  -p, --param NAME:=VALUE       set a parameter
      --params-file FILE        set the parameters of a YAML file (config/*.yaml)
  -e, --enclave ENCLAVE         where in the keystore the node's identity is (DDS security)
      --log-level [LOGGER:=]LEVEL
      --enable-rosout-logs, --disable-rosout-logs, --enable-stdout-logs, --disable-stdout-logs

Environment: ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_LOCALHOST_ONLY, RMW_IMPLEMENTATION,
ROS_SECURITY_ENABLE, ROS_SECURITY_STRATEGY, ROS_SECURITY_KEYSTORE, ROS_SECURITY_ENCLAVE_OVERRIDE,
ZENOH_SESSION_CONFIG_URI, ZENOH_CONFIG_OVERRIDE";

/// The command line behind `node`.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct NodeArgs {
    /// ROS 2 arguments: --ros-args -r from:=to -p name:=value --params-file FILE …
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ROS ARGUMENTS")]
    pub arguments: Vec<String>,
}

impl NodeArgs {
    /// The arguments of this process without its name.
    pub fn of_process() -> Self {
        let text = |argument: std::ffi::OsString| argument.to_string_lossy().into_owned();
        Self { arguments: std::env::args_os().skip(1).map(text).collect() }
    }
}

/// Why the node did not run.
#[derive(Debug, Error)]
pub enum NodeCommandError {
    /// The command line or a parameter file.
    #[error(transparent)]
    Arguments(#[from] ArgsError),
    /// An environment variable.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// The node itself.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// Signals cannot be caught, so the node could not end cleanly.
    #[error("cannot catch signals: {0}")]
    Signals(#[from] ctrlc::Error),
}

impl NodeCommandError {
    /// True when the fault is in what the user has written (exit code 2).
    pub const fn is_usage(&self) -> bool {
        matches!(self, Self::Arguments(_) | Self::Environment(_))
    }
}

/// Runs the node and turns its end into the exit code of the process.
pub fn run_to_exit(args: &NodeArgs) -> ExitCode {
    run(args).unwrap_or_else(|error| {
        eprintln!("error: {error}");
        ExitCode::from(if error.is_usage() { 2 } else { 1 })
    })
}

/// Runs the node until SIGINT or SIGTERM; a second signal ends the process at once.
///
/// # Errors
/// When arguments, environment or the graph keep it from starting.
pub fn run(args: &NodeArgs) -> Result<ExitCode, NodeCommandError> {
    let (ros, rest) = RosArgs::split(args.arguments.iter().cloned())?;
    if rest.iter().any(|argument| argument == "--help" || argument == "-h") {
        say(format_args!("{HELP}"));
        return Ok(ExitCode::SUCCESS);
    }
    let names = ros.names("/", NODE_NAME)?;
    let (config, warnings) = ros.config(&Config::default(), &names)?;
    let qos_overrides = ros.qos_overrides(&names)?;
    let environment = Environment::of_process(ros.enclave.as_deref())?;
    log::init(&ros.log, &names.logger());
    for argument in rest {
        tracing::warn!("argument '{argument}' stands outside --ros-args and means nothing here");
    }
    for warning in warnings {
        tracing::warn!("{warning}");
    }

    let signals = Arc::new(AtomicUsize::new(0));
    {
        let signals = Arc::clone(&signals);
        ctrlc::set_handler(move || {
            if signals.fetch_add(1, Ordering::AcqRel) > 0 {
                std::process::exit(130);
            }
        })?;
    }
    let options = NodeOptions {
        qos_overrides,
        rosout: ros.log.rosout,
        ..NodeOptions::new(config, names, environment)
    };
    let mut runtime = NodeRuntime::start(options)?;
    let failed = loop {
        thread::sleep(Duration::from_millis(50));
        if signals.load(Ordering::Acquire) > 0 {
            break None;
        }
        if let Some(name) = runtime.failed_thread() {
            break Some(name);
        }
    };
    if let Some(name) = failed {
        tracing::error!("the {name} thread has ended: the node stops");
    }
    let stopped = runtime.stop();
    let totals = runtime.status().totals();
    tracing::info!(
        "{} pairs, {} frames processed, {} regions; {} pairs replaced by newer ones, {} dropped",
        totals.paired,
        totals.processed,
        totals.regions,
        totals.displaced,
        totals.dropped.values().sum::<u64>(),
    );
    if !stopped {
        tracing::error!("a thread did not end in time");
    }
    Ok(if stopped && failed.is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
