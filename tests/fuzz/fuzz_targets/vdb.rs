//! The structure of .vdb files, which is checked before OpenVDB sees one.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vdb");
    std::fs::write(&path, data).unwrap();
    if let Err(error) = frazil::vdb::file::metadata(&path) {
        assert!(!error.to_string().contains('\n'), "{error}");
    }
});
