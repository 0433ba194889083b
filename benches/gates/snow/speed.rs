//! Gates of time and memory.

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use frazil::numeric::blocks::{Block, BlockEdit};
use frazil::snow::base_layer::BaseLayer;
use frazil::sweep::{self, Body, SamplesSettings};
use frazil::vdb::{FloatGrid, level_set};
use rayon::prelude::*;

use crate::harness::{Harness, median, timed};
use crate::process::{kilobytes, number_of, own, printed};
use crate::scenes::{self, FRAMES, context};

/// Seconds of each of five frames of a scene, after the first pose and a frame to warm up.
pub fn frame_times(ctx: &frazil::Context, base: &mut BaseLayer, body: &Body) -> Vec<f64> {
    let bodies = std::slice::from_ref(body);
    base.step(ctx, bodies, 0.0, 0.0, 0).expect("first pose");
    let step =
        |frame: i32| timed(|| drop(base.step(ctx, bodies, f64::from(frame - 1), f64::from(frame), frame))).0;
    // The first frame warms up.
    (1..=FRAMES).map(step).skip(1).collect()
}

/// Times of a frame, against the bounds and against stock OpenVDB; memory.
pub fn run(h: &mut Harness) {
    let ctx = context(2);
    let cpu = format!("threads=2 cpu={:?}", frazil::numeric::cpu::cpu_level());
    if h.wants("snow.base.small") || h.wants("snow.base.stock_small") {
        let (mut base, body) = scenes::small(&ctx, 2.0);
        let seconds = median(frame_times(&ctx, &mut base, &body));
        let note = format!("{cpu} thesis=1.7-1.84 s on 6 cores");
        h.gate("snow.base.small", seconds, &note);
        let (stock, noisy) = timed(|| stock(&ctx, &body, &scenes::snow(&ctx, 2.0, 0.005, scenes::EXACT)));
        let note = format!("stock {stock:.2} s{noisy}");
        h.gate("snow.base.stock_small", stock / seconds, &note);
    }
    if ["large", "area", "stock_large", "memory"].iter().any(|name| h.wants(&format!("snow.base.{name}"))) {
        let (mut base, body) = scenes::large(&ctx, 6.0);
        let seconds = median(frame_times(&ctx, &mut base, &body));
        let note = format!("{cpu} thesis=3.15-4.59 s on 6 cores");
        h.gate("snow.base.large", seconds, &note);
        let bytes = base.surface().memory_bytes() as f64 / base.surface().active_voxels() as f64;
        h.gate("snow.base.memory_voxel", bytes, "stock=12-14");
        let peak = number_of(&printed(&mut own("peak-of-large")), "MB ").expect("a peak");
        h.gate("snow.base.memory_peak", peak, "stock=370; a process of its own, the layer's making included");
        let (stock, noisy) = timed(|| stock(&ctx, &body, &base));
        let note = format!("stock {stock:.2} s{noisy}");
        h.gate("snow.base.stock_large", stock / seconds, &note);
        drop(base);
        let (mut wide, body) = scenes::large(&ctx, 20.0);
        let ratio = median(frame_times(&ctx, &mut wide, &body)) / seconds;
        h.gate("snow.base.area", ratio, &cpu);
    }
}

/// The run that makes the frames of `large` and prints its peak of memory (MB).
pub fn print_peak() {
    let ctx = context(2);
    let (mut base, body) = scenes::large(&ctx, 6.0);
    frame_times(&ctx, &mut base, &body);
    println!("MB {}", kilobytes("self", "VmHWM:") / 1024.0);
}

/// The thesis' step with OpenVDB's default tools: 9 poses, dilated, smoothed, advected by noise, cut out.
pub fn stock(ctx: &frazil::Context, body: &Body, base: &BaseLayer) {
    let cell = base.surface().voxel_size();
    let settings = SamplesSettings::new(cell);
    let mut swept = sweep::samples(ctx, std::slice::from_ref(body), 0.0, 1.0, &settings).expect("samples");
    let speed = noise(ctx, &swept);
    level_set::advect_outward(ctx, &mut swept, &speed).expect("advection");
    level_set::intersection_copy(ctx, base.surface(), &swept).expect("removed");
    let mut snow = base.surface().deep_copy().expect("copy");
    level_set::difference(ctx, &mut snow, swept).expect("difference");
}

/// Speed of the advection (m in its unit of time): max(noise, 0), two cells at most, in a level set's leaves.
fn noise(ctx: &frazil::Context, swept: &FloatGrid) -> FloatGrid {
    let cell = swept.voxel_size();
    let mut noise = FastNoiseLite::with_seed(0);
    noise.set_noise_type(Some(NoiseType::Perlin));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(3));
    noise.set_frequency(Some((1.0 / (8.0 * cell)) as f32));
    let block = |leaf: &frazil::vdb::Leaf<'_>| {
        let values = Box::new(std::array::from_fn(|index| {
            let at = [index >> 6, index >> 3 & 7, index & 7];
            let [x, y, z] = [0, 1, 2].map(|axis| f64::from(leaf.origin[axis] + at[axis] as i32) * cell);
            2.0 * cell as f32 * noise.get_noise_3d(x, y, z).max(0.0)
        }));
        BlockEdit::Dense(Block { origin: leaf.origin, values, mask: [u64::MAX; 8] })
    };
    let leaves = swept.leaves().expect("leaves");
    let blocks: Vec<BlockEdit> = ctx.pool().install(|| leaves.par_iter().map(block).collect());
    let mut speed = FloatGrid::new(cell, 0.0).expect("speed");
    speed.replace_blocks(ctx, &blocks).expect("blocks");
    speed
}
