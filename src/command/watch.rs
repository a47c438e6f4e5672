//! What a person sees and a script reads of a run: progress, interruption, JSON.

use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::Value;

use crate::command::CommandError;

/// A flag that Ctrl-C and SIGTERM set.
///
/// # Errors
/// When the signal handlers cannot be installed.
pub fn stop_on_signal() -> Result<Arc<AtomicBool>, CommandError> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .map_err(CommandError::failed)?;
    Ok(stop)
}

/// A progress bar over `steps`, drawn only when stderr is a terminal.
pub fn progress_bar(steps: u64) -> ProgressBar {
    let target = if io::stderr().is_terminal() {
        ProgressDrawTarget::stderr_with_hz(10)
    } else {
        ProgressDrawTarget::hidden()
    };
    let style =
        ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} (still {eta})  {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(steps), target).with_style(style)
}

/// Writes a JSON document to a file, or to stdout for `-`.
///
/// # Errors
/// When it cannot be written.
pub fn write_json(path: &Path, value: &Value) -> Result<(), CommandError> {
    let text = format!("{value:#}\n");
    if path.as_os_str() == "-" {
        io::stdout().write_all(text.as_bytes()).map_err(CommandError::failed)
    } else {
        write_file(path, text.as_bytes())
    }
}

/// Writes a file, making its folder if there is none.
///
/// # Errors
/// When it cannot be written; the text names the file.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), CommandError> {
    make_parent(path)?;
    std::fs::write(path, bytes)
        .map_err(|e| CommandError::failed(format!("cannot write {}: {e}", path.display())))
}

/// Makes the folder that a file is to stand in.
///
/// # Errors
/// When it cannot be made; the text names the folder.
pub fn make_parent(path: &Path) -> Result<(), CommandError> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => std::fs::create_dir_all(folder)
            .map_err(|e| CommandError::failed(format!("cannot make {}: {e}", folder.display()))),
        _ => Ok(()),
    }
}
