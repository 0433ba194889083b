//! Terrain that moves takes its liquid along, and none is lost.

use frazil::geometry::DVec3;
use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights, TOP};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::sources::Kind;
use frazil::shallow::terrain::Solids;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::terrain::solids::Solid;
use frazil::shallow::{Moved, Params, Shallow, Snapshot};

use crate::common::bodies::Dice;
use crate::common::flowing::{Frames, from_corner, point};
use crate::common::shallow::context;

/// Heights from -1 m to 1 m.
fn heights() -> Heights {
    Heights::between(-1.0, 1.0).unwrap()
}

fn units(metres: f64) -> i32 {
    heights().round(metres)
}

fn grid(nx: usize, nz: usize) -> Grid {
    from_corner(0.01, [nx, nz])
}

fn solids(grid: Grid, cell: impl FnMut(usize) -> Vec<Solid>) -> Solids {
    Solids::new(grid, heights(), (0..grid.cells()).map(cell))
}

fn floor(grid: Grid, height: f64) -> Solids {
    solids(grid, |_| vec![[BOTTOMLESS, units(height)]])
}

fn params() -> Params {
    Params { liquid: Liquid::WATER, pace: TimeStepping::Realtime(0.005), ..Params::default() }
}

/// Checks that nothing is missing, and that all columns hold what they can.
fn check(shallow: &Shallow, what: &str) {
    assert_eq!(shallow.balance().error, 0, "{what}");
    let columns = shallow.columns();
    for (index, &depth) in shallow.depths().iter().enumerate() {
        let room = columns.ceilings()[index] - columns.bases()[index];
        assert!((0..=room.max(0)).contains(&depth), "{what}: {depth} units in a column of {room}");
    }
}

/// Ground with up to three slabs above it.
fn random_cell(dice: &mut Dice) -> Vec<Solid> {
    let mut solids = vec![[BOTTOMLESS, units(dice.between(-0.9, -0.5))]];
    for layer in 0..dice.below(4) {
        let bottom = dice.between(-0.4, -0.2) + 0.4 * layer as f64;
        solids.push([units(bottom), units(bottom + dice.between(0.001, 0.15))]);
    }
    match dice.below(50) {
        0 => solids.clear(),
        1 => solids = vec![[BOTTOMLESS, TOP]],
        2 => solids.last_mut().unwrap()[1] = TOP,
        3 => solids[0][0] = units(-0.95),
        _ => {}
    }
    solids
}

fn random_body(dice: &mut Dice) -> Shape {
    let mut position =
        || DVec3::new(dice.between(-0.05, 0.45), dice.between(-0.9, 0.9), dice.between(-0.05, 0.3));
    let (a, b) = (position(), position());
    match dice.below(3) {
        0 => Shape::Sphere { centre: a, radius: dice.between(0.005, 0.2) },
        1 => Shape::Capsule { ends: [a, b], radius: dice.between(0.005, 0.1) },
        _ => Shape::Cuboid { centre: a, axes: [DVec3::x(), DVec3::y(), DVec3::z()], half: [0.05, 0.1, 0.07] },
    }
}

