//! Liquid that falls freely: where it goes, where it lands, and that none of it is lost on the way.

use frazil::geometry::DVec3;
use frazil::shallow::free_fall::mesh::{Balls, Target, bound};
use frazil::shallow::free_fall::{Droplet, Falls};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::{FlowPoint, Kind};
use frazil::shallow::surface::{Indices, Layout, Up};
use frazil::shallow::terrain::Solids;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Params, Shallow, Snapshot};
use frazil::{Context, Pool};

use crate::common::bodies::Dice;
use crate::common::flowing::{DOWN, FRAME, Frames, from_corner, point, pour_each, stacked};
use crate::common::shallow::{Turn, context, turnable};

const G: f64 = 9.81;

fn solids(size: [usize; 2], cell: f64, high: f64, at: impl Fn([usize; 2]) -> Vec<[f64; 2]>) -> Solids {
    stacked(from_corner(cell, size), [0.0, high], at)
}

fn params(falls: Falls) -> Params {
    Params { liquid: Liquid::new(1e-6), falls: Some(falls), ..Params::default() }
}

fn source(at: [f64; 3], rate: f64) -> FlowPoint {
    point(Kind::Source, at, 0.003, rate)
}

const CELL: f64 = 0.005;

/// A table, half a metre high, from the west to x = 0.1 m, and a source on it.
fn table(ctx: &Context, falls: Falls) -> Shallow {
    let ground = solids([80, 9], CELL, 1.0, |[x, _]| vec![[DOWN, if x < 20 { 0.55 } else { 0.05 }]]);
    let mut liquid = Shallow::new(ctx, &ground, params(falls)).unwrap();
    liquid.set_flows(&[source([0.06, 0.55, 0.0225], 5e-6)], |_| "the source".into()).unwrap();
    liquid
}

fn depth_sum(liquid: &Shallow, holds: impl Fn([usize; 2], usize) -> bool) -> i64 {
    let columns = liquid.columns();
    let all = columns.indices().filter(|&i| holds(columns.cell(i), columns.layer(i)));
    all.map(|i| i64::from(liquid.depths()[i])).sum()
}

#[test]
fn liquid_flies_as_ballistics_says_and_lands_there() {
    let ctx = context();
    let mut liquid = table(&ctx, Falls::default());
    let time = (2.0 * 0.5 / G).sqrt();
    let (mut seen, mut reach) = (0, [f64::INFINITY, 0.0_f64]);
    for _ in 0..90 {
        liquid.step(&ctx, FRAME).unwrap();
        for drop in liquid.drops() {
            let ([x, y, _], [east, down, south]) = (drop.position, drop.velocity);
            let fall = 0.5 * G * drop.age * drop.age;
            assert!((0.55 - fall - y).abs() < 1e-6, "{drop:?}");
            assert!((0.1 + east * drop.age - x).abs() < 1e-6, "{drop:?}");
            assert!((down + G * drop.age).abs() < 1e-6 && south == 0.0, "{drop:?}");
            assert!(drop.age < time + 1e-9);
            // A stream that leaves a table runs about as fast as its waves; its first, thin front is slower.
            assert!(
                (0.0..0.5).contains(&east) && (east > 0.02 || liquid.time() - drop.age < 0.7),
                "{drop:?}"
            );
            seen += 1;
            reach = [reach[0].min(x + east * (time - drop.age)), reach[1].max(x + east * (time - drop.age))];
        }
        // Nothing is wet before the first of it arrives, nor nearer than it lands.
        let under = (reach[0] / CELL).floor() as usize;
        if liquid.time() < time {
            assert_eq!(depth_sum(&liquid, |[x, _], _| x >= 20), 0);
        } else if liquid.time() < time + 0.15 {
            assert_eq!(depth_sum(&liquid, |[x, _], _| x >= 20 && x + 8 < under), 0);
        }
        assert_eq!(liquid.balance().error, 0);
    }
    assert!(seen > 1000 && reach[1] > 0.12, "{seen} {reach:?}");
    assert!(depth_sum(&liquid, |[x, _], _| x >= 20) > 0);
}

