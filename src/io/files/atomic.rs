//! Files that appear whole or not at all.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// Extension of files that are not finished.
const PART: &str = "part";

/// Number of temporary files that this process has made.
static COUNTER: AtomicU64 = AtomicU64::new(0);
/// Temporary files that are not finished.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Writes a file through a temporary neighbour that is synced and renamed; a failure leaves nothing behind. A link stays a link; devices
/// and pipes are written to directly.
///
/// # Errors
/// What the operating system reports.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write(path, |out| out.write_all(bytes))
}

/// As [`write_bytes`], with contents written by a function.
///
/// # Errors
/// What the operating system or the function reports.
pub fn write(path: &Path, content: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let attempt = match target(path) {
        Target::File(path) => via_temporary(&path, content),
        Target::Stream => append_directly(path, content),
    };
    attempt.map_err(|error| Error::io(path, "write", error))
}

/// Whether a path must be written to directly: a device, a pipe, an open file of this process.
pub fn is_stream(path: &Path) -> bool {
    matches!(target(path), Target::Stream)
}

/// The kind of file at a path.
enum Target {
    /// A file that can be replaced (links are followed), or does not exist yet.
    File(PathBuf),
    /// Something else.
    Stream,
}

fn target(path: &Path) -> Target {
    match std::fs::metadata(path) {
        Err(_) => Target::File(path.to_path_buf()),
        Ok(metadata) if !metadata.is_file() && !metadata.is_dir() => Target::Stream,
        Ok(_) if is_open_file(path) => Target::Stream,
        Ok(_) => match std::fs::symlink_metadata(path) {
            Ok(link) if link.is_symlink() => {
                Target::File(std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()))
            }
            _ => Target::File(path.to_path_buf()),
        },
    }
}

/// Whether a path names a file that a process has open, such as /dev/stdout after `> file`.
fn is_open_file(path: &Path) -> bool {
    let mut path = path.to_path_buf();
    // The maximum number of links that the system follows.
    for _ in 0..40 {
        let folder = path.parent().and_then(|folder| std::fs::canonicalize(folder).ok());
        if folder.is_some_and(|folder| folder.starts_with("/proc")) {
            return true;
        }
        let Ok(next) = std::fs::read_link(&path) else { return false };
        path = path.parent().unwrap_or(Path::new("")).join(next);
    }
    false
}

/// Appends to a stream or an open file.
fn append_directly(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::options().append(true).open(path)?);
    content(&mut out)?;
    out.flush()
}

fn via_temporary(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    // Processes or threads that write the same file use different temporary files.
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    name.push(format!(".{}-{number}.{PART}", std::process::id()));
    let part = path.with_file_name(name);
    UNFINISHED.lock().expect("no panic while it is locked").push(part.clone());
    let attempt = || -> std::io::Result<()> {
        let mut out = BufWriter::new(File::create(&part)?);
        content(&mut out)?;
        out.flush()?;
        out.get_ref().sync_all()?;
        std::fs::rename(&part, path)
    };
    let done = attempt().inspect_err(|_| {
        let _ = std::fs::remove_file(&part);
    });
    UNFINISHED.lock().expect("no panic while it is locked").retain(|begun| *begun != part);
    done
}

/// Removes the unfinished files of this process, for a process that is about to exit.
pub fn abandon() {
    // The lock is only ever held briefly.
    if let Ok(begun) = UNFINISHED.lock() {
        begun.iter().for_each(|part| {
            let _ = std::fs::remove_file(part);
        });
    }
}

/// The final name of an unfinished temporary file; none for other names.
pub fn finished_name(name: &str) -> Option<&str> {
    let (name, number) = name.strip_suffix(PART)?.strip_suffix('.')?.rsplit_once('.')?;
    let (process, number) = number.split_once('-')?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|letter| letter.is_ascii_digit());
    (is_number(process) && is_number(number)).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unfinished_files_have_names_that_nobody_else_gives() {
        assert_eq!(finished_name("base.0001.vdb.123-4.part"), Some("base.0001.vdb"));
        for foreign in
            ["film.mkv.part", "a.12.part", "a.1-2", "a.1-.part", "a.-2.part", ".part", "a.1-2x.part"]
        {
            assert_eq!(finished_name(foreign), None, "{foreign}");
        }
    }

    #[test]
    fn a_link_stays_a_link_and_what_it_names_is_replaced() {
        let folder = std::env::temp_dir().join(format!("frazil-atomic-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (file, link) = (folder.join("file"), folder.join("link"));
        std::fs::write(&file, "before").unwrap();
        std::os::unix::fs::symlink("file", &link).unwrap();
        write_bytes(&link, b"after").unwrap();
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(std::fs::read(&file).unwrap(), b"after");
        // Through a link of our own: replacing the real device would harm the machine.
        let null = folder.join("null");
        std::os::unix::fs::symlink("/dev/null", &null).unwrap();
        write_bytes(&null, b"nothing").unwrap();
        assert!(
            std::fs::symlink_metadata(&null).unwrap().is_symlink()
                && is_stream(&null)
                && !is_stream(&file)
                && !is_stream(&folder.join("none"))
        );
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
