//! Hashes of contents, to identify files and check that they are complete (XXH3, 128 bits; not for security).

use std::path::Path;

use xxhash_rust::xxh3::Xxh3;

use crate::error::{Error, Result};

/// A hash being computed.
#[derive(Default)]
pub struct Hasher(Xxh3);

impl Hasher {
    /// Adds bytes.
    pub fn add(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.update(bytes);
        self
    }

    /// Adds a text preceded by its length, so that "ab" + "c" differs from "a" + "bc".
    pub fn add_text(&mut self, text: &str) -> &mut Self {
        self.add(&(text.len() as u64).to_le_bytes()).add(text.as_bytes())
    }

    /// The hash, 32 hexadecimal digits.
    pub fn finish(&self) -> String {
        format!("{:032x}", self.0.digest128())
    }
}

/// The hash of some bytes, 32 hexadecimal digits.
pub fn of_bytes(bytes: &[u8]) -> String {
    Hasher::default().add(bytes).finish()
}

/// The hash of a file's content.
///
/// # Errors
/// What the operating system reports.
pub fn of_file(path: &Path) -> Result<String> {
    use std::io::Read;
    let failed = |error| Error::io(path, "read", error);
    let mut file = std::fs::File::open(path).map_err(failed)?;
    let mut hasher = Hasher::default();
    let mut buffer = vec![0; 1 << 18];
    loop {
        match file.read(&mut buffer).map_err(failed)? {
            0 => return Ok(hasher.finish()),
            count => hasher.add(&buffer[..count]),
        };
    }
}
