//! Fine cells near, and coarse ones far away: nothing is lost, lakes stay at rest, and films and waves cross the edge.

use frazil::Context;
use frazil::Pool;
use frazil::shallow::free_fall::Falls;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::{FlowPoint, Kind};
use frazil::shallow::{Detail, Params, Shallow};

use crate::common::bodies::Dice;
use crate::common::flowing::{FRAME, Frames, four_points, near_cells, point, turned_box};
use crate::common::shallow::{Plan, Turn, context, floors, ground, waves};

/// Depths (m) that columns of the lowest layer have along x, averaged over some rows (fine cells): of each fine or coarse cell its middle (m) and
/// depth.
fn profile(detail: &Detail, rows: std::ops::Range<usize>) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    let near = detail.near();
    for (liquid, size) in [(detail.fine(), 1), (detail.coarse(), 2)] {
        let columns = liquid.columns();
        for x in 0..columns.grid.size[0] {
            let rows = rows.start / size..rows.end / size;
            let is_own = |z: usize| {
                let [x, z] = [x, z].map(|at| at * size);
                (near[0].contains(&x) && near[1].contains(&z)) == (size == 1)
            };
            let own: Vec<usize> = rows.filter(|&z| is_own(z)).collect();
            if !own.is_empty() {
                let depth = |&z: &usize| f64::from(liquid.depths()[columns.column([x, z], 0).unwrap()]);
                let mean = own.iter().map(depth).sum::<f64>() / own.len() as f64;
                out.push([columns.grid.centre([x, own[0]])[0], columns.heights.length(mean)]);
            }
        }
    }
    out.sort_by(|a, b| a[0].total_cmp(&b[0]));
    out
}

/// The least and the greatest surface of wet columns (units).
fn surfaces(detail: &Detail) -> [i32; 2] {
    let of = |liquid: &Shallow| {
        let columns = liquid.columns();
        let wet = columns.indices().filter(|&i| liquid.depths()[i] > 0);
        wet.map(|i| columns.bases()[i] + liquid.depths()[i])
            .fold([i32::MAX, 0], |[low, high], eta| [low.min(eta), high.max(eta)])
    };
    let [fine, coarse] = [of(detail.fine()), of(detail.coarse())];
    [fine[0].min(coarse[0]), fine[1].max(coarse[1])]
}

#[test]
fn nothing_is_lost_while_the_near_cells_move() {
    let ctx = context();
    let mut dice = Dice(7);
    for (round, border) in
        [Border::Closed, Border::Open, Border::Absorbing, Border::Closed].into_iter().enumerate()
    {
        let cell = 0.001;
        let floor_count = 1 + 2 * (round % 2);
        let solids = floors([60, 44], cell, [-0.02, 0.1], floor_count, |at @ [x, z], floor| {
            let top = 0.012 * floor as f64 + 2e-3 * waves(at, cell);
            (floor == 0 || x.abs().max(z.abs()) < 0.015).then_some([top - 0.003, top])
        });
        let pace = if round == 3 { TimeStepping::Exact } else { TimeStepping::Realtime(0.003) };
        let params = Params { border, pace, ..Params::default() };
        let mut detail = Detail::new(&ctx, &solids, params, [10..30, 8..24]).unwrap();
        detail.fill(0.001);
        detail.set_flows(&four_points([0.02, 0.015]), |at| format!("point {at}")).unwrap();
        for frame in 0..600 {
            if frame % 3 == 0 {
                detail.set_near(near_cells(&mut dice, [60, 44])).unwrap();
                assert_eq!(detail.balance().error, 0, "round {round}, frame {frame}: {:?}", detail.near());
            }
            detail.step(&ctx, FRAME).unwrap();
            assert_eq!(detail.balance().error, 0, "round {round}, frame {frame}: {:?}", detail.near());
        }
        let balance = detail.balance();
        assert!(balance.sourced > 0.0 && balance.drained > 0.0 && balance.absorbed > 0.0, "{balance:?}");
        // What waits is less than a coarse unit a cell, but for what has no room.
        assert!(balance.held < 0.1 * balance.inside, "{balance:?}");
    }
}

