//! Gate of turbulence: eddies change with time, and do not only move.

use frazil::Context;
use frazil::snow::mist::{Mist, Params, StepInputs};

use crate::scenes::context;
use crate::snow::mist::open;

/// Edge of a cell (m).
const CELL: f64 = 0.0133;

/// The acceleration by eddies (m/s2) at the cells' lower faces of a cube of 40 cells, eight of them an eddy, at a time (s): what air
/// at rest gains in a step of a thousandth.
fn eddies(ctx: &Context, time: f64) -> Vec<[f32; 3]> {
    let params = Params {
        turbulence: 1000.0,
        turbulence_size: 8.0 * CELL,
        gravity: 0.0,
        noise: 0.0,
        half_life: f64::INFINITY,
        ..Params::for_cell(CELL)
    };
    let mut mist = Mist::new(params).expect("mist");
    let tiles: Vec<[i32; 3]> =
        (0..5).flat_map(|x| (0..5).flat_map(move |y| (0..5).map(move |z| [x, y, z]))).collect();
    mist.add(&tiles, |_| (1.0, [0.0; 3]));
    let around = StepInputs { sources: &[], boundary: &open, fastest: 0.0, wind: None };
    mist.step(ctx, &around, [time, time + 1.0e-3]).expect("a step");
    let flow = mist.flow();
    let at = |x: usize, y: usize, z: usize| {
        let slot = flow.tiles().find([x >> 3, y >> 3, z >> 3].map(|x| x as i32)).expect("a tile");
        let cell = (x & 7) << 6 | (y & 7) << 3 | z & 7;
        [0, 1, 2].map(|axis| flow.velocity()[axis][slot as usize][cell])
    };
    (0..EDGE * EDGE * EDGE).map(|n| at(n / (EDGE * EDGE), n / EDGE % EDGE, n % EDGE)).collect()
}

/// Cells along the edge of that cube.
const EDGE: usize = 40;
/// Farthest shift (cells) by which eddies are compared: an eddy and a half.
const SHIFT: i32 = 12;

/// The best correlation of two fields over all shifts.
fn best_correlation(one: &[[f32; 3]], other: &[[f32; 3]]) -> f64 {
    let edge = EDGE as i32;
    let range = |by: i32| (0.max(-by)..edge.min(edge - by)).step_by(3);
    let index = |x: i32, y: i32, z: i32| ((x * edge + y) * edge + z) as usize;
    let of_shift = |[dx, dy, dz]: [i32; 3]| {
        let (mut both, mut first, mut second) = (0.0, 0.0, 0.0);
        for x in range(dx) {
            for y in range(dy) {
                for z in range(dz) {
                    let (a, b) = (one[index(x, y, z)], other[index(x + dx, y + dy, z + dz)]);
                    for axis in 0..3 {
                        both += f64::from(a[axis] * b[axis]);
                        first += f64::from(a[axis] * a[axis]);
                        second += f64::from(b[axis] * b[axis]);
                    }
                }
            }
        }
        both / f64::sqrt(first * second)
    };
    let shifts = -SHIFT..=SHIFT;
    let all = shifts.clone().flat_map(|x| shifts.clone().map(move |y| [x, y]));
    let all = all.flat_map(|[x, y]| shifts.clone().map(move |z| [x, y, z]));
    all.map(of_shift).fold(-1.0, f64::max)
}

/// Eddies of a moment are those of the moment before, and later have nothing to do with them, however they are moved.
pub fn measure() -> (bool, String) {
    let ctx = context(2);
    let first = eddies(&ctx, 1.0);
    let later = [0.02, 0.2, 0.5, 1.0, 2.0].map(|by| (by, best_correlation(&first, &eddies(&ctx, 1.0 + by))));
    let falls = later[..4].is_sorted_by(|a, b| a.1 >= b.1);
    let note: Vec<String> = later.iter().map(|(by, best)| format!("{best:.2} after {by} s")).collect();
    let is_right = later[0].1 > 0.95 && later[3].1 < 0.5 && later[4].1 < 0.5;
    (falls && is_right, format!("best correlation over all shifts {}", note.join(", ")))
}