#[test]
fn what_is_in_the_air_is_in_the_balance_until_it_has_landed() {
    let ctx = context();
    let mut liquid = table(&ctx, Falls::default());
    for frame in 0..240 {
        if frame == 60 {
            liquid.set_rate(0, 0.0).unwrap();
        }
        liquid.step(&ctx, FRAME).unwrap();
        let balance = liquid.balance();
        assert_eq!(balance.error, 0);
        let drops: f64 = liquid.drops().map(|drop| drop.volume).sum();
        assert!(drops <= balance.falling * (1.0 + 1e-12));
        if frame == 50 {
            assert!(drops > 5e-8 && balance.falling < drops + 1e-8, "{drops} {balance:?}");
        }
        let radii = |drop: Droplet| drop.volume / (4.0 / 3.0 * std::f64::consts::PI * drop.radius.powi(3));
        assert!(liquid.drops().map(radii).all(|share| (share - 1.0).abs() < 1e-12));
    }
    let balance = liquid.balance();
    assert!((balance.inside + balance.falling - balance.sourced).abs() < 1e-18, "{balance:?}");
}

/// Ground, and a floor above it with a hole of 4 x 4 cells.
fn floors(size: [usize; 2], hole: impl Fn([usize; 2]) -> bool) -> Solids {
    solids(size, 0.002, 0.3, |at| if hole(at) { vec![[DOWN, 0.01]] } else { vec![[DOWN, 0.01], [0.2, 0.21]] })
}

fn in_hole([x, z]: [usize; 2]) -> bool {
    (20..24).contains(&x) && (10..14).contains(&z)
}

#[test]
fn liquid_falls_through_a_hole_onto_the_floor_below() {
    let ctx = context();
    let mut liquid = Shallow::new(&ctx, &floors([40, 24], in_hole), params(Falls::default())).unwrap();
    for at in [[16, 11], [26, 12]] {
        liquid.pour(liquid.columns().column(at, 1).unwrap(), 0.05);
    }
    let time = (2.0 * 0.19_f64 / G).sqrt();
    let (mut first, mut fastest) = (None, 0.0_f64);
    for frame in 0..120 {
        fastest = liquid
            .drops()
            .fold(fastest, |fastest, drop| fastest.max(drop.velocity[0].abs()).max(drop.velocity[2].abs()));
        liquid.step(&ctx, FRAME).unwrap();
        let below = depth_sum(&liquid, |_, layer| layer == 0);
        if first.is_none() && below > 0 {
            first = Some(liquid.time());
            // As far as it flies on its way, and drops spread over three cells.
            let reach = (fastest * time / 0.002) as usize + 3;
            let outside = depth_sum(&liquid, |[x, z], layer| {
                let is_near = x + reach >= 20 && x < 24 + reach && z + reach >= 10 && z < 14 + reach;
                layer == 0 && !is_near
            });
            assert!(outside * 10 < below && reach < 20, "{outside} of {below}, {reach}, frame {frame}");
        }
        assert_eq!(liquid.balance().error, 0);
    }
    assert!(first.unwrap() > (2.0 * 0.2 / G).sqrt(), "after its flight: {first:?}");
    assert_eq!(liquid.balance().lost, 0.0);
}

