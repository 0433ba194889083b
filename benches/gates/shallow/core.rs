//! The library without OpenVDB: what it exports and needs, and the manners of its frames.

use std::process::Command;

use crate::harness::Harness;

/// All gates: `make gates` has built and installed it, and its programs (`make hosts-core`).
pub fn run(h: &mut Harness) {
    let root = env!("CARGO_MANIFEST_DIR");
    let symbols = || {
        let mut tool = Command::new("tools/core-symbols");
        tool.arg("target/core/install").current_dir(root);
        tool
    };
    pass_on(h, symbols, ["shallow.core_symbols", "shallow.core_needs"], "by nm and readelf");
    let frames = || Command::new(format!("{root}/target/core/ctest/manners_shallow"));
    let names = [
        "shallow.manners_allocations",
        "shallow.manners_system_calls",
        "shallow.surgery_worst_frame",
        "shallow.surgery_fitted_frame",
    ];
    pass_on(h, frames, names, "10000 frames of examples/c/surgery.c on the core library");
}

/// Passes on the gates that a program prints, as `gate NAME VALUE UNIT ...`.
fn pass_on<const N: usize>(
    h: &mut Harness,
    program: impl Fn() -> Command,
    names: [&'static str; N],
    note: &str,
) {
    if !names.iter().any(|name| h.wants(name)) {
        return;
    }
    let said = program().output().map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    let said = said.unwrap_or_default();
    for name in names {
        let line =
            said.lines().find_map(|line| line.strip_prefix("gate ")?.strip_prefix(name)?.split(' ').nth(1));
        let value = line.and_then(|value| value.parse().ok()).unwrap_or(f64::NAN);
        h.gate(name, value, note);
    }
}
