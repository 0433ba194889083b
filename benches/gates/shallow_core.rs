//! The library without OpenVDB: what it exports and needs.

use std::process::Command;

use crate::harness::Harness;

/// Both gates: `make gates` has built and installed it (`make hosts-core`).
pub fn run(h: &mut Harness) {
    let names = ["shallow.core_symbols", "shallow.core_needs"];
    if !names.iter().any(|name| h.wants(name)) {
        return;
    }
    let root = env!("CARGO_MANIFEST_DIR");
    let tool = Command::new("tools/core-symbols").arg("target/core/install").current_dir(root).output();
    let said = String::from_utf8(tool.expect("a shell").stdout).expect("a text");
    for name in names {
        // gate NAME VALUE UNIT ...
        let line =
            said.lines().find_map(|line| line.strip_prefix("gate ")?.strip_prefix(name)?.split(' ').nth(1));
        let value = line.and_then(|value| value.parse().ok()).unwrap_or(f64::NAN);
        h.gate(name, value, "by nm and readelf");
    }
}
