//! Times of a frame beside the thesis' and stock OpenVDB's, errors beside those of other methods: `make bench [ONLY=snow,surface,shallow]`.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "gates/surface/edit_history.rs"]
#[allow(dead_code)]
mod edit_history;
#[path = "gates/harness.rs"]
#[allow(dead_code)]
mod harness;
#[path = "times/matching.rs"]
mod matching;
#[path = "gates/process.rs"]
#[allow(dead_code)]
mod process;
#[path = "times/projections.rs"]
mod projections;
#[path = "times/rebuilding.rs"]
mod rebuilding;
#[path = "gates/surface/rebuilt_sequences.rs"]
#[allow(dead_code)]
mod rebuilt_sequences;
#[path = "gates/scenes.rs"]
#[allow(dead_code)]
mod scenes;
#[path = "times/shallow.rs"]
mod shallow;
#[path = "gates/shallow/speed.rs"]
#[allow(dead_code)]
mod shallow_speed;
#[path = "gates/snow/speed.rs"]
#[allow(dead_code)]
mod speed;
#[path = "times/surface.rs"]
mod surface;
#[path = "gates/surface/known_motion.rs"]
#[allow(dead_code)]
mod surface_gates;

use common::character::{data, walk_scene};
use frazil::Context;
use frazil::scene::{Inputs, Scene};
use frazil::snow::base_layer::{BaseLayer, Params};
use frazil::sweep::Body;
use harness::{median, timed};
use scenes::context;

type Make = fn(&Context, f64) -> (BaseLayer, Body);

/// What can be asked for.
const SYSTEMS: [&str; 3] = ["snow", "surface", "shallow"];

fn main() {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    // `cargo bench` adds an argument of its own.
    let asked: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let asked: Vec<&str> = asked.iter().flat_map(|names| names.split(',')).collect();
    if let Some(unknown) = asked.iter().find(|name| !SYSTEMS.contains(name)) {
        eprintln!("no system is named {unknown}, only {}", SYSTEMS.join(", "));
        std::process::exit(2);
    }
    let [snow_too, surface_too, shallow_too] = SYSTEMS.map(|name| asked.is_empty() || asked.contains(&name));
    if snow_too {
        snow(cores);
        walk(cores);
    }
    if surface_too {
        surface::tables(cores);
        rebuilding::tables();
        matching::tables();
    }
    if shallow_too {
        shallow::tables();
    }
}

/// Steps of the base layer.
fn snow(cores: usize) {
    println!(
        "Snow, base layer: seconds a frame, without files, noise on; median of 5 after a frame to warm up."
    );
    println!(
        "The thesis' times (Table 3.1) are from 6 cores; stock is the thesis' pipeline with OpenVDB's tools.\n"
    );
    println!("| scene | thesis | stock, {cores} threads | frazil, 1 thread | frazil, {cores} threads |");
    println!("|---|---|---|---|---|");
    let scenes: [(&str, &str, Make, f64); 3] = [
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

/// CesiumMan walks over 6 x 6 m for 240 frames, 7.5 mm: steps alone, and the program with its files.
fn walk(cores: usize) {
    let Some(man) = data("character/CesiumMan.glb") else {
        return println!("\nThe walk of a character is skipped: no data.");
    };
    let folder = tempfile::tempdir().expect("a folder");
    println!(
        "\nA character walks, 6 x 6 m, 7.5 mm, 240 frames: seconds a frame (average, worst), then of the whole pass with files.\n"
    );
    println!("| | thesis | frazil, 1 thread | frazil, {cores} threads |");
    println!("|---|---|---|---|");
    let steps = |threads: usize| {
        let ctx = context(threads);
        let scene = Scene::read(&walk_scene(folder.path(), &man, 240, 0.0075, "")).expect("a scene");
        let inputs = Inputs::load(&scene).expect("inputs");
        let layer = inputs.layer(&ctx).expect("a layer");
        let mut base =
            BaseLayer::new(&ctx, layer, Params::for_cell(scene.snow().expect("snow").cell)).expect("a layer");
        let at = |frame: i32| f64::from(frame) / 24.0;
        let step =
            |frame: i32| timed(|| drop(base.step(&ctx, &inputs.bodies, at(frame - 1), at(frame), frame))).0;
        let times: Vec<f64> = (2..=240).map(step).collect();
        let (sum, worst) =
            times.iter().fold((0.0, 0.0f64), |(sum, worst), time| (sum + time, worst.max(*time)));
        format!("{:.3}, {worst:.3}", sum / times.len() as f64)
    };
    println!("| a step | 3.15, 4.59 | {} | {} |", steps(1), steps(cores));
    for mode in ["full", "delta"] {
        let pass = |threads: usize| {
            let output = format!("base_mode = \"{mode}\"");
            let scene = walk_scene(folder.path(), &man, 240, 0.0075, &output);
            let out = folder.path().join(format!("{mode}{threads}"));
            let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_frazil"));
            command.arg("snow").arg(scene).arg("-o").arg(&out).args([
                "-q",
                "--threads",
                &threads.to_string(),
            ]);
            let (seconds, _) = timed(|| assert!(command.status().expect("frazil").success()));
            std::fs::remove_dir_all(out).expect("the output");
            seconds
        };
        println!("| the pass, {mode} | 756 | {:.1} | {:.1} |", pass(1), pass(cores));
    }
}
