//! A bounded, evenly spaced sample of a stream whose length is not known.

/// Keeps every `stride`-th item of a stream; when it is full, every second one
/// of those is dropped and the stride doubles.
///
/// What is kept depends on nothing but the number and the weight of the items,
/// and the first item always stays.
#[derive(Clone, Debug)]
pub struct EvenSample<T> {
    capacity: usize,
    stride: u64,
    seen: u64,
    kept: Vec<T>,
}

impl<T> EvenSample<T> {
    /// An empty sample of at most `capacity` items (at least two).
    pub const fn new(capacity: usize) -> Self {
        let capacity = if capacity < 2 { 2 } else { capacity };
        Self { capacity, stride: 1, seen: 0, kept: Vec::new() }
    }

    /// Counts one more item of the stream and keeps it when it is its turn;
    /// `make` is called only then.
    ///
    /// # Errors
    /// The one of `make`; the item counts as seen and is not kept.
    pub fn try_offer<E>(&mut self, make: impl FnOnce() -> Result<T, E>) -> Result<(), E> {
        let index = self.seen;
        self.seen += 1;
        if !index.is_multiple_of(self.stride) {
            return Ok(());
        }
        if self.kept.len() >= self.capacity {
            self.thin();
            if !index.is_multiple_of(self.stride) {
                return Ok(());
            }
        }
        self.kept.push(make()?);
        Ok(())
    }

    /// [`EvenSample::try_offer`] for an item that is at hand.
    pub fn offer(&mut self, item: T) {
        let made: Result<(), std::convert::Infallible> = self.try_offer(|| Ok(item));
        let Ok(()) = made;
    }

    /// Drops every second item and doubles the stride.
    pub fn thin(&mut self) {
        let mut index = 0_usize;
        self.kept.retain(|_| {
            index += 1;
            index % 2 == 1
        });
        self.stride = self.stride.saturating_mul(2);
    }

    /// What is kept, in the order of the stream.
    pub fn items(&self) -> &[T] {
        &self.kept
    }

    /// Length of the stream so far.
    pub const fn seen(&self) -> u64 {
        self.seen
    }

    /// One item in how many is kept.
    pub const fn stride(&self) -> u64 {
        self.stride
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_stream_is_kept_whole() {
        let mut sample = EvenSample::new(8);
        (0..8).for_each(|i| sample.offer(i));
        assert_eq!(sample.items(), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!((sample.seen(), sample.stride()), (8, 1));
    }

    #[test]
    fn a_long_stream_is_kept_at_even_distances_from_the_first() {
        for length in 1..200_u64 {
            let mut sample = EvenSample::new(8);
            (0..length).for_each(|i| sample.offer(i));
            let stride = sample.stride();
            let expected: Vec<u64> = (0..length).step_by(stride as usize).collect();
            assert_eq!(sample.items(), expected, "length {length}");
            assert!(sample.items().len() <= 8);
            assert!(length < 8 || sample.items().len() >= 4, "length {length}");
        }
    }

    #[test]
    fn a_failed_item_is_counted_and_not_kept() {
        let mut sample = EvenSample::new(4);
        assert_eq!(sample.try_offer(|| Err::<i32, _>("no")), Err("no"));
        sample.offer(1);
        assert_eq!((sample.items(), sample.seen()), (&[1][..], 2));
    }
}
