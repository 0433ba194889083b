//! The buffers of a file: embedded, or files beside it.

use std::path::{Component, Path};

use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use crate::error::Result;
use crate::io::files::source;

/// A value, or why the buffer cannot be read: words that follow the buffer's name.
pub(super) type OrReason<T> = std::result::Result<T, String>;

/// Reads a buffer. A file must lie in the model's folder or below: a model is data, and may not read other files.
///
/// # Errors
/// Another folder, a missing file, something that is not a regular file, text that is not base64.
pub(super) fn read(
    buffer: &gltf::Buffer,
    folder: &Path,
    blob: &mut Option<Vec<u8>>,
) -> Result<OrReason<Vec<u8>>> {
    let uri = match buffer.source() {
        gltf::buffer::Source::Bin => return Ok(blob.take().ok_or_else(|| "is missing".to_string())),
        gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
            return Ok(embedded(uri).ok_or_else(|| "is damaged".into()));
        }
        gltf::buffer::Source::Uri(uri) => uri,
    };
    let Some(name) = decoded(uri).filter(|name| !name.contains(':') && !name.contains('\0')) else {
        return Ok(Err("is not the name of a file beside the model".into()));
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

/// Base64 (RFC 4648, section 4), with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes of a buffer embedded in its URI; `None` if they are not base64.
fn embedded(uri: &str) -> Option<Vec<u8>> {
    let mut bytes = BASE64.decode(uri.split_once(";base64,")?.1).ok()?;
    // Padded like the chunk of a .glb.
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    Some(bytes)
}

/// A URI with its percent encoding decoded; `None` if the result is not text.
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
    fn base64_is_decoded_with_its_padding_and_without() {
        let cases: [(&str, &[u8]); 5] =
            [("", b""), ("Zg==", b"f"), ("Zm8=", b"fo"), ("Zm9v", b"foo"), ("Zm9vYmFyZm8", b"foobarfo")];
        for (text, bytes) in cases {
            let read = embedded(&format!("data:application/octet-stream;base64,{text}")).unwrap();
            assert_eq!(&read[..bytes.len()], bytes, "{text}");
            assert!(
                read.len().is_multiple_of(4) && read[bytes.len()..].iter().all(|&byte| byte == 0),
                "{text}"
            );
        }
        // One character too many, non-zero unused bits, characters of another alphabet, a line end, padding inside.
        for wrong in ["Z", "Zm9vY", "Zh==", "Zm9=", "Zm-v", "Zm9v\n", "Zg==Zm9v", "Zg==="] {
            assert_eq!(embedded(&format!("data:;base64,{wrong}")), None, "{wrong}");
        }
        assert_eq!(embedded("data:text/plain,Zm9v"), None);
    }

    #[test]
    fn percent_signs_are_decoded_and_nothing_else_is_text() {
        assert_eq!(decoded("a%20b.bin").as_deref(), Some("a b.bin"));
        assert_eq!(decoded("%C3%A9.bin").as_deref(), Some("é.bin"));
        for wrong in ["%FF.bin", "%2", "%zz", "%+1"] {
            assert_eq!(decoded(wrong), None, "{wrong}");
        }
    }
}
