//! Ground and liquid of the gates that compare shallow liquids with theory.

use frazil::Context;
use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Shallow};

/// Gravity (m/s2).
pub const G: f64 = 9.81;

/// Ground of so many cells of an edge (m), as high (m) as a function of their centres (m) says.
pub fn ground(size: [usize; 2], cell: f64, heights: Heights, height: impl Fn([f64; 2]) -> f64) -> Solids {
    let grid = Grid { cell, origin: [0.0; 2], size };
    let solid = |index: usize| {
        let top = height(grid.centre([index % size[0], index / size[0]]));
        vec![[BOTTOMLESS, heights.round(top)]]
    };
    Solids::new(grid, heights, (0..grid.cells()).map(solid))
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
