//! Gates of the file format: other readers see what we see.

use std::process::Command;

use frazil::vdb::file::{WriteOptions, write};

use crate::harness::Harness;
use crate::scenes::{self, context};

/// All of them: active count, class and cell of a level set.
pub fn run(h: &mut Harness) {
    if !h.wants("snow.base.readers") {
        return;
    }
    let ctx = context(2);
    let base = scenes::snow(&ctx, 1.0, 0.01, scenes::EXACT);
    let path = std::env::temp_dir().join(format!("frazil-gates-{}.vdb", std::process::id()));
    write(&path, &[base.surface()], &WriteOptions::default()).expect("write");
    let expected = format!("{} level set 0.01", base.surface().active_voxels());

    // Crate vdb-rs in a program that does not link frazil: benches/reader.rs.
    let mut reader = Command::new(env!("CARGO"));
    reader.current_dir(env!("CARGO_MANIFEST_DIR")).args(["bench", "--quiet", "--bench", "reader", "--"]);
    let seen = said(reader.arg(&path).arg("surface"));
    h.holds("snow.base.readers_vdb_rs", seen == expected, &format!("{seen} | {expected}"));

    let script = "import sys, pyopenvdb as v; g = v.read(sys.argv[1], 'surface'); \
                  print(g.activeVoxelCount(), g.gridClass, g.transform.voxelSize()[0])";
    let seen = said(Command::new("/usr/bin/python3").args(["-c", script]).arg(&path));
    h.holds("snow.base.readers_pyopenvdb", seen == expected, &format!("{seen} | {expected}"));
    let print = Command::new("vdb_print").arg("-l").arg(&path).output();
    h.holds("snow.base.readers_vdb_print", print.is_ok_and(|output| output.status.success()), "");
    let _ = std::fs::remove_file(path);
}

/// What a program prints; nothing where it cannot be started.
fn said(command: &mut Command) -> String {
    let output = command.output().map(|output| String::from_utf8_lossy(&output.stdout).trim().to_string());
    output.unwrap_or_default()
}
