//! Frames that are made one by one: a frame that cannot be made does not cost the others.

use frazil::scene::FrameChoice;
use frazil::{Error, Result};

use super::session::{Failure, Phase, Session};

/// Number of failed frames that are named one by one, and of those listed at the end.
const MAX_NAMED: usize = 20;

/// The result of a run's frames so far.
#[derive(Default)]
pub struct Each {
    made: usize,
    failed: Vec<i32>,
    /// The error of the first failed frame, and whether it occurred before its work began.
    first: Option<(String, bool)>,
}

impl Each {
    /// Makes frames one by one; `add` gets what was made of each. The report of the session gets their number.
    ///
    /// # Errors
    /// As [`Each::take`].
    pub fn run<T>(
        session: &Session,
        frames: &FrameChoice,
        mut make: impl FnMut(i32) -> Result<T>,
        mut add: impl FnMut(T),
    ) -> std::result::Result<Self, Failure> {
        let mut each = Self::default();
        for frame in frames.iter() {
            session.ctx.check().during()?;
            each.take(frame, make(frame))?.into_iter().for_each(&mut add);
        }
        session.record("frames", each.made.into());
        Ok(each)
    }

    /// Counts a frame; returns its result, none if it failed.
    ///
    /// # Errors
    /// Errors that every other frame would have too: cancel; an argument or a memory limit that is refused before any frame is made.
    pub fn take<T>(&mut self, frame: i32, result: Result<T>) -> std::result::Result<Option<T>, Failure> {
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
                self.lose(frame, &error);
                Ok(None)
            }
        }
    }

    /// Counts a frame that failed.
    pub fn lose(&mut self, frame: i32, error: &Error) {
        if self.first.is_some() && self.failed.len() < MAX_NAMED {
            log::warn!("frame {frame} is not made: {error}");
        }
        let is_before = !matches!(error, Error::Io { action, .. } if *action != "read");
        self.first.get_or_insert_with(|| (error.to_string(), is_before));
        self.failed.push(frame);
    }

    /// Finishes the run.
    ///
    /// # Errors
    /// Names the first frame that could not be made, and lists the others: exit code 1, or 2 if none was begun.
    pub fn finish(self) -> std::result::Result<(), Failure> {
        let Some((first, is_before)) = self.first else { return Ok(()) };
        if self.made == 0 {
            return Err(if is_before { Failure::refused(first) } else { Failure::failed(first) });
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
