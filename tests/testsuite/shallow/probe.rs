//! Read-back and snapshots: volumes against sums by hand, points on layers, and velocities from all sides.

use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::Kind;
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Reading, Shallow, Snapshot};
use frazil::{Context, Error};

use crate::common::bodies::Dice;
use crate::common::flowing::{DOWN, FRAME, Frames, from_corner, point, pour_each, stacked};
use crate::common::shallow::context;

const CELL: f64 = 0.002;

/// How a scene is turned: cells of the turned one by those of the first, which has `size` cells, and vectors.
#[derive(Debug, Clone, Copy)]
enum Turn {
    None,
    Mirror,
    Quarter,
}

impl Turn {
    fn size(self, [nx, nz]: [usize; 2]) -> [usize; 2] {
        if matches!(self, Self::Quarter) { [nz, nx] } else { [nx, nz] }
    }

    fn cell(self, [x, z]: [usize; 2], [nx, nz]: [usize; 2]) -> [usize; 2] {
        match self {
            Self::None => [x, z],
            Self::Mirror => [nx - 1 - x, z],
            Self::Quarter => [nz - 1 - z, x],
        }
    }

    fn vector(self, [u, w]: [f32; 2]) -> [f32; 2] {
        match self {
            Self::None => [u, w],
            Self::Mirror => [-u, w],
            Self::Quarter => [-w, u],
        }
    }
}

const SIZE: [usize; 2] = [37, 26];

/// Hills with a hole, below a bridge that leans.
fn scene(ctx: &Context, turn: Turn) -> Shallow {
    let size = turn.size(SIZE);
    let grid = Grid { cell: CELL, origin: [0.0; 2], size };
    let heights = Heights::between(-0.02, 0.08).unwrap();
    let mut cells = vec![Vec::new(); grid.cells()];
    let mut dice = Dice(5);
    for (x, z) in (0..SIZE[1]).flat_map(|z| (0..SIZE[0]).map(move |x| (x, z))) {
        let unit = |height: f64| heights.round(height);
        let ground = 0.0002 * x as f64 + dice.between(0.0, 0.002);
        let solids = &mut cells[grid.index(turn.cell([x, z], SIZE))];
        if (30..32).contains(&x) && (10..13).contains(&z) {
            continue;
        }
        solids.push([BOTTOMLESS, unit(ground)]);
        if (12..17).contains(&x) {
            solids.push([unit(0.007), unit(0.01 + 0.0003 * z as f64)]);
        }
    }
    let params = Params { border: Border::Open, ..Params::default() };
    let mut shallow = Shallow::new(ctx, &Solids::new(grid, heights, cells), params).unwrap();
    for (x, z) in (4..9).flat_map(|z| (10..16).map(move |x| (x, z))) {
        let columns: Vec<usize> = shallow.columns().of_cell(turn.cell([x, z], SIZE)).collect();
        for column in columns {
            shallow.pour(column, 0.004);
        }
    }
    shallow
}

fn run(ctx: &Context, turn: Turn, frames: usize) -> Shallow {
    let mut shallow = scene(ctx, turn);
    shallow.frames(ctx, FRAME, frames);
    shallow
}

#[test]
fn velocities_are_the_same_from_all_sides() {
    let ctx = context();
    let first = Snapshot::new(&run(&ctx, Turn::None, 12));
    assert!(first.velocities().iter().filter(|velocity| **velocity != [0.0; 2]).count() > 200);
    for turn in [Turn::Mirror, Turn::Quarter] {
        let other = Snapshot::new(&run(&ctx, turn, 12));
        for index in first.columns().indices() {
            let cell = turn.cell(first.columns().cell(index), SIZE);
            let turned = other.columns().column(cell, first.columns().layer(index)).unwrap();
            assert_eq!(other.depths()[turned], first.depths()[index], "{turn:?}, {cell:?}");
            let expected = turn.vector(first.velocities()[index]);
            assert_eq!(other.velocities()[turned], expected, "{turn:?}, {cell:?}");
        }
        let whole = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
        let [volume, turned] =
            [&first, &other].map(|snapshot| snapshot.view().volume(whole[0], whole[1]).unwrap());
        assert_eq!(volume, turned);
    }
}

