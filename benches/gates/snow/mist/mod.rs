//! Gates of mist and of the flow under it.

pub mod cancel;
pub mod eddies;
pub mod frame_rate;
pub mod jets;
pub mod passes;
pub mod walls;

use std::time::Instant;

use frazil::Context;
use frazil::flow::tiles::{padded, shifted};
use frazil::flow::{Coord, Faces, Flow, Scheme, Solids, Tile, Tiles};
use frazil::geometry::DVec3;
use frazil::snow::mist::{Boundary, Mist, Params, Source, StepInputs, StepReport};

use crate::harness::Harness;
use crate::process::kilobytes;
use crate::scenes::{context, voxel};
use crate::snow::grains::memory::of_a_step;

/// Length of a frame (s).
const FRAME: f64 = 1.0 / 24.0;
/// Edge of a cell (m).
const CELL: f64 = 0.01;

pub fn run(h: &mut Harness) {
    h.measure_all(["snow.mist.divergence", "snow.mist.density_negative"], projection);
    h.measure("snow.mist.still", still);
    h.measure("snow.mist.symmetry", symmetry);
    h.measure("snow.mist.taylor_green", vortices);
    mass(h);
    h.measure("snow.mist.padding", padding);
    h.measure("snow.mist.dashes", dashes);
    h.measure("snow.mist.speed", speed);
    h.measure("snow.mist.memory", || of_a_step("memory-of-mist"));
}

/// Steps mist through a frame, the first one is 0.
pub fn step(
    mist: &mut Mist,
    ctx: &Context,
    sources: &[Source],
    boundary: &Boundary<'_>,
    frame: i32,
) -> StepReport {
    let times = [f64::from(frame) * FRAME, f64::from(frame + 1) * FRAME];
    let around = StepInputs { sources, boundary, fastest: 0.0, wind: None };
    mist.step(ctx, &around, times).expect("a step")
}

/// No solids.
pub fn open(tiles: &Tiles, _: f32, _: f64) -> frazil::Result<Solids> {
    Ok(Solids::none(tiles))
}

fn air() -> Params {
    Params { half_life: f64::INFINITY, noise: 0.0, ..Params::for_cell(CELL) }
}

/// Coordinates of the tiles of a box, sorted.
fn tiles_of(low: [i32; 3], high: [i32; 3]) -> Vec<Coord> {
    let mut out = Vec::new();
    for x in low[0]..high[0] {
        for y in low[1]..high[1] {
            out.extend((low[2]..high[2]).map(|z| [x, y, z]));
        }
    }
    out
}

/// A ball of mist of a radius (cells) around the corner of tile 0, which moves upward.
fn puff(params: Params, radius: f32, speed: f32) -> Mist {
    let mut mist = Mist::new(params).expect("mist");
    mist.add(&tiles_of([-2; 3], [2; 3]), |cell| {
        let square: f32 = cell.iter().map(|x| (*x as f32 + 0.5).powi(2)).sum();
        let density = (1.0 - (square.sqrt() - radius) / 3.0).clamp(0.0, 1.0);
        (density, [0.0, speed, 0.0])
    });
    mist
}

/// Divergence after projections and least density, while a puff is blown past a ball that moves.
fn projection() -> [(f64, String); 2] {
    let ctx = context(2);
    let mut mist = puff(air(), 8.0, 2.0);
    let (mut left, mut least, mut iterations) = (0.0f64, 0.0f32, 0);
    for frame in 0..24 {
        let at = |share: f64| [0.3 * (f64::from(frame) + share), 12.0, 0.0].map(|x| x as f32);
        let boundary = |tiles: &Tiles, cell: f32, share: f64| {
            Ok(ball(tiles, cell, at(share), 6.0, 0.3 * 24.0 * CELL as f32))
        };
        let report = step(&mut mist, &ctx, &[], &boundary, frame);
        left = left.max(f64::from(report.divergence));
        iterations = iterations.max(report.iterations);
        least = mist.flow().density().iter().flatten().fold(least, |least, value| least.min(*value));
    }
    [
        (left, format!("in 24 frames, at most {iterations} iterations in one")),
        (f64::from(-least), String::new()),
    ]
}

