//! Under which circumstances something is measured.

use std::fmt::Write as _;
use std::fs;
use std::process::Command;

use sha2::{Digest, Sha256};

use super::part::Run;
use crate::config::Config;
use crate::simd;

/// Bytes of a fingerprint; in hexadecimal it is twice as long.
const FINGERPRINT: usize = 6;

impl Run {
    /// What all methods of this process have in common.
    pub fn here() -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: commit(),
            executable: executable(),
            machine: machine(),
            ..Self::default()
        }
    }

    /// The same with the parameters of one method.
    #[must_use]
    pub fn with_config(&self, config: &Config, threads: usize) -> Self {
        let values = config.flatten();
        let defaults = Config::default().flatten();
        let mut hash = Sha256::new();
        let mut changed = Vec::new();
        for ((name, value), (_, default)) in values.iter().zip(&defaults) {
            let text = format!("{name}={value}");
            hash.update(&text);
            hash.update(b"\n");
            if value != default {
                changed.push(text.replace('"', ""));
            }
        }
        Self { config: hex(&hash.finalize()), changed, threads, ..self.clone() }
    }

    /// True when a measurement made then need not be made again now.
    pub fn repeats(&self, now: &Self) -> bool {
        (&self.executable, &self.config, self.seed, self.threads)
            == (&now.executable, &now.config, now.seed, now.threads)
            && self.machine == now.machine
    }
}

/// Processor, number of cores, and the instructions in use.
fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == "model name").then(|| value.trim().to_owned())
    });
    let model = model.unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    // The level's debug text is its name and a token: `Avx2(…)`.
    let level = format!("{:?}", simd::detect());
    let level = level.split_once('(').map_or(level.as_str(), |(name, _)| name).trim();
    format!("{model}, {cores} cores, {level}")
}

/// The commit of the checkout that this is run in; with `+` when files differ
/// from it. Empty outside of one.
fn commit() -> String {
    let git = |args: &[&str]| {
        let output = Command::new("git").args(args).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(commit) = git(&["rev-parse", "--short=10", "HEAD"]) else { return String::new() };
    let dirty = git(&["status", "--porcelain", "--untracked-files=no", "src", "Cargo.lock"])
        .is_none_or(|changes| !changes.is_empty());
    if dirty { commit + "+" } else { commit }
}

/// Fingerprint of this program: another build may measure something else.
fn executable() -> String {
    let bytes = std::env::current_exe().and_then(fs::read);
    bytes.map_or_else(|_| String::new(), |bytes| hex(&Sha256::digest(bytes)))
}

fn hex(digest: &[u8]) -> String {
    digest.iter().take(FINGERPRINT).fold(String::new(), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}
