//! Gate of grains behind the ground: hills, valleys and slopes that a ball sweeps, and plates that press snow on a plane.

use crate::common::hills::{params, squeeze, terrains};
use crate::scenes::context;

/// Seeds of each scene, which have different compression too.
const SEEDS: u64 = 3;

pub fn measure() -> (f64, String) {
    let ctx = context(2);
    let (mut behind, mut born) = (0, 0);
    for terrain in terrains() {
        for seed in 0..SEEDS {
            for clearance in [0.0, 0.01, 0.046] {
                let out = terrain.sweep(&ctx, clearance, params(seed));
                if out.behind > 0 {
                    println!("# {}, seed {seed}, {clearance} m: {out:?}", terrain.name);
                }
                (behind, born) = (behind + out.behind, born + out.born);
            }
        }
    }
    for seed in 0..SEEDS {
        let out = squeeze(&ctx, params(seed));
        if out.behind + out.low > 0 {
            println!("# plates, seed {seed}: {out:?}");
        }
        (behind, born) = (behind + out.behind + out.low, born + out.born);
    }
    (behind as f64, format!("{born} births, in every frame"))
}
