//! Meshes: the first byte chooses the format, the rest is the file.
#![no_main]

use std::path::Path;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else { return };
    let name = ["a.obj", "a.ply", "a.stl", "a.usdc"][usize::from(*kind) % 4];
    match frazil::io::mesh::parse_polygons(Path::new(name), bytes) {
        Ok(mesh) => assert!(mesh.positions.iter().all(|position| position.iter().all(|x| x.is_finite()))),
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