/// Faces of a ball around a position (fine cells), of a radius (fine cells), that moves along x at a speed (m/s), for cells of an
/// edge (m).
fn ball(tiles: &Tiles, cell: f32, position: [f32; 3], radius: f32, speed: f32) -> Solids {
    let wider = cell / CELL as f32;
    let (position, radius) = (position.map(|x| x / wider), radius / wider);
    let mut faces = Vec::new();
    for (slot, coord) in (0..).zip(tiles.coords()) {
        let middle = [0, 1, 2].map(|axis| coord[axis] as f32 * 8.0 + 4.0 - position[axis]);
        if middle.iter().map(|x| x * x).sum::<f32>().sqrt() > radius + 8.0 {
            continue;
        }
        let mut tile = Faces::open();
        for cell in 0..512usize {
            let at = voxel(coord.map(|x| 8 * x), cell);
            for axis in 0..3 {
                let square: f32 = (0..3)
                    .map(|other| {
                        let half = if other == axis { 0.0 } else { 0.5 };
                        (at[other] as f32 + half - position[other]).powi(2)
                    })
                    .sum();
                tile.open[axis][cell] = (0.5 + square.sqrt() - radius).clamp(0.0, 1.0);
                tile.speed[axis][cell] = if axis == 0 { speed } else { 0.0 };
            }
        }
        faces.push((slot, tile));
    }
    Solids::new(tiles, faces)
}

/// A closed box that is full of mist: gravity must not move it.
fn still() -> (f64, &'static str) {
    let ctx = context(2);
    let mut mist = Mist::new(air()).expect("mist");
    mist.add(&tiles_of([0; 3], [4; 3]), |_| (1.0, [0.0; 3]));
    let boundary = |tiles: &Tiles, cell: f32, _: f64| Ok(closed(tiles, cell / CELL as f32, [4; 3]));
    for frame in 0..100 {
        step(&mut mist, &ctx, &[], &boundary, frame);
    }
    (f64::from(mist.flow().fastest()), "100 frames in a box of 32 cells")
}

/// Walls around the tiles from 0 to some on each axis; everything outside is solid. Cells may be wider than these tiles'.
fn closed(tiles: &Tiles, wider: f32, high: [i32; 3]) -> Solids {
    let inside = |cell: [i32; 3]| {
        (0..3).all(|axis| (0.0..8.0 * high[axis] as f32).contains(&((cell[axis] as f32 + 0.5) * wider)))
    };
    walled(tiles, inside, |_, _| 0.0)
}

/// Faces that are open between two cells that are inside, each with a speed (m/s) by its upper cell and its axis.
pub fn walled(
    tiles: &Tiles,
    is_inside: impl Fn([i32; 3]) -> bool,
    speed: impl Fn([i32; 3], usize) -> f32,
) -> Solids {
    let faces = |coord: &Coord| {
        let mut faces = Faces::open();
        for cell in 0..512usize {
            let at = voxel(coord.map(|x| 8 * x), cell);
            for axis in 0..3 {
                let below = shifted(at, axis, -1);
                faces.open[axis][cell] = f32::from(u8::from(is_inside(at) && is_inside(below)));
                faces.speed[axis][cell] = speed(at, axis);
            }
        }
        faces
    };
    Solids::new(tiles, (0..).zip(tiles.coords()).map(|(slot, coord)| (slot, faces(coord))).collect())
}

/// A puff that is the same on both sides stays so.
fn symmetry() -> (f64, &'static str) {
    let ctx = context(2);
    let mut mist = puff(air(), 6.0, 1.0);
    for frame in 0..24 {
        step(&mut mist, &ctx, &[], &open, frame);
    }
    let (tiles, density) = (mist.flow().tiles(), mist.flow().density());
    let (mut most, mut off) = (0.0f32, 0.0f32);
    for (coord, tile) in tiles.coords().iter().zip(density) {
        let mirrored =
            tiles.find([-1 - coord[0], coord[1], coord[2]]).and_then(|slot| density.get(slot as usize));
        for (cell, value) in tile.iter().enumerate() {
            most = most.max(*value);
            off = off.max((value - mirrored.map_or(0.0, |tile| tile[cell ^ 0o700])).abs());
        }
    }
    (f64::from(off / most), "a puff after 24 frames, over its greatest density")
}

/// Taylor and Green's vortices in a closed box: how much smaller the error is with cells half as wide.
fn vortices() -> (f64, String) {
    let ctx = context(2);
    let errors = [2, 4, 8].map(|tiles| vortex_error(&ctx, tiles));
    let note = format!(
        "errors {:.5}, {:.5}, {:.5}; the last two, {:.2}, first two",
        errors[0],
        errors[1],
        errors[2],
        errors[0] / errors[1]
    );
    (errors[1] / errors[2], note)
}

