//! The C header: every function has a text and is called by a program of tests/ctest.

use std::collections::BTreeSet;

use crate::common::header::{bare_functions, functions, struct_writers};

#[test]
fn every_function_has_a_text_and_is_called_by_a_host() {
    assert!(functions().len() > 50, "{}", functions().len());
    assert_eq!(bare_functions(), Vec::<String>::new());
}

#[test]
fn every_parameter_of_an_out_pointer_is_described() {
    for (name, text) in functions() {
        if name.contains("create") || name.contains("_from_") {
            assert!(text.contains("out: receives"), "{name}: {text}");
        }
    }
}

#[test]
fn functions_say_which_threads_may_call_them() {
    for (name, text) in functions() {
        let says = text.contains("thread") || text.contains("Any number of threads");
        assert!(says, "{name} does not say which threads may call it");
    }
}

#[test]
fn every_function_that_writes_a_struct_is_tried_on_a_guard_page() {
    let writers = struct_writers();
    assert!(writers.len() > 40 && writers.contains("frz_grains_params_of_snow"), "{writers:?}");
    let tables = ["tests/ctest/full/guard_page.c", "tests/ctest/core/guard_page.c"].map(|path| {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        std::fs::read_to_string(path).expect("a program")
    });
    let entries =
        tables.iter().flat_map(|table| table.lines()).filter_map(|line| line.trim().strip_prefix("{\""));
    let tried: BTreeSet<String> =
        entries.filter_map(|entry| Some(entry.split_once('"')?.0.to_string())).collect();
    assert_eq!(tried, writers);
}
