//! Liquid is neither lost nor made, whatever dries up and gets wet.

use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Shallow};
use frazil::{Context, Pool};

/// Numbers from a seed.
struct Dice(u64);

impl Dice {
    fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.draw() % count as u64) as usize
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.draw() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Rough slopes; with an odd seed a low shelf and a high wall hang over them.
fn slopes(ctx: &Context, seed: u64, dice: &mut Dice) -> Shallow {
    let size = [90 + dice.below(20), 40 + dice.below(10)];
    let grid = Grid { cell: 0.002, origin: [0.0; 2], size };
    let heights = Heights::between(-0.02, 0.1).unwrap();
    let fall = [dice.between(-0.4, 0.4), dice.between(-0.3, 0.3)];
    let rough = dice.between(0.0, 0.001);
    let cells = (0..grid.cells()).map(|index| {
        let [x, z] = [index % size[0], index / size[0]];
        let [from_x, from_z] = [x as f64 - 50.0, z as f64 - 20.0].map(|cells| cells * grid.cell);
        let ground = 0.04 + fall[0] * from_x + fall[1] * from_z + dice.between(0.0, rough);
        let mut solids = vec![[BOTTOMLESS, heights.round(ground)]];
        if seed % 2 == 1 && (10..20).contains(&z) && (20..70).contains(&x) {
            solids.push([heights.round(ground + 0.0015), heights.round(ground + 0.003)]);
        }
        if seed % 2 == 1 && x == 33 {
            solids.push([heights.round(0.085), heights.round(0.09)]);
        }
        solids
    });
    let solids = Solids::new(grid, heights, cells.collect::<Vec<_>>());
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
    let ctx = Context::new(Pool::new(0).unwrap());
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
