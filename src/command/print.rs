//! What commands say on stdout.

use std::fmt::Arguments;
use std::io::{Write, stdout};

/// Prints a line. A reader that has gone (`| head`) ends the printing, not the
/// work: the output bag is still finished, and the exit code says how it went.
pub fn say(line: Arguments<'_>) {
    let _ = writeln!(stdout(), "{line}");
}

/// Prints text that brings its line ends along.
pub fn put(text: Arguments<'_>) {
    let _ = write!(stdout(), "{text}").and_then(|()| stdout().flush());
}
