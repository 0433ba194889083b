//! Output of the program: stdout lines and files.

use frazil::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Prints text on stdout; a closed pipe is not an error.
pub fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    // Names from files must not send control sequences to a terminal.
    match stdout.write_all(frazil::error::visible(text).as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(Error::io("stdout", "write", error)),
        Ok(()) => Ok(()),
    }
}

/// Checks before any work whether a file can be written at a path: its folder accepts new files.
/// A device or a pipe is checked when it is written.
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

/// Refuses to overwrite one of the input files.
pub fn refuse_input<'a>(path: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<()> {
    // A file that does not exist yet is not an input; a device is not overwritten.
    let Ok(output) = std::fs::canonicalize(path) else { return Ok(()) };
    let is_output = |input: &&Path| std::fs::canonicalize(input).is_ok_and(|input| input == output);
    match inputs.into_iter().find(is_output) {
        Some(_) if output.is_file() => {
            Err(Error::file(path, "is an input too and would be overwritten: choose another output"))
        }
        _ => Ok(()),
    }
}

/// Refuses to overwrite a file that is not a report with a report.
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

/// Checks that new files can be created in a folder.
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
