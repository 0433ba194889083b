//! Projection: what flows in flows out, around solids and in pockets.

use frazil::flow::tiles::padded;
use frazil::flow::{Coord, Faces, Flow, Solids, Tiles};
use frazil::{Context, Pool};

use super::fields::{box_of, random_velocity};
use crate::common::liquids::context;

fn open(tiles: &Tiles, _: f32) -> frazil::Result<Solids> {
    Ok(Solids::none(tiles))
}

fn greatest(field: &[[f32; 512]]) -> f32 {
    field.iter().flatten().fold(0.0, |most, value| most.max(value.abs()))
}

#[test]
fn a_random_velocity_becomes_free_of_divergence() {
    let ctx = context(2);
    let mut tiles: Vec<Coord> = box_of([-1, 0, 0], [4, 2, 3]);
    tiles.extend([[9, 0, 0], [9, 0, 1]]);
    tiles.sort_unstable();
    let mut flow = Flow::new(0.1, [0.0; 3]).unwrap();
    flow.resize(&tiles);
    random_velocity(&mut flow);
    let solids = Solids::none(flow.tiles());
    let solved = ctx.phase("project", || flow.project(&ctx, &open, 1.0e-5)).unwrap();
    assert!(solved.iterations <= 16, "{solved:?}");
    let left = greatest(&flow.net_inflow(&solids));
    assert!(left <= 1.2e-5 * solved.fastest, "{left} {solved:?}");
}

#[test]
fn a_ball_that_moves_carries_the_air_around_it() {
    let ctx = context(2);
    let mut flow = Flow::new(0.1, [0.0; 3]).unwrap();
    flow.resize(&padded(&[[0, 0, 0]], 2));
    let boundary = |tiles: &Tiles, cell: f32| Ok(ball(tiles, cell, 9.0, [1.0, 0.0, 0.0]));
    let solved = ctx.phase("project", || flow.project(&ctx, &boundary, 1.0e-5)).unwrap();
    let solids = boundary(flow.tiles(), flow.cell()).unwrap();
    assert!(solved.iterations <= 25, "{solved:?}");
    let left = flow.net_inflow(&solids);
    for (coord, tile) in flow.tiles().coords().iter().zip(&left) {
        for (cell, value) in tile.iter().enumerate() {
            assert!(value.abs() < 1.0e-4, "{coord:?} {:?}: {value}", [cell >> 6, cell >> 3 & 7, cell & 7]);
        }
    }
    // Potential flow around a ball: in its equator's plane the air flows back at half its speed times (9 / 10.5)^3, 0.31.
    let tile = flow.tiles().find([0, 1, 0]).unwrap() as usize;
    let beside = flow.velocity()[0][tile][4 << 6 | 6 << 3 | 4];
    assert!((-0.4..-0.25).contains(&beside), "{beside}");
}

#[test]
fn solids_that_move_into_each_other_leave_the_air_around_them_solvable() {
    let ctx = context(2);
    let mut flow = Flow::new(0.1, [0.0; 3]).unwrap();
    flow.resize(&padded(&[[0, 0, 0]], 2));
    // One half of a ball moves into the other, which stands still: inside, faces of one cell move at two speeds.
    let boundary = |tiles: &Tiles, cell: f32| {
        let [moves, stands] = [1.0, 0.0].map(|speed| ball(tiles, cell, 9.0, [speed, 0.0, 0.0]));
        let halves = (0..tiles.count()).filter_map(|slot| {
            let of = if tiles.coords()[slot][0] < 0 { &moves } else { &stands };
            Some((slot as u32, of.faces(slot)?.clone()))
        });
        Ok(Solids::new(tiles, halves.collect()))
    };
    let solved = ctx.phase("project", || flow.project(&ctx, &boundary, 1.0e-5)).unwrap();
    assert!(solved.iterations <= 40 && solved.divergence <= 1.0e-5 * solved.fastest, "{solved:?}");
    let solids = boundary(flow.tiles(), flow.cell()).unwrap();
    let left = flow.net_inflow(&solids);
    let mut covered = 0;
    for (slot, tile) in left.iter().enumerate() {
        for (cell, value) in tile.iter().enumerate() {
            let open: f32 = (0..6).map(|face| open_share(flow.tiles(), &solids, slot, cell, face)).sum();
            covered += usize::from(open == 0.0 && value.abs() > 0.5);
            assert!(open < 1.0e-3 || value.abs() < 1.0e-4, "{slot} {cell}: {value}");
        }
    }
    assert!(covered > 0, "no cell inside is pressed together");
    assert!(flow.fastest() < 10.0, "{}", flow.fastest());
}

