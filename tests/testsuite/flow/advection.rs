//! Advection: what is carried, how far and how sharp.

use frazil::flow::tiles::padded;
use frazil::flow::{Flow, MassConservation, Scheme};
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
    let (start, mass, _) = carried(Scheme::Bounded, 0);
    for scheme in [Scheme::SemiLagrangian, Scheme::Bounded, Scheme::Unbounded] {
        let (end, later, most) = carried(scheme, 10);
        for (axis, wind) in [3.3, -1.0, 0.5].into_iter().enumerate() {
            assert!((end[axis] - start[axis] - 10.0 * wind).abs() < 0.05, "{scheme:?} {end:?} {start:?}");
        }
        // Bounds take mass where they keep values from rising.
        let drift = if scheme == Scheme::Bounded { 0.02 } else { 0.01 };
        assert!((later / mass - 1.0).abs() < drift, "{scheme:?} {later} {mass}");
        let sharp = if scheme == Scheme::SemiLagrangian { 0.35 } else { 0.65 };
        assert!(most > sharp && most <= 1.2, "{scheme:?} {most}");
    }
    assert!(carried(Scheme::Bounded, 10).2 <= 1.0);
}

/// Sums of the density around two vortices far apart, of which one turns and the other one stands still; after some steps in which
/// density keeps a share of its mass.
fn two_balls(steps: usize, conservation: MassConservation) -> ([f64; 2], f32) {
    let ctx = Context::new(Pool::new(2).unwrap());
    let mut flow = Flow::new(1.0, [0.0; 3]).unwrap();
    let mut tiles = padded(&[[-6, 0, 0], [6, 0, 0]], 2);
    tiles.sort_unstable();
    flow.resize(&tiles);
    let (tiles, velocity, density) = flow.fields();
    let off = |coord: &[i32; 3], cell: usize| {
        let at = [cell >> 6, cell >> 3 & 7, cell & 7];
        let at = [0, 1, 2].map(|axis| (coord[axis] * 8 + at[axis] as i32) as f32);
        [at[0] - if coord[0] < 0 { -44.0 } else { 52.0 }, at[1] - 4.0, at[2] - 4.0]
    };
    for (coord, tile) in tiles.coords().iter().zip(density) {
        for (cell, value) in tile.iter_mut().enumerate() {
            let [x, y, z] = off(coord, cell);
            // A slab, which a vortex winds up, so that the scheme loses some of it.
            *value = (4.0 - (2.0 * x.abs()).max(y.abs().max(z.abs()) * 0.6)).clamp(0.0, 1.0);
        }
    }
    // Around y, faster in the middle: free of divergence.
    for (axis, field) in velocity.iter_mut().enumerate() {
        for (coord, tile) in tiles.coords().iter().zip(field).filter(|(coord, _)| coord[0] > 0) {
            for (cell, value) in tile.iter_mut().enumerate() {
                let [x, y, z] = off(coord, cell);
                let rate = 0.35 * (-(x * x + z * z) / 60.0).exp() * (-y * y / 200.0).exp();
                *value = [rate * z, 0.0, -rate * x][axis];
            }
        }
    }
    for _ in 0..steps {
        ctx.phase("advect", || flow.advect_conserving(&ctx, 1.0, conservation)).unwrap();
    }
    let (mut sums, mut most) = ([0.0; 2], 0.0f32);
    for (coord, tile) in flow.tiles().coords().iter().zip(flow.density()) {
        for value in tile {
            assert!(*value >= 0.0);
            sums[usize::from(coord[0] > 0)] += f64::from(*value);
            most = most.max(*value);
        }
    }
    (sums, most)
}

#[test]
fn mass_that_is_lost_is_put_back_where_it_was() {
    let all = MassConservation { kept_share: 1.0, fade_below: 0.01 };
    let (start, _) = two_balls(0, all);
    let (end, most) = two_balls(30, all);
    for side in 0..2 {
        // That of each ball, not only that of both.
        assert!((end[side] / start[side] - 1.0).abs() < 1.0e-3, "{end:?} {start:?}");
    }
    let [all_then, all_now] = [start, end].map(|sums| sums[0] + sums[1]);
    assert!((all_now / all_then - 1.0).abs() < 1.0e-5, "{end:?} {start:?}");
    assert!(most < 1.15, "{most}");
    let (end, _) = two_balls(30, MassConservation { kept_share: 0.95, ..all });
    let wanted = start.map(|mass| mass * 0.95f64.powi(30));
    assert!((0..2).all(|side| (end[side] / wanted[side] - 1.0).abs() < 2.0e-3), "{end:?} {wanted:?}");
    // The last of it is cut off, and does not come back.
    let (end, _) = two_balls(40, MassConservation { kept_share: 0.7, ..all });
    assert_eq!(end, [0.0; 2]);
}
