//! The library without OpenVDB: what it exports and needs, and the manners of its frames.

use std::process::Command;

use crate::harness::Harness;
use crate::process::said;

/// All gates: `make gates` has built and installed it, and its programs (`make hosts-core`).
pub fn run(h: &mut Harness) {
    let root = env!("CARGO_MANIFEST_DIR");
    let names = ["shallow.core_symbols", "shallow.core_needs"];
    h.measure_all(names, || {
        let mut tool = Command::new("tools/core-symbols");
        passed_on(tool.arg("target/core/install").current_dir(root), names, "by nm and readelf")
    });
    let names = [
        "shallow.manners_allocations",
        "shallow.manners_system_calls",
        "shallow.surgery_worst_frame",
        "shallow.surgery_fitted_frame",
    ];
    h.measure_all(names, || {
        let mut program = Command::new(format!("{root}/target/core/ctest/manners_shallow"));
        passed_on(&mut program, names, "10000 frames of examples/c/surgery.c on the core library")
    });
}

/// The gates that a program prints, as `gate NAME VALUE UNIT ...`.
fn passed_on<const N: usize>(
    program: &mut Command,
    names: [&str; N],
    note: &'static str,
) -> [(f64, &'static str); N] {
    let said = said(program);
    names.map(|name| {
        let line =
            said.lines().find_map(|line| line.strip_prefix("gate ")?.strip_prefix(name)?.split(' ').nth(1));
        (line.and_then(|value| value.parse().ok()).unwrap_or(f64::NAN), note)
    })
}