#[test]
fn liquid_falls_on_a_box_that_moves_and_a_box_that_rises_takes_what_it_meets() {
    let ctx = context();
    let mut liquid = Shallow::new(&ctx, &floors([40, 24], in_hole), params(Falls::default())).unwrap();
    let cube = |height: f64, x: f64| Shape::Cuboid {
        centre: DVec3::new(x, height, 0.024),
        axes: [DVec3::x(), DVec3::y(), DVec3::z()],
        half: [0.012, 0.01, 0.012],
    };
    let on_box = |liquid: &Shallow, top: f64| {
        let columns = liquid.columns();
        let top = columns.heights.round(top);
        let all = columns.indices().filter(|&i| (columns.bases()[i] - top).abs() < 10);
        all.map(|i| i64::from(liquid.depths()[i])).sum::<i64>()
    };
    liquid.set_flows(&[source([0.034, 0.21, 0.024], 3e-6)], |_| "source".into()).unwrap();
    liquid.set_bodies(&[cube(0.08, 0.044)]).unwrap();
    for frame in 0..40 {
        // It goes to and fro, and stays below the hole.
        liquid.set_bodies(&[cube(0.08, 0.044 + 0.002 * f64::from(frame % 3))]).unwrap();
        liquid.step(&ctx, FRAME).unwrap();
        assert_eq!(liquid.balance().error, 0);
    }
    assert!(on_box(&liquid, 0.09) > 0);
    // What is in the air just above the box is on it when it has risen.
    let is_above = |drop: &Droplet| {
        let [x, y, z] = drop.position;
        (0.098..0.116).contains(&y) && (0.033..0.055).contains(&x) && (0.013..0.035).contains(&z)
    };
    let volume: f64 = liquid.drops().filter(is_above).map(|drop| drop.volume).sum();
    assert!(volume > 0.0);
    let falling = liquid.balance().falling;
    liquid.set_bodies(&[cube(0.107, 0.044)]).unwrap();
    let balance = liquid.balance();
    assert_eq!(balance.error, 0);
    assert!(falling - balance.falling >= 0.999 * volume, "{falling} {volume} {balance:?}");
    assert!(on_box(&liquid, 0.117) > 0);
    assert!(!liquid.drops().any(|drop| is_above(&drop)));
}

#[test]
fn liquid_that_falls_into_nowhere_is_lost_when_it_has_left() {
    let ctx = context();
    let ground = solids([40, 24], 0.002, 0.3, |at| if in_hole(at) { vec![] } else { vec![[0.19, 0.2]] });
    let mut liquid = Shallow::new(&ctx, &ground, params(Falls::default())).unwrap();
    liquid.pour(liquid.columns().column([16, 11], 0).unwrap(), 0.05);
    let time = (2.0 * 0.2 / G).sqrt();
    for _ in 0..300 {
        liquid.step(&ctx, FRAME).unwrap();
        let balance = liquid.balance();
        assert_eq!((balance.error, balance.lost > 0.0 && liquid.time() < time), (0, false));
    }
    let balance = liquid.balance();
    assert!(balance.lost > 0.3 * balance.poured, "{balance:?}");
}

#[test]
fn fast_liquid_does_not_pass_through_a_thin_floor() {
    let ctx = context();
    // From 5.2 m it arrives with 10 m/s: 30 cm in a step. The floor is as thin as a sheet, and so is a ledge a cell wide.
    let sheet = |[x, z]: [usize; 2]| (20..24).contains(&x) && (10..14).contains(&z);
    for ledge in [false, true] {
        let ground = solids([40, 24], 0.002, 6.0, |at| {
            let mut cell = vec![[DOWN, 0.1]];
            if !ledge || sheet(at) {
                cell.push([0.5, 0.500_001]);
            }
            if !sheet(at) {
                cell.push([5.6, 5.7]);
            }
            cell
        });
        let pace = TimeStepping::Realtime(0.03);
        let liquid = Params { pace, ..params(Falls::default()) };
        let mut liquid = Shallow::new(&ctx, &ground, liquid).unwrap();
        let column = liquid.columns().of_cell([18, 12]).last().unwrap();
        liquid.pour(column, 0.02);
        let (mut most, mut fastest) = (0, 0.0_f64);
        for _ in 0..40 {
            liquid.step(&ctx, 0.03).unwrap();
            assert_eq!(liquid.balance().error, 0);
            fastest = liquid.drops().fold(fastest, |fastest, drop| fastest.max(-drop.velocity[1]));
            let below = depth_sum(&liquid, |_, layer| layer == 0);
            let on_sheet = depth_sum(&liquid, |_, layer| layer == 1);
            most = most.max(on_sheet);
            if !ledge {
                assert_eq!(below, 0, "through the floor");
            } else if most == 0 {
                assert_eq!(below, 0, "past the ledge");
            }
        }
        assert!(most > 0 && fastest > 8.0, "{most} {fastest}");
    }
}

