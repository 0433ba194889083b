//! Gate of valid glTF files: each without one of its optional fields says the same.

use crate::common::gltf_variants::{complete, geometry, variants};
use crate::harness::Harness;

/// Complete files, each with its variants.
const FILES: u32 = 12;

/// The count of files that are refused, or whose geometry is not the complete file's.
pub fn run(h: &mut Harness) {
    if !h.wants("reliability.gltf_valid") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let (mut files, mut wrong) = (0, Vec::new());
    for seed in 0..FILES {
        let whole = complete(seed);
        let expected = geometry(&whole.write(&folder));
        files += 1;
        if expected.is_err() {
            wrong.push(format!("{seed}: all fields"));
        }
        for (field, variant) in variants(&whole) {
            files += 1;
            if geometry(&variant.write(&folder)) != expected {
                wrong.push(format!("{seed}: {field}"));
            }
        }
    }
    let shown = wrong.iter().take(4).map(String::as_str).collect::<Vec<_>>().join(", ");
    h.gate("reliability.gltf_valid", wrong.len() as f64, &format!("of {files} files {shown}"));
}
