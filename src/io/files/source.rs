//! Opening of input files: only regular ones; a stop flag ends the reading.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use crate::error::{Error, Result};

/// Contents of a file, or what is wrong with it: a message without the file's name.
pub type Parsed<T> = std::result::Result<T, String>;

/// Bytes between two checks of the flag.
const PIECE: usize = 1 << 20;

/// The flag with which a program stops its readers.
static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Makes all readers of this process stop, with [`Error::Cancelled`], once a flag is raised. For programs, which then end; a library does
/// not use it. Only the first call has an effect.
pub fn stop_when(raised: Arc<AtomicBool>) {
    let _ = STOP.set(raised);
}

/// Whether readers must stop.
pub fn is_stopped() -> bool {
    STOP.get().is_some_and(|flag| flag.load(Ordering::Relaxed))
}

/// Fails if readers must stop; long readers call it regularly.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn check() -> Result<()> {
    if is_stopped() { Err(Error::Cancelled) } else { Ok(()) }
}

/// Fails if readers must stop. Parsers call it for each item of a file; it checks the flag every `piece` items.
///
/// # Errors
/// Readers must stop. The text is never shown: callers check the flag.
pub fn check_every(item: usize, piece: usize) -> Parsed<()> {
    if item.is_multiple_of(piece) && is_stopped() { Err("stopped".into()) } else { Ok(()) }
}

/// Opens a regular file: reading a pipe, a terminal or a device may never end, or never begin.
///
/// # Errors
/// A file that does not exist, cannot be read, or is not a regular file.
pub fn open(path: &Path) -> Result<File> {
    let failed = |error| Error::io(path, "read", error);
    // Checked before opening: opening a pipe waits for its writer.
    let refuse = |kind: std::fs::FileType| {
        let what = if kind.is_dir() {
            "is a folder, not a file"
        } else {
            "is a pipe or a device, not a regular file"
        };
        Err(Error::file(path, what))
    };
    let kind = std::fs::metadata(path).map_err(failed)?.file_type();
    if !kind.is_file() {
        return refuse(kind);
    }
    let file = File::open(path).map_err(failed)?;
    let kind = file.metadata().map_err(failed)?.file_type();
    if kind.is_file() { Ok(file) } else { refuse(kind) }
}

/// Reads a regular file.
///
/// # Errors
/// As [`open`]; [`Error::Cancelled`] once the flag of [`stop_when`] is raised.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let failed = |error| Error::io(path, "read", error);
    let mut file = open(path)?;
    let length = file.metadata().map_err(failed)?.len();
    let mut bytes = Vec::new();
    let reserved = usize::try_from(length).ok().and_then(|length| bytes.try_reserve_exact(length + 1).ok());
    if reserved.is_none() {
        return Err(Error::file(path, format!("has {length} bytes, more than there is memory for")));
    }
    loop {
        check()?;
        let read = (&mut file).take(PIECE as u64).read_to_end(&mut bytes).map_err(failed)?;
        if read < PIECE {
            return Ok(bytes);
        }
    }
}
