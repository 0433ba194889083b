//! The gates' own rules: a name that no gate has is an error, not silence.

#[path = "../../../benches/gates/harness.rs"]
#[allow(dead_code)]
mod harness;

use harness::{Bound, Harness};

#[test]
fn a_name_that_no_gate_has_is_told() {
    let mut h = Harness::of(
        ["snow.shot", "snow.shot.rebuilt", "capi.typo", "clients.none"].map(String::from).to_vec(),
    );
    assert!(h.wants("snow.shot.rebuilt") && h.wants("snow") && !h.wants("speed"));
    h.gate("snow.shot.rebuilt", 1.0, "bool", Bound::Least(1.0), Bound::Open, "");
    h.gate("capi.cancel", 1.0, "bool", Bound::Least(1.0), Bound::Open, "");
    h.skipped("clients", "not installed");
    assert_eq!(h.unknown(), ["capi.typo"]);
    assert_eq!(Harness::of(Vec::new()).unknown(), Vec::<&str>::new());
}
