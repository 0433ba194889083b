//! What leaves the program: lines on stdout, files.

use frazil::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Prints text on stdout; a reader that closed the pipe has seen enough.
pub fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    // Names out of files must not command a terminal.
    match stdout.write_all(frazil::error::visible(text).as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Error::io("stdout", "write", error)),
        Ok(()) => Ok(()),
    }
}

/// Whether a file can be written at a path, found out before any work: its folder takes a new file.
pub fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::file(path, "is a folder, not a file to write"));
    }
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    check_folder(folder).map_err(|error| match error {
        Error::Io { source, .. } => Error::io(path, "write", source),
        other => other,
    })
}

/// Whether a folder takes new files.
pub fn check_folder(folder: &Path) -> Result<()> {
    let probe = folder.join(format!(".frazil-probe-{}", std::process::id()));
    let made = std::fs::File::create_new(&probe);
    made.map_err(|error| Error::io(folder, "write", error))?;
    std::fs::remove_file(&probe).map_err(|error| Error::io(folder, "write", error))
}

/// Writes JSON atomically.
pub fn write_json(path: &Path, value: &serde_json::Value) -> Result<()> {
    let mut text = serde_json::to_string_pretty(value).expect("plain values become JSON");
    text.push('\n');
    frazil::io::atomic::write_bytes(path, text.as_bytes())
}
