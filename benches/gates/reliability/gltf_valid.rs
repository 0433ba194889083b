//! Valid glTF files: each without one of its optional fields says the same.

use crate::common::gltf_variants::{complete, geometry, variants};

/// Complete files, each with its variants.
const FILES: u32 = 12;

/// The count of files that are refused, or whose geometry is not the complete file's.
pub fn measure() -> (f64, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut files, mut wrong) = (0, Vec::new());
    for seed in 0..FILES {
        let whole = complete(seed);
        let expected = geometry(&whole.write(&folder));
        let complete = std::iter::once(("all fields".to_string(), expected.is_ok()));
        let without = variants(&whole)
            .into_iter()
            .map(|(field, variant)| (field, geometry(&variant.write(&folder)) == expected));
        for (field, is_right) in complete.chain(without) {
            files += 1;
            if !is_right {
                wrong.push(format!("{seed}: {field}"));
            }
        }
    }
    let shown = wrong.iter().take(4).map(String::as_str).collect::<Vec<_>>().join(", ");
    (wrong.len() as f64, format!("of {files} files {shown}"))
}