#[test]
fn no_unit_is_lost_while_layers_come_and_go() {
    let ctx = context();
    for seed in 0..8 {
        let mut dice = Dice(seed);
        let grid = grid(1 + dice.below(45), 1 + dice.below(25));
        let mut cells: Vec<_> = (0..grid.cells()).map(|_| random_cell(&mut dice)).collect();
        cells[0] = vec![[BOTTOMLESS, units(-0.9)]];
        let mut shallow = Shallow::new(&ctx, &solids(grid, |cell| cells[cell].clone()), params()).unwrap();
        let mut displaced = 0.0;
        for change in 0..500 {
            let what = format!("seed {seed}, change {change}");
            if dice.one_in(5) {
                shallow.fill(dice.between(-0.9, 0.2));
            }
            let moved: Moved = match dice.below(4) {
                0 => {
                    cells.iter_mut().for_each(|cell| {
                        if dice.one_in(3) {
                            *cell = random_cell(&mut dice);
                        }
                    });
                    shallow.update_terrain(&solids(grid, |cell| cells[cell].clone())).unwrap_or_default()
                }
                1 => {
                    let bodies: Vec<_> = (0..dice.below(4)).map(|_| random_body(&mut dice)).collect();
                    shallow.set_bodies(&bodies).unwrap()
                }
                _ => {
                    let [nx, nz] = grid.size;
                    let (x, z) = (dice.below(nx), dice.below(nz));
                    let (x, z) = (x..x + dice.below(nx - x) + 1, z..z + dice.below(nz - z) + 1);
                    let width = x.len();
                    let index = |at: usize| grid.index([x.start + at % width, z.start + at / width]);
                    (0..width * z.len()).for_each(|at| cells[index(at)] = random_cell(&mut dice));
                    let cells = &cells;
                    let (x0, z0) = (x.start, z.start);
                    let cast = move |at: usize| &cells[grid.index([x0 + at % width, z0 + at / width])][..];
                    shallow.update_cells([x, z], cast).unwrap()
                }
            };
            check(&shallow, &what);
            displaced += moved.displaced;
            if dice.one_in(3) {
                shallow.step(&ctx, 0.01).unwrap();
                check(&shallow, &what);
            }
        }
        assert!(displaced > 0.0, "seed {seed}");
    }
}

#[test]
fn a_film_rides_on_a_floor_that_rises_and_sinks() {
    let ctx = context();
    let grid = grid(40, 30);
    let mut shallow = Shallow::new(&ctx, &floor(grid, 0.0), params()).unwrap();
    shallow.fill(1e-6);
    let film = shallow.depths().to_vec();
    assert!(film.iter().any(|&depth| depth > 0));
    for frame in 0..200 {
        // A millimetre a frame, a thousand times the film.
        let height = 0.05 * (f64::from(frame) * 0.02).sin();
        let moved = shallow.update_terrain(&floor(grid, height)).unwrap();
        assert_eq!((moved.displaced, moved.held), (0.0, 0.0));
        shallow.step(&ctx, 1.0 / 60.0).unwrap();
        assert!(shallow.depths() == film, "frame {frame}");
    }
    check(&shallow, "after all frames");
}

#[test]
fn films_ride_on_ground_and_bridge_alike() {
    let ctx = context();
    let grid = grid(40, 5);
    let scene = |frame: i32| {
        let rise = 0.03 * (f64::from(frame) * 0.05).sin();
        solids(grid, |cell| {
            let ground = [BOTTOMLESS, units(-0.5 + rise)];
            let bridge = [units(-0.4 - rise), units(-0.35 - rise)];
            if (10..30).contains(&(cell % 40)) { vec![ground, bridge] } else { vec![ground] }
        })
    };
    let mut shallow = Shallow::new(&ctx, &scene(0), params()).unwrap();
    let columns: Vec<usize> = shallow.columns().indices().collect();
    columns.iter().for_each(|&column| {
        shallow.pour(column, 1e-5);
    });
    let film = shallow.depths().to_vec();
    for frame in 1..100 {
        assert_eq!(shallow.update_terrain(&scene(frame)).unwrap().displaced, 0.0);
        assert!(shallow.depths() == film, "frame {frame}");
    }
}

