//! `install-ament`: the ament overlay, so that `ros2 run` and `ros2 launch` find
//! the node without colcon.
//!
//! The small files travel inside the executable; the two executables are copied
//! from beside the running one.

mod files;
mod setup;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use thiserror::Error;

use crate::command::print::say;
use crate::command::{CommandError, Outcome};
use files::SHARED;
use setup::SCRIPTS;

/// Name of the package.
const PACKAGE: &str = "salient_stereo";

/// Executables that `ros2 run` is to find.
const EXECUTABLES: [&str; 2] = ["salient_stereo_node", "salient_stereo"];

/// Arguments of `install-ament`.
#[derive(Debug, Args)]
pub struct InstallAmentArgs {
    /// Folder of the overlay: a new one, or an install folder of colcon
    #[arg(long, value_name = "DIR")]
    prefix: PathBuf,
}

/// Why the overlay could not be written.
#[derive(Debug, Error)]
pub enum InstallError {
    /// An executable is missing.
    #[error(
        "{} is not beside this executable: build both with cargo build --release", path.display()
    )]
    NoExecutable {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// The running executable cannot be found.
    #[error("cannot find this executable: {source}")]
    Unknown {
        /// What the system said.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// What was installed.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Installed {
    /// Files written.
    pub written: Vec<PathBuf>,
    /// Files of others that were left alone.
    pub kept: Vec<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When an executable is missing or a file cannot be written.
pub fn run(args: &InstallAmentArgs) -> Result<Outcome, CommandError> {
    let this = std::env::current_exe()
        .map_err(|source| CommandError::failed(InstallError::Unknown { source }))?;
    let folder = this.parent().unwrap_or(Path::new("."));
    let installed = install(&args.prefix, folder).map_err(CommandError::failed)?;
    say(format_args!("{} files written to {}", installed.written.len(), args.prefix.display()));
    for kept in &installed.kept {
        say(format_args!("{} belongs to somebody else and was left alone", kept.display()));
    }
    let prefix = fs::canonicalize(&args.prefix).unwrap_or_else(|_| args.prefix.clone());
    say(format_args!("source {}/setup.bash", prefix.display()));
    say(format_args!("ros2 launch {PACKAGE} salient_stereo.launch.py namespace:=/stereo"));
    Ok(Outcome::Done)
}

/// Writes the overlay to `prefix`, with the executables of `folder`.
///
/// # Errors
/// When an executable is missing or a file cannot be written.
pub fn install(prefix: &Path, folder: &Path) -> Result<Installed, InstallError> {
    let mut installed = Installed::default();
    let mut place = |to: PathBuf, write: &dyn Fn(&Path) -> io::Result<()>| {
        let made = to.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| write(&to));
        made.map_err(|source| InstallError::Write { path: to.clone(), source })?;
        installed.written.push(to);
        Ok(())
    };
    for name in EXECUTABLES {
        let from = folder.join(name).with_extension(std::env::consts::EXE_EXTENSION);
        if !from.is_file() {
            return Err(InstallError::NoExecutable { path: from });
        }
        let to = prefix.join("lib").join(PACKAGE).join(name);
        // A running executable cannot be written over, but it can be replaced.
        place(to.with_extension(std::env::consts::EXE_EXTENSION), &|to| {
            let fresh = to.with_extension("new");
            fs::copy(&from, &fresh)?;
            fs::rename(&fresh, to)
        })?;
    }
    // The marker by which ament finds the package.
    let index = prefix.join("share/ament_index/resource_index/packages");
    place(index.join(PACKAGE), &|to| fs::write(to, ""))?;
    let share = prefix.join("share").join(PACKAGE);
    for (name, text) in SHARED {
        place(share.join(name), &|to| fs::write(to, text))?;
    }
    for (name, text) in SCRIPTS {
        let to = prefix.join(name);
        match fs::read_to_string(&to) {
            Ok(old) if !old.contains(setup::MARK) => installed.kept.push(to),
            _ => {
                let made = fs::write(&to, text);
                made.map_err(|source| InstallError::Write { path: to.clone(), source })?;
                installed.written.push(to);
            }
        }
    }
    Ok(installed)
}
