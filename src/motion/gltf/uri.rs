//! The buffers of a file: inside it, or files beside it.

use std::path::{Component, Path};

use crate::error::Result;
use crate::io::source;

/// Why a buffer cannot be had: behind its name.
pub(super) type Told<T> = std::result::Result<T, String>;

/// Reads a buffer. A file must lie in the model's folder or below: a model is data, and names no other file.
///
/// # Errors
/// Another place, a missing file, something that is no regular file, base64 that is none.
pub(super) fn read(
    buffer: &gltf::Buffer,
    folder: &Path,
    blob: &mut Option<Vec<u8>>,
) -> Result<Told<Vec<u8>>> {
    let inside =
        |data: gltf::Result<gltf::buffer::Data>| Ok(data.map(|data| data.0).map_err(|_| "is damaged".into()));
    let uri = match buffer.source() {
        gltf::buffer::Source::Bin => return Ok(blob.take().ok_or_else(|| "is missing".to_string())),
        gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
            return inside(gltf::buffer::Data::from_source(buffer.source(), None));
        }
        gltf::buffer::Source::Uri(uri) => uri,
    };
    let Some(name) = decoded(uri).filter(|name| !name.contains(':') && !name.contains('\0')) else {
        return Ok(Err("is no name of a file beside the model".into()));
    };
    let relative = Path::new(&name);
    let within = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if !within || name.contains('\\') {
        return Ok(Err("lies outside of the model's folder, which frazil does not leave".into()));
    }
    match source::read(&folder.join(relative)) {
        Err(crate::error::Error::Cancelled) => Err(crate::error::Error::Cancelled),
        Err(error) => Ok(Err(format!("cannot be read ({error})"))),
        Ok(bytes) => Ok(Ok(bytes)),
    }
}

/// A URI without its percent signs; none when it is no text.
fn decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, more)) = rest.split_first() {
        rest = more;
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let (digits, more) = rest.split_at_checked(2)?;
        let digit = |at: usize| (digits[at] as char).to_digit(16);
        bytes.push((digit(0)? * 16 + digit(1)?) as u8);
        rest = more;
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percent_signs_are_decoded_and_nothing_else_is_text() {
        assert_eq!(decoded("a%20b.bin").as_deref(), Some("a b.bin"));
        assert_eq!(decoded("%C3%A9.bin").as_deref(), Some("é.bin"));
        for wrong in ["%FF.bin", "%2", "%zz", "%+1"] {
            assert_eq!(decoded(wrong), None, "{wrong}");
        }
    }
}
