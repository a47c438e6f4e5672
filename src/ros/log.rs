//! Logging, set up in one place: `tracing` events of this crate in the line
//! format of ROS 2 on stderr and as `/rosout` messages, and what the transport
//! libraries report thinned out, because `RustDDS` writes tens of thousands of
//! lines when packets are lost.

use std::fmt::Write as _;
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::{Duration, Instant};

use tracing::field::{Field, Visit};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt as _};
use tracing_subscriber::util::SubscriberInitExt as _;

use crate::ros::args::{LogArgs, Severity};
use crate::ros::endpoint::Publisher;
use crate::ros::message::rcl_interfaces::Log;
use crate::ros::time::NodeClock;

/// Lines of the transport libraries that are shown per window.
const FOREIGN_LINES: u32 = 3;
const FOREIGN_WINDOW: Duration = Duration::from_secs(5);

/// Starts logging for this process under the name of a logger (see
/// [`crate::ros::names::Names::logger`]). Later calls have no effect.
///
/// `RUST_LOG`, when set, decides what is shown instead of `args`.
pub fn init(args: &LogArgs, logger: &str) {
    let own = match args.threshold(logger) {
        Severity::Debug => LevelFilter::DEBUG,
        Severity::Info => LevelFilter::INFO,
        Severity::Warn => LevelFilter::WARN,
        Severity::Error | Severity::Fatal => LevelFilter::ERROR,
    };
    let layer = RosLayer {
        logger: logger.to_owned(),
        stderr: args.stdout,
        foreign: Mutex::new(Thinning::default()),
    };
    let result = if std::env::var_os(EnvFilter::DEFAULT_ENV).is_some() {
        tracing_subscriber::registry().with(EnvFilter::from_default_env()).with(layer).try_init()
    } else {
        let targets = Targets::new().with_default(LevelFilter::ERROR).with_target(OWN_TARGET, own);
        tracing_subscriber::registry().with(targets).with(layer).try_init()
    };
    // Another subscriber is in place, as in tests: it decides.
    drop(result);
}

const OWN_TARGET: &str = env!("CARGO_CRATE_NAME");

static ROSOUT: RwLock<Option<Rosout>> = RwLock::new(None);

struct Rosout {
    publisher: Publisher<Log>,
    logger: String,
    clock: Arc<NodeClock>,
}

/// Sends this crate's events to `/rosout` from now on.
pub(crate) fn connect_rosout(publisher: Publisher<Log>, logger: String, clock: Arc<NodeClock>) {
    *ROSOUT.write().unwrap_or_else(PoisonError::into_inner) =
        Some(Rosout { publisher, logger, clock });
}

/// Ends what [`connect_rosout`] began.
pub(crate) fn disconnect_rosout() {
    // Dropped outside the lock: the end of a publisher logs.
    let old = ROSOUT.write().unwrap_or_else(PoisonError::into_inner).take();
    drop(old);
}

/// Set when a node leaves the graph, until the next one joins: what the
/// transport then says about vanished counterparts and groups is of no use.
static LEAVING: AtomicBool = AtomicBool::new(false);

/// Shows nothing of the transport libraries while a node takes itself down.
pub(crate) fn mute_transport(mute: bool) {
    LEAVING.store(mute, Ordering::Relaxed);
}

struct RosLayer {
    logger: String,
    stderr: bool,
    foreign: Mutex<Thinning>,
}

impl<S: Subscriber> Layer<S> for RosLayer {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let metadata = event.metadata();
        let mut line = Line::default();
        event.record(&mut line);
        let own = line.target.is_none() && metadata.target().starts_with(OWN_TARGET);
        let level = *metadata.level();

        if own {
            if let Ok(rosout) = ROSOUT.try_read()
                && let Some(rosout) = &*rosout
            {
                // A full window or a closed transport: the line stands on stderr.
                let _ = rosout.publisher.publish(Log {
                    stamp: rosout.clock.now().into(),
                    level: rosout_level(level),
                    name: rosout.logger.clone(),
                    msg: line.text.clone(),
                    file: metadata.file().unwrap_or_default().to_owned(),
                    function: metadata.module_path().unwrap_or_default().to_owned(),
                    line: metadata.line().unwrap_or_default(),
                });
            }
            if self.stderr {
                write_line(level, &self.logger, &line.text);
            }
        } else if self.stderr && !LEAVING.load(Ordering::Relaxed) {
            let target = line.target.as_deref().unwrap_or_else(|| metadata.target());
            let admitted =
                self.foreign.lock().unwrap_or_else(PoisonError::into_inner).admit(Instant::now());
            if let Some(suppressed) = admitted {
                if suppressed > 0 {
                    let _ = write!(line.text, " (and {suppressed} lines before it, not shown)");
                }
                write_line(level, target, &line.text);
            }
        }
    }
}

/// As in `rcl_interfaces/msg/Log`.
fn rosout_level(level: Level) -> u8 {
    match level {
        Level::ERROR => 40,
        Level::WARN => 30,
        Level::INFO => 20,
        Level::DEBUG | Level::TRACE => 10,
    }
}

fn write_line(level: Level, logger: &str, text: &str) {
    let now = NodeClock::default().now();
    // A closed stderr is no reason to stop.
    let _ = writeln!(std::io::stderr().lock(), "[{level}] [{now}] [{logger}]: {text}");
}

/// Message and fields of an event as one text.
#[derive(Default)]
struct Line {
    text: String,
    /// The origin of an event that came from the `log` crate.
    target: Option<String>,
}

impl Visit for Line {
    fn record_str(&mut self, field: &Field, value: &str) {
        match field.name() {
            "log.target" => self.target = Some(value.to_owned()),
            name if name.starts_with("log.") => {}
            "message" => self.text.insert_str(0, value),
            name => drop(write!(self.text, " {name}={value}")),
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        match field.name() {
            name if name.starts_with("log.") => {}
            "message" => self.text.insert_str(0, &format!("{value:?}")),
            name => drop(write!(self.text, " {name}={value:?}")),
        }
    }
}

/// Admits a few lines per window and counts the others.
#[derive(Default)]
struct Thinning {
    window: Option<Instant>,
    shown: u32,
    suppressed: u64,
}

impl Thinning {
    /// `Some(how many were suppressed since the last one)` when a line may be shown.
    fn admit(&mut self, now: Instant) -> Option<u64> {
        if self.window.is_none_or(|start| now.duration_since(start) >= FOREIGN_WINDOW) {
            self.window = Some(now);
            self.shown = 0;
        }
        if self.shown == FOREIGN_LINES {
            self.suppressed += 1;
            return None;
        }
        self.shown += 1;
        Some(std::mem::take(&mut self.suppressed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_thinned_and_counted() {
        let mut thinning = Thinning::default();
        let start = Instant::now();
        let shown = (0..1000).filter(|_| thinning.admit(start).is_some()).count();
        assert_eq!(shown, 3);
        assert_eq!(thinning.admit(start + FOREIGN_WINDOW), Some(997));
        assert_eq!(thinning.admit(start + FOREIGN_WINDOW), Some(0));
    }
}
