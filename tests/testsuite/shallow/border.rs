//! What lies beyond the border.

use frazil::shallow::columns::grid::Grid;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::{Params, Shallow};

use crate::common::flowing::{DOWN, Frames, stacked};
use crate::common::shallow::context;

const CELLS: usize = 100;
const DEPTH: f64 = 0.02;

/// A pond of 1 cm cells over level ground.
fn pond(border: Border) -> Shallow {
    let grid = Grid { cell: 0.01, origin: [-0.5, -0.5], size: [CELLS, CELLS] };
    let solids = stacked(grid, [-0.1, 0.1], |_| vec![[DOWN, 0.0]]);
    let params = Params {
        liquid: Liquid::new(0.0),
        kept: 1.0,
        border,
        pace: TimeStepping::Exact,
        ..Params::default()
    };
    let mut pond = Shallow::new(&context(), &solids, params).unwrap();
    pond.fill(DEPTH);
    pond
}

/// Raises a smooth hill of liquid of 1 mm in the middle.
fn raise(pond: &mut Shallow) {
    for index in 0..pond.columns().len() {
        if pond.columns().is_column(index) {
            let [x, z] = pond.columns().grid.centre(pond.columns().cell(index));
            pond.pour(index, 1e-3 * libm::exp(-(x * x + z * z) / (2.0 * 0.06 * 0.06)));
        }
    }
}

/// How far the surface is from rest at most (m).
fn roughness(pond: &Shallow) -> f64 {
    let unit = pond.columns().heights.unit;
    let off = |&depth: &i32| (f64::from(depth) * unit - DEPTH).abs();
    let columns = (0..pond.depths().len()).filter(|&index| pond.columns().is_column(index));
    columns.map(|index| off(&pond.depths()[index])).fold(0.0, f64::max)
}

#[test]
fn waves_leave_over_an_absorbing_border_and_come_back_from_a_wall() {
    let [absorbed, thrown_back] = [Border::Absorbing, Border::Closed].map(|border| {
        let mut pond = pond(border);
        raise(&mut pond);
        // A wave takes 1.1 s from the middle to the border: it has left after 1.8, and what came back would be in the middle after 2.3.
        pond.frames(&context(), 0.1, 23);
        assert_eq!(pond.balance().error, 0);
        roughness(&pond)
    });
    assert!(absorbed < 2e-5 && thrown_back > 1.2e-4, "{absorbed} m, {thrown_back} m");
}

#[test]
fn liquid_at_rest_stays_inside_of_an_absorbing_border() {
    let mut pond = pond(Border::Absorbing);
    let before = pond.depths().to_vec();
    pond.frames(&context(), 0.1, 10);
    assert!(pond.depths() == before);
    assert_eq!([pond.balance().lost, pond.balance().gained], [0.0; 2]);
}

#[test]
fn what_is_taken_comes_back_over_an_absorbing_border_also_from_a_saved_state() {
    let mut pond = pond(Border::Absorbing);
    for index in 0..pond.columns().len() {
        pond.pour(index, -0.5 * DEPTH);
    }
    let mut again = self::pond(Border::Absorbing);
    again.fill(3.0 * DEPTH);
    again.restore(&pond.save()).unwrap();
    for pond in [&mut pond, &mut again] {
        pond.frames(&context(), 0.1, 100);
        let balance = pond.balance();
        assert_eq!(balance.error, 0);
        assert!(balance.gained > 0.9 * 0.5 * DEPTH && roughness(pond) < 0.02 * DEPTH, "{balance:?}");
    }
    assert!(pond.save() == again.save());
}
