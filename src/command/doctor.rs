//! `doctor`: looks at a bag, or at the live graph as the node would see it, and
//! names each fault with its fix.

mod bag;
mod check;
mod finding;
mod graph;
mod remedy;

use std::path::PathBuf;

use clap::Args;

pub use bag::examine_bag;
pub use finding::{Finding, Severity};
pub use graph::{Patient, examine_graph};

use crate::command::print::say;
use crate::command::replay::TopicArgs;
use crate::command::settings::{Settings, bag_options};
use crate::command::watch::stop_on_signal;
use crate::command::{CommandError, Outcome};
use crate::config::Config;
use crate::ros::NODE_NAME;
use crate::ros::args::RosArgs;
use crate::ros::environment::Environment;

/// Arguments of `doctor`.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Bag to look at, an .mcap file or a bag folder; without it, the live graph
    bag: Option<PathBuf>,
    /// Listen to the live graph for this long
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0)]
    seconds: f64,
    #[command(flatten)]
    topics: TopicArgs,
    #[command(flatten)]
    settings: Settings,
    /// As for the node: --ros-args -r from:=to -p name:=value --params-file FILE …
    #[arg(last = true, value_name = "ROS ARGUMENTS")]
    ros: Vec<String>,
}

/// Runs the command: exit code 0 when all is well, 3 with warnings only, 1 with
/// a fault that keeps the node from working.
///
/// # Errors
/// A fault that was found, unusable arguments, or a graph that cannot be joined.
pub fn run(args: &DoctorArgs) -> Result<Outcome, CommandError> {
    if !(args.seconds.is_finite() && (0.1..=3600.0).contains(&args.seconds)) {
        return Err(CommandError::Usage(format!(
            "--seconds {} is not in 0.1 to 3600",
            args.seconds
        )));
    }
    let usage = |error: &dyn std::error::Error| CommandError::Usage(error.to_string());
    let base = args.settings.config(Config::default())?;
    let (ros, unknown) = RosArgs::split(args.ros.iter().cloned()).map_err(|e| usage(&e))?;
    if let Some(unknown) = unknown.first() {
        return Err(CommandError::Usage(format!(
            "'{unknown}' after '--': ROS arguments begin with --ros-args"
        )));
    }
    let names = ros.names("/", NODE_NAME).map_err(|e| usage(&e))?;
    let (config, warnings) = ros.config(&base, &names).map_err(|e| usage(&e))?;
    for warning in warnings {
        eprintln!("note: {warning}");
    }
    let findings = if let Some(bag) = &args.bag {
        let options = bag_options(&config, args.topics.topics())?;
        examine_bag(bag, &config, options)
    } else {
        let environment = Environment::of_process(ros.enclave.as_deref()).map_err(|e| usage(&e))?;
        let stop = stop_on_signal()?;
        say(format_args!(
            "listening on domain {}{} for {} s as the node would …",
            environment.domain_id,
            if environment.localhost { ", this machine only" } else { "" },
            args.seconds
        ));
        let patient = Patient { remaps: &ros.remaps, names: &names, config: &config };
        examine_graph(&patient, &environment, args.seconds, &stop).map_err(CommandError::failed)?
    };
    for finding in &findings {
        say(format_args!("{finding}"));
    }
    let count = |severity| findings.iter().filter(|f| f.severity == severity).count();
    match (count(Severity::Fault), count(Severity::Warning)) {
        (0, 0) => Ok(Outcome::Done),
        (0, _) => Ok(Outcome::DoneWithLosses),
        (1, _) => Err(CommandError::failed("one fault was found")),
        (faults, _) => Err(CommandError::failed(format!("{faults} faults were found"))),
    }
}
