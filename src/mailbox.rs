//! Hand-over between threads where the newest wins: the giver never waits, and
//! what did not fit is given back to be counted.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A short queue between two threads.
#[derive(Debug)]
pub struct Mailbox<T> {
    slot: Mutex<Slot<T>>,
    changed: Condvar,
    capacity: usize,
}

#[derive(Debug)]
struct Slot<T> {
    items: VecDeque<T>,
    closed: bool,
}

/// What [`Mailbox::take`] found.
#[derive(Debug, PartialEq, Eq)]
pub enum Taken<T> {
    /// The oldest item.
    Item(T),
    /// Nothing came in time.
    Nothing,
    /// Nothing is left and nothing will come.
    Closed,
}

impl<T> Mailbox<T> {
    /// An empty mailbox for `capacity` items, at least one.
    pub fn new(capacity: usize) -> Self {
        let capacity = capacity.max(1);
        let slot = Slot { items: VecDeque::with_capacity(capacity), closed: false };
        Self { slot: Mutex::new(slot), changed: Condvar::new(), capacity }
    }

    /// Puts an item in and returns what it displaces: the oldest item of a full
    /// mailbox, or the item itself when the mailbox is closed.
    pub fn put(&self, item: T) -> Option<T> {
        let mut slot = self.lock();
        if slot.closed {
            return Some(item);
        }
        let displaced =
            if slot.items.len() == self.capacity { slot.items.pop_front() } else { None };
        slot.items.push_back(item);
        drop(slot);
        self.changed.notify_one();
        displaced
    }

    /// The oldest item, waited for until `timeout` has passed.
    pub fn take(&self, timeout: Duration) -> Taken<T> {
        let deadline = Instant::now() + timeout;
        let mut slot = self.lock();
        loop {
            if let Some(item) = slot.items.pop_front() {
                return Taken::Item(item);
            }
            if slot.closed {
                return Taken::Closed;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Taken::Nothing;
            }
            (slot, _) =
                self.changed.wait_timeout(slot, left).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Takes no more items; those inside can still be taken.
    pub fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Slot<T>> {
        // No code of others runs under the lock: a panic cannot leave it halfway.
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_item_wins_and_the_oldest_comes_back() {
        let mailbox = Mailbox::new(1);
        assert_eq!(mailbox.put(1), None);
        assert_eq!(mailbox.put(2), Some(1));
        assert_eq!(mailbox.take(Duration::ZERO), Taken::Item(2));
        assert_eq!(mailbox.take(Duration::ZERO), Taken::Nothing);
    }

    #[test]
    fn a_closed_mailbox_is_emptied_first() {
        let mailbox = Mailbox::new(2);
        mailbox.put(1);
        mailbox.close();
        assert_eq!(mailbox.put(2), Some(2));
        assert_eq!(mailbox.take(Duration::from_secs(60)), Taken::Item(1));
        assert_eq!(mailbox.take(Duration::from_secs(60)), Taken::Closed);
    }

    #[test]
    fn a_waiting_taker_is_woken() {
        let mailbox = Mailbox::new(1);
        std::thread::scope(|scope| {
            let taker = scope.spawn(|| mailbox.take(Duration::from_secs(60)));
            mailbox.put(7);
            assert_eq!(taker.join().unwrap(), Taken::Item(7));
            let taker = scope.spawn(|| mailbox.take(Duration::from_secs(60)));
            mailbox.close();
            assert_eq!(taker.join().unwrap(), Taken::Closed);
        });
    }
}