fn vortex_error(ctx: &Context, tiles: i32) -> f64 {
    let cells = 8 * tiles;
    let cell = std::f64::consts::PI / f64::from(cells);
    let mut flow = Flow::new(cell, [0.0; 3]).expect("a flow");
    let high = [tiles, tiles, 1];
    flow.resize(&padded(&tiles_of([0; 3], high), 1));
    let boundary = |tiles: &Tiles, wide: f32| Ok(closed(tiles, wide / cell as f32, high));
    let exact = |axis: usize, x: f64, y: f64| match axis {
        0 => x.sin() * y.cos(),
        1 => -x.cos() * y.sin(),
        _ => 0.0,
    };
    let position = |coord: &Coord, at: usize, axis: usize| {
        let [x, y] = [coord[0] * 8 + (at >> 6) as i32, coord[1] * 8 + (at >> 3 & 7) as i32].map(f64::from);
        let half = |other: usize| if other == axis { 0.0 } else { 0.5 };
        [(x + half(0)) * cell, (y + half(1)) * cell]
    };
    {
        let (tiles, velocity, _) = flow.fields();
        for (axis, field) in velocity.iter_mut().enumerate() {
            for (coord, tile) in tiles.coords().iter().zip(field) {
                for (at, speed) in tile.iter_mut().enumerate() {
                    let [x, y] = position(coord, at, axis);
                    *speed = exact(axis, x, y) as f32;
                }
            }
        }
    }
    let steps = (cells * cells / 32) as usize;
    let dt = 1.0 / steps as f64;
    let project = |flow: &mut Flow| {
        ctx.phase("project", || flow.project(ctx, &boundary, 1.0e-6)).expect("a projection");
    };
    project(&mut flow);
    for _ in 0..steps {
        ctx.phase("advect", || flow.advect(ctx, dt, Scheme::Unbounded)).expect("advection");
        project(&mut flow);
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for axis in 0..2 {
        for (coord, tile) in flow.tiles().coords().iter().zip(&flow.velocity()[axis]) {
            if (0..3).all(|axis| (0..high[axis]).contains(&coord[axis])) {
                for (at, speed) in tile.iter().enumerate() {
                    let [x, y] = position(coord, at, axis);
                    sum += (f64::from(*speed) - exact(axis, x, y)).powi(2);
                    count += 1.0;
                }
            }
        }
    }
    f64::sqrt(sum / count)
}

/// Half of the mist after its half-life, and all of it without one.
fn mass(h: &mut Harness) {
    let ctx = context(2);
    h.measure("snow.mist.half_life", || {
        let mut mist = puff(Params { half_life: 0.5, gravity: 0.0, ..air() }, 8.0, 0.0);
        let before = mist.mass();
        (0..12).for_each(|frame| drop(step(&mut mist, &ctx, &[], &open, frame)));
        ((2.0 * mist.mass() / before - 1.0).abs(), "after 0.5 s")
    });
    h.measure("snow.mist.mass_drift", || {
        let mut mist = puff(air(), 8.0, 1.0);
        let before = mist.mass();
        let mut note = "every 12 frames:".to_string();
        for frame in 1..=48 {
            step(&mut mist, &ctx, &[], &open, frame);
            if frame % 12 == 0 {
                note += &format!(" {:.2} %", (mist.mass() / before - 1.0) * 100.0);
            }
        }
        ((mist.mass() / before - 1.0).abs() * 100.0, note)
    });
}

/// The same puff with one tile of air around it and with three.
fn padding() -> (f64, &'static str) {
    let ctx = context(2);
    let [near, far] = [1, 3].map(|padding| {
        let mut mist = puff(Params { padding, ..air() }, 8.0, 1.0);
        (0..24).for_each(|frame| drop(step(&mut mist, &ctx, &[], &open, frame)));
        mist
    });
    let (mut off, mut sum) = (0.0, 0.0);
    let none: Tile = [0.0; 512];
    for (coord, tile) in far.flow().tiles().coords().iter().zip(far.flow().density()) {
        let other = near.flow().tiles().find(*coord);
        let other = other.and_then(|slot| near.flow().density().get(slot as usize)).unwrap_or(&none);
        for (a, b) in tile.iter().zip(other) {
            off += f64::from((a - b).abs());
            sum += f64::from(*a);
        }
    }
    (off / sum * 100.0, "difference of the densities after 24 frames")
}

/// A grain at 5 m/s leaves no gaps.
fn dashes() -> (f64, String) {
    let ctx = context(2);
    let mut mist = Mist::new(Params { gravity: 0.0, ..air() }).expect("mist");
    let velocity = [5.0f32 / 2f32.sqrt(), 5.0 / 2f32.sqrt(), 0.0];
    let start = DVec3::new(0.013, 0.007, 0.004);
    let at = |time: f64| start + DVec3::from(velocity.map(f64::from)) * time;
    for frame in 1..=6 {
        let source = Source { position: at(f64::from(frame) * FRAME), velocity, radius: 0.0025, start: None };
        step(&mut mist, &ctx, &[source], &open, frame);
    }
    let density = |position: DVec3| {
        let cell = [0, 1, 2].map(|axis| (position[axis] / CELL).floor() as i32);
        let slot = mist.flow().tiles().find(cell.map(|x| x >> 3));
        let tile = slot.and_then(|slot| mist.flow().density().get(slot as usize));
        tile.map_or(0.0, |tile| {
            f64::from(tile[((cell[0] & 7) << 6 | (cell[1] & 7) << 3 | cell[2] & 7) as usize])
        })
    };
    // Along its path in some frames: the greatest value of cells beside it.
    let gaps = |frames: [f64; 2]| {
        let values: Vec<f64> = (0..600)
            .map(|step| {
                let middle = at((frames[0] + (frames[1] - frames[0]) * f64::from(step) / 600.0) * FRAME);
                let beside = [-1.0, 0.0, 1.0]
                    .into_iter()
                    .flat_map(|x| [-1.0, 0.0, 1.0].map(|y| DVec3::new(x, -x, y) * CELL));
                beside.map(|off| density(middle + off)).fold(0.0, f64::max)
            })
            .collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().filter(|value| **value < 0.5 * mean).count() as f64 / values.len() as f64, mean)
    };
    // Mist of earlier frames moves away from where it was raised.
    let ((last, mean), (all, _)) = (gaps([5.0, 6.0]), gaps([2.0, 6.0]));
    (last, format!("in the last frame, mean density {mean:.2}; in the last four {all:.3}"))
}

