//! Other processes: the command, and runs of this very program that measure one thing and print it, so that memory and CPU level are
//! their own.

use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Stdio};

/// The command.
pub fn frazil<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_frazil"));
    command.args(arguments);
    command
}

/// A program whose output is thrown away.
pub fn quiet(command: &mut Command) -> &mut Command {
    command.stdout(Stdio::null()).stderr(Stdio::null())
}

/// Runs a program to its end, quietly.
///
/// # Panics
/// When it fails.
pub fn works(command: &mut Command) {
    assert!(quiet(command).status().expect("a program").success(), "{command:?}");
}

/// A report, or another file of JSON.
///
/// # Panics
/// When it cannot be read.
pub fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).expect("a report")).expect("JSON")
}

/// What a program prints; nothing where it cannot be started.
pub fn said(command: &mut Command) -> String {
    command.output().map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default()
}

/// A run of this program that does what `main` does for a word.
pub fn own(word: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("this program's path"));
    command.arg(word).stderr(Stdio::inherit());
    command
}

/// What such a run prints; lines that begin with `#` are passed on.
pub fn printed(command: &mut Command) -> String {
    let output = command.output().expect("a process of this program");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().filter(|line| line.starts_with("# ")).for_each(|line| println!("{line}"));
    text
}

/// Whether such runs print the same hash with each set of instructions.
pub fn is_same_at_levels(word: &str) -> bool {
    let hashes = ["baseline", "avx2", "avx512"].map(|level| printed(own(word).env("FRAZIL_CPU", level)));
    // 64 bits, and the end of the line.
    hashes.iter().all(|hash| hash.len() == 17 && *hash == hashes[0])
}

/// What follows a key at the beginning of a line.
pub fn number_of(text: &str, key: &str) -> Option<f64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(key))?;
    rest.split_whitespace().next()?.parse().ok()
}

/// A value of the status of a process (kB), or of `self`.
pub fn kilobytes(process: &str, key: &str) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    number_of(&status, key).unwrap_or(0.0)
}
