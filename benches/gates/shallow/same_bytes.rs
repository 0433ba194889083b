//! Gates of shallow's determinism: the same liquid however the scene lies, whatever does the work, and when a run is played again.

use std::hash::{DefaultHasher, Hash, Hasher};

use frazil::numeric::cpu::cpu_level;
use frazil::shallow::Shallow;
use frazil::shallow::free_fall::mesh::Balls;
use frazil::shallow::free_fall::{Droplet, Falls};
use frazil::shallow::surface::rim::ledges::Ledges;
use frazil::shallow::surface::{Depths, Layout, Surface};
use frazil::{Context, Pool};

use crate::common::bodies::Dice;
use crate::common::shallow::{Plan, Turn, busy, context, hash, turnable};
use crate::harness::Harness;
use crate::process::is_same_at_levels;
use crate::shallow::buffers::Buffers;

/// Random scenes that are turned.
const SCENES: u64 = 60;
/// Frames of each.
const FRAMES: u64 = 30;

/// All of them.
pub fn run(h: &mut Harness) {
    h.measure("shallow.same_rotated", || {
        let (is_same, note) = turned(&Turn::TURNS);
        (is_same, format!("by 90, 180 and 270 degrees; {note}"))
    });
    h.measure("shallow.same_mirrored", || {
        let (is_same, note) = turned(&Turn::MIRRORS);
        (is_same, format!("along x, along z, over both diagonals; {note}"))
    });
    h.measure("shallow.same_replay", || {
        let differ = (0..SCENES).filter(|&seed| !replays(seed)).count();
        (differ == 0, format!("{SCENES} scenes, {differ} differ"))
    });
    h.measure("shallow.same_threads", || (is_same_on_threads(all), "0, 1 and 2 threads"));
    h.measure("shallow.same_cpu", || {
        let note = format!("FRAZIL_CPU baseline, avx2, avx512; this one has {:?}", cpu_level());
        (is_same_at_levels("hash-of-shallow"), note)
    });
    h.measure("shallow.surface_same", || {
        let is_same = is_same_on_threads(surfaces) && is_same_at_levels("hash-of-surfaces");
        (is_same, "0, 1 and 2 threads; FRAZIL_CPU baseline, avx2, avx512")
    });
}

/// Whether a hash is the same on 0, 1 and 2 threads.
fn is_same_on_threads(hash: fn(&Context) -> u64) -> bool {
    let hashes = [0, 1, 2].map(|threads| hash(&Context::new(Pool::new(threads).expect("threads"))));
    hashes.iter().all(|hash| *hash == hashes[0])
}

/// Whether scenes that are turned do the same, cell by cell, layer by layer, in each frame.
fn turned(turns: &[Turn]) -> (bool, String) {
    let ctx = context();
    let (mut links, mut emptied, mut filled, mut differ) = (0, 0, 0, 0);
    for seed in 0..SCENES {
        let plan = turnable(seed);
        links += plan.links();
        let mut liquids: Vec<Shallow> =
            [Turn::NONE].iter().chain(turns).map(|turn| plan.make(&ctx, *turn)).collect();
        let mut is_same = true;
        for frame in 0..FRAMES {
            // Columns run dry and get wet again: strips fall asleep, which lie otherwise when the scene is turned.
            let mut dice = Dice(seed << 32 | frame);
            let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
            let depth = [-1.0, -1.0, 1e-4, 0.0][dice.below(4)];
            for (liquid, turn) in liquids.iter_mut().zip([Turn::NONE].iter().chain(turns)) {
                plan.pour(liquid, *turn, corners, depth);
                let report = liquid.step(&ctx, 1.0 / 60.0).expect("a frame");
                emptied += report.emptied;
                filled += report.filled;
            }
            let first = plan.depths_of(&liquids[0], Turn::NONE);
            is_same &=
                liquids[1..].iter().zip(turns).all(|(liquid, turn)| plan.depths_of(liquid, *turn) == first);
        }
        differ += u32::from(!is_same);
    }
    let note = format!(
        "{SCENES} scenes, {differ} differ; {links} links, rows scaled by K_min {emptied}, by K_max {filled}"
    );
    (differ == 0 && links > 0 && emptied > 0 && filled > 0, note)
}

