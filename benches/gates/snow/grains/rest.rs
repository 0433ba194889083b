//! Gates of rest: its effect on the result, and the time that it saves.

use frazil::snow::grain_friction::of_repose;

use crate::harness::Harness;
use crate::process::{json, works};
use crate::scenes::{MAN, wanted_data};
use crate::snow::grains::Experiment;
use crate::snow::grains::passes;

pub fn run(h: &mut Harness) {
    changes(h);
    gain(h);
}

/// Skipping resting grains changes nothing; rest itself changes the angle of a pile little.
fn changes(h: &mut Harness) {
    if h.wants("snow.grains.rest_bytes") {
        let run = |visits_all: bool| {
            let mut pile = Experiment::new(2, 0.005, of_repose(32.0, false), 2);
            pile.visits_all = visits_all;
            pile.pour(3_000, 60, 60);
            (pile.state(), pile.heap.resting())
        };
        let (skipped, all) = (run(false), run(true));
        let note = format!("{} of 3000 grains rest", all.1);
        h.holds("snow.grains.rest_bytes", skipped == all && all.1 > 1_000, &note);
    }
    if h.wants("snow.grains.rest_angle") {
        const SEEDS: u64 = 16;
        let slope = |rests: bool| {
            let one = |seed: u64| {
                let mut pile = Experiment::new(2, 0.005, of_repose(32.0, false), seed);
                pile.params.rests = rests;
                pile.pour(10_000, 220, 30);
                pile.slope()
            };
            (1..=SEEDS).map(one).sum::<f64>() / SEEDS as f64
        };
        let (with, without) = (slope(true), slope(false));
        let note = format!("{with:.2} and {without:.2} degrees, mean of {SEEDS} seeds");
        h.gate("snow.grains.rest_angle", (with - without).abs(), &note);
    }
}

/// A walker of 96 frames: time of the grains' motion in the last 48 without rest, over that with it.
fn gain(h: &mut Harness) {
    let name = "snow.grains.rest_gain";
    let Some(man) = wanted_data(h, &[name], MAN) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let seconds = |rests: bool| {
        let scene = passes::walk(folder.path(), &man, 96, 0.009, &format!("rest = {rests}"));
        let out = folder.path().join(format!("rest-{rests}"));
        works(&mut passes::pass(&scene, &out, 2));
        (49..=96).map(|frame| moving(&out.join(format!("report/grains.{frame:04}.json")))).sum::<f64>()
    };
    let (with, without) = (seconds(true), seconds(false));
    let note = format!("threads=2 {with:.1} s with rest, {without:.1} s without; thesis=1.58 x");
    h.gate(name, without / with, &note);
}

/// Time (s) of the phase `move` of a frame, from its report.
pub fn moving(report: &std::path::Path) -> f64 {
    let report = json(report);
    let phases = report["phases"].as_array().expect("phases").iter();
    phases.filter(|phase| phase["name"] == "move").filter_map(|phase| phase["seconds"].as_f64()).sum()
}
