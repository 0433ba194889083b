//! Exit codes, and the sentence on stderr when a command fails.

use frazil::Error;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code: done.
pub const DONE: u8 = 0;
/// Exit code: failed after the work had begun.
pub const FAILED: u8 = 1;
/// Exit code: refused before the work began.
pub const REFUSED: u8 = 2;

/// Exit code: refused because another run is at work in the folder (`EX_TEMPFAIL` of sysexits.h): the same command may succeed later.
pub const BUSY: u8 = 75;

/// Why a command ends early.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    message: String,
}

impl Failure {
    /// An error before the work begins: exit code 2.
    pub fn refused(message: impl std::fmt::Display) -> Self {
        Self { code: REFUSED, message: message.to_string() }
    }

    /// As [`Failure::refused`], with the name of the faulty file.
    pub fn of_file(path: &Path, what: impl std::fmt::Display) -> Self {
        Self::refused(format!("{}: {what}", path.display()))
    }

    /// An error after the work has begun: exit code 1.
    pub fn failed(message: impl std::fmt::Display) -> Self {
        Self { code: FAILED, message: message.to_string() }
    }

    /// Prints the message and returns the exit code.
    pub fn report(&self) -> u8 {
        print_error(&self.message);
        self.code
    }
}

/// Converts an error of the library to the failure of a command.
pub trait OrFailure<T> {
    /// For an error before the work begins: exit code 2, or 75 if another run is at work in the folder.
    fn or_refuse(self) -> Result<T, Failure>;
    /// For an error of the work: exit code 1, but 2 for arguments and memory, which are checked before any of it is done.
    fn or_fail(self) -> Result<T, Failure>;
}

impl<T> OrFailure<T> for frazil::Result<T> {
    fn or_refuse(self) -> Result<T, Failure> {
        self.map_err(|error| match error {
            Error::Busy(_) => Failure { code: BUSY, message: error.to_string() },
            error => Failure::refused(error),
        })
    }

    fn or_fail(self) -> Result<T, Failure> {
        self.map_err(Failure::from)
    }
}

/// As [`OrFailure::or_fail`].
impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match error {
            Error::Argument(_) | Error::Memory { .. } => Self::refused(error),
            _ => Self::failed(error),
        }
    }
}

/// Prints one sentence on stderr, without the line breaks of its parts.
pub fn print_error(message: &str) {
    let message = frazil::error::visible(message);
    let sentence: Vec<&str> = message.split_whitespace().collect();
    // If stderr is closed, there is nowhere to report to.
    let _ = writeln!(std::io::stderr(), "frazil: {}", sentence.join(" "));
}

/// Reports that a signal stopped the program; its exit code shows which.
pub fn print_stopped(code: u8) {
    static PRINTED: AtomicBool = AtomicBool::new(false);
    if PRINTED.swap(true, Ordering::Relaxed) {
        return;
    }
    print_error(if code == 130 { "interrupted" } else { "terminated" });
}

/// Turns a panic, in any thread, into one sentence.
pub fn install_panic_hook() {
    static PRINTED: AtomicBool = AtomicBool::new(false);
    std::panic::set_hook(Box::new(|panic| {
        if PRINTED.swap(true, Ordering::Relaxed) {
            return;
        }
        let payload = panic.payload();
        let what = match (payload.downcast_ref::<&str>(), payload.downcast_ref::<String>()) {
            (Some(text), _) => text,
            (_, Some(text)) => text.as_str(),
            _ => "unknown",
        };
        let position =
            panic.location().map(|at| format!(" ({}:{})", at.file(), at.line())).unwrap_or_default();
        print_error(&format!("internal error: {what}{position}; please report it"));
    }));
}
