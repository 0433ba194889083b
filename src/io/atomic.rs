//! Files that appear whole or not at all.

use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// Extension of files that are not finished.
pub const PART: &str = "part";

/// Files begun by this process.
static TURN: AtomicU64 = AtomicU64::new(0);

/// Writes a file through a temporary neighbour that is synced and renamed; nothing is left behind on failure.
///
/// # Errors
/// What the operating system reports.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write(path, |out| out.write_all(bytes))
}

/// As [`write_bytes`], with the content from a function.
///
/// # Errors
/// What the operating system or the function reports.
pub fn write(path: &Path, content: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    // Two processes or threads that write the same file do not share a neighbour.
    let turn = TURN.fetch_add(1, Ordering::Relaxed);
    name.push(format!(".{}-{turn}.{PART}", std::process::id()));
    let part = path.with_file_name(name);
    let attempt = || -> std::io::Result<()> {
        let mut out = std::io::BufWriter::new(std::fs::File::create(&part)?);
        content(&mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        std::fs::rename(&part, path)
    };
    attempt().map_err(|error| {
        let _ = std::fs::remove_file(&part);
        Error::io(path, "write", error)
    })
}
