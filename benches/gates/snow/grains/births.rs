//! Gates of births: removed snow pays for every grain, for any count of frames, and birth throws none.

use frazil::Context;
use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::{BaseLayer, Params as BaseParams};
use frazil::snow::grains::{Base, Grains, Object, PACKING, Params, StepReport, Surroundings};
use frazil::sweep::Body;
use frazil::vdb::FloatGrid;

use crate::common::shapes::sphere;
use crate::harness::Harness;
use crate::scenes::{context, layer};
use crate::snow::grains::{FRAME, ON_A_FLOOR};

/// Edge of a cell of the layer (m).
const CELL: f64 = 0.01;
/// Height below which grains are dropped (m): under the snow.
const LOWEST: f64 = -0.1;

pub fn run(h: &mut Harness) {
    h.measure("snow.grains.ledger", ledger);
    h.measure("snow.grains.birth_spread", spread);
    h.measure("snow.grains.birth_speed", speed);
}

/// Snow 0.15 m deep.
fn snow(ctx: &Context) -> BaseLayer {
    layer(ctx, 0.0, [-0.3, -0.25, 0.3, 0.25], 0.15, CELL, BaseParams::for_cell(CELL))
}

/// A body that passes positions (m) at times (s).
fn body(mesh: TriMesh, way: &[(f64, [f64; 3])]) -> Body {
    let key = |&(time, at): &(f64, [f64; 3])| Key { time, at: DVec3::from(at), turn: DVec3::zeros() };
    let keys = Keys::new(way.iter().map(key).collect()).expect("keys");
    Body::new(Box::new(Rigid::new(mesh, keys)), 0.0).expect("a body")
}

/// A ball that is pressed into the snow, then drawn through it and over its edge.
fn plough() -> Body {
    let way = [(0.0, [-0.1, 0.4, 0.0]), (0.25, [-0.1, 0.15, 0.0]), (1.0, [0.4, 0.15, 0.0])];
    body(sphere(0.1, 24), &way)
}

/// Steps a layer, and grains with it; returns the volume that the layer lost (m3) and the report of the grains.
fn step(
    ctx: &Context,
    base: &mut BaseLayer,
    grains: &mut Grains,
    body: &Body,
    [from, to]: [f64; 2],
    frame: i32,
) -> (f64, StepReport) {
    let lost = base.step(ctx, std::slice::from_ref(body), from, to, frame).expect("a step");
    let around = Surroundings {
        base: Base::Changed(base.surface(), base.before()),
        objects: &[Object::new(body, 0.3)],
        floor: None,
        lowest: LOWEST,
        ..ON_A_FLOOR
    };
    (lost.removed_volume, grains.step(ctx, &around, [from, to], frame).expect("a step"))
}

/// Grains some frames after a plough started to move; some of them are at rest.
pub fn ploughed(ctx: &Context, frames: i32) -> Grains {
    ploughed_snow(ctx, frames).1
}

/// The layer and the grains some frames after a plough started to move.
pub fn ploughed_snow(ctx: &Context, frames: i32) -> (BaseLayer, Grains) {
    let (mut base, body) = (snow(ctx), plough());
    let mut grains = Grains::new(Params::for_cell(CELL)).expect("grains");
    for frame in 1..=frames {
        let times = [f64::from(frame - 1) * FRAME, f64::from(frame) * FRAME];
        step(ctx, &mut base, &mut grains, &body, times, frame);
    }
    (base, grains)
}

