//! Gates of whole shots, made by the command with default settings: what their folders hold and take, what was forecast of them, and farms
//! that make them in parts.

mod chunks;
mod contents;
mod forecast;
mod made;
mod resumed;
mod same;

use std::path::Path;

use crate::common::clients;
use crate::harness::Harness;
use crate::process::{number_of, said};
use made::{DEMO, Made, scenes};

/// All of them.
pub fn run(h: &mut Harness) {
    let of_demo = [
        "files.size",
        "files.usd_errors",
        "files.usd_whole",
        "files.usd_whole_blender",
        "first.eta",
        "first.memory",
    ];
    if of_demo.iter().any(|name| h.wants(name)) {
        let folder = tempfile::tempdir().expect("a folder");
        let scenes = scenes(folder.path());
        let shots: Vec<Made> =
            DEMO.iter().map(|shot| Made::with_defaults(shot, &scenes, folder.path())).collect();
        h.measure("files.size", || contents::size(&shots, &scenes, folder.path()));
        contents::usd(h, &shots);
        h.measure("first.eta", || forecast::time_left(&shots));
        h.measure("first.memory", || forecast::memory(&shots));
    }
    h.measure("files.same", same::is_same);
    h.measure("first.from", resumed::recomputed);
    h.measure("farm.chunks", chunks::speed);
    farms(h);
}

/// A shot by OpenJD and Slurm, by the script of `make test-farm`.
fn farms(h: &mut Harness) {
    if !h.wants("farm.equal") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    match clients::farm(Path::new(env!("CARGO_BIN_EXE_frazil")), folder.path()) {
        Some(mut script) => {
            let text = said(&mut script);
            let differing = number_of(&text, "farm.equal").unwrap_or(f64::INFINITY);
            h.gate("farm.equal", differing, text.lines().last().unwrap_or_default());
        }
        None => h.skipped("farm.equal", "not installed: make test-farm"),
    }
}
