//! Images of one camera that wait for their partners.

use std::collections::VecDeque;

use crate::stamp::Stamp;

/// Intervals remembered per camera for the shortcut of rule 3.
const INTERVALS: usize = 8;

/// One camera.
#[derive(Debug)]
pub struct Stream<T> {
    pub queue: VecDeque<(Stamp, T)>,
    pub newest: Option<Stamp>,
    pub intervals: VecDeque<i64>,
    /// The newest stamp lies before the last jump back.
    pub behind: bool,
}

impl<T> Stream<T> {
    pub fn new() -> Self {
        Self {
            queue: VecDeque::new(),
            newest: None,
            intervals: VecDeque::with_capacity(INTERVALS),
            behind: false,
        }
    }

    pub fn restart(&mut self) {
        self.newest = None;
        self.behind = false;
    }

    pub fn note(&mut self, stamp: Stamp) {
        if let Some(newest) = self.newest {
            if self.intervals.len() == INTERVALS {
                self.intervals.pop_front();
            }
            self.intervals.push_back(stamp.0.saturating_sub(newest.0));
        }
        self.newest = Some(stamp);
    }

    pub fn leaves_no_room(&self, gap: u64) -> bool {
        self.intervals
            .iter()
            .min()
            .is_some_and(|shortest| gap.saturating_mul(4) <= shortest.unsigned_abs())
    }
}
