//! Gates of time and memory.

use frazil::snow::base_layer::BaseLayer;
use frazil::sweep::{self, Body, SamplesSettings};
use frazil::vdb::{FloatGrid, level_set};

use crate::harness::{Bound, Harness, median, timed};
use crate::scenes::{self, FRAMES, context};

/// Seconds of each frame of a scene, after the first pose.
pub fn frame_times(ctx: &frazil::Context, base: &mut BaseLayer, body: &Body) -> Vec<f64> {
    let bodies = std::slice::from_ref(body);
    base.step(ctx, bodies, 0.0, 0.0, 0).expect("first pose");
    let step =
        |frame: i32| timed(|| drop(base.step(ctx, bodies, f64::from(frame - 1), f64::from(frame), frame))).0;
    (1..=FRAMES).map(step).collect()
}

/// Times of a frame, against the bounds and against stock OpenVDB; memory.
pub fn run(h: &mut Harness) {
    let ctx = context(2);
    let cpu = format!("threads=2 cpu={:?}", frazil::base::cpu::cpu_level());
    if h.wants("snow.base.small") || h.wants("snow.base.stock_small") {
        let (mut base, body) = scenes::small(&ctx, 2.0);
        let seconds = median(frame_times(&ctx, &mut base, &body));
        let note = format!("{cpu} thesis=1.7-1.84 s on 6 cores");
        h.gate("snow.base.small", seconds, "s", Bound::Most(0.15), Bound::Most(0.04), &note);
        let (stock, noisy) = timed(|| stock(&ctx, &body, &scenes::snow(&ctx, 2.0, 0.005, scenes::EXACT)));
        let note = format!("stock {stock:.2} s{noisy}");
        h.gate("snow.base.stock_small", stock / seconds, "x", Bound::Least(20.0), Bound::Least(60.0), &note);
    }
    if ["large", "area", "stock_large", "memory"].iter().any(|name| h.wants(&format!("snow.base.{name}"))) {
        let (mut base, body) = scenes::large(&ctx, 6.0);
        let seconds = median(frame_times(&ctx, &mut base, &body));
        let note = format!("{cpu} thesis=3.15-4.59 s on 6 cores");
        h.gate("snow.base.large", seconds, "s", Bound::Most(0.15), Bound::Most(0.05), &note);
        let bytes = base.surface().memory_bytes() as f64 / base.surface().active_voxels() as f64;
        h.gate("snow.base.memory_voxel", bytes, "B", Bound::Most(14.0), Bound::Most(12.0), "stock=12-14");
        let peak = peak_megabytes();
        h.gate(
            "snow.base.memory_peak",
            peak,
            "MB",
            Bound::Most(300.0),
            Bound::Most(200.0),
            "stock=370; this process",
        );
        let (stock, noisy) = timed(|| stock(&ctx, &body, &base));
        let note = format!("stock {stock:.2} s{noisy}");
        h.gate("snow.base.stock_large", stock / seconds, "x", Bound::Least(40.0), Bound::Least(120.0), &note);
        drop(base);
        let (mut wide, body) = scenes::large(&ctx, 20.0);
        let ratio = median(frame_times(&ctx, &mut wide, &body)) / seconds;
        h.gate("snow.base.area", ratio, "x", Bound::Most(1.2), Bound::Most(1.05), &cpu);
    }
}

fn peak_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0");
    line.split_whitespace().next().and_then(|kilobytes| kilobytes.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}

/// The thesis' step with OpenVDB's default tools: 9 poses, dilated, smoothed, advected by noise, cut out.
fn stock(ctx: &frazil::Context, body: &Body, base: &BaseLayer) {
    let cell = base.surface().voxel_size();
    let settings = SamplesSettings::new(cell);
    let mut swept = sweep::samples(ctx, std::slice::from_ref(body), 0.0, 1.0, &settings).expect("samples");
    let speed = FloatGrid::new(cell, cell as f32).expect("speed");
    level_set::advect_outward(ctx, &mut swept, &speed).expect("advection");
    level_set::intersection_copy(ctx, base.surface(), &swept).expect("removed");
    let mut snow = base.surface().deep_copy().expect("copy");
    level_set::difference(ctx, &mut snow, swept).expect("difference");
}
