//! Grains at work: how many in a second, and the same bytes whatever does the work.

use frazil::snow::grain_friction::of_repose;

use crate::snow::grains::Experiment;

/// The state of a heap of 10,000 grains some frames after it began to collapse.
pub fn collapse(threads: usize) -> Vec<u32> {
    let mut heap = Experiment::new(threads, 0.0015, of_repose(25.0, false), 1);
    heap.fill(24);
    (0..8).for_each(|_| heap.step());
    heap.state()
}

/// All grains of a heap that collapses at work.
pub fn measure() -> (f64, String) {
    let mut pile = Experiment::new(1, 0.0015, of_repose(32.0, false), 1);
    pile.params.rests = false;
    pile.fill(60);
    (0..12).for_each(|_| pile.step());
    let frames = 6;
    let start = std::time::Instant::now();
    (0..frames).for_each(|_| pile.step());
    let seconds = start.elapsed().as_secs_f64();
    let rate = pile.heap.count() as f64 * f64::from(frames) / seconds / 1e3;
    let note = format!(
        "threads=1 cpu={:?} {} grains, {} sub-steps, {:.1} M grain-sub-steps/s; thesis=3-13 Newton=1.8 MPM=48-93 Taichi=2.4",
        frazil::numeric::cpu::cpu_level(),
        pile.heap.count(),
        pile.division.sub_steps,
        rate * pile.division.sub_steps as f64 / 1e3
    );
    (rate, note)
}
