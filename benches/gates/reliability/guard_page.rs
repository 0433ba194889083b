//! No function of the C interface writes outside of a struct of its caller: programs of both libraries, with every size on a guard page.

use std::path::Path;
use std::process::Command;

/// The count of such writes: `make gates` has built the programs (`make hosts`, `make hosts-core`).
pub fn measure() -> (f64, String) {
    let said = ["target/ctest/guard_page", "target/core/ctest/guard_page"].map(said);
    // What was not built, or wrote nothing, is no 0.
    let outside: f64 = said.iter().map(|said| said.as_ref().map_or(f64::NAN, |(count, _)| *count)).sum();
    let notes: Vec<&str> = said.iter().flatten().map(|(_, note)| note.as_str()).collect();
    (outside, format!("OpenVDB's and the core's: {}", notes.join("; ")))
}

/// The writes outside that a program counts, and what it did.
fn said(program: &str) -> Option<(f64, String)> {
    let output = Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join(program)).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = text.lines().find_map(|line| line.strip_prefix("gate reliability.guard_page "))?;
    let (count, rest) = line.split_once(' ')?;
    let (_, note) = rest.split_once(": ")?;
    // It fails for other reasons, too: a function that refuses its own struct.
    let count = count.parse().ok().filter(|count| output.status.success() || *count > 0.0)?;
    Some((count, note.to_string()))
}