#[test]
fn a_capsule_in_a_pool_lifts_it_and_lets_it_sink_back() {
    let ctx = context();
    let grid = grid(40, 40);
    let thick = Params { liquid: Liquid::HONEY, kept: 0.01, ..params() };
    let mut shallow = Shallow::new(&ctx, &floor(grid, -0.1), thick).unwrap();
    shallow.fill(0.0);
    let (pool, still) = (shallow.balance().inside, shallow.depths().to_vec());
    // From the air down to the ground, in the middle, and back.
    let capsule = |frame: i32| {
        let low = 0.1 - 0.23 * (f64::from(frame) * std::f64::consts::PI / 120.0).sin();
        let ends = [DVec3::new(0.2, low, 0.2), DVec3::new(0.2, low + 0.3, 0.2)];
        Shape::Capsule { ends, radius: 0.06 }
    };
    let mut highest = 0;
    for frame in 0..=120 {
        let moved = shallow.set_bodies(&[capsule(frame)]).unwrap();
        assert_eq!((moved.held, moved.fallen), (0.0, 0.0));
        check(&shallow, &format!("frame {frame}"));
        shallow.step(&ctx, 1.0 / 60.0).unwrap();
        let corner = shallow.columns().column([0, 0], 0).unwrap();
        highest = highest.max(shallow.depths()[corner] - still[corner]);
        let balance = shallow.balance();
        assert_eq!((balance.inside, balance.lost), (pool, 0.0));
    }
    // Some 1,000 cm3 that it displaces lift 16 dm2 by 6 mm, and waves.
    assert!((0.002..0.03).contains(&heights().length(f64::from(highest))), "by {highest} units");
    shallow.set_bodies(&[]).unwrap();
    let ground = floor(grid, -0.1);
    assert!(*shallow.columns() == *Shallow::new(&ctx, &ground, params()).unwrap().columns());
    shallow.frames(&ctx, 0.5, 60);
    let off = shallow.depths().iter().zip(&still).map(|(a, b)| (a - b).abs()).max().unwrap();
    assert!(heights().length(f64::from(off)) < 1e-4, "it is still by {off} units");
    assert_eq!(shallow.balance().inside, pool);
}

#[test]
fn a_ball_in_a_pool_carries_what_was_in_its_position() {
    let ctx = context();
    let grid = grid(20, 20);
    let mut shallow = Shallow::new(&ctx, &floor(grid, -0.1), params()).unwrap();
    shallow.fill(0.0);
    let ball = Shape::Sphere { centre: DVec3::new(0.1, -0.05, 0.1), radius: 0.03 };
    let moved = shallow.set_bodies(&[ball]).unwrap();
    let columns = shallow.columns();
    let on_it = columns.indices().filter(|&column| columns.layer(column) == 1);
    let units: i64 = on_it.map(|column| i64::from(shallow.depths()[column])).sum();
    let above = units as f64 * heights().unit * 1e-4;
    assert!((above - moved.displaced).abs() < 1e-12, "{above} m3 of {}", moved.displaced);
    // The ball's position, and the room above it.
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.03f64.powi(3);
    assert!(above > volume && above < 3.0 * volume, "{above} m3 above {volume} m3");
    let below = columns.column([10, 10], 0).unwrap();
    assert_eq!(shallow.depths()[below], columns.ceilings()[below] - columns.bases()[below]);
}

#[test]
fn a_terrain_that_swallows_all_liquid_gives_it_back() {
    let ctx = context();
    let grid = grid(33, 20);
    let ground = solids(grid, |cell| {
        let slab = [units(0.1), units(0.15)];
        let ground = [BOTTOMLESS, units(-0.2 + 0.001 * (cell % 7) as f64)];
        if cell % 33 < 9 { vec![ground, slab] } else { vec![ground] }
    });
    let mut shallow = Shallow::new(&ctx, &ground, params()).unwrap();
    shallow.fill(-0.1);
    let on_slab: Vec<usize> = (0..9).map(|x| shallow.columns().column([x, 4], 1).unwrap()).collect();
    on_slab.iter().for_each(|&column| {
        shallow.pour(column, 0.01);
    });
    let (all, before) = (shallow.balance().inside, shallow.depths().to_vec());
    let block = solids(grid, |_| vec![[BOTTOMLESS, TOP]]);
    for _ in 0..3 {
        let moved = shallow.update_terrain(&block).unwrap();
        assert_eq!((moved.held, moved.fallen), (all, 0.0));
        assert!(shallow.depths().iter().all(|&depth| depth == 0));
        shallow.step(&ctx, 0.1).unwrap();
        let balance = shallow.balance();
        assert_eq!((balance.inside, balance.held, balance.lost, balance.error), (0.0, all, 0.0, 0));
        let moved = shallow.update_terrain(&ground).unwrap();
        assert_eq!(moved.held, 0.0);
        // Each cell's liquid is back at its lowest position.
        for z in 0..20 {
            for x in 0..33 {
                let sum = |depths: &[i32]| -> i32 {
                    shallow.columns().of_cell([x, z]).map(|column| depths[column]).sum()
                };
                assert_eq!(sum(shallow.depths()), sum(&before), "({x}, {z})");
                let low = shallow.columns().column([x, z], 0).unwrap();
                assert_eq!(shallow.depths()[low], sum(&before));
            }
        }
        check(&shallow, "given back");
    }
}

