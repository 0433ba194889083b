//! Particle caches: the first byte chooses the format, the rest is the file.
#![no_main]

use std::path::Path;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else { return };
    let name = ["a.bgeo", "a.vtk", "a.vtu", "a.xyz", "a.ply", "a.usdc"][usize::from(*kind) % 6];
    match frazil::io::particles::parse(Path::new(name), bytes) {
        Ok(cloud) => assert!(cloud.positions.iter().all(|position| position.iter().all(|x| x.is_finite()))),
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
