//! Small JSON files that show whether they are complete and whether this version can read them.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use crate::error::{Error, Result, fail_if};
use crate::io::files::{atomic, hash};

/// The format that this version writes, and the newest that it reads.
const FORMAT: u64 = 1;

/// Writes a value, whole or not at all.
///
/// # Errors
/// What the operating system reports.
pub fn write(path: &Path, content: &impl Serialize) -> Result<()> {
    atomic::write_bytes(path, to_text(content)?.as_bytes())
}

/// The text of a file that holds a value.
///
/// # Errors
/// A value that JSON cannot represent.
pub fn to_text(content: &impl Serialize) -> Result<String> {
    let content = serde_json::to_value(content).map_err(|error| Error::Internal(error.to_string()))?;
    let check = hash::of_bytes(content.to_string().as_bytes());
    Ok(text_of(&json!({ "format": FORMAT, "check": check, "content": content })))
}

fn text_of(file: &Value) -> String {
    format!("{file:#}\n")
}

/// Placeholder for a stamp while it is computed.
pub const UNSTAMPED: &str = "00000000000000000000000000000000";
/// The text before a stamp.
const BEFORE_STAMP: &str = "\"check\": \"";

/// Replaces [`UNSTAMPED`], the value of the key `check`, by the hash of the text.
pub fn stamp(text: &str) -> String {
    let hash = hash::of_bytes(text.as_bytes());
    text.replacen(&format!("{BEFORE_STAMP}{UNSTAMPED}"), &format!("{BEFORE_STAMP}{hash}"), 1)
}

/// Whether a stamped text is unchanged.
pub fn is_stamped(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Some(start) = text.find(BEFORE_STAMP).map(|at| at + BEFORE_STAMP.len()) else { return false };
    let Some(hash) = text.get(start..start + UNSTAMPED.len()) else { return false };
    let unstamped = [&text[..start], UNSTAMPED, &text[start + UNSTAMPED.len()..]].concat();
    hash::of_bytes(unstamped.as_bytes()) == hash
}

/// Reads a value; none if there is no such file.
///
/// # Errors
/// A file that was cut short or changed, or that a newer version wrote.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    let bytes = match std::fs::read(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        other => other.map_err(|error| Error::io(path, "read", error))?,
    };
    let damaged = || {
        Error::file(
            path,
            "the record is damaged, cut short or changed by hand: remove it, and what it records is made again",
        )
    };
    let file: Value = serde_json::from_slice(&bytes).map_err(|_| damaged())?;
    match file["format"].as_u64() {
        None => return Err(damaged()),
        Some(format) if format > FORMAT => {
            let what =
                format!("was written by a newer frazil (format {format}; this one reads up to {FORMAT})");
            return Err(Error::file(path, what));
        }
        Some(0) => return Err(damaged()),
        Some(_) => {}
    }
    let content = &file["content"];
    fail_if(file["check"].as_str() != Some(&hash::of_bytes(content.to_string().as_bytes())), damaged)?;
    // What this version wrote must read back byte for byte.
    fail_if(file["format"].as_u64() == Some(FORMAT) && text_of(&file).as_bytes() != bytes, damaged)?;
    serde_json::from_value(content.clone()).map(Some).map_err(|_| damaged())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_what_is_changed_is_refused() {
        let folder = std::env::temp_dir().join(format!("frazil-sealed-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.json");
        assert_eq!(read::<Vec<i32>>(&path).unwrap(), None);
        write(&path, &vec![1, 2, 3]).unwrap();
        assert_eq!(read::<Vec<i32>>(&path).unwrap(), Some(vec![1, 2, 3]));
        let text = std::fs::read_to_string(&path).unwrap();
        for (from, to, word) in
            [("2,", "4,", "damaged"), ("\"format\": 1", "\"format\": 9", "newer"), ("]", "", "damaged")]
        {
            std::fs::write(&path, text.replace(from, to)).unwrap();
            let error = read::<Vec<i32>>(&path).unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("a.json"), "{error}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_stamp_detects_every_changed_bit() {
        let text = stamp(&format!("{{\n  \"check\": \"{UNSTAMPED}\",\n  \"frame\": 1\n}}\n"));
        assert!(is_stamped(text.as_bytes()) && !text.contains(UNSTAMPED));
        for at in 0..text.len() {
            for bit in 0..8 {
                let mut bytes = text.clone().into_bytes();
                bytes[at] ^= 1 << bit;
                assert!(!is_stamped(&bytes), "bit {bit} of byte {at}");
            }
        }
    }
}
