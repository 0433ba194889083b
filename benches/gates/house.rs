//! Gate of the house: what a test of the project holds.

use std::process::Command;

/// Whether no file needs, by way of others, a file that needs it.
pub fn circles() -> (f64, &'static str) {
    let test = ["test", "--release", "--test", "testsuite", "house::circles::"];
    let cargo = Command::new(env!("CARGO")).args(test).current_dir(env!("CARGO_MANIFEST_DIR")).output();
    let passed = String::from_utf8_lossy(&cargo.expect("cargo").stdout).contains("test result: ok. 2 passed");
    (
        f64::from(u8::from(!passed)),
        "files that need, by way of others, a file that needs them: the test house::circles",
    )
}
