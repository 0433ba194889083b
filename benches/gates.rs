//! Every promise with a number: `make gates [ONLY=prefix,...]`.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "gates/harness.rs"]
mod harness;
#[path = "gates/oracle.rs"]
mod oracle;
#[path = "gates/scenes.rs"]
mod scenes;
#[path = "gates/snow.rs"]
mod snow;
#[path = "gates/speed.rs"]
mod speed;
#[path = "gates/sweeps.rs"]
mod sweeps;

use frazil::vdb::file::{WriteOptions, to_bytes};
use harness::Harness;
use scenes::context;

fn main() {
    if std::env::args().any(|argument| argument == speed::PEAK) {
        return speed::print_peak();
    }
    let mut h = Harness::from_arguments();
    sweeps::run(&mut h);
    snow::run(&mut h);
    speed::run(&mut h);
    bytes(&mut h);
    readers(&mut h);
    h.finish();
}

/// The same bytes from 1 and 2 threads.
fn bytes(h: &mut Harness) {
    if !h.wants("snow.base.same_bytes") {
        return;
    }
    let make = |threads: usize| {
        let ctx = context(threads);
        let (mut base, body) = scenes::small(&ctx, 1.4);
        speed::frame_times(&ctx, &mut base, &body);
        let grids = [base.surface(), base.removed(), base.compression(), base.touched()];
        to_bytes(&grids, &WriteOptions::default()).expect("bytes")
    };
    h.holds("snow.base.same_bytes_threads", make(1) == make(2), "1 and 2 threads");
}

/// pyopenvdb and vdb_print see what we see.
fn readers(h: &mut Harness) {
    if !h.wants("snow.base.readers") {
        return;
    }
    let ctx = context(2);
    let base = scenes::snow(&ctx, 1.0, 0.01, scenes::EXACT);
    let path = std::env::temp_dir().join(format!("frazil-gates-{}.vdb", std::process::id()));
    frazil::vdb::file::write(&path, &[base.surface()], &WriteOptions::default()).expect("write");
    let script = "import sys, pyopenvdb as v; g = v.readAllGridMetadata(sys.argv[1])[0]; g = v.read(sys.argv[1], 'surface'); \
                  print(g.activeVoxelCount(), g.gridClass, g.transform.voxelSize()[0])";
    let python = std::process::Command::new("/usr/bin/python3").args(["-c", script]).arg(&path).output();
    let expected = format!("{} level set 0.01", base.surface().active_voxels());
    let said =
        python.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_string()).unwrap_or_default();
    h.holds("snow.base.readers_pyopenvdb", said == expected, &format!("{said} | {expected}"));
    let print = std::process::Command::new("vdb_print").arg("-l").arg(&path).output();
    h.holds("snow.base.readers_vdb_print", print.is_ok_and(|output| output.status.success()), "");
    let _ = std::fs::remove_file(path);
}