/// Open share of a face of a cell: the lower one on each axis, then the upper ones.
fn open_share(tiles: &Tiles, solids: &Solids, slot: usize, cell: usize, face: usize) -> f32 {
    let axis = face % 3;
    let (slot, cell) =
        if face < 3 { (slot as u32, cell) } else { tiles.adjacent_cell(slot, cell, axis, true) };
    solids.faces(slot as usize).map_or(1.0, |faces| faces.open[axis][cell])
}

/// Faces of a ball of a radius (cells of 0.1 m) around the middle of tile 0 that moves at a speed (m/s), for cells of an edge (m).
fn ball(tiles: &Tiles, cell: f32, radius: f32, speed: [f32; 3]) -> Solids {
    let wider = cell / 0.1;
    let mut faces = Vec::new();
    for (slot, coord) in (0..).zip(tiles.coords()) {
        let mut tile = Faces::open();
        let mut touches = false;
        for cell in 0..512usize {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            for (axis, speed) in speed.into_iter().enumerate() {
                let position = [0, 1, 2].map(|other| {
                    let half = if other == axis { 0.0 } else { 0.5 };
                    (coord[other] * 8 + at[other] as i32) as f32 + half - 4.0 / wider
                });
                let distance = position.iter().map(|x| x * x).sum::<f32>().sqrt() - radius / wider;
                tile.open[axis][cell] = (0.5 + distance).clamp(0.0, 1.0);
                tile.speed[axis][cell] = speed;
                touches |= tile.open[axis][cell] < 1.0;
            }
        }
        if touches {
            faces.push((slot, tile));
        }
    }
    Solids::new(tiles, faces)
}

#[test]
fn a_sealed_pocket_that_shrinks_is_solved() {
    let ctx = context(2);
    let mut flow = Flow::new(0.1, [0.0; 3]).unwrap();
    flow.resize(&padded(&[[0, 0, 0]], 1));
    random_velocity(&mut flow);
    // Walls around the middle tile, of which the upper one moves down.
    let mut faces = Vec::new();
    for (axis, offset) in [(0, [1, 0, 0]), (1, [0, 1, 0]), (2, [0, 0, 1])] {
        for coord in [[0, 0, 0], offset] {
            let slot = flow.tiles().find(coord).unwrap();
            let at = faces.iter().position(|(other, _)| *other == slot).unwrap_or_else(|| {
                faces.push((slot, Faces::open()));
                faces.len() - 1
            });
            for cell in (0..512usize).filter(|cell| cell >> (6 - 3 * axis) & 7 == 0) {
                faces[at].1.open[axis][cell] = 0.0;
                faces[at].1.speed[axis][cell] = if coord == [0, 1, 0] { -1.0 } else { 0.0 };
            }
        }
    }
    let solids = Solids::new(flow.tiles(), faces);
    // The wide cells around know nothing of walls that are thinner than they are.
    let boundary =
        |tiles: &Tiles, cell: f32| Ok(if cell < 0.2 { solids.clone() } else { Solids::none(tiles) });
    let solved = ctx.phase("project", || flow.project(&ctx, &boundary, 1.0e-5)).unwrap();
    assert!(solved.iterations < 40 && solved.divergence <= 1.0e-5 * solved.fastest, "{solved:?}");
    let middle = flow.tiles().find([0, 0, 0]).unwrap() as usize;
    // What the wall presses in remains, evenly.
    let left = flow.net_inflow(&solids);
    let mean = 64.0 / 512.0;
    let off = left[middle].iter().fold(0.0f32, |most, value| most.max((value - mean).abs()));
    assert!(off < 1.0e-4, "{off}");
    let outside = left.iter().enumerate().filter(|(slot, _)| *slot != middle);
    let outside = outside.flat_map(|(_, tile)| tile).fold(0.0f32, |most, value| most.max(value.abs()));
    assert!(outside < 1.0e-4, "{outside}");
}

#[test]
fn the_bytes_do_not_depend_on_threads() {
    let run = |threads| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let mut flow = Flow::new(0.1, [0.3, 0.0, 0.0]).unwrap();
        flow.resize(&box_of([0, 0, 0], [4, 3, 2]));
        random_velocity(&mut flow);
        let boundary = |tiles: &Tiles, cell: f32| Ok(ball(tiles, cell, 5.0, [0.0, 1.0, 0.0]));
        for _ in 0..3 {
            ctx.phase("flow", || {
                flow.advect(&ctx, 0.05, frazil::flow::Scheme::Bounded)?;
                flow.project(&ctx, &boundary, 1.0e-4)
            })
            .unwrap();
        }
        flow.velocity().clone()
    };
    assert!(run(1) == run(2), "1 and 2 threads differ");
}
