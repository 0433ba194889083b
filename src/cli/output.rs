//! Output of the program: lines on stdout, files.

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
/// A device or a pipe is looked at when it is written.
pub fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::file(path, "is a folder, not a file to write"));
    }
    if frazil::io::files::atomic::is_stream(path) {
        return Ok(());
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

/// Refuses to write over one of the files that are read.
pub fn refuse_input<'a>(path: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<()> {
    // A file that does not exist yet is not an input; a device is not overwritten.
    let Ok(output) = std::fs::canonicalize(path) else { return Ok(()) };
    let is_output = |input: &&Path| std::fs::canonicalize(input).is_ok_and(|input| input == output);
    match inputs.into_iter().find(is_output) {
        Some(_) if output.is_file() => {
            Err(Error::file(path, "is an input too and would be written over: choose another output"))
        }
        _ => Ok(()),
    }
}

/// Refuses to write a report over something else than a report.
pub fn check_report(path: &Path) -> Result<()> {
    check_writable(path)?;
    if !path.is_file() || frazil::io::files::atomic::is_stream(path) {
        return Ok(());
    }
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, "read", error))?;
    let value: Option<serde_json::Value> = serde_json::from_slice(&bytes).ok();
    let is_report = value
        .is_some_and(|value| ["arguments", "version", "seconds"].iter().all(|key| !value[key].is_null()));
    if bytes.is_empty() || is_report {
        return Ok(());
    }
    Err(Error::file(path, "exists and is not the report of a run: choose another name for --report"))
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
    frazil::io::files::atomic::write_bytes(path, text.as_bytes())
}