#[test]
fn velocities_of_all_columns_are_those_of_each() {
    let ctx = context();
    let shallow = run(&ctx, Turn::None, 12);
    let mut all = vec![[7.0; 2]; shallow.columns().len()];
    shallow.velocities(&mut all).unwrap();
    let snapshot = Snapshot::new(&shallow);
    for (index, velocity) in all.iter().enumerate() {
        assert_eq!(
            (*velocity, snapshot.velocities()[index]),
            (shallow.velocity(index), *velocity),
            "{index}"
        );
        let active = snapshot.active()[index / 16] && shallow.active()[index / 16];
        assert!(active || shallow.depths()[index] == 0, "{index}");
    }
    let error = shallow.velocities(&mut all[1..]).unwrap_err();
    assert!(error.to_string().contains("room for 2079 velocities"), "{error}");
}

/// Where two snapshots differ.
fn difference(one: &Snapshot, other: &Snapshot) -> Option<usize> {
    assert!(one.columns() == other.columns() && one.time() == other.time() && one.active() == other.active());
    assert!(one.depths().len() == other.depths().len() && one.velocities().len() == other.velocities().len());
    (0..one.depths().len()).find(|&index| {
        let all =
            |snapshot: &Snapshot| (snapshot.depths()[index], snapshot.velocities()[index].map(f32::to_bits));
        all(one) != all(other)
    })
}

#[test]
fn a_snapshot_that_is_taken_again_is_a_new_one() {
    let ctx = context();
    let mut shallow = scene(&ctx, Turn::None);
    let mut elsewhere = scene(&ctx, Turn::Quarter);
    elsewhere.step(&ctx, FRAME).unwrap();
    let mut kept = Snapshot::new(&shallow);
    for frame in 0..40 {
        shallow.step(&ctx, FRAME).unwrap();
        if frame % 10 == 4 {
            // What was wet sleeps again.
            let wet: Vec<usize> = (0..shallow.depths().len()).filter(|&i| shallow.depths()[i] > 0).collect();
            for column in wet {
                shallow.pour(column, -1.0);
            }
            let column = shallow.columns().column([frame % 30, 20], 0).unwrap();
            shallow.pour(column, 0.003);
        }
        if frame % 10 == 8 {
            kept.take(&elsewhere);
            assert_eq!(difference(&kept, &Snapshot::new(&elsewhere)), None, "frame {frame}");
        }
        kept.take(&shallow);
        assert_eq!(difference(&kept, &Snapshot::new(&shallow)), None, "frame {frame}");
    }
}

#[test]
fn a_snapshot_is_read_in_another_thread_while_the_liquid_flows() {
    let ctx = context();
    let mut shallow = run(&ctx, Turn::None, 3);
    let mut drawn = Snapshot::new(&shallow);
    let mut taken = Snapshot::new(&shallow);
    for _ in 0..5 {
        let expected = shallow.balance().inside;
        std::thread::scope(|scope| {
            let drawn = &drawn;
            scope.spawn(move || {
                for _ in 0..20 {
                    let volume = drawn.view().volume([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]).unwrap();
                    assert_eq!(volume, expected);
                }
            });
            shallow.step(&ctx, FRAME).unwrap();
            taken.take(&shallow);
        });
        std::mem::swap(&mut drawn, &mut taken);
    }
}

#[test]
fn volumes_of_boxes_are_sums_over_columns() {
    let ctx = context();
    let shallow = run(&ctx, Turn::None, 8);
    let (columns, view) = (shallow.columns(), shallow.view());
    let mut dice = Dice(11);
    let heights = columns.heights;
    let mut boxes = Vec::new();
    for _ in 0..200 {
        let low: [f64; 3] = std::array::from_fn(|_| dice.between(-0.01, 0.04));
        boxes.push([low, low.map(|low| low + dice.between(0.0, 0.05))]);
    }
    let mut volumes = vec![7.0; boxes.len()];
    view.volumes(&boxes, &mut volumes).unwrap();
    let mut some = 0;
    for ([low, high], volume) in boxes.iter().zip(&volumes) {
        let mut expected = 0.0;
        for index in columns.indices() {
            let [x, z] = columns.grid.centre(columns.cell(index));
            if (low[0]..=high[0]).contains(&x) && (low[2]..=high[2]).contains(&z) {
                let base = heights.metres(columns.bases()[index]);
                let top = base + heights.length(f64::from(shallow.depths()[index]));
                expected += (top.min(high[1]) - base.max(low[1])).max(0.0) * CELL * CELL;
            }
        }
        some += usize::from(expected > 0.0);
        assert!(
            (volume - expected).abs() < 1e-6 * expected + 1e-14,
            "{low:?} {high:?}: {volume} is not {expected}"
        );
        assert_eq!(*volume, view.volume(*low, *high).unwrap());
    }
    assert!(some > 40, "{some} boxes have liquid");
}

