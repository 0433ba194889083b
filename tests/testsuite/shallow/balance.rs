//! Liquid is neither lost nor made, whatever dries up and gets wet.

use frazil::Context;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::{Params, Shallow};

use crate::common::bodies::Dice;
use crate::common::flowing::{DOWN, from_corner, stacked};
use crate::common::shallow::context;

/// Rough slopes; with an odd seed a low shelf and a high wall hang over them.
fn slopes(ctx: &Context, seed: u64, dice: &mut Dice) -> Shallow {
    let size = [90 + dice.below(20), 40 + dice.below(10)];
    let fall = [dice.between(-0.4, 0.4), dice.between(-0.3, 0.3)];
    let rough = dice.between(0.0, 0.001);
    let grid = from_corner(0.002, size);
    let solids = stacked(grid, [-0.02, 0.1], |[x, z]| {
        let [from_x, from_z] = [x as f64 - 50.0, z as f64 - 20.0].map(|cells| cells * grid.cell);
        let ground = 0.04 + fall[0] * from_x + fall[1] * from_z + dice.between(0.0, rough);
        let mut solids = vec![[DOWN, ground]];
        if seed % 2 == 1 && (10..20).contains(&z) && (20..70).contains(&x) {
            solids.push([ground + 0.0015, ground + 0.003]);
        }
        if seed % 2 == 1 && x == 33 {
            solids.push([0.085, 0.09]);
        }
        solids
    });
    let params = Params {
        liquid: Liquid::new([1e-6, 4e-6, 1e-4][dice.below(3)]),
        border: [Border::Open, Border::Closed][dice.below(2)],
        pace: [TimeStepping::Exact, TimeStepping::Realtime(0.003)][dice.below(2)],
        ..Params::default()
    };
    Shallow::new(ctx, &solids, params).unwrap()
}

/// Pours so deep (m) into the columns of 3 x 3 cells, or dries those of a box.
fn change(liquid: &mut Shallow, low: [usize; 2], size: [usize; 2], depth: f64) {
    let [nx, nz] = liquid.columns().grid.size;
    for z in low[1]..(low[1] + size[1]).min(nz) {
        for x in low[0]..(low[0] + size[0]).min(nx) {
            for column in liquid.columns().of_cell([x, z]).collect::<Vec<_>>() {
                liquid.pour(column, depth);
            }
        }
    }
}

#[test]
fn what_dries_up_at_once_leaves_nothing_behind_that_flows() {
    let ctx = context();
    for seed in 0..24 {
        let mut dice = Dice(seed);
        let mut liquid = slopes(&ctx, seed, &mut dice);
        let [nx, nz] = liquid.columns().grid.size;
        for frame in 0..60 {
            if frame % 4 == 0 {
                let low = [dice.below(nx), dice.below(nz)];
                let size = [dice.below(60), dice.below(30)];
                change(&mut liquid, low, size, -1.0);
                change(&mut liquid, [dice.below(nx - 3), dice.below(nz - 3)], [3, 3], 0.004);
            }
            liquid.step(&ctx, 1.0 / 60.0).unwrap();
            assert_eq!(liquid.balance().error, 0, "seed {seed}, frame {frame}");
        }
        let columns = liquid.columns();
        let is_within =
            |i: usize| (0..=columns.ceilings()[i] - columns.bases()[i]).contains(&liquid.depths()[i]);
        assert!(columns.indices().all(is_within), "seed {seed}");
    }
}
