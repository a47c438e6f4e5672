//! Doors out: where perceptions go.

use crate::input::Observation;
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

    fn finish_any(&mut self) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        Ok(self.finish()?)
    }
}
