//! Characters: a .glb file, opened and posed.
#![no_main]

use frazil::motion::{Character, Motion, Play};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, data).unwrap();
    match Character::open(&path, Play::default()) {
        Ok(character) => {
            let _ = character.pose(0.5, &mut Vec::new());
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
