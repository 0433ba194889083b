//! Gates of the house: what tests and tools of the project hold, as numbers.

use std::process::Command;

use crate::harness::Harness;

/// All of them; the one that builds two commits is `tools/build-cpu`.
pub fn run(h: &mut Harness) {
    if h.wants("house.stages") {
        let tests = passed(&["--test", "alone", "shot_stages::"]);
        h.holds("house.stages", tests > 1, &format!("{tests} tests of three stages on one frame loop"));
    }
    if h.wants("house.key") {
        let tests = passed(&["--lib", "scene::systems::tests::"]);
        h.holds("house.key", tests > 1, &format!("{tests} tests of a key that is declared in one place"));
    }
    if h.wants("house.circles") {
        let tests = passed(&["--test", "testsuite", "house::circles::"]);
        h.holds("house.circles", tests > 1, "no file needs, by way of others, a file that needs it");
    }
    if h.wants("house.bare_cli") {
        let tool = Command::new("tools/bare-cli").current_dir(env!("CARGO_MANIFEST_DIR")).output();
        let said = String::from_utf8(tool.expect("a shell").stdout).expect("a text");
        h.holds("house.bare_cli", said.trim_end().ends_with("aim"), "the command without OpenVDB");
    }
}

/// How many of some tests passed; 0 when one failed.
fn passed(tests: &[&str]) -> usize {
    let cargo = Command::new(env!("CARGO"))
        .args(["test", "--release"])
        .args(tests)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo");
    let said = String::from_utf8_lossy(&cargo.stdout);
    let count = |line: &str| line.strip_prefix("test result: ok. ")?.split_once(' ')?.0.parse::<usize>().ok();
    if cargo.status.success() { said.lines().filter_map(count).sum() } else { 0 }
}
