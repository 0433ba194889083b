//! Advection: what is carried, how far and how sharp.

use frazil::flow::tiles::padded;
use frazil::flow::{Flow, Scheme};
use frazil::{Context, Pool};

/// Centre (cells) and mass of a ball of density that a wind of 3.3 cells a step carried for some steps, and its greatest value.
fn carried(scheme: Scheme, steps: usize) -> ([f64; 3], f64, f32) {
    let ctx = Context::new(Pool::new(2).unwrap());
    let wind = [3.3, -1.0, 0.5];
    let mut flow = Flow::new(1.0, wind).unwrap();
    let tiles: Vec<[i32; 3]> = (-1..9).flat_map(|x| padded(&[[x, -1, 0]], 2)).collect();
    let mut tiles = tiles;
    tiles.sort_unstable();
    tiles.dedup();
    flow.resize(&tiles);
    let (tiles, _, density) = flow.fields();
    for (coord, tile) in tiles.coords().iter().zip(density) {
        for (cell, value) in tile.iter_mut().enumerate() {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            let square: f32 =
                (0..3).map(|axis| (coord[axis] * 8 + at[axis] as i32) as f32 - 3.5).map(|x| x * x).sum();
            *value = (-square / 10.0).exp();
        }
    }
    for _ in 0..steps {
        ctx.phase("advect", || flow.advect(&ctx, 1.0, scheme)).unwrap();
    }
    let (mut sum, mut centre, mut most) = (0.0f64, [0.0f64; 3], 0.0f32);
    for (coord, tile) in flow.tiles().coords().iter().zip(flow.density()) {
        for (cell, value) in tile.iter().enumerate() {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            sum += f64::from(*value);
            most = most.max(*value);
            for axis in 0..3 {
                centre[axis] += f64::from(*value) * f64::from(coord[axis] * 8 + at[axis] as i32);
            }
        }
    }
    (centre.map(|x| x / sum), sum, most)
}

#[test]
fn a_ball_moves_with_the_wind() {
    let (start, mass, _) = carried(Scheme::MacCormack, 0);
    for scheme in [Scheme::SemiLagrangian, Scheme::MacCormack, Scheme::Unbounded] {
        let (end, later, most) = carried(scheme, 10);
        for (axis, wind) in [3.3, -1.0, 0.5].into_iter().enumerate() {
            // Bounds hold the front back a little.
            let most = if scheme == Scheme::MacCormack { 0.5 } else { 0.05 };
            assert!((end[axis] - start[axis] - 10.0 * wind).abs() < most, "{scheme:?} {end:?} {start:?}");
        }
        // Bounds add mass where they keep values from falling.
        let drift = if scheme == Scheme::MacCormack { 0.07 } else { 0.01 };
        assert!((later / mass - 1.0).abs() < drift, "{scheme:?} {later} {mass}");
        let sharp = if scheme == Scheme::SemiLagrangian { 0.35 } else { 0.65 };
        assert!(most > sharp && most <= 1.2, "{scheme:?} {most}");
    }
    assert!(carried(Scheme::MacCormack, 10).2 <= 1.0);
}
