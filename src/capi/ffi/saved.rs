//! States that a host saves and restores.

use std::ffi::c_void;
use std::sync::{Mutex, PoisonError};

use super::guard::{Failure, Outcome, frz_status};
use super::views::write_bytes;
use crate::context::Context;
use crate::error::{Error, Result};

/// The bytes of a state whose size was queried, kept for the call that copies them.
#[derive(Default)]
pub(in crate::capi) struct Saved(Mutex<Option<Vec<u8>>>);

impl Saved {
    /// Removes and returns the bytes, which are outdated once the object changes.
    pub(in crate::capi) fn take(&self) -> Option<Vec<u8>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Writes a state to the host, or reports its size, as [`write_bytes`] does; `save` makes it unless it was kept.
    ///
    /// # Safety
    /// As [`write_bytes`].
    pub(in crate::capi) unsafe fn write(
        &self,
        (dst, capacity, size): (*mut c_void, usize, *mut usize),
        save: impl FnOnce() -> Result<Vec<u8>>,
    ) -> Outcome {
        // No lock is held while the host's poll function runs.
        let bytes = match self.take() {
            Some(bytes) => bytes,
            None => save()?,
        };
        // SAFETY: guaranteed by the caller.
        let written = unsafe { write_bytes(dst, capacity, size, || bytes.len(), || Ok(bytes.as_slice())) };
        if dst.is_null() || written.is_err() {
            // A caller that queried the size, or whose buffer was too small, calls again.
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(bytes);
        }
        written
    }
}

/// Resumes from a saved state of a `noun`, which has `unpacked` bytes when unpacked.
pub(in crate::capi) fn resumed<T: Send>(
    ctx: &Context,
    noun: &str,
    unpacked: u64,
    resume: impl FnOnce() -> Result<T> + Send,
) -> Outcome<T> {
    ctx.allow(&format!("the saved state of {noun}"), unpacked.saturating_mul(3))?;
    ctx.phase("unpack", resume).map_err(|error| match error {
        Error::Bytes(what) => {
            let what = what.strip_prefix("the state ").unwrap_or(&what);
            Failure::new(frz_status::FRZ_ERROR_FILE, format!("the saved state {what}"))
        }
        other => other.into(),
    })
}
