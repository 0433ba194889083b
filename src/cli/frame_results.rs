//! The results of frames that are made one by one: a frame that fails does not stop the others.

use frazil::scene::FrameChoice;
use frazil::{Error, Result};

use super::session::{Failure, OrFailure, Session};

/// Maximum number of failed frames that get a warning each, and of those listed at the end.
const MAX_NAMED: usize = 20;

/// The results of a run's frames so far.
#[derive(Default)]
pub struct FrameResults {
    made: usize,
    failed: Vec<i32>,
    /// The error of the first failed frame, and whether it counts as refused: not if writing failed.
    first: Option<(String, bool)>,
}

impl FrameResults {
    /// Makes frames one by one, and passes each result to `add`. The report of the session gets their number.
    ///
    /// # Errors
    /// As [`FrameResults::record`].
    pub fn run<T>(
        session: &Session,
        frames: &FrameChoice,
        mut make: impl FnMut(i32) -> Result<T>,
        mut add: impl FnMut(T),
    ) -> std::result::Result<Self, Failure> {
        let mut results = Self::default();
        for frame in frames.iter() {
            session.ctx.check().or_fail()?;
            results.record(frame, make(frame))?.into_iter().for_each(&mut add);
        }
        session.record("frames", results.made.into());
        Ok(results)
    }

    /// Counts a frame; returns its result, or none if it failed.
    ///
    /// # Errors
    /// Errors that every other frame would have too: cancel; an invalid argument or an exceeded memory limit, before any frame is made.
    pub fn record<T>(&mut self, frame: i32, result: Result<T>) -> std::result::Result<Option<T>, Failure> {
        match result {
            Ok(done) => {
                self.made += 1;
                Ok(Some(done))
            }
            Err(error @ Error::Cancelled) => Err(Failure::failed(error)),
            Err(error @ (Error::Argument(_) | Error::Memory { .. })) if self.made == 0 => {
                Err(Failure::refused(error))
            }
            Err(error) => {
                self.record_failure(frame, &error);
                Ok(None)
            }
        }
    }

    /// Counts a frame that failed.
    pub fn record_failure(&mut self, frame: i32, error: &Error) {
        if self.first.is_some() && self.failed.len() < MAX_NAMED {
            log::warn!("frame {frame} is not made: {error}");
        }
        let is_refused = !matches!(error, Error::Io { action, .. } if *action != "read");
        self.first.get_or_insert_with(|| (error.to_string(), is_refused));
        self.failed.push(frame);
    }

    /// Finishes the run.
    ///
    /// # Errors
    /// Names the first frame that could not be made, and lists the others: exit code 1, or 2 if none was begun.
    pub fn finish(self) -> std::result::Result<(), Failure> {
        let Some((first, is_refused)) = self.first else { return Ok(()) };
        if self.made == 0 {
            return Err(if is_refused { Failure::refused(first) } else { Failure::failed(first) });
        }
        let all = self.made + self.failed.len();
        let mut listed: Vec<String> = self.failed.iter().take(MAX_NAMED).map(i32::to_string).collect();
        if self.failed.len() > MAX_NAMED {
            listed.push("...".into());
        }
        let (count, listed) = (self.failed.len(), listed.join(", "));
        Err(Failure::failed(format!("{first}; {count} of {all} frames were not made: {listed}")))
    }
}