/// Mist of two million cells that whirls.
fn large(tiles: i32) -> Mist {
    let mut mist = Mist::new(Params { tolerance: 1.0e-4, ..air() }).expect("mist");
    let size = 8.0 * tiles as f32;
    mist.add(&tiles_of([1; 3], [tiles - 1; 3]), |cell| {
        let [x, y, z] = cell.map(|x| (x as f32 + 0.5) / size * std::f32::consts::TAU);
        let density = 0.5 + 0.5 * (3.0 * x).sin() * (2.0 * y).cos() * (2.0 * z).sin();
        let around = [
            y.sin() * z.cos() + (5.0 * z).sin() * 0.3,
            z.sin() * x.cos(),
            x.sin() * y.cos() + (4.0 * x).cos() * 0.3,
        ];
        (density.max(0.01), around)
    });
    mist
}

fn speed() -> (f64, String) {
    let ctx = context(2);
    let mut mist = large(14);
    let mut note = String::new();
    let mut seconds = Vec::new();
    for frame in 0..6 {
        let start = Instant::now();
        let report = step(&mut mist, &ctx, &[], &open, frame);
        let each = start.elapsed().as_secs_f64() / report.sub_steps as f64;
        seconds.push(each);
        note = format!(
            "{} cells, {} sub-steps of {each:.3} s, {} iterations, fastest {:.2} m/s",
            report.cells, report.sub_steps, report.iterations, report.fastest
        );
        println!("# {note}");
    }
    seconds.remove(0);
    seconds.sort_by(f64::total_cmp);
    (seconds[seconds.len() / 2], note)
}

/// The run that steps mist and prints its memory.
pub fn print_memory() {
    let ctx = context(2);
    ctx.pool().install(|| rayon::broadcast(|_| vec![1u8; 1 << 16].len()));
    let before = kilobytes("self", "VmRSS:");
    let mut mist = large(14);
    let mut cells = 0;
    for frame in 0..3 {
        cells = step(&mut mist, &ctx, &[], &open, frame).cells;
    }
    println!(
        "# between two steps {:.0} bytes a cell",
        (kilobytes("self", "VmRSS:") - before) * 1024.0 / cells as f64
    );
    println!("bytes {}", (kilobytes("self", "VmHWM:") - before) * 1024.0 / cells as f64);
}
