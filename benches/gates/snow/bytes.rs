//! Gates of determinism: the same bytes whatever does the work.

use std::hash::{DefaultHasher, Hash, Hasher};

use frazil::vdb::file::{WriteOptions, to_bytes};

use crate::harness::Harness;
use crate::process::is_same_at_levels;
use crate::scenes::{self, context};
use crate::snow::grains::rate;
use crate::snow::speed;

/// All of them.
pub fn run(h: &mut Harness) {
    h.measure("snow.base.same_bytes_threads", || (small(1) == small(2), "1 and 2 threads"));
    h.measure("snow.base.same_bytes_cpu", || {
        let level = frazil::numeric::cpu::cpu_level();
        let note = format!("FRAZIL_CPU baseline, avx2, avx512; this one has {level:?}");
        (is_same_at_levels("hash-of-small"), note)
    });
    h.measure("snow.grains.same_bytes", || {
        let is_same = rate::collapse(1) == rate::collapse(2) && is_same_at_levels("hash-of-small");
        (is_same, "a heap that collapses: 1 and 2 threads, all CPU levels")
    });
}

/// The files of `small` after its frames.
fn small(threads: usize) -> Vec<u8> {
    let ctx = context(threads);
    let (mut base, body) = scenes::small(&ctx, 1.4);
    speed::frame_times(&ctx, &mut base, &body);
    let grids = [base.surface(), base.removed(), base.compression(), base.touched()];
    to_bytes(&grids, &WriteOptions::default()).expect("bytes")
}

/// The run that prints a hash of the files of `small` and of grains.
pub fn print_hash() {
    let mut hasher = DefaultHasher::new();
    small(2).hash(&mut hasher);
    rate::collapse(2).hash(&mut hasher);
    println!("{:016x}", hasher.finish());
}