#[test]
fn volumes_of_parts_and_of_layers_are_the_whole() {
    let ctx = context();
    let shallow = run(&ctx, Turn::None, 8);
    let view = shallow.view();
    let (low, high) = ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);
    let inside = shallow.balance().inside;
    assert_eq!(view.volume(low, high).unwrap(), inside);
    for axis in 0..3 {
        let [mut middle_high, mut middle_low] = [high, low];
        (middle_high[axis], middle_low[axis]) = (0.021, 0.021);
        // Centres are at odd multiples of a millimetre: what lies on the side of both boxes is in both.
        if axis != 1 {
            middle_low[axis] += 1e-9;
        }
        let parts = [view.volume(low, middle_high).unwrap(), view.volume(middle_low, high).unwrap()];
        assert!(
            ((parts[0] + parts[1]) / inside - 1.0).abs() < 1e-12 && parts[0] > 0.0,
            "axis {axis}: {parts:?}"
        );
    }
    assert_eq!(view.layers(), 2);
    let layers = [0, 1, 2].map(|layer| view.layer_volume(layer));
    assert!(((layers[0] + layers[1]) / inside - 1.0).abs() < 1e-12, "{layers:?}");
    assert!(layers[0] > 0.0 && layers[1] > 0.0 && layers[2] == 0.0, "{layers:?}");
    let on_bridge = view.volume([low[0], 0.0085, low[2]], high).unwrap();
    assert!((on_bridge / layers[1] - 1.0).abs() < 0.5, "{on_bridge} m3");
}

#[test]
fn boxes_without_an_inside_are_refused() {
    let ctx = context();
    let shallow = scene(&ctx, Turn::None);
    let view = shallow.view();
    let error = view.volume([0.0, 0.1, 0.0], [1.0, 0.0, 1.0]).unwrap_err();
    assert_eq!(error.to_string(), "a box from [0.0, 0.1, 0.0] to [1.0, 0.0, 1.0] m has no inside");
    assert!(view.volume([f64::NAN, 0.0, 0.0], [1.0; 3]).is_err());
    let boxes = [[[0.0; 3], [1.0; 3]], [[0.0; 3], [1.0, f64::NAN, 1.0]]];
    let mut out = [7.0; 2];
    let error = view.volumes(&boxes, &mut out).unwrap_err();
    assert_eq!(error.to_string(), "box 1: a box from [0.0, 0.0, 0.0] to [1.0, NaN, 1.0] m has no inside");
    assert_eq!(out, [7.0; 2]);
    let error = view.volumes(&boxes, &mut out[..1]).unwrap_err();
    assert!(
        matches!(error, Error::Argument(what) if what == "there is room for 1 volumes, but there are 2 boxes")
    );
}

#[test]
fn points_are_on_the_layer_that_holds_them_or_is_nearest() {
    let ctx = context();
    let shallow = scene(&ctx, Turn::None);
    let view = shallow.view();
    // Below the bridge, in it, on it, high above, far below.
    let [x, z] = shallow.columns().grid.centre([14, 6]);
    let layer = |y: f64| view.at([x, y, z]).map(|reading| reading.layer);
    let all = [0.004, 0.0073, 0.0115, 1e9, f64::INFINITY, -1.0, f64::NEG_INFINITY].map(layer);
    assert_eq!(all, [Some(0), Some(0), Some(1), Some(1), Some(1), Some(0), Some(0)]);
    let bridge = view.at([x, 0.012, z]).unwrap();
    assert!((bridge.depth - 0.004).abs() < 1e-9, "{bridge:?}");
    assert!((bridge.height - (0.01 + 0.0003 * 6.0 + 0.004)).abs() < 1e-9, "{bridge:?}");
    let dry = view.at([0.0601, 0.0, 0.001]).unwrap();
    let ground = shallow.columns().heights.metres(shallow.columns().bases()[dry.column]);
    assert_eq!((dry.depth, dry.height, dry.velocity), (0.0, ground, [0.0; 2]));
    // The hole, and outside.
    let hole = shallow.columns().grid.centre([30, 11]);
    for [x, y, z] in [
        [hole[0], 0.0, hole[1]],
        [-1e-9, 0.0, 0.01],
        [0.01, 0.0, 26.0 * CELL],
        [f64::NAN, 0.0, 0.01],
        [0.01, f64::NAN, 0.01],
        [f64::INFINITY, 0.0, 0.01],
    ] {
        assert_eq!(view.at([x, y, z]), None, "({x}, {y}, {z})");
    }
}