#[test]
fn there_are_never_more_packets_than_allowed() {
    let ctx = context();
    for most in [1, 20, 100] {
        let mut liquid = table(&ctx, Falls { max_packets: most, drop: 0.0, ..Falls::default() });
        let mut fullest = 0;
        for _ in 0..120 {
            liquid.step(&ctx, FRAME).unwrap();
            fullest = fullest.max(liquid.drops().len());
            assert!(liquid.drops().len() <= most);
            assert_eq!(liquid.balance().error, 0);
        }
        // What did not fit is below, and not at the lips.
        let balance = liquid.balance();
        assert!(fullest + 9 > most && balance.falling < 1e-6, "{fullest} of {most}, {balance:?}");
        assert!(depth_sum(&liquid, |[x, _], _| x >= 20) > 0);
    }
}

#[test]
fn liquid_waits_at_its_lip_until_it_is_a_drop() {
    let ctx = context();
    let drop = 2e-8;
    let mut liquid = table(&ctx, Falls { drop, ..Falls::default() });
    liquid.set_rate(0, 1e-6).unwrap();
    let [mut large, mut small] = [0; 2];
    for frame in 0..600 {
        liquid.step(&ctx, FRAME).unwrap();
        if frame > 300 {
            let count = liquid.drops().filter(|other| other.volume >= 0.999 * drop).count();
            large += count;
            small += liquid.drops().len() - count;
        }
    }
    assert!(large > 100 && small * 20 < large, "{large} {small}");
    // When the source has run dry the last ones wait half a second, and fall.
    liquid.set_rate(0, 0.0).unwrap();
    liquid.frames(&ctx, FRAME, 600);
    assert!(liquid.drops().len() > 0 && liquid.balance().falling < 3.0 * drop, "{:?}", liquid.balance());
}

#[test]
fn any_number_of_threads_and_a_restored_liquid_make_the_same_bytes() {
    let run = |threads: usize, frames: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let ground = solids([340, 320], 0.002, 0.3, |[x, z]| {
            if (x / 20 + z / 3) % 3 == 0 { vec![[DOWN, 0.01 + 1e-5 * x as f64]] } else { vec![[DOWN, 0.15]] }
        });
        let mut liquid =
            Shallow::new(&ctx, &ground, params(Falls { max_packets: 1 << 16, ..Falls::default() })).unwrap();
        pour_each(&mut liquid, |[x, z]| 0.0001 * ((x * x + 5 * z) % 23) as f64);
        liquid.frames(&ctx, FRAME, frames);
        (liquid, ctx)
    };
    let (mut alone, ctx) = run(0, 6);
    let saved = alone.save();
    assert!(alone.drops().len() > 1000 && alone.balance().error == 0, "{}", alone.drops().len());
    for threads in [2, 3] {
        assert!(run(threads, 6).0.save() == saved, "{threads} threads");
    }
    let (mut resumed, _) = run(0, 1);
    resumed.restore(&saved).unwrap();
    assert!(resumed.save() == saved);
    for _ in 0..8 {
        resumed.step(&ctx, FRAME).unwrap();
        alone.step(&ctx, FRAME).unwrap();
    }
    assert!(resumed.save() == alone.save());
    assert_eq!(resumed.balance(), alone.balance());
}

