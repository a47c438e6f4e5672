//! One thing that the doctor has to say.

use std::fmt;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// As it should be.
    Well,
    /// The node works, but loses something or is less exact.
    Warning,
    /// The node cannot work.
    Fault,
}

/// What was found and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// What was found, with its numbers.
    pub what: String,
    /// What to do; empty when `what` says it, or nothing is to be done.
    pub fix: String,
}

impl Finding {
    /// Something that is as it should be.
    pub fn well(what: impl Into<String>) -> Self {
        Self { severity: Severity::Well, what: what.into(), fix: String::new() }
    }

    /// Something that costs frames or exactness.
    pub fn warning(what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, what: what.into(), fix: fix.into() }
    }

    /// Something that keeps the node from working.
    pub fn fault(what: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { severity: Severity::Fault, what: what.into(), fix: fix.into() }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = match self.severity {
            Severity::Well => "ok     ",
            Severity::Warning => "warning",
            Severity::Fault => "FAULT  ",
        };
        write!(f, "{word}  {}", self.what)?;
        if self.fix.is_empty() { Ok(()) } else { write!(f, "\n         fix: {}", self.fix) }
    }
}