#[test]
fn points_are_read_of_a_snapshot_as_of_the_liquid() {
    let ctx = context();
    let shallow = run(&ctx, Turn::None, 8);
    let mut dice = Dice(2);
    let points: Vec<[f64; 3]> =
        (0..500).map(|_| [0.08, 0.02, 0.06].map(|to| dice.between(-0.002, to))).collect();
    let mut read = vec![Some(Reading::default()); points.len()];
    shallow.view().read(&points, &mut read).unwrap();
    assert!(read.iter().flatten().filter(|reading| reading.velocity != [0.0; 2]).count() > 50);
    assert!(read.iter().any(Option::is_none));
    let mut copied = vec![None; points.len()];
    Snapshot::new(&shallow).view().read(&points, &mut copied).unwrap();
    for ((point, reading), copied) in points.iter().zip(&read).zip(&copied) {
        assert_eq!(reading, copied, "{point:?}");
    }
    let error = shallow.view().read(&points, &mut copied[1..]).unwrap_err();
    assert_eq!(error.to_string(), "there is room for 499 readings, but there are 500 points");
}

#[test]
fn the_surface_of_a_film_is_half_as_fast_again() {
    let ctx = context();
    let (slope, depth, viscosity) = (0.1, 1e-3, 1e-4);
    let solids = stacked(from_corner(0.0005, [400, 3]), [-0.01, 0.1], |[x, _]| {
        vec![[DOWN, slope * 0.0005 * (400 - x) as f64]]
    });
    let params =
        Params { liquid: Liquid::new(viscosity), kept: 1.0, pace: TimeStepping::Exact, ..Params::default() };
    let mut shallow = Shallow::new(&ctx, &solids, params).unwrap();
    pour_each(&mut shallow, |_| depth);
    shallow.step(&ctx, 0.1).unwrap();
    let reading = shallow.view().at([0.1, 0.0, 0.00075]).unwrap();
    let mean =
        9.81 * slope * depth * depth / (3.0 * viscosity * (1.0 + slope * slope) * (1.0 + slope * slope));
    assert!((f64::from(reading.velocity[0]) / mean - 1.0).abs() < 1e-3, "{reading:?}, {mean} m/s");
    assert!((f64::from(reading.surface_velocity[0]) / mean - 1.5).abs() < 2e-3, "{reading:?}");
    assert_eq!(reading.velocity[1], 0.0);
}

#[test]
fn an_absorber_that_is_full_is_read_as_such_behind_a_restore() {
    let ctx = context();
    let gauze = point(Kind::Absorber(1e-8), [0.026, 0.0, 0.013], 0.005, 1e-5);
    let set =
        |shallow: &mut Shallow| shallow.set_flows(std::slice::from_ref(&gauze), |_| "gauze".into()).unwrap();
    let mut shallow = scene(&ctx, Turn::None);
    set(&mut shallow);
    shallow.frames(&ctx, FRAME, 20);
    let taken = shallow.balance().absorbed;
    assert!((taken / 1e-8 - 1.0).abs() < 1e-3, "{taken} m3");
    let saved = shallow.save();
    let mut fresh = scene(&ctx, Turn::None);
    set(&mut fresh);
    fresh.restore(&saved).unwrap();
    fresh.step(&ctx, FRAME).unwrap();
    assert_eq!(fresh.balance().absorbed, taken);
}