#[test]
fn a_lake_at_rest_stays_level_to_a_unit() {
    let ctx = context();
    let cell = 0.001;
    let solids = ground([64, 48], cell, [-0.02, 0.1], |at| 2e-3 * waves(at, cell));
    for rest in [1e-6, 0.0] {
        let params = Params { kept: 1.0, rest, liquid: Liquid::WATER, ..Params::default() };
        let mut detail = Detail::new(&ctx, &solids, params, [10..30, 8..24]).unwrap();
        detail.fill(0.004);
        let level = solids.heights.round(0.004);
        assert_eq!(surfaces(&detail), [level; 2]);
        let all = |detail: &Detail| detail.balance().inside + detail.balance().held;
        let inside = all(&detail);
        for frame in 0..60_usize {
            let x = 2 * (frame % 20);
            detail.set_near([x..x + 20, 8 + 2 * (frame % 7)..30]).unwrap();
            let [low, high] = surfaces(&detail);
            assert!(
                low >= level - 1 && high <= level + 1,
                "rest {rest}, frame {frame}: {low} to {high} of {level}"
            );
            if rest > 0.0 {
                detail.step(&ctx, FRAME).unwrap();
                for liquid in [detail.fine(), detail.coarse()] {
                    assert!(liquid.fluxes().into_iter().flatten().all(|flux| *flux == 0.0), "frame {frame}");
                }
            }
        }
        detail.frames(&ctx, FRAME, 120);
        let [low, high] = surfaces(&detail);
        assert!(low >= level - 100 && high <= level + 100, "rest {rest}: {low} to {high} of {level}");
        let off = all(&detail) / inside - 1.0;
        assert!(off.abs() < 1e-12, "{off}: {:?}", detail.balance());
    }
}

/// Blood over a slope, with sources all along its upper border; where the near cells are.
fn film(slope: f64, near: [std::ops::Range<usize>; 2]) -> (Detail, f64) {
    let (cell, size) = (0.0005, [160, 32]);
    let solids = ground(size, cell, [-0.05, 0.1], |[x, _]| 0.03 - slope * x);
    let params = Params { kept: 1.0, pace: TimeStepping::Exact, ..Params::default() };
    let mut detail = Detail::new(&context(), &solids, params, near).unwrap();
    // A source a coarse cell: each a row of it; and as many drains below.
    let discharge = 1e-5;
    let point = |row: usize, x: f64, kind: Kind, rate: f64| {
        let at = [x, 0.03 - x * slope, -0.008 + 0.001 * (row as f64 + 0.5)];
        self::point(kind, at, 0.00036, rate)
    };
    let sources = (0..16).map(|row| point(row, -0.0395, Kind::Source, discharge * 0.001));
    let drains = (0..16).map(|row| point(row, 0.0395, Kind::Drain, 1e-3));
    let points: Vec<FlowPoint> = sources.chain(drains).collect();
    detail.set_flows(&points, |at| format!("point {at}")).unwrap();
    let viscosity = Liquid::BLOOD.viscosity;
    let steep = (1.0 + slope * slope).powi(2);
    (detail, (3.0 * viscosity * steep * discharge / (9.81 * slope)).cbrt())
}

#[test]
fn a_film_crosses_the_edge_both_ways() {
    let ctx = context();
    for slope in [0.1, 0.5] {
        let (mut detail, theory) = film(slope, [60..100, 0..32]);
        detail.frames(&ctx, FRAME, 480);
        let profile = profile(&detail, 0..32);
        let mut worst: f64 = 0.0;
        for [x, depth] in profile.iter().filter(|[x, _]| x.abs() < 0.025) {
            let off = depth / theory - 1.0;
            println!("slope {slope}: at {:.2} mm {:.4} of Nusselt's depth", 1e3 * x, 1.0 + off);
            worst = worst.max(off.abs());
        }
        assert!(worst < 0.03, "slope {slope}: off by {worst}");
    }
}

#[test]
fn a_film_runs_along_the_edge() {
    let ctx = context();
    let (mut detail, theory) = film(0.3, [0..160, 8..24]);
    detail.frames(&ctx, FRAME, 480);
    let mut worst: f64 = 0.0;
    for row in (4..28).step_by(2) {
        for [_, depth] in profile(&detail, row..row + 2).iter().filter(|[x, _]| x.abs() < 0.025) {
            worst = worst.max((depth / theory - 1.0).abs());
        }
    }
    println!("along: off by {worst}");
    assert!(worst < 0.03, "off by {worst}");
}

/// The surface of a long basin after a hump in its middle has gone outward for a time; `near` is fine.
fn hump(near: [std::ops::Range<usize>; 2], frames: usize) -> Vec<[f64; 2]> {
    let ctx = context();
    let (cell, depth) = (0.001, 0.004);
    let solids = ground([400, 8], cell, [-0.02, 0.1], |_| 0.0);
    let params = Params {
        kept: 1.0,
        liquid: Liquid::new(0.0),
        pace: TimeStepping::Realtime(0.001),
        ..Params::default()
    };
    let mut detail = Detail::new(&ctx, &solids, params, near).unwrap();
    detail.fill(depth);
    for x in 0..200 {
        let at = -0.2 + 0.002 * (f64::from(x) + 0.5);
        let high = 1e-4 * libm::exp(-(at / 0.012) * (at / 0.012));
        for z in 0..4 {
            let position = [at, 0.0, -0.004 + 0.002 * (f64::from(z) + 0.5)];
            detail.pour_at(position, 0.0012, high * 4e-6).unwrap();
        }
    }
    detail.frames(&ctx, FRAME, frames);
    profile(&detail, 0..8).into_iter().map(|[x, deep]| [x, deep - depth]).collect()
}

