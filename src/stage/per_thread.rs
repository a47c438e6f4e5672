//! Buffers of which every thread has its own.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// One `T` for each thread that may work on a frame.
///
/// Whoever holds one must not start work for other threads: while it waits for
/// them its thread could be given another piece that wants the same buffers.
#[derive(Debug)]
pub struct PerThread<T> {
    slots: Vec<Mutex<T>>,
}

impl<T> PerThread<T> {
    /// None yet.
    pub const fn new() -> Self {
        Self { slots: Vec::new() }
    }

    /// Makes one with `make` for every thread of the pool that has none.
    pub fn fit(&mut self, make: impl Fn() -> T) {
        let threads = rayon::current_num_threads();
        while self.slots.len() < threads {
            self.slots.push(Mutex::new(make()));
        }
    }

    /// The current thread's, after [`PerThread::fit`] in the same pool.
    pub fn lock(&self) -> MutexGuard<'_, T> {
        let index = rayon::current_thread_index().unwrap_or(0) % self.slots.len();
        // A poisoned lock means that the work of another frame panicked; the
        // buffers are overwritten in any case.
        self.slots[index].lock().unwrap_or_else(PoisonError::into_inner)
    }
}