/// Whether a run's steps make the same frames again.
fn replays(seed: u64) -> bool {
    let ctx = context();
    let plan = turnable(seed);
    let (mut run, mut again) = (plan.make(&ctx, Turn::NONE), plan.make(&ctx, Turn::NONE));
    (0..FRAMES).all(|_| {
        run.step(&ctx, 1.0 / 60.0).expect("a frame");
        again.replay(&ctx, run.last_steps()).expect("a frame");
        hash(&run) == hash(&again) && run.time() == again.time()
    })
}

/// A hash of what scenes have become, one of them wide enough for more than one thread.
fn all(ctx: &Context) -> u64 {
    let one = |plan: &Plan| {
        let mut liquid = plan.make(ctx, Turn::NONE);
        for _ in 0..FRAMES {
            liquid.step(ctx, 1.0 / 60.0).expect("a frame");
        }
        hash(&liquid)
    };
    let small = (0..SCENES).map(|seed| one(&turnable(seed)));
    small.fold(one(&busy([517, 403])), |all, hash| all.rotate_left(1) ^ hash)
}

/// A hash of the surfaces of scenes, with all that vertices may have, and of their drops.
fn surfaces(ctx: &Context) -> u64 {
    let (mut surface, mut balls) = (Surface::default(), Balls::default());
    let mut all = 0_u64;
    let mut draw = |plan: &Plan, frames: u64| {
        let mut plan = plan.clone();
        plan.params.falls = Some(Falls { height: 0.001, drop: 0.0, ..Falls::default() });
        let mut liquid = plan.make(ctx, Turn::NONE);
        for frame in 0..frames {
            liquid.step(ctx, 1.0 / 60.0).expect("a frame");
            if frame % 5 == 4 {
                all = all.rotate_left(1) ^ hash_drawn(&mut surface, &mut balls, &liquid);
            }
        }
    };
    (0..SCENES).for_each(|seed| draw(&turnable(seed), FRAMES));
    draw(&busy([517, 403]), 10);
    all
}

/// A hash of a surface, with all that vertices may have, and of drops.
fn hash_drawn(surface: &mut Surface, balls: &mut Balls, liquid: &Shallow) -> u64 {
    let columns = liquid.columns();
    let mut velocity = vec![[0.0; 2]; columns.len()];
    liquid.velocities(&mut velocity).expect("as many positions");
    let depths = Depths {
        depth: liquid.depths(),
        velocity: &velocity,
        active: Some(liquid.active()),
        ..Depths::default()
    };
    let cell = columns.grid.cell;
    let layout = Layout { least_depth: 0.05 * cell, fade_depth: 0.02 * cell, ..Layout::default() };
    let drops: Vec<Droplet> = liquid.drops().collect();
    let mut buffers = Buffers::new(columns, &Ledges::default(), drops.len());
    surface.reserve(columns);
    let mut hasher = DefaultHasher::new();
    let mut bits = |numbers: &[f32]| numbers.iter().for_each(|number| number.to_bits().hash(&mut hasher));
    let flat = surface.build(columns, &depths, &layout, &mut buffers.all()).expect("a surface");
    for numbers in [&buffers.positions, &buffers.normals, &buffers.velocities] {
        bits(&numbers[..3 * flat.vertices]);
    }
    bits(&buffers.depths[..flat.vertices]);
    bits(&buffers.opacities[..flat.vertices]);
    let (layers, triangles) =
        (buffers.layers[..flat.vertices].to_vec(), buffers.indices[..flat.indices].to_vec());
    let round = balls.build(&drops, &layout, &mut buffers.drops()).expect("drops");
    bits(&buffers.positions[..3 * round.vertices]);
    bits(&buffers.normals[..3 * round.vertices]);
    let indices = [&layers[..], &triangles, &buffers.indices[..round.indices]];
    indices.into_iter().for_each(|numbers| numbers.hash(&mut hasher));
    hasher.finish()
}

/// The run that prints the hash of scenes.
pub fn print_hash() {
    println!("{:016x}", all(&context()));
}

/// The run that prints the hash of their surfaces.
pub fn print_surfaces() {
    println!("{:016x}", surfaces(&context()));
}
