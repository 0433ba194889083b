//! Scene files.
#![no_main]

use std::path::Path;

libfuzzer_sys::fuzz_target!(|text: &str| {
    if let Err(error) = frazil::scene::Scene::parse(text, Path::new("a.toml"), &[]) {
        assert!(!error.to_string().contains('\n'), "{error}");
    }
});