#[test]
fn what_waits_goes_to_the_cells_beside_it_as_soon_as_there_is_room() {
    let ctx = context();
    let grid = grid(5, 5);
    let mut shallow = Shallow::new(&ctx, &floor(grid, 0.0), params()).unwrap();
    let middle = shallow.columns().column([2, 2], 0).unwrap();
    shallow.pour(middle, 0.1);
    let poured = shallow.depths()[middle];
    // All is solid but a shaft at each of three sides, of which one is nearly full.
    let open = |x: usize, z: usize| matches!((x, z), (1, 2) | (3, 2) | (2, 1));
    let narrow = poured / 100;
    let shafts = solids(grid, |cell| match (cell % 5, cell / 5) {
        (2, 1) => vec![[BOTTOMLESS, TOP - narrow]],
        (x, z) if open(x, z) => vec![[BOTTOMLESS, units(0.0)]],
        _ => vec![[BOTTOMLESS, TOP]],
    });
    shallow.update_terrain(&shafts).unwrap();
    let depth = |shallow: &Shallow, x: usize, z: usize| {
        shallow.depths()[shallow.columns().column([x, z], 0).unwrap()]
    };
    assert_eq!(depth(&shallow, 2, 1), narrow);
    assert_eq!((depth(&shallow, 1, 2), depth(&shallow, 3, 2)), (poured / 3, poured / 3));
    let unit = shallow.columns().heights.unit * 1e-4;
    let held = |shallow: &Shallow| (shallow.balance().held / unit).round() as i32;
    assert_eq!(held(&shallow), poured - 2 * (poured / 3) - narrow);
    // In the next frame both take half of the rest.
    shallow.step(&ctx, 1e-6).unwrap();
    assert!(held(&shallow) <= 1, "{} units", held(&shallow));
    check(&shallow, "after a frame");
}

#[test]
fn liquid_whose_ground_is_gone_falls_unless_there_is_ground_beside_it() {
    let ctx = context();
    let grid = grid(5, 5);
    let mut shallow = Shallow::new(&ctx, &floor(grid, 0.0), params()).unwrap();
    shallow.fill(0.01);
    let all = shallow.balance().inside;
    // A row of cells is left: what the rows beside it held goes there, or falls with what was farther away.
    let left = solids(grid, |cell| if cell / 5 == 2 { vec![[BOTTOMLESS, units(0.0)]] } else { vec![] });
    let moved = shallow.update_terrain(&left).unwrap();
    let balance = shallow.balance();
    assert_eq!((moved.held, balance.error), (0.0, 0));
    assert!((balance.inside - 0.6 * all).abs() < 1e-9 * all, "{} of {all} m3", balance.inside);
    assert_eq!(moved.fallen, balance.lost);
}

#[test]
fn boxes_give_the_same_state_as_the_whole_terrain() {
    let ctx = context();
    let mut dice = Dice(7);
    let grid = grid(50, 23);
    let mut cells: Vec<_> = (0..grid.cells()).map(|_| random_cell(&mut dice)).collect();
    let make = |cells: &[Vec<Solid>]| solids(grid, |cell| cells[cell].clone());
    let mut whole = Shallow::new(&ctx, &make(&cells), params()).unwrap();
    let mut boxes = Shallow::new(&ctx, &make(&cells), params()).unwrap();
    [&mut whole, &mut boxes].into_iter().for_each(|shallow| shallow.fill(-0.3));
    for frame in 0..60 {
        let (x, z) = (dice.below(40), dice.below(13));
        for (x, z) in (0..100).map(|at| (x + at % 10, z + at / 10)) {
            cells[grid.index([x, z])] = random_cell(&mut dice);
        }
        let solids = make(&cells);
        whole.update_terrain(&solids).unwrap();
        let cell = |at: usize| solids.cell(grid.index([x + at % 10, z + at / 10]));
        boxes.update_cells([x..x + 10, z..z + 10], cell).unwrap();
        for shallow in [&mut whole, &mut boxes] {
            shallow.step(&ctx, 0.02).unwrap();
        }
        assert!(whole.columns() == boxes.columns(), "frame {frame}: other columns");
        assert!(whole.depths() == boxes.depths(), "frame {frame}: other depths");
        assert!(whole.fluxes() == boxes.fluxes(), "frame {frame}: other fluxes");
        assert_eq!(whole.balance(), boxes.balance());
    }
}

