//! Walls that cover part of the faces: air between them neither gains energy nor becomes faster without a force.

use frazil::flow::{Faces, Flow, FlowState, Scheme, Solids, Tiles};

use super::fields::{box_of, random_velocity};
use crate::common::liquids::context;

/// Edge of a cell (m).
const CELL: f32 = 0.1;

/// A pseudo-random number 0..1 for a position.
fn noise(at: [i32; 3], seed: u64) -> f32 {
    let mut state = seed;
    for x in at {
        state = (state ^ x as u32 as u64).wrapping_mul(0x5851_f42d_4c95_7f2d);
        state ^= state >> 29;
    }
    (state >> 40) as f32 / (1 << 24) as f32
}

/// Walls that stand still: a third of the faces are closed, a third leave a gap of 5 to 50 %, and the others are open.
fn porous(tiles: &Tiles, cell: f32, seed: u64) -> Solids {
    let level = (cell / CELL) as u64;
    let faces_of = |coord: &[i32; 3]| {
        let mut faces = Faces::open();
        for cell in 0..512usize {
            let local = [cell >> 6, cell >> 3 & 7, cell & 7];
            let at = [0, 1, 2].map(|axis| 8 * coord[axis] + local[axis] as i32);
            for axis in 0..3 {
                let share = 3.0 * noise(at, seed + 10 * level + axis as u64);
                faces.open[axis][cell] = match share {
                    share if share < 1.0 => 0.0,
                    share if share < 2.0 => 0.05 + 0.45 * (share - 1.0),
                    _ => 1.0,
                };
            }
        }
        faces
    };
    Solids::new(tiles, (0..).zip(tiles.coords().iter().map(faces_of)).collect())
}

/// Sum of the squares of speeds, each times the open fraction of its face.
fn energy(flow: &Flow, solids: &Solids) -> f64 {
    let mut sum = 0.0;
    for (axis, field) in flow.velocity().iter().enumerate() {
        for (slot, tile) in field[..flow.tiles().active()].iter().enumerate() {
            let open = &solids.faces(slot).expect("walls everywhere").open[axis];
            sum += tile.iter().zip(open).map(|(speed, open)| f64::from(open * speed * speed)).sum::<f64>();
        }
    }
    sum
}

#[test]
fn air_in_narrow_gaps_gains_no_energy() {
    let ctx = context(2);
    for seed in 1..=3 {
        let mut flow = Flow::new(f64::from(CELL), [0.0; 3]).unwrap();
        flow.resize(&box_of([0, 0, 0], [3, 2, 2]));
        random_velocity(&mut flow);
        let boundary = |tiles: &Tiles, cell: f32| Ok(porous(tiles, cell, seed));
        let solids = boundary(flow.tiles(), CELL).unwrap();
        let (mut before, mut first) = (f64::INFINITY, f32::INFINITY);
        for step in 0..12 {
            ctx.phase("project", || flow.project(&ctx, &boundary, 1.0e-4)).unwrap();
            let (energy, fastest) = (energy(&flow, &solids), flow.fastest());
            assert!(energy < before && fastest <= first, "{seed} {step}: {energy} {fastest} {first}");
            (before, first) = (energy, if step == 0 { fastest } else { first });
            ctx.phase("advect", || flow.advect(&ctx, 0.1, Scheme::Bounded)).unwrap();
        }
    }
}

#[test]
fn solids_of_a_projection_do_not_outlive_its_tiles() {
    let ctx = context(2);
    let walls = |tiles: &Tiles, cell: f32| Ok(porous(tiles, cell, 1));
    let mut flow = Flow::new(f64::from(CELL), [0.0; 3]).unwrap();
    flow.resize(&box_of([0, 0, 0], [1, 1, 1]));
    random_velocity(&mut flow);
    let mut kept = FlowState::default();
    kept.copy_from(&flow);
    let mut wanted = flow.copy();
    flow.resize(&box_of([-2, 0, 0], [3, 2, 2]));
    ctx.phase("project", || flow.project(&ctx, &walls, 1.0e-4)).unwrap();
    // The state of before has fewer tiles, and no solids.
    flow.restore(&mut kept);
    for flow in [&mut flow, &mut wanted] {
        ctx.phase("advect", || flow.advect(&ctx, 0.1, Scheme::Bounded)).unwrap();
    }
    assert!(flow.velocity() == wanted.velocity());
    // Tiles that are added between projection and advection change nothing of the air that was there.
    let [small, large] = [false, true].map(|grows| {
        let mut flow = Flow::new(f64::from(CELL), [0.0; 3]).unwrap();
        flow.resize(&box_of([0, 0, 0], [3, 3, 3]));
        random_velocity(&mut flow);
        ctx.phase("project", || flow.project(&ctx, &walls, 1.0e-4)).unwrap();
        if grows {
            flow.resize(&box_of([0, 0, 0], [3, 3, 4]));
        }
        ctx.phase("advect", || flow.advect(&ctx, 0.02, Scheme::Bounded)).unwrap();
        let middle = flow.tiles().find([1, 1, 1]).unwrap() as usize;
        [0, 1, 2].map(|axis| flow.velocity()[axis][middle])
    });
    assert!(small == large);
}
