//! Gates of the packages for pip and of the Blender add-on, by the scripts of `make test-wheel` and `make test-blender`, which print a line
//! `NAME: NUMBER` for each.

use std::path::Path;
use std::process::Command;

use crate::harness::Harness;
use crate::process::{number_of, said};

/// All of them.
pub fn run(h: &mut Harness) {
    let of_wheel = ["blender.pip", "blender.two_openvdbs", "wheel.notices"];
    of_script(h, "tools/test-wheel", &of_wheel, "target/wheels", "make test-wheel");
    let of_addon = [
        "blender.operators",
        "blender.roundtrip_keys",
        "blender.roundtrip_ball",
        "blender.load",
        "blender.render",
        "blender.cancel",
        "blender.alembic",
        "blender.tutorials",
    ];
    of_script(h, "tools/test-blender", &of_addon, "target/blender", "make test-blender");
}

/// Gates that a script prints, if what it tests was made.
fn of_script(h: &mut Harness, script: &str, names: &[&str], made: &str, how: &str) {
    if !names.iter().any(|name| h.wants(name)) {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    if !root.join(made).is_dir() || !root.join("target/clients-blender").is_dir() {
        for name in names {
            if h.wants(name) {
                h.skipped(name, &format!("not made: {how}"));
            }
        }
        return;
    }
    let text = said(Command::new(root.join(script)).current_dir(root));
    for name in names {
        h.measure(name, || {
            let key = format!("{name}:");
            let note = text.lines().find(|line| line.starts_with(&key)).unwrap_or("it was not printed");
            (number_of(&text, &key).unwrap_or(f64::INFINITY), note.to_string())
        });
    }
}
