//! Tests that cannot run for want of data or of another program: they are counted, and the end of `make test` lists them.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

/// Notes that the calling test, or a part of it, is skipped, and why.
pub fn skipped(why: &str) {
    let test = std::thread::current().name().unwrap_or("a test").to_string();
    eprintln!("skipped: {why}");
    let list = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/skipped.txt");
    let line = format!("{test}: {why}\n");
    let written = OpenOptions::new().create(true).append(true).open(list);
    let _ = written.and_then(|mut file| file.write_all(line.as_bytes()));
}
