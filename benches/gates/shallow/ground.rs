//! Ground and liquid of the gates that compare shallow liquids with theory.

use frazil::Context;
use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::terrain::Solids;
use frazil::shallow::terrain::solids::Solid;
use frazil::shallow::{Balance, Params, Shallow};

use crate::common::bodies::Dice;

/// Gravity (m/s2).
pub const G: f64 = 9.81;

/// Terrain of so many cells of an edge (m), given the solids of each.
pub fn terrain(
    size: [usize; 2],
    cell: f64,
    heights: Heights,
    solids: impl Fn([usize; 2]) -> Vec<Solid>,
) -> Solids {
    let grid = Grid { cell, origin: [0.0; 2], size };
    Solids::new(grid, heights, (0..grid.cells()).map(|index| solids([index % size[0], index / size[0]])))
}

/// Ground of so many cells of an edge (m), as high (m) as a function of their centres (m) says.
pub fn ground(size: [usize; 2], cell: f64, heights: Heights, height: impl Fn([f64; 2]) -> f64) -> Solids {
    let centre = |at: [usize; 2]| at.map(|at| (at as f64 + 0.5) * cell);
    terrain(size, cell, heights, |at| vec![[BOTTOMLESS, heights.round(height(centre(at)))]])
}

/// Heights from `low` to `high` (m).
pub fn between(low: f64, high: f64) -> Heights {
    Heights::between(low, high).expect("a range")
}

/// A liquid of a viscosity (m2/s) that loses nothing else, in steps as long as is stable.
pub fn viscous(viscosity: f64) -> Params {
    Params { liquid: Liquid::new(viscosity), kept: 1.0, pace: TimeStepping::Exact, ..Params::default() }
}

/// Dry ground.
pub fn dry(ctx: &Context, solids: &Solids, params: Params) -> Shallow {
    Shallow::new(ctx, solids, params).expect("a terrain")
}

/// Pours a depth (m) that depends on the position (m) into every column of the lowest layer.
pub fn pour(shallow: &mut Shallow, depth: impl Fn([f64; 2]) -> f64) {
    let [nx, nz] = shallow.columns().grid.size;
    for cell in (0..nx * nz).map(|index| [index % nx, index / nx]) {
        let column = shallow.columns().column(cell, 0).expect("ground everywhere");
        shallow.pour(column, depth(shallow.columns().grid.centre(cell)));
    }
}

/// The depth of the lowest column of a cell (m).
pub fn depth(shallow: &Shallow, cell: [usize; 2]) -> f64 {
    let column = shallow.columns().column(cell, 0).expect("ground everywhere");
    f64::from(shallow.depths()[column]) * shallow.columns().heights.unit
}

/// Runs until a time (s), in frames of at most `frame` seconds.
pub fn run_until(shallow: &mut Shallow, ctx: &Context, time: f64, frame: f64) {
    let frames = ((time - shallow.time()) / frame).ceil().max(1.0);
    let dt = (time - shallow.time()) / frames;
    (0..frames as usize).for_each(|_| {
        shallow.step(ctx, dt).expect("a frame");
    });
}

/// The power of a power law: the slope of the line through the logarithms of points.
pub fn power(points: &[[f64; 2]]) -> f64 {
    let logs: Vec<[f64; 2]> = points.iter().map(|point| point.map(f64::ln)).collect();
    let mean = [0, 1].map(|axis| logs.iter().map(|log| log[axis]).sum::<f64>() / logs.len() as f64);
    let sum =
        |a: usize, b: usize| logs.iter().map(|log| (log[a] - mean[a]) * (log[b] - mean[b])).sum::<f64>();
    sum(0, 1) / sum(0, 0)
}

/// Lets a liquid swing for so many frames (s), and notes a position over time (s); and the period of its swing (s), the mean time between
/// two falls through 0.
pub fn swing(
    liquid: &mut Shallow,
    ctx: &Context,
    dt: f64,
    frames: usize,
    position: impl Fn(&Shallow) -> f64,
) -> (Vec<[f64; 2]>, f64) {
    let mut swing = vec![[0.0, position(liquid)]];
    for frame in 1..=frames {
        liquid.step(ctx, dt).expect("a frame");
        swing.push([frame as f64 * dt, position(liquid)]);
    }
    let falls = swing.windows(2).filter(|ends| ends[0][1] > 0.0 && ends[1][1] <= 0.0);
    let zeros: Vec<f64> =
        falls.map(|ends| ends[0][0] + dt * ends[0][1] / (ends[0][1] - ends[1][1])).collect();
    let period = (zeros[zeros.len() - 1] - zeros[0]) / (zeros.len() - 1) as f64;
    (swing, period)
}

/// Where a current's depth along a row of cells falls through a depth (m) at its front (m).
pub fn front(liquid: &Shallow, row: usize, through: f64) -> f64 {
    let at = |x: usize| depth(liquid, [x, row]);
    let last = (0..liquid.columns().grid.size[0]).rev().find(|&x| at(x) > through).expect("a current");
    let past = (at(last) - through) / (at(last) - at(last + 1));
    (last as f64 + 0.5 + past) * liquid.columns().grid.cell
}

/// Something that a trainer does between frames: liquid is poured, or dabbed off, here and there, it gets another viscosity, and the table
/// leans.
pub fn change(liquid: &mut Shallow, dice: &mut Dice) {
    for _ in 0..200 {
        let column = dice.below(liquid.columns().len());
        if liquid.columns().is_column(column) {
            liquid.pour(column, dice.between(-2e-3, 1e-3));
        }
    }
    let mut params = liquid.params().clone();
    params.liquid = Liquid::new([0.0, 1e-6, 4e-6, 4e-5, 4e-1][dice.below(5)]);
    params.gravity = [dice.between(-3.0, 3.0), -9.81, dice.between(-3.0, 3.0)];
    liquid.set_params(params).expect("parameters");
}

/// What became of a liquid.
pub fn fate(all: &Balance) -> String {
    let ml = [all.poured, all.sourced, all.drained, all.absorbed, all.lost, all.inside].map(|v| v * 1e6);
    let [poured, sourced, drained, absorbed, lost, inside] = ml;
    format!(
        "ml poured {poured:.1}, sourced {sourced:.1}, drained {drained:.1}, absorbed {absorbed:.1}, lost {lost:.1}, inside {inside:.1}"
    )
}

/// Numbers from one to another in so many even steps.
pub fn even(from: f64, to: f64, steps: u32) -> impl Iterator<Item = f64> {
    (0..=steps).map(move |i| from + (to - from) * f64::from(i) / f64::from(steps))
}

/// Numbers from one to another in so many steps of one ratio.
pub fn ratios(from: f64, to: f64, steps: u32) -> impl Iterator<Item = f64> {
    even(from.ln(), to.ln(), steps).map(f64::exp)
}