#[test]
fn bodies_over_terrain_that_moves_give_the_same_state_as_terrain_with_them() {
    let ctx = context();
    let grid = grid(40, 25);
    let body = |frame: i32| {
        let x = 0.1 + 0.002 * f64::from(frame);
        Shape::Capsule { ends: [DVec3::new(x, -0.02, 0.05), DVec3::new(x + 0.1, 0.1, 0.2)], radius: 0.03 }
    };
    let ground = |frame: i32| {
        let wave = |cell: usize| 0.02 * ((cell % 40) as f64 * 0.3 + f64::from(frame) * 0.1).sin();
        solids(grid, |cell| vec![[BOTTOMLESS, units(wave(cell))]])
    };
    let united = |frame: i32| {
        let ground = ground(frame);
        solids(grid, |cell| {
            let mut solids = ground.cell(cell).to_vec();
            solids.extend(body(frame).solid(grid.centre([cell % 40, cell / 40]), &heights()));
            solids
        })
    };
    let mut own = Shallow::new(&ctx, &united(0), params()).unwrap();
    let mut over = Shallow::new(&ctx, &ground(0), params()).unwrap();
    over.set_bodies(&[body(0)]).unwrap();
    [&mut own, &mut over].into_iter().for_each(|shallow| shallow.fill(0.02));
    for frame in 1..60 {
        own.update_terrain(&united(frame)).unwrap();
        if frame % 2 == 0 {
            over.update_terrain(&ground(frame)).unwrap();
            over.set_bodies(&[body(frame)]).unwrap();
        } else {
            over.set_bodies(&[body(frame)]).unwrap();
            over.update_terrain(&ground(frame)).unwrap();
        }
        assert!(own.columns() == over.columns(), "frame {frame}");
        check(&over, &format!("frame {frame}"));
        for shallow in [&mut own, &mut over] {
            shallow.step(&ctx, 0.01).unwrap();
        }
    }
    assert_eq!(own.balance().inside, over.balance().inside);
}

#[test]
fn mirrored_and_turned_scenes_move_alike() {
    let ctx = context();
    let n = 24;
    let grid = grid(n, n);
    let mirror = |[x, z]: [usize; 2]| [n - 1 - x, z];
    let turn = |[x, z]: [usize; 2]| [z, n - 1 - x];
    let turns: [&dyn Fn([usize; 2]) -> [usize; 2]; 3] = [&|at| at, &mirror, &turn];
    let mut dice = Dice(3);
    let mut cells: Vec<_> = (0..grid.cells()).map(|_| random_cell(&mut dice)).collect();
    // The terrain as one sees it after a turn.
    let make = |cells: &[Vec<Solid>], to: &dyn Fn([usize; 2]) -> [usize; 2]| {
        let mut turned = vec![Vec::new(); n * n];
        (0..n * n).for_each(|at| turned[grid.index(to([at % n, at / n]))] = cells[at].clone());
        Solids::new(grid, heights(), turned)
    };
    let mut all = turns.map(|to| Shallow::new(&ctx, &make(&cells, to), params()).unwrap());
    all.iter_mut().for_each(|shallow| shallow.fill(0.1));
    let mut held = 0;
    for frame in 0..40 {
        for _ in 0..100 {
            let at = dice.below(n * n);
            cells[at] = if dice.one_in(3) { vec![[BOTTOMLESS, TOP - 9]] } else { random_cell(&mut dice) };
        }
        for (shallow, to) in all.iter_mut().zip(turns) {
            let moved = shallow.update_terrain(&make(&cells, to)).unwrap();
            held += i32::from(moved.held > 0.0);
        }
        let [own, turned @ ..] = &all;
        for (other, to) in turned.iter().zip(&turns[1..]) {
            for column in own.columns().indices() {
                let cell = to(own.columns().cell(column));
                let image = other.columns().column(cell, own.columns().layer(column)).unwrap();
                assert_eq!(own.depths()[column], other.depths()[image], "frame {frame}, cell {cell:?}");
            }
            assert_eq!(own.balance(), other.balance());
        }
    }
    assert!(held > 20, "held {held} times");
}

