//! Pictures of heights: a .png file.
#![no_main]

use std::path::Path;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Err(error) = frazil::io::image::parse(Path::new("a.png"), bytes) {
        assert!(!error.to_string().contains('\n'), "{error}");
    }
});
