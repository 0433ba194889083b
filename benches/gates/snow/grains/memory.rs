//! Gate of the memory of grains in a step, measured in a process of its own.

use frazil::geometry::DVec3;
use frazil::snow::grains::{Grains, Params, memory};

use crate::harness::Harness;
use crate::process::{kilobytes, number_of, own, printed};
use crate::scenes::context;
use crate::snow::grains::{FRAME, ON_A_FLOOR, Random};

/// Count of grains along each axis of a box of them that settles.
const SIDES: [u32; 3] = [90, 32, 90];
/// Count of frames until they lie on each other.
const SETTLE: usize = 10;

pub fn run(h: &mut Harness) {
    h.measure("snow.grains.memory", || of_a_step("memory-of-grains"));
}

/// The bytes that a run of this program prints.
pub fn of_a_step(word: &str) -> (f64, &'static str) {
    let bytes = number_of(&printed(&mut own(word)), "bytes ").expect("a number of bytes");
    (bytes, "the peak of a step, without what the process had before")
}

/// The run that steps grains and prints their memory.
pub fn print_memory() {
    let ctx = context(2);
    // Memory of the threads themselves is in the baseline.
    ctx.pool().install(|| rayon::broadcast(|_| vec![1u8; 1 << 16].len()));
    let mut random = Random(7);
    let params = Params { rests: false, ..Params::for_cell(0.0075) };
    let mut grains = Grains::new(params).expect("grains");
    let count = SIDES.iter().product::<u32>() as usize;
    let mut positions = Vec::with_capacity(count);
    for index in 0..count as u32 {
        let site = [index % SIDES[0], index / SIDES[0] % SIDES[1], index / SIDES[0] / SIDES[1]];
        let off = site.map(|at| (f64::from(at) + 0.5 + 0.06 * random.next()) * 1.1 * 2.0 * params.radius);
        positions.push(DVec3::from(off));
    }
    let before = kilobytes("self", "VmRSS:");
    let each = |kilobytes: f64| kilobytes * 1024.0 / count as f64;
    grains.emit(&positions, &[], 0).expect("grains");
    println!("# grains that were added: {:.0} bytes each", each(kilobytes("self", "VmRSS:") - before));
    for frame in 0..SETTLE {
        grains.step(&ctx, &ON_A_FLOOR, [0.0, FRAME], frame as i32).expect("a step");
    }
    // Returns memory that earlier steps freed to the system, so that only what is in use counts.
    let resident = || {
        // SAFETY: a function of glibc that any thread may call.
        unsafe { malloc_trim(0) };
        kilobytes("self", "VmRSS:")
    };
    let between = resident() - before;
    println!("# between two steps (the grains, impulses of contacts, what they touch): {:.0}", each(between));
    let copy = grains.clone();
    println!("# the copy to which a failed step returns: {:.0}", each(resident() - before - between));
    drop(copy);
    resident();
    // From here on the peak is that of one step.
    let is_reset = std::fs::write("/proc/self/clear_refs", "5").is_ok();
    grains.step(&ctx, &ON_A_FLOOR, [0.0, FRAME], SETTLE as i32).expect("a step");
    let peak = kilobytes("self", "VmHWM:") - before;
    println!("# a step adds (that copy, blocks, anchors, pairs in batches): {:.0}", each(peak - between));
    println!("# after it, before freed memory goes back: {:.0}", each(kilobytes("self", "VmRSS:") - before));
    println!("# the library reckons with {}", memory(count) / count as u64);
    println!(
        "# {count} grains; the peak is {} one step",
        if is_reset { "that of" } else { "not only that of" }
    );
    println!("bytes {}", each(peak));
}

// SAFETY: the declaration is that of glibc.
unsafe extern "C" {
    /// Returns freed memory to the system.
    fn malloc_trim(pad: usize) -> i32;
}