#[test]
fn sources_stay_in_their_positions_when_layers_appear() {
    let ctx = context();
    let grid = grid(20, 20);
    let mut shallow = Shallow::new(&ctx, &floor(grid, 0.0), params()).unwrap();
    let source = point(Kind::Source, [0.1, 0.01, 0.1], 0.0, 1e-5);
    let drain = point(Kind::Drain, [0.1, 0.0, 0.1], 0.0, 1e-6);
    shallow.set_flows(&[source, drain], |_| String::new()).unwrap();
    let cellar = |_: usize| vec![[BOTTOMLESS, units(-0.3)], [units(-0.1), units(0.0)]];
    let mut shown = 0.0;
    for frame in 0..20 {
        let solids = if frame % 2 == 0 { solids(grid, cellar) } else { floor(grid, 0.0) };
        shallow.update_terrain(&solids).unwrap();
        shallow.step(&ctx, 0.1).unwrap();
        check(&shallow, &format!("frame {frame}"));
        let balance = shallow.balance();
        assert!(balance.sourced > shown && balance.drained > 0.0);
        shown = balance.sourced;
        let columns = shallow.columns();
        let wet = columns.indices().filter(|&column| shallow.depths()[column] > 0);
        assert!(wet.into_iter().all(|column| columns.bases()[column] == units(0.0)), "frame {frame}");
    }
    assert!((shown - 2e-5).abs() < 1e-9, "{shown} m3");
    // Below solid it rests, and does not make up for it.
    shallow.update_terrain(&solids(grid, |_| vec![[BOTTOMLESS, units(0.5)]])).unwrap();
    shallow.step(&ctx, 1.0).unwrap();
    shallow.update_terrain(&floor(grid, 0.0)).unwrap();
    shallow.step(&ctx, 0.1).unwrap();
    assert!((shallow.balance().sourced - 2.1e-5).abs() < 1e-9, "{} m3", shallow.balance().sourced);
}

#[test]
fn snapshots_follow_columns_that_change() {
    let ctx = context();
    let grid = grid(20, 20);
    let mut shallow = Shallow::new(&ctx, &floor(grid, 0.0), params()).unwrap();
    shallow.fill(0.01);
    let mut snapshot = Snapshot::new(&shallow);
    let mut dice = Dice(5);
    for _ in 0..3 {
        shallow.update_terrain(&solids(grid, |_| random_cell(&mut dice))).unwrap();
        snapshot.take(&shallow);
        assert!(snapshot.columns() == shallow.columns() && snapshot.depths() == shallow.depths());
    }
}

#[test]
fn bad_terrain_is_a_sentence() {
    let ctx = context();
    let ground = grid(20, 10);
    let mut shallow = Shallow::new(&ctx, &floor(ground, 0.0), params()).unwrap();
    shallow.fill(0.1);
    let before = shallow.balance();
    let mut message = |solids: &Solids| shallow.update_terrain(solids).unwrap_err().to_string();
    let other = message(&floor(grid(10, 20), 0.0));
    assert_eq!(other, "the terrain's cells or heights are not those of the liquid");
    let none = message(&solids(ground, |_| vec![]));
    assert_eq!(none, "the terrain has no surface that faces up within the domain");
    let beyond = shallow.update_cells([3..21, 0..4], |_| &[]).unwrap_err().to_string();
    assert_eq!(beyond, "cells 3..21 x 0..4 are not a box within 20 x 10 cells");
    let body = Shape::Sphere { centre: DVec3::zeros(), radius: f64::NAN };
    let body = shallow.set_bodies(&[body]).unwrap_err().to_string();
    assert_eq!(body, "an obstacle has a length of NaN m: it must be positive and finite");
    assert_eq!(shallow.balance(), before);
}
