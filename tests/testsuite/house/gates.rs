//! The gates' own rules: each is declared once, and a name that no gate has is an error, not silence.

#[path = "../../../benches/gates/harness.rs"]
#[allow(dead_code)]
mod harness;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use harness::{Bound, GATES, Gate, Harness, Speed};

const fn gate(name: &'static str) -> Gate {
    Gate { name, unit: "x", must: Bound::Most(2.0), aim: Bound::Least(1.0), speed: Speed::Any }
}

const FOUR: &[Gate] =
    &[gate("shot.wall"), gate("shot.rebuilt"), gate("clients.usd"), gate("clients.blender")];

fn harness(only: &[&str]) -> Result<Harness, String> {
    Harness::of(FOUR, only.iter().map(|name| name.to_string()).collect())
}

#[test]
fn a_name_that_no_gate_has_is_reported() {
    let error = harness(&["shot", "shot.rebuilt.twice", "walls"]).err();
    assert_eq!(error.as_deref(), Some("no gate is named shot.rebuilt.twice, walls"));
    let h = harness(&["shot.rebuilt", "clients.u"]).unwrap();
    assert!(h.wants("shot") && h.wants("shot.rebuilt") && !h.wants("shot.wall") && h.wants("clients"));
    assert!(harness(&[]).unwrap().wants("shot.wall"));
}

#[test]
fn a_gate_that_was_not_measured_is_reported() {
    let mut h = harness(&["shot", "clients"]).unwrap();
    h.gate("shot.rebuilt", 3.0, "");
    assert_eq!(h.missing(), ["shot.wall", "clients.usd", "clients.blender"]);
    h.skipped("clients", "not installed");
    assert_eq!(h.missing(), ["shot.wall"]);
    // What was not asked for may be measured along with it.
    let mut h = harness(&["shot.wall"]).unwrap();
    h.gate("shot.wall", 1.0, "");
    h.gate("shot.rebuilt", true, "");
    assert_eq!(h.missing(), Vec::<&str>::new());
}

#[test]
#[should_panic(expected = "list.rs has no gate shot.typo")]
fn a_gate_that_is_not_declared_is_an_error() {
    harness(&[]).unwrap().gate("shot.typo", 1.0, "");
}

#[test]
fn gates_are_declared_once_and_an_aim_keeps_the_bound() {
    let names: BTreeSet<&str> = GATES.iter().map(|gate| gate.name).collect();
    assert_eq!(names.len(), GATES.len());
    for gate in GATES {
        let (Bound::Most(aim) | Bound::Least(aim)) = gate.aim else { continue };
        assert!(gate.must.holds(aim), "{} aims at {aim}", gate.name);
    }
}

#[test]
fn the_names_in_the_code_are_declared() {
    let mut count = 0;
    let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/gates")];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let (inner, own): (Vec<_>, Vec<_>) = paths.partition(|path| path.is_dir());
        folders.extend(inner);
        files.extend(own);
    }
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        for (call, is_whole) in [("measure", true), ("gate", true), ("skipped", false), ("wants", false)] {
            for rest in text.split(&format!("h.{call}(")).skip(1) {
                // Names that are put together are looked up when they are measured.
                let Some(name) = rest.trim_start().strip_prefix('"') else { continue };
                let name = name.split('"').next().unwrap();
                let is_it = |gate: &Gate| gate.name == name || !is_whole && gate.name.starts_with(name);
                assert!(GATES.iter().any(is_it), "{}: list.rs has no gate {name}", path.display());
                count += 1;
            }
        }
        for list in text.split("h.measure_all([").skip(1) {
            let names = list.split(']').next().unwrap().split('"').skip(1).step_by(2);
            for name in names.filter(|name| name.contains('.')) {
                assert!(
                    GATES.iter().any(|gate| gate.name == name),
                    "{}: list.rs has no gate {name}",
                    path.display()
                );
                count += 1;
            }
        }
    }
    assert!(count > 120, "{count}");
}