/// The balance of each frame: grains paid for by snow, owed before, owed after and born.
fn ledger() -> (f64, &'static str) {
    let ctx = context(2);
    let params = Params { compression: 0.5, ..Params::for_cell(CELL) };
    let paid = |volume: f64| {
        let grain = std::f64::consts::PI * (2.0 * params.radius).powi(3) / 6.0;
        (1.0 - params.compression) * volume * PACKING / grain
    };
    let (mut base, mut grains) = (snow(&ctx), Grains::new(params).expect("grains"));
    let body = plough();
    let (mut owed, mut born, mut dropped) = (0.0, 0, 0);
    let (mut worst, mut off, mut volumes) = (0.0f64, 0, [0.0; 2]);
    for frame in 1..=48 {
        let time = |frame: i32| f64::from(frame) * FRAME;
        let times = [time(frame - 1), time(frame)];
        let (lost, report) = step(&ctx, &mut base, &mut grains, &body, times, frame);
        worst = worst.max((paid(report.removed_volume) + owed - report.owed - report.born as f64).abs());
        owed = report.owed;
        (born, dropped) = (born + report.born, dropped + report.dropped);
        off = off.max(born.abs_diff(grains.count() + dropped));
        volumes = [volumes[0] + lost, volumes[1] + report.removed_volume];
    }
    let apart = volumes[1] / volumes[0] - 1.0;
    println!(
        "# {born} born, {dropped} dropped, {owed:.1} owed; the layer's own volume differs by {apart:.1e}"
    );
    println!(
        "# {worst:.1e} grains of a frame unaccounted for, at most {off} births neither there nor dropped"
    );
    assert!(dropped > 0, "the experiment drops none");
    // The rest is rounding of sums.
    let worst = if worst < 1.0e-6 { 0.0 } else { worst };
    (worst + off as f64, "")
}

/// Count of grains of the same print, made in few and in many frames.
fn spread() -> (f64, &'static str) {
    let ctx = context(2);
    let params = Params { compression: 0.5, ..Params::for_cell(CELL) };
    let body =
        body(sphere(0.1, 24), &[(0.0, [0.0, 0.26, 0.0]), (0.5, [0.0, 0.17, 0.0]), (1.0, [0.0, 0.26, 0.0])]);
    let counts = [6, 24, 96].map(|frames| {
        let (mut base, mut grains) = (snow(&ctx), Grains::new(params).expect("grains"));
        let (mut born, mut owed, mut volume) = (0, 0.0, 0.0);
        for frame in 1..=frames {
            let time = |frame: i32| f64::from(frame) / f64::from(frames);
            let times = [time(frame - 1), time(frame)];
            let (_, report) = step(&ctx, &mut base, &mut grains, &body, times, frame);
            born += report.born;
            (owed, volume) = (report.owed, volume + report.removed_volume);
        }
        println!("# {frames} frames: {born} born, {owed:.1} owed, {:.4} l of snow", volume * 1.0e3);
        born as f64
    });
    let most = counts.iter().copied().fold(f64::MIN, f64::max);
    let least = counts.iter().copied().fold(f64::MAX, f64::min);
    ((most - least) / (counts.iter().sum::<f64>() / 3.0) * 100.0, "")
}

/// Speed of grains a frame after birth, pushed only by each other and the snow around them.
fn speed() -> (f64, String) {
    let ctx = context(2);
    let params = Params { compression: 0.0, gravity: 0.0, ..Params::for_cell(CELL) };
    let (mut base, body) = (snow(&ctx), plough());
    let whole = base.surface().deep_copy().expect("a copy");
    let speed = |layers: [&FloatGrid; 2], frame: i32| {
        let around = Surroundings { base: Base::Whole(layers), floor: None, lowest: LOWEST, ..ON_A_FLOOR };
        let mut grains = Grains::new(params).expect("grains");
        let report = grains.step(&ctx, &around, [0.0, FRAME], frame).expect("a step");
        if report.fastest > 0.0 {
            println!("# frame {frame}: {} born, the fastest at {:.1e} m/s", report.born, report.fastest);
        }
        (report.born, f64::from(report.fastest))
    };
    let (mut born, mut fastest) = (0, 0.0f64);
    let mut add = |(count, speed): (usize, f64)| (born, fastest) = (born + count, fastest.max(speed));
    for frame in 1..=24 {
        let time = |frame: i32| f64::from(frame) * FRAME;
        let before = base.surface().deep_copy().expect("a copy");
        base.step(&ctx, std::slice::from_ref(&body), time(frame - 1), time(frame), frame).expect("a step");
        add(speed([&before, base.surface()], frame));
    }
    // All removed snow at once.
    add(speed([&whole, base.surface()], 99));
    (fastest, format!("{born} births"))
}
