//! The echo: what the node sends itself once a second. It passes through the
//! whole transport, so that one that has stalled is noticed although the node's
//! threads still run.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::draft::Draft;
use crate::ros::message::diagnostic_msgs::DiagnosticStatus;

/// Unanswered calls from which on something is wrong, and from which on
/// nothing works.
const SUSPICIOUS: usize = 3;
const BROKEN: usize = 10;

/// An echo may take this long before it counts as missing.
const PATIENCE: Duration = Duration::from_secs(1);

/// Calls after which a transport that has never answered is no longer called.
const TRIALS: i32 = 60;

/// Unanswered calls that are remembered.
const REMEMBERED: usize = 3600;

/// Calls and what came back.
#[derive(Debug, Default)]
pub(super) struct Echo {
    calls: VecDeque<(i32, Instant)>,
    number: i32,
    round_trip: Option<Duration>,
}

impl Echo {
    /// The number of a call that is made now; `None` where calls are in vain.
    pub fn call(&mut self, now: Instant) -> Option<i32> {
        if self.round_trip.is_none() && self.number == TRIALS {
            return None;
        }
        self.number = self.number.wrapping_add(1);
        if self.calls.len() == REMEMBERED {
            self.calls.pop_front();
        }
        self.calls.push_back((self.number, now));
        Some(self.number)
    }

    /// The call of this number came back. Those before it will not any more.
    pub fn hear(&mut self, number: i32, now: Instant) {
        if let Some(at) = self.calls.iter().position(|&(call, _)| call == number) {
            self.round_trip = Some(now.duration_since(self.calls[at].1));
            self.calls.drain(..=at);
        }
    }

    /// Calls without an echo since the last one that came.
    fn missing(&self, now: Instant) -> usize {
        self.calls.iter().filter(|(_, made)| now.duration_since(*made) > PATIENCE).count()
    }

    /// What is to be said of it: nothing before the first echo. A machine
    /// without a network has none (`RustDDS` does not send to its own loopback
    /// address) and is well.
    pub fn report(&self, now: Instant, draft: &mut Draft) {
        let Some(round_trip) = self.round_trip else { return };
        let ms = round_trip.as_secs_f64() * 1e3;
        draft.value("echo over the transport (ms)", format_args!("{ms:.2}"));
        let missing = self.missing(now);
        draft.value("echoes missing", missing);
        if missing >= SUSPICIOUS {
            let level =
                if missing < BROKEN { DiagnosticStatus::WARN } else { DiagnosticStatus::ERROR };
            draft.say(
                level,
                format_args!(
                    "the last {missing} messages of the node to itself did not come back: the transport has stalled, the network has gone or this machine is overloaded; look at the network and the processor load, restart the node when it lasts"
                ),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_echoes_are_a_warning_then_an_error_and_one_echo_ends_it() {
        let start = Instant::now();
        let second = |n: u64| start + Duration::from_secs(n);
        let level = |echo: &Echo, now| {
            let mut draft = Draft::new();
            echo.report(now, &mut draft);
            draft.level
        };
        let mut echo = Echo::default();
        assert_eq!(echo.call(second(0)), Some(1));
        echo.hear(1, second(0) + Duration::from_millis(2));
        assert_eq!(echo.round_trip, Some(Duration::from_millis(2)));
        for n in 1..=14 {
            echo.call(second(n));
        }
        // The call of second 1 is late from second 2 on.
        assert_eq!(level(&echo, second(3)), DiagnosticStatus::OK);
        assert_eq!(echo.missing(second(5)), 3);
        assert_eq!(level(&echo, second(5)), DiagnosticStatus::WARN);
        assert_eq!(level(&echo, second(14)), DiagnosticStatus::ERROR);
        echo.hear(99, second(14));
        assert_eq!(level(&echo, second(14)), DiagnosticStatus::ERROR);
        echo.hear(14, second(14));
        assert_eq!((echo.missing(second(14)), level(&echo, second(14))), (0, DiagnosticStatus::OK));
    }

    #[test]
    fn a_transport_that_never_answers_is_not_called_for_ever_and_no_fault() {
        let now = Instant::now();
        let mut echo = Echo::default();
        let calls = (0..2 * TRIALS).filter_map(|_| echo.call(now)).count();
        assert_eq!(calls, TRIALS as usize);
        let mut draft = Draft::new();
        echo.report(now + Duration::from_secs(100), &mut draft);
        assert_eq!((draft.level, draft.values.len()), (DiagnosticStatus::OK, 0));
    }

    #[test]
    fn a_transport_that_has_stalled_for_long_does_not_fill_the_memory() {
        let now = Instant::now();
        let mut echo = Echo::default();
        echo.call(now);
        echo.hear(1, now);
        for _ in 0..2 * REMEMBERED {
            assert!(echo.call(now).is_some());
        }
        assert_eq!(echo.missing(now + Duration::from_secs(2)), REMEMBERED);
    }
}
