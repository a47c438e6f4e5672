//! Doors out: where perceptions go.

pub mod bag;
pub(crate) mod html;
pub mod live;
pub mod picture;
pub mod report;
pub mod scene;
pub mod score;

use crate::input::{Observation, Tally};
use crate::perception::Perception;

/// A consumer of perceptions.
pub trait Sink {
    /// What can go wrong on the way out.
    type Error: std::error::Error + Send + Sync + 'static;

    /// Takes one frame and what was made of it.
    ///
    /// # Errors
    /// When it could not be written.
    fn write(
        &mut self,
        observation: &Observation,
        perception: &Perception,
    ) -> Result<(), Self::Error>;

    /// Takes note of what the source has met, before [`Sink::finish`]. Most
    /// sinks have no use for it.
    fn note_tally(&mut self, _tally: &Tally) {}

    /// Completes the output: afterwards it is whole and readable. Called once,
    /// also after an interruption.
    ///
    /// # Errors
    /// When it could not be completed.
    fn finish(&mut self) -> Result<(), Self::Error>;
}

/// A [`Sink`] whose error type is not named, so that different sinks can stand
/// in one list.
pub trait AnySink {
    /// As [`Sink::write`].
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn write_any(
        &mut self,
        observation: &Observation,
        perception: &Perception,
    ) -> Result<(), Box<dyn std::error::Error + Send + Sync>>;

    /// As [`Sink::note_tally`].
    fn note_tally_any(&mut self, tally: &Tally);

    /// As [`Sink::finish`].
    ///
    /// # Errors
    /// As [`Sink::finish`].
    fn finish_any(&mut self) -> Result<(), Box<dyn std::error::Error + Send + Sync>>;
}

impl<S: Sink> AnySink for S {
    fn write_any(
        &mut self,
        observation: &Observation,
        perception: &Perception,
    ) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        Ok(self.write(observation, perception)?)
    }

    fn note_tally_any(&mut self, tally: &Tally) {
        self.note_tally(tally);
    }

    fn finish_any(&mut self) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        Ok(self.finish()?)
    }
}