#[test]
fn waves_that_cross_the_edge_reflect_little() {
    // At 0.2 m/s, after 0.5 s the humps are 0.1 m away, and what the edges at 0.04 m reflect is within 0.02 m of the middle.
    let frames = 30;
    let whole = hump([0..400, 0..8], frames);
    let both = hump([160..240, 0..8], frames);
    let high = |profile: &[[f64; 2]]| profile.iter().map(|[_, eta]| *eta).fold(0.0, f64::max);
    let inner = |profile: &[[f64; 2]]| {
        profile.iter().filter(|[x, _]| x.abs() < 0.05).map(|[_, eta]| eta.abs()).fold(0.0, f64::max)
    };
    let reflected = (inner(&both) - inner(&whole)) / high(&whole);
    println!("humps {:.3e} and {:.3e} m high, reflected {reflected:.4}", high(&whole), high(&both));
    assert!((high(&both) / high(&whole) - 1.0).abs() < 0.05);
    assert!(reflected < 0.03, "{reflected}");
}

#[test]
fn turned_and_mirrored_scenes_are_the_same() {
    let ctx = context();
    let size = [48, 32];
    let cell = 1.0 / 1024.0;
    let plan = Plan::new(size, cell, [0.0, 0.125], |at| {
        let [x, z] = [0, 1].map(|axis| (at[axis] / cell + 0.5 * size[axis] as f64) as usize);
        vec![[0.0, 0.02 + 1e-4 * ((x * 13 + z * 7) % 17) as f64 + 2e-4 * x as f64]]
    });
    let run = |turn: Turn| {
        let solids = plan.solids(turn);
        let near = |cells: [[usize; 2]; 2]| turned_box(turn, cells, size);
        let params = Params { border: Border::Open, ..Params::default() };
        let mut detail = Detail::new(&ctx, &solids, params, near([[6, 6], [20, 18]])).unwrap();
        detail.fill(0.026);
        for frame in 0..12 {
            if frame == 6 {
                detail.set_near(near([[10, 4], [24, 20]])).unwrap();
            }
            detail.step(&ctx, FRAME).unwrap();
        }
        let of = |liquid: &Shallow, size: [usize; 2]| -> Vec<i32> {
            let cells = (0..size[0] * size[1]).map(|index| [index % size[0], index / size[0]]);
            // What is the other liquid's has no column.
            let column = |cell| liquid.columns().column(turn.cell(cell, size), 0);
            let depth = |cell| column(cell).map_or(-1, |column| liquid.depths()[column]);
            cells.map(depth).collect()
        };
        assert_eq!(detail.balance().error, 0);
        [of(detail.fine(), size), of(detail.coarse(), size.map(|count| count / 2))]
    };
    let straight = run(Turn::NONE);
    for turn in Turn::TURNS.into_iter().chain(Turn::MIRRORS) {
        assert!(run(turn) == straight, "{turn:?}");
    }
}

#[test]
fn threads_find_the_same() {
    let run = |threads: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let cell = 0.0005;
        let solids = ground([600, 400], cell, [-0.01, 0.1], |at| 3e-4 * waves(at, cell));
        let mut detail = Detail::new(&ctx, &solids, Params::default(), [100..500, 50..350]).unwrap();
        detail.fill(0.001);
        detail.pour_at([0.0, 0.0, 0.07], 0.01, 1e-6).unwrap();
        let reports: Vec<_> = (0..6).map(|_| detail.step(&ctx, FRAME).unwrap()).collect();
        (reports, detail.fine().save(), detail.coarse().save())
    };
    let alone = run(0);
    assert!(run(3) == alone);
}

#[test]
fn bad_boxes_are_a_sentence() {
    let ctx = context();
    let solids = ground([40, 30], 0.001, [-0.01, 0.1], |_| 0.0);
    let odd = ground([41, 30], 0.001, [-0.01, 0.1], |_| 0.0);
    let params = Params::default;
    let error = |result: frazil::Result<Detail>| result.err().expect("an error").to_string();
    assert_eq!(
        error(Detail::new(&ctx, &odd, params(), [0..2, 0..2])),
        "41 x 30 cells are not an even count along both axes"
    );
    let fall = Params { falls: Some(Falls::default()), ..params() };
    assert_eq!(
        error(Detail::new(&ctx, &solids, fall, [0..2, 0..2])),
        "liquid with a level of detail does not fall freely"
    );
    let mut detail = Detail::new(&ctx, &solids, params(), [0..2, 0..2]).unwrap();
    for (near, sentence) in [
        ([0..42, 0..2], "near cells 0..42 x 0..2 are not a box within 40 x 30 cells"),
        ([4..4, 0..2], "near cells 4..4 x 0..2 are not a box within 40 x 30 cells"),
        ([1..4, 0..2], "near cells 1..4 x 0..2 do not begin and end at even ones"),
    ] {
        assert_eq!(detail.set_near(near).unwrap_err().to_string(), sentence);
    }
    assert_eq!(*detail.near(), [0..2, 0..2]);
}
