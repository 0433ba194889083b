//! Times of a frame beside the thesis' and stock OpenVDB's: `make bench`.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "gates/harness.rs"]
#[allow(dead_code)]
mod harness;
#[path = "gates/scenes.rs"]
#[allow(dead_code)]
mod scenes;
#[path = "gates/speed.rs"]
#[allow(dead_code)]
mod speed;

use frazil::Context;
use frazil::snow::base_layer::BaseLayer;
use frazil::sweep::Body;
use harness::{median, timed};
use scenes::context;

type Scene = fn(&Context, f64) -> (BaseLayer, Body);

fn main() {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    println!(
        "Snow, base layer: seconds a frame, without files, noise on; median of 5 after a frame to warm up."
    );
    println!(
        "The thesis' times (Table 3.1) are from 6 cores; stock is the thesis' pipeline with OpenVDB's tools.\n"
    );
    println!("| scene | thesis | stock, {cores} threads | frazil, 1 thread | frazil, {cores} threads |");
    println!("|---|---|---|---|---|");
    let scenes: [(&str, &str, Scene, f64); 3] = [
        ("0.4 m object, 2 x 2 m, 5 mm", "1.68-1.84", scenes::small, 2.0),
        ("1.7 m body, 6 x 6 m, 7.5 mm", "3.15-4.59", scenes::large, 6.0),
        ("1.7 m body, 20 x 20 m, 7.5 mm", "-", scenes::large, 20.0),
    ];
    for (name, thesis, make, edge) in scenes {
        let run = |threads: usize| {
            let ctx = context(threads);
            let (mut base, body) = make(&ctx, edge);
            median(speed::frame_times(&ctx, &mut base, &body))
        };
        let ctx = context(cores);
        let (base, body) = make(&ctx, edge);
        let (stock, _) = timed(|| speed::stock(&ctx, &body, &base));
        drop(base);
        println!("| {name} | {thesis} | {stock:.2} | {:.3} | {:.3} |", run(1), run(cores));
    }
}
