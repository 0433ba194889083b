//! Gates of determinism: the same bytes whatever does the work.

use std::hash::{DefaultHasher, Hash, Hasher};

use frazil::vdb::file::{WriteOptions, to_bytes};

use crate::common::tools;
use crate::harness::Harness;
use crate::scenes::{self, context};
use crate::snow::grains::rate;
use crate::snow::speed;

/// All of them.
pub fn run(h: &mut Harness) {
    if h.wants("snow.base.same_bytes_threads") {
        h.holds("snow.base.same_bytes_threads", small(1) == small(2), "1 and 2 threads");
    }
    if h.wants("snow.base.same_bytes_cpu") {
        let hashes = ["baseline", "avx2", "avx512"].map(hash_at);
        let note = format!(
            "FRAZIL_CPU baseline, avx2, avx512; this one has {:?}",
            frazil::numeric::cpu::cpu_level()
        );
        h.holds("snow.base.same_bytes_cpu", hashes.iter().all(|hash| *hash == hashes[0]), &note);
    }
    if h.wants("snow.grains.same_bytes") {
        let one = rate::collapse(1);
        let hashes = ["baseline", "avx2", "avx512"].map(hash_at);
        let is_same = one == rate::collapse(2) && hashes.iter().all(|hash| *hash == hashes[0]);
        h.holds("snow.grains.same_bytes", is_same, "a heap that collapses: 1 and 2 threads, all CPU levels");
    }
    if h.wants("snow.base.same_bytes_tools") {
        let one = tools::outputs(&context(1));
        let same = [2, 8].map(|threads| tools::outputs(&context(threads)) == one);
        let note = format!("{} tools of OpenVDB at 1, 2 and 8 threads", one.len());
        h.holds("snow.base.same_bytes_tools", same == [true; 2], &note);
    }
}

/// The files of `small` after its frames.
fn small(threads: usize) -> Vec<u8> {
    let ctx = context(threads);
    let (mut base, body) = scenes::small(&ctx, 1.4);
    speed::frame_times(&ctx, &mut base, &body);
    let grids = [base.surface(), base.removed(), base.compression(), base.touched()];
    to_bytes(&grids, &WriteOptions::default()).expect("bytes")
}

/// Argument of a run that only prints a hash of the files of `small` and of grains.
pub const HASH: &str = "hash-of-small";

/// Such a run.
pub fn print_hash() {
    let mut hasher = DefaultHasher::new();
    small(2).hash(&mut hasher);
    rate::collapse(2).hash(&mut hasher);
    println!("{:016x}", hasher.finish());
}

/// The hash that a process with one set of instructions prints.
fn hash_at(level: &str) -> Vec<u8> {
    let program = std::env::current_exe().expect("this program's path");
    let output = std::process::Command::new(program).arg(HASH).env("FRAZIL_CPU", level).output();
    output.expect("a process for `small`").stdout
}
