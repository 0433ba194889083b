//! One error type for the whole library: each message is one sentence that names what is at fault.

use std::path::{Path, PathBuf};

/// What went wrong, in one sentence.
///
/// The kinds are those of the C status numbers; a kind says who can fix it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A parameter or argument is outside its range: the caller can fix it.
    #[error("{0}")]
    Argument(String),
    /// The contents of a file cannot be used: the file must be fixed.
    #[error("{}: {what}", path.display())]
    File {
        /// The file at fault.
        path: PathBuf,
        /// What is wrong with it, with the line or element where known.
        what: String,
    },
    /// The contents of bytes, a saved state for instance, cannot be used.
    #[error("{0}")]
    Bytes(String),
    /// The operating system refused an operation on a file.
    #[error("{}: cannot {action}: {}", path.display(), os_reason(source))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The verb: "read", "write", "create the folder".
        action: &'static str,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// Another run works in the folder.
    #[error("{}: another run writes into this folder: wait for it, or choose another -o", .0.display())]
    Busy(PathBuf),
    /// The work would need more memory than it may use.
    #[error("{what} needs about {} MB, more than the limit of {} MB", needed.div_ceil(1_000_000), limit / 1_000_000)]
    Memory {
        /// The work, with the setting that makes it large.
        what: String,
        /// Bytes it would need.
        needed: u64,
        /// Bytes it may use.
        limit: u64,
    },
    /// The context was cancelled; the state is as it was before the call.
    #[error("cancelled")]
    Cancelled,
    /// Memory ran out in the middle of the work.
    #[error("there is not enough memory left for this")]
    OutOfMemory,
    /// OpenVDB refused for a reason that no other kind covers.
    #[error("{0}")]
    OpenVdb(String),
    /// An invariant of the library does not hold: a bug.
    #[error("internal error: {0}")]
    Internal(String),
}

/// Result with the library's [`enum@Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A file whose content cannot be used.
    pub fn file(path: impl AsRef<Path>, what: impl Into<String>) -> Self {
        Self::File { path: path.as_ref().to_path_buf(), what: visible(&what.into()) }
    }

    /// A file operation that the operating system refused.
    pub fn io(path: impl AsRef<Path>, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().to_path_buf(), action, source }
    }

    /// Refuses work, named by `what`, that needs more bytes than the limit.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn check_memory(needed: u64, limit: u64, what: impl FnOnce() -> String) -> Result<()> {
        if needed <= limit { Ok(()) } else { Err(Self::Memory { what: what(), needed, limit }) }
    }

    /// A parameter outside its range.
    pub fn argument(what: impl Into<String>) -> Self {
        Self::Argument(what.into())
    }

    /// Turns an error about an argument that comes from a file into one about the file; other errors stay as they are.
    pub fn in_file(self, path: impl AsRef<Path>) -> Self {
        self.in_file_at(path, "")
    }

    /// As [`Error::in_file`], with the text `at` before the sentence: which part of the file it is about.
    pub fn in_file_at(self, path: impl AsRef<Path>, at: impl std::fmt::Display) -> Self {
        match self {
            Self::Argument(what) => Self::file(path, format!("{at}{what}")),
            other => other,
        }
    }
}

/// Fails if `is_wrong`; only then is the error made.
///
/// # Errors
/// `error`.
pub fn fail_if<E>(is_wrong: bool, error: impl FnOnce() -> E) -> std::result::Result<(), E> {
    if is_wrong { Err(error()) } else { Ok(()) }
}

/// Maximum characters of an untrusted text in a message.
const MAX_CHARACTERS: usize = 400;

/// An untrusted text on one line, truncated, without control characters.
pub fn one_line(text: &str) -> String {
    let cut: String = text.chars().take(MAX_CHARACTERS).collect();
    visible(&cut).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A text whose control characters, except line ends, are replaced by spaces.
pub fn visible(text: &str) -> String {
    let shown = |character: char| if character != '\n' && is_control(character) { ' ' } else { character };
    text.chars().map(shown).collect()
}

/// Whether a character controls a terminal instead of being shown, is invisible, or changes the direction of text.
fn is_control(character: char) -> bool {
    let invisible =
        ['\u{200b}'..='\u{200f}', '\u{2028}'..='\u{202e}', '\u{2060}'..='\u{2069}', '\u{feff}'..='\u{feff}'];
    character.is_control() || invisible.iter().any(|range| range.contains(&character))
}

/// The system's reason without Rust's "(os error 2)" tail.
fn os_reason(error: &std::io::Error) -> String {
    let text = error.to_string();
    match text.find(" (os error") {
        Some(end) => text[..end].to_lowercase(),
        None => text,
    }
}
