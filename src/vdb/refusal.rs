//! Maps OpenVDB's exceptions to errors; their own texts go to the log.

use crate::error::{Error, one_line};

/// Exception text of the C++ side's `Cancelled`.
const CANCELLED: &str = "frazil: cancelled";

/// Parts of exception texts of the C++ library and OpenVDB that mean out of memory.
const MEMORY: [&str; 5] = ["bad_alloc", "length_error", "vector::", "basic_string::", "array new length"];

/// Whether an exception means out of memory.
fn is_of_memory(what: &str) -> bool {
    MEMORY.iter().any(|word| what.contains(word))
}

/// The error for an exception.
pub(super) fn error_of(what: &str) -> Error {
    const KNOWN: [(&[&str], &str); 5] = [
        (
            &["uniform scale", "uniform voxels"],
            "the grid's voxels are not cubes: this needs the same length on each axis",
        ),
        (&["empty grid"], "the grid has no active voxels"),
        (&["iso-value"], "the value at the surface is not within the grid's band of distances"),
        (&["NaNs or infs"], "the grid has values that are not finite"),
        (
            &["level set", "background value", "outside value", "inside value"],
            "the grid is not a level set with a band of distances on both sides of its surface",
        ),
    ];
    if what == CANCELLED {
        return Error::Cancelled;
    }
    log::info!("OpenVDB: {}", one_line(what));
    if is_of_memory(what) {
        return Error::OutOfMemory;
    }
    match KNOWN.iter().find(|(words, _)| words.iter().any(|word| what.contains(word))) {
        Some((_, ours)) => Error::argument(*ours),
        None => Error::OpenVdb("OpenVDB cannot do this with the grid".into()),
    }
}

/// The error for data that OpenVDB could not read.
pub(in crate::vdb) fn cannot_read(error: &cxx::Exception) -> String {
    let what = error.what();
    log::info!("OpenVDB: {}", crate::error::one_line(what));
    let mentions = |words: &[&str]| words.iter().any(|word| what.contains(word));
    if is_of_memory(what) {
        "the .vdb file is damaged, or needs more memory than it may take".into()
    } else if mentions(&["LookupError", "non-registered", "not registered", "unregistered"]) {
        "the .vdb file is damaged, or holds a kind of grid that frazil does not know".into()
    } else if mentions(&["no longer supported", "unsupported"]) {
        "the .vdb file is of a version that frazil does not read".into()
    } else {
        "the .vdb file cannot be read, it is cut short or damaged".into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_exceptions_become_sentences() {
        let said = |what: &str| error_of(what).to_string();
        let cubes =
            said("RuntimeError: The transform must have uniform scale for the LevelSetTracker to function");
        assert!(cubes.contains("not cubes"), "{cubes}");
        assert_eq!(said("RuntimeError: LevelSetRayIntersector only supports uniform voxels!"), cubes);
        let class =
            said("RuntimeError: LevelSetTracker expected a level set, got a grid of class \"unknown\"");
        assert!(class.contains("not a level set"), "{class}");
        assert!(matches!(error_of("std::bad_alloc"), Error::OutOfMemory));
        assert!(matches!(error_of(CANCELLED), Error::Cancelled));
        let other = said("ValueError: task is undefined - don't call this method directly\n\x1b[31m");
        assert_eq!(other, "OpenVDB cannot do this with the grid");
    }
}