#[test]
fn a_state_of_other_falls_is_refused() {
    let ctx = context();
    let mut liquid = table(&ctx, Falls::default());
    liquid.frames(&ctx, FRAME, 60);
    let saved = liquid.save();
    let ground = solids([80, 9], CELL, 1.0, |[x, _]| vec![[DOWN, if x < 20 { 0.55 } else { 0.05 }]]);
    let others = [
        None,
        Some(Falls { max_packets: 3, ..Falls::default() }),
        Some(Falls { height: 0.7, ..Falls::default() }),
    ];
    for falls in others {
        let params = Params { falls, ..params(Falls::default()) };
        let mut other = Shallow::new(&ctx, &ground, params).unwrap();
        other.set_flows(&[source([0.06, 0.55, 0.0225], 5e-6)], |_| "the source".into()).unwrap();
        let error = other.restore(&saved).unwrap_err().to_string();
        assert!(error.contains("other falls"), "{error}");
    }
    for (falls, name) in [
        (Falls { height: -1.0, ..Falls::default() }, "falls.height"),
        (Falls { interval: 0.0, ..Falls::default() }, "falls.interval"),
        (Falls { drop: f64::NAN, ..Falls::default() }, "falls.drop"),
        (Falls { max_packets: 0, ..Falls::default() }, "falls.most"),
    ] {
        assert!(params(falls).validate().unwrap_err().to_string().contains(name));
    }
    let other = Params { falls: None, ..liquid.params().clone() };
    assert!(liquid.set_params(other).unwrap_err().to_string().contains("falls"));
}

#[test]
fn a_turned_or_mirrored_scene_has_the_same_falls() {
    let ctx = context();
    let mut flown = 0;
    for seed in 0..30 {
        let mut plan = turnable(seed);
        plan.params.falls = Some(Falls { height: 0.001, drop: 0.0, max_packets: 400, ..Falls::default() });
        let mut liquids = Turn::ALL.map(|turn| plan.make(&ctx, turn));
        for frame in 0..12 {
            let mut dice = Dice(seed << 32 | frame);
            let corners = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
            let all = liquids.iter_mut().zip(Turn::ALL).map(|(liquid, turn)| {
                plan.pour(liquid, turn, corners, [-1.0, 1e-4, 1e-3][dice.below(3)]);
                dice = Dice(seed << 32 | frame);
                let _ = [(); 2].map(|()| plan.size.map(|count| dice.below(count)));
                liquid.step(&ctx, FRAME).unwrap();
                let balance = liquid.balance();
                assert_eq!(balance.error, 0);
                let mut drops: Vec<[u64; 3]> = liquid
                    .drops()
                    .map(|drop| [drop.position[1].to_bits(), drop.volume.to_bits(), drop.age.to_bits()])
                    .collect();
                drops.sort_unstable();
                (plan.depths_of(liquid, turn), drops, balance.falling.to_bits(), balance.lost.to_bits())
            });
            let all: Vec<_> = all.collect();
            flown += all[0].1.len();
            assert!(all.iter().all(|other| *other == all[0]), "seed {seed}, frame {frame}");
        }
    }
    assert!(flown > 1000, "{flown}");
}

#[test]
fn terrain_that_moves_under_falls_loses_nothing() {
    let ctx = context();
    for seed in 0..12 {
        let mut dice = Dice(seed);
        let border = [Border::Closed, Border::Open][dice.below(2)];
        let falls =
            Falls { height: 0.003, drop: 0.0, max_packets: [40, 4000][dice.below(2)], ..Falls::default() };
        let params = Params { border, gravity: [dice.between(-3.0, 3.0), -G, 1.0], ..params(falls) };
        let shape = |dice: &mut Dice| {
            let low = [dice.below(30), dice.below(20)];
            let height = dice.between(0.0, 0.2);
            let is_void = dice.below(4) == 0;
            move |[x, z]: [usize; 2]| {
                let within = (low[0]..low[0] + 12).contains(&x) && (low[1]..low[1] + 12).contains(&z);
                match (within, is_void) {
                    (false, _) => vec![[DOWN, 0.01], [0.1, 0.11]],
                    (true, true) => vec![],
                    (true, false) => vec![[DOWN, height]],
                }
            }
        };
        let ground = solids([40, 30], 0.002, 0.3, shape(&mut dice));
        let mut liquid = Shallow::new(&ctx, &ground, params).unwrap();
        pour_each(&mut liquid, |_| dice.between(0.0, 0.004));
        let mut flown = 0;
        for frame in 0..60 {
            if frame % 7 == 0 {
                liquid.update_terrain(&solids([40, 30], 0.002, 0.3, shape(&mut dice))).unwrap();
                assert_eq!(liquid.balance().error, 0, "seed {seed}, frame {frame}");
            }
            liquid.step(&ctx, FRAME).unwrap();
            flown += liquid.drops().len();
            assert!(liquid.drops().len() <= falls.max_packets);
            assert_eq!(liquid.balance().error, 0, "seed {seed}, frame {frame}");
        }
        assert!(flown > 100);
    }
}

