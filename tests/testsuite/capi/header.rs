//! The C header: every function has a text and is called by a program of tests/ctest.

use crate::common::header::{bare_functions, functions};

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
