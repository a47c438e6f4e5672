//! The command line tool `salient_stereo`.

use std::process::ExitCode;

use clap::Parser;
use salient_stereo::command::{self, Cli};

fn main() -> ExitCode {
    command::run(Cli::parse())
}
