//! Scratch profile.
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../benches/gates/scenes.rs"]
mod scenes;
use scenes::{FRAMES, context};
fn main() {
    let threads = std::env::args().nth(2).map_or(2, |t| t.parse().unwrap());
    let ctx = context(threads);
    let which = std::env::args().nth(1).unwrap();
    let (mut base, body) = if which == "small" { scenes::small(&ctx, 2.0) } else { scenes::large(&ctx, 6.0) };
    let bodies = std::slice::from_ref(&body);
    base.step(&ctx, bodies, 0.0, 0.0, 0).unwrap();
    for f in 1..=FRAMES {
        let t = std::time::Instant::now();
        let r = base.step(&ctx, bodies, f64::from(f - 1), f64::from(f), f).unwrap();
        println!(
            "{:.1} ms faces {} blocks {} vol {:.5} {:?}",
            t.elapsed().as_secs_f64() * 1e3,
            r.sweep_faces,
            r.touched_blocks,
            r.removed_volume,
            r.stages
        );
    }
}