#[test]
fn drops_and_strands_are_a_mesh_in_buffers_of_known_capacity() {
    let ctx = context();
    let mut liquid = table(&ctx, Falls::default());
    liquid.frames(&ctx, FRAME, 60);
    let mut seen = Snapshot::new(&table(&ctx, Falls::default()));
    seen.take(&liquid);
    let drops = seen.drops().to_vec();
    assert_eq!(drops, liquid.drops().collect::<Vec<_>>());
    let most = bound(drops.len());
    let mut balls = Balls::default();
    balls.reserve(drops.len());
    for (up, left_handed) in [(Up::Y, false), (Up::Y, true), (Up::Z, false), (Up::Z, true)] {
        let layout = Layout { scale: 100.0, up, left_handed, ..Layout::default() };
        let mut vectors = [(); 3].map(|()| vec![f32::NAN; 3 * most.vertices]);
        let mut indices = vec![u32::MAX; most.indices];
        let mut of_drops = vec![u32::MAX; most.vertices];
        let [positions, normals, velocities] = &mut vectors;
        let mut target = Target {
            positions: Some(positions),
            normals: Some(normals),
            velocities: Some(velocities),
            drops: Some(&mut of_drops),
            indices: Indices::U32(&mut indices),
        };
        let counts = balls.build(&drops, &layout, &mut target).unwrap();
        assert!(counts.vertices <= most.vertices && counts.indices <= most.indices);
        assert!(counts.extras > 0 && counts.extras < most.extras, "some strands, and some have broken");
        for numbers in &vectors {
            assert!(numbers[..3 * counts.vertices].iter().all(|number| number.is_finite()));
            assert!(numbers[3 * counts.vertices..].iter().all(|number| number.is_nan()));
        }
        let position = |list: &[f32], at: u32| [0, 1, 2].map(|n| f64::from(list[3 * at as usize + n]));
        for triangle in indices[..counts.indices].as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|at| position(&vectors[0], at));
            let (p, q) = ([0, 1, 2].map(|n| b[n] - a[n]), [0, 1, 2].map(|n| c[n] - a[n]));
            let up = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
            let normal = position(&vectors[1], triangle[0]);
            assert!((0..3).map(|n| up[n] * normal[n]).sum::<f64>() > 0.0, "{up:?} {normal:?}");
        }
        let vertical = if up == Up::Y { 1 } else { 2 };
        let first = position(&vectors[0], 0);
        let [_, y, _] = drops[0].position;
        assert!((first[vertical] - 100.0 * y).abs() <= 100.0 * drops[0].radius * 1.2);
        for (at, drop) in of_drops[..counts.vertices].iter().enumerate() {
            let down = (100.0 * drops[*drop as usize].velocity[1]) as f32;
            assert_eq!(vectors[2][3 * at + vertical], down, "vertex {at} of drop {drop}");
        }
        assert!(of_drops[counts.vertices..].iter().all(|drop| *drop == u32::MAX));
    }
    let mut short = vec![0.0; 10];
    let mut target = Target { positions: Some(&mut short), ..Target::default() };
    let error = balls.build(&drops, &Layout::default(), &mut target).unwrap_err().to_string();
    assert!(error.contains("positions"), "{error}");
    assert_eq!(bound(0).vertices + bound(0).indices, 0);
}
