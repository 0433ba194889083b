//! The C boundary: every failure inside it becomes a status and a message.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

use crate::error::Error;

/// Status codes. Numbers never change; new ones are added at the end.
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum frz_status {
    /// Done.
    FRZ_OK = 0,
    /// An argument is NULL, out of range or not finite.
    FRZ_ERROR_ARGUMENT = 1,
    /// The contents of a file, or the bytes given instead of a file, cannot be used.
    FRZ_ERROR_FILE = 2,
    /// The operating system refused to read or write.
    FRZ_ERROR_IO = 3,
    /// More memory would be needed than the context allows, or than is available.
    FRZ_ERROR_MEMORY = 4,
    /// The context was cancelled; everything is as it was before the call.
    FRZ_CANCELLED = 5,
    /// OpenVDB cannot do this, for a reason that no other status covers.
    FRZ_ERROR_OPENVDB = 6,
    /// An internal invariant was violated: a bug in frazil. The context, and the handles that the call was changing, are poisoned.
    FRZ_ERROR_INTERNAL = 7,
    /// An earlier call with the handle returned FRZ_ERROR_INTERNAL: it can only be destroyed.
    FRZ_ERROR_POISONED = 8,
    /// The handle is in use by another call: on another thread, or the one within which this call is made.
    FRZ_ERROR_BUSY = 9,
    /// The caller's buffer is too small.
    FRZ_ERROR_CAPACITY = 10,
    /// The caller's header and this library are incompatible.
    FRZ_ERROR_VERSION = 11,
    /// The pointer is not a handle of the required kind.
    FRZ_ERROR_HANDLE = 12,
}

use frz_status::*;

/// A failure: its status and message.
pub(in crate::capi) struct Failure {
    pub status: frz_status,
    /// One sentence.
    pub text: String,
}

/// Result of the body of an interface function.
pub(in crate::capi) type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    /// A failure with a message.
    pub(in crate::capi) fn new(status: frz_status, text: impl Into<String>) -> Self {
        Self { status, text: text.into() }
    }

    /// Invalid argument.
    pub(in crate::capi) fn argument(text: impl Into<String>) -> Self {
        Self::new(FRZ_ERROR_ARGUMENT, text)
    }
}

/// Returns an argument failure if there is a fault.
pub(in crate::capi) fn refuse<T: Into<String>>(fault: bool, text: impl FnOnce() -> T) -> Outcome {
    if fault { Err(Failure::argument(text())) } else { Ok(()) }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let status = match &error {
            Error::Argument(_) => FRZ_ERROR_ARGUMENT,
            Error::File { .. } | Error::Bytes(_) => FRZ_ERROR_FILE,
            Error::Io { .. } | Error::Busy(_) => FRZ_ERROR_IO,
            Error::Memory { .. } | Error::OutOfMemory => FRZ_ERROR_MEMORY,
            Error::Cancelled => FRZ_CANCELLED,
            Error::OpenVdb(_) => FRZ_ERROR_OPENVDB,
            // A bug, like a panic: it must unwind through the handles in use, which this poisons.
            Error::Internal(what) => std::panic::panic_any(what.clone()),
        };
        Self::new(status, error.to_string())
    }
}

/// Maximum length (bytes) of an error message, including its terminating zero.
const MAX_MESSAGE: usize = 1024;

thread_local! {
    // No destructor: a thread may end after the library is unloaded.
    static LAST: RefCell<[u8; MAX_MESSAGE]> = const { RefCell::new([0; MAX_MESSAGE]) };
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Runs the body of an interface function. A failure or a panic sets this thread's last error, and its status is returned.
pub(in crate::capi) fn guard(body: impl FnOnce() -> Outcome) -> frz_status {
    silence_panics();
    DEPTH.set(DEPTH.get() + 1);
    let outcome = catch_unwind(AssertUnwindSafe(body));
    DEPTH.set(DEPTH.get() - 1);
    let failure = match outcome {
        Ok(Ok(())) => return FRZ_OK,
        Ok(Err(failure)) => failure,
        Err(panic) => Failure::new(FRZ_ERROR_INTERNAL, format!("internal error: {}", panic_message(&*panic))),
    };
    remember(&failure.text);
    failure.status
}

/// As [`guard`], for functions that do not return a status: `otherwise` is returned on failure.
pub(in crate::capi) fn guard_value<T>(otherwise: T, body: impl FnOnce() -> Outcome<T>) -> T {
    let mut value = otherwise;
    guard(|| {
        value = body()?;
        Ok(())
    });
    value
}

/// The message of this thread's last failed call; empty before the first.
pub(in crate::capi) fn last_error() -> *const c_char {
    LAST.with_borrow(|text| text.as_ptr().cast())
}

fn remember(text: &str) {
    let cut = cut_at(text, MAX_MESSAGE - 1);
    LAST.with_borrow_mut(|last| {
        last[..cut].copy_from_slice(&text.as_bytes()[..cut]);
        last[cut] = 0;
    });
}

/// Length (bytes) to which a text is cut: at most `max`, at a character boundary, before any embedded zero.
fn cut_at(text: &str, max: usize) -> usize {
    let end = text.find('\0').unwrap_or(text.len());
    (0..=max.min(end)).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0)
}

fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("a panic without a message")
}

/// Keeps panics inside calls, which are reported by status, from being printed; others go to the previous panic hook.
fn silence_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            let worker = || std::thread::current().name().is_some_and(|name| name.starts_with("frazil-"));
            if DEPTH.get() == 0 && !worker() {
                before(panic);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;

    fn last_message() -> String {
        // SAFETY: the text ends with a zero.
        unsafe { CStr::from_ptr(last_error()) }.to_str().unwrap().to_string()
    }

    #[test]
    fn failures_and_panics_become_a_status_and_a_message() {
        assert_eq!(guard(|| Ok(())), FRZ_OK);
        assert_eq!(guard(|| Err(Failure::argument("n = 7 is not within 1 to 3"))), FRZ_ERROR_ARGUMENT);
        assert_eq!(last_message(), "n = 7 is not within 1 to 3");
        assert_eq!(guard(|| panic!("on {}", "purpose")), FRZ_ERROR_INTERNAL);
        assert_eq!(last_message(), "internal error: on purpose");
        assert_eq!(guard_value(3, || Err(Failure::argument("é".repeat(1000)))), 3);
        assert_eq!(last_message(), "é".repeat(511));
        assert_eq!(guard(|| Err(Failure::argument("a\0b"))), FRZ_ERROR_ARGUMENT);
        assert_eq!(last_message(), "a");
    }

    #[test]
    fn each_thread_has_its_own_last_error() {
        guard(|| Err(Failure::argument("mine")));
        let other = std::thread::spawn(|| {
            let before = last_message();
            guard(|| Err(Failure::argument("theirs")));
            (before, last_message())
        });
        assert_eq!(other.join().unwrap(), (String::new(), "theirs".to_string()));
        assert_eq!(last_message(), "mine");
    }
}
