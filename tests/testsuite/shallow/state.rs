//! Saved states: what is restored flows on to the same bytes, and what is damaged changes nothing.

use frazil::shallow::columns::grid::Grid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::{FlowPoint, Kind, Pulse};
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Shallow};
use frazil::{Context, Error};

use crate::common::flowing::{DOWN, FRAME, Frames, damaged, from_corner, point, seal, stacked};

use crate::common::bodies::Dice;
use crate::common::liquids::context;

const SIZE: [usize; 2] = [45, 30];
const CELL: f64 = 0.002;

/// Rough ground with a hole and a trough, which a slab covers up to its brim, and a bridge above all.
fn terrain(seed: u64) -> Solids {
    let mut dice = Dice(seed);
    let grid = Grid { cell: CELL, origin: [0.01, -0.02], size: SIZE };
    stacked(grid, [-0.02, 0.08], |[x, z]| {
        let rough = dice.between(0.0, 0.0004);
        let trough = (8..14).contains(&z) && (4..30).contains(&x);
        let ground = if trough { -0.008 } else { 0.0003 * x as f64 + rough };
        let mut solids = vec![[DOWN, ground]];
        if (8..14).contains(&z) && (10..24).contains(&x) {
            solids.push([-0.004, 0.009 + rough]);
        }
        if (20..24).contains(&x) {
            solids.push([0.015, 0.02 - 0.0004 * z as f64]);
        }
        if (16..18).contains(&x) && (3..5).contains(&z) { Vec::new() } else { solids }
    })
}

fn points() -> Vec<FlowPoint> {
    let point = |kind: Kind, at: [f64; 3], rate: f64| self::point(kind, at, 0.004, rate);
    let pulse = Some(Pulse { frequency: 1.3, share: 0.8 });
    vec![
        FlowPoint { pulse, ..point(Kind::Source, [0.053, 0.02, -0.01], 3e-6) },
        point(Kind::Drain, [0.03, 0.0, 0.02], 2e-7),
        point(Kind::Absorber(4e-7), [0.047, 0.01, -0.009], 1e-6),
        point(Kind::Source, [0.022, -0.008, 0.001], 4e-6),
    ]
}

fn params(border: Border, pace: TimeStepping) -> Params {
    Params { border, pace, ..Params::default() }
}

/// Liquid in the trough and on the bridge, and what the points bring.
fn scene(ctx: &Context, seed: u64, params: Params) -> Shallow {
    let mut shallow = Shallow::new(ctx, &terrain(seed), params).unwrap();
    shallow.set_flows(&points(), |at| format!("point {at}")).unwrap();
    shallow.fill(-0.005);
    for z in 4..9 {
        let bridge = shallow.columns().of_cell([21, z]).last().unwrap();
        shallow.pour(bridge, 0.004);
    }
    // A puddle over the drain.
    for cell in (18..23).flat_map(|z| (8..13).map(move |x| [x, z])) {
        let ground = shallow.columns().column(cell, 0).unwrap();
        shallow.pour(ground, 0.001);
    }
    shallow
}

/// A liquid on the same terrain that has been elsewhere.
fn other(ctx: &Context, seed: u64, params: Params) -> Shallow {
    let mut shallow = Shallow::new(ctx, &terrain(seed), params).unwrap();
    shallow.set_flows(&points(), |at| format!("point {at}")).unwrap();
    let corner = shallow.columns().column([40, 27], 0).unwrap();
    shallow.pour(corner, 0.02);
    shallow.step(ctx, 3.0 * FRAME).unwrap();
    shallow
}

/// The first position where bytes differ.
fn difference(one: &[u8], other: &[u8]) -> Option<usize> {
    let differs = one.iter().zip(other).position(|(one, other)| one != other);
    differs.or((one.len() != other.len()).then_some(one.len().min(other.len())))
}

const ALL: [(Border, TimeStepping); 4] = [
    (Border::Closed, TimeStepping::Realtime(0.003)),
    (Border::Closed, TimeStepping::Exact),
    (Border::Open, TimeStepping::Exact),
    (Border::Absorbing, TimeStepping::Realtime(0.002)),
];

#[test]
fn a_restored_liquid_flows_on_to_the_same_bytes() {
    let ctx = context(0);
    for (seed, (border, pace)) in ALL.into_iter().enumerate() {
        let mut straight = scene(&ctx, seed as u64, params(border, pace));
        let mut resumed: Vec<(usize, Shallow)> = Vec::new();
        for frame in 0..60 {
            let report = straight.step(&ctx, FRAME).unwrap();
            let bytes = straight.save();
            for (from, liquid) in &mut resumed {
                let own = liquid.step(&ctx, FRAME).unwrap();
                assert_eq!(own, report, "{border:?}, {pace:?}, frame {frame}, resumed at {from}");
                let at = difference(&liquid.save(), &bytes);
                assert_eq!(at, None, "{border:?}, {pace:?}, frame {frame}, resumed at {from}");
                assert_eq!(liquid.balance(), straight.balance());
            }
            if [0, 3, 20, 41].contains(&frame) {
                let mut liquid = other(&ctx, seed as u64, params(border, pace));
                liquid.restore(&bytes).unwrap();
                assert_eq!(difference(&liquid.save(), &bytes), None, "{border:?}, {pace:?}, frame {frame}");
                assert_eq!(liquid.time(), straight.time());
                assert!(liquid.last_steps().is_empty());
                resumed.push((frame, liquid));
            }
        }
        let balance = straight.balance();
        assert_eq!(balance.error, 0);
        assert!(balance.sourced > 0.0 && balance.drained > 0.0, "{balance:?}");
        assert!(balance.lost > 0.0, "into the hole: {balance:?}");
        assert!((balance.absorbed / 4e-7 - 1.0).abs() < 0.01, "the gauze is full: {balance:?}");
    }
}

#[test]
fn pouring_between_frames_is_part_of_the_state() {
    let ctx = context(0);
    let params = params(Border::Closed, TimeStepping::Exact);
    let mut straight = scene(&ctx, 7, params.clone());
    let mut dice = Dice(3);
    let mut resumed = other(&ctx, 7, params);
    for frame in 0..40 {
        let columns: Vec<usize> = straight.columns().indices().collect();
        for _ in 0..4 {
            let column = columns[dice.below(columns.len())];
            let depth = dice.between(-0.004, 0.004);
            straight.pour(column, depth);
        }
        let saved = straight.save();
        resumed.restore(&saved).unwrap();
        assert_eq!(straight.step(&ctx, FRAME).unwrap(), resumed.step(&ctx, FRAME).unwrap(), "frame {frame}");
        assert_eq!(difference(&straight.save(), &resumed.save()), None, "frame {frame}");
    }
}

#[test]
fn any_number_of_threads_saves_the_same_bytes_and_goes_on_from_them() {
    // Enough columns for a step to be divided among threads.
    let ground = |[x, z]: [usize; 2]| vec![[DOWN, 1e-5 * x as f64 + 2e-5 * z as f64]];
    let solids = stacked(from_corner(CELL, [340, 320]), [-0.02, 0.08], ground);
    let params = params(Border::Open, TimeStepping::Realtime(0.003));
    let contexts = [context(0), context(2)];
    let mut liquids = [0, 1].map(|which| Shallow::new(&contexts[which], &solids, params.clone()).unwrap());
    for liquid in &mut liquids {
        for z in 100..220 {
            liquid.pour(liquid.columns().column([z, z], 0).unwrap(), 0.01);
        }
    }
    for (liquid, ctx) in liquids.iter_mut().zip(&contexts) {
        liquid.frames(ctx, FRAME, 4);
    }
    let saved = liquids.each_ref().map(Shallow::save);
    assert_eq!(difference(&saved[0], &saved[1]), None);
    let [alone, several] = &mut liquids;
    alone.frames(&contexts[0], FRAME, 4);
    several.fill(0.001);
    several.frames(&contexts[1], FRAME, 1);
    several.restore(&saved[0]).unwrap();
    several.frames(&contexts[1], FRAME, 4);
    assert_eq!(difference(&alone.save(), &several.save()), None);
}

#[test]
fn a_state_goes_into_a_vector_or_a_slice_that_is_there() {
    let ctx = context(0);
    let mut shallow = scene(&ctx, 1, params(Border::Open, TimeStepping::Exact));
    shallow.step(&ctx, FRAME).unwrap();
    let saved = shallow.save();
    assert_eq!(shallow.save_size(), saved.len());
    let mut kept = Vec::with_capacity(saved.len() + 1000);
    kept.extend([7; 100]);
    let at = kept.as_ptr();
    shallow.save_into(&mut kept);
    assert_eq!((difference(&kept, &saved), kept.as_ptr()), (None, at));
    kept.resize(saved.len() + 9, 7);
    kept.fill(7);
    assert_eq!(shallow.save_to(&mut kept).unwrap(), saved.len());
    assert_eq!((difference(&kept[..saved.len()], &saved), &kept[saved.len()..]), (None, &[7; 9][..]));
    let error = shallow.save_to(&mut kept[..saved.len() - 1]).unwrap_err();
    let expected = format!("a state of {} bytes does not fit into {}", saved.len(), saved.len() - 1);
    assert!(matches!(error, Error::Argument(what) if what == expected));
}

#[test]
fn a_puddle_in_a_large_domain_is_a_small_state() {
    let ctx = context(0);
    let solids = stacked(from_corner(CELL, [800, 800]), [-0.02, 0.08], |_| vec![[DOWN, 0.0]]);
    let mut shallow = Shallow::new(&ctx, &solids, Params::default()).unwrap();
    shallow.pour(shallow.columns().column([399, 400], 0).unwrap(), 0.004);
    shallow.step(&ctx, FRAME).unwrap();
    let size = shallow.save_size();
    assert!(size < 30_000, "{size} bytes");
    let saved = shallow.save();
    shallow.fill(0.01);
    assert!(shallow.save_size() > 12_000_000);
    shallow.step(&ctx, FRAME).unwrap();
    shallow.restore(&saved).unwrap();
    assert_eq!(difference(&shallow.save(), &saved), None, "what was elsewhere is gone");
    assert_eq!(shallow.balance().error, 0);
}

fn refusal(shallow: &mut Shallow, bytes: &[u8]) -> String {
    let before = shallow.save();
    let (steps, time) = (shallow.last_steps().to_vec(), shallow.time());
    let Err(Error::Bytes(what)) = shallow.restore(bytes) else { panic!("it was not refused as bytes") };
    assert_eq!(difference(&shallow.save(), &before), None, "{what}");
    assert!(shallow.last_steps() == steps && shallow.time() == time, "{what}");
    what
}

#[test]
fn a_state_of_something_else_is_refused_with_a_sentence() {
    let ctx = context(0);
    let closed = params(Border::Closed, TimeStepping::Exact);
    let mut shallow = scene(&ctx, 1, closed.clone());
    shallow.step(&ctx, FRAME).unwrap();
    let saved = shallow.save();

    let mut elsewhere = scene(&ctx, 2, closed.clone());
    elsewhere.step(&ctx, FRAME).unwrap();
    assert_eq!(refusal(&mut elsewhere, &saved), "the saved state belongs to another terrain");

    let mut open = scene(&ctx, 1, params(Border::Open, TimeStepping::Exact));
    assert_eq!(refusal(&mut open, &saved), "the saved state belongs to a liquid with another border");

    let mut fewer = scene(&ctx, 1, closed.clone());
    fewer.set_flows(&points()[..3], |at| format!("point {at}")).unwrap();
    let expected = "the saved state has 4 flow points, and the liquid 3: set the same ones first";
    assert_eq!(refusal(&mut fewer, &saved), expected);

    let mut kinds = points();
    kinds.swap(1, 2);
    fewer.set_flows(&kinds, |at| format!("point {at}")).unwrap();
    let expected = "the saved state has flow point 1 of another kind than the liquid";
    assert_eq!(refusal(&mut fewer, &saved), expected);

    let mut newer = saved.clone();
    newer[8] = 9;
    seal(&mut newer);
    let expected = "the saved state has format 9, and this library reads 2";
    assert_eq!(refusal(&mut shallow, &newer), expected);
    assert_eq!(refusal(&mut shallow, &[]), "the saved state is not of a shallow liquid");
    assert_eq!(refusal(&mut shallow, &saved[1..]), "the saved state is not of a shallow liquid");
    assert_eq!(refusal(&mut shallow, &saved[..60]), "the saved state is cut short");
    assert_eq!(refusal(&mut shallow, &saved[..saved.len() - 1]), "the saved state is cut short");
    let longer = [&saved[..], &[0]].concat();
    assert_eq!(refusal(&mut shallow, &longer), "the saved state is damaged");
    shallow.restore(&saved).unwrap();
}

#[test]
fn damaged_states_are_refused_and_change_nothing() {
    let ctx = context(0);
    let mut shallow = scene(&ctx, 1, params(Border::Open, TimeStepping::Exact));
    shallow.frames(&ctx, FRAME, 10);
    let saved = shallow.save();
    shallow.frames(&ctx, FRAME, 3);
    let before = shallow.save();
    let mut dice = Dice(17);
    for turn in 0..10_000 {
        let bytes = damaged(&saved, 600, &mut dice);
        match shallow.restore(&bytes) {
            Ok(()) => {
                assert_eq!(difference(&bytes, &saved), None, "turn {turn}");
                shallow.restore(&before).unwrap();
            }
            Err(error) => assert!(matches!(error, Error::Bytes(_)), "turn {turn}: {error}"),
        }
        assert_eq!(difference(&shallow.save(), &before), None, "turn {turn}");
    }
}

#[test]
fn states_with_wrong_numbers_and_the_right_hash_are_refused_or_flow() {
    let ctx = context(0);
    let mut shallow = scene(&ctx, 1, params(Border::Open, TimeStepping::Realtime(0.003)));
    shallow.frames(&ctx, FRAME, 10);
    let saved = shallow.save();
    let before = shallow.save();
    let mut dice = Dice(23);
    let mut flowed = 0;
    for turn in 0..10_000 {
        let mut bytes = damaged(&saved, 600, &mut dice);
        if bytes.len() < 16 {
            continue;
        }
        seal(&mut bytes);
        let result = shallow.restore(&bytes);
        if result.is_err() {
            assert_eq!(difference(&shallow.save(), &before), None, "turn {turn}");
            continue;
        }
        flowed += 1;
        // A time or a length of a step may be so that a frame is refused.
        let _ = shallow.step(&ctx, FRAME);
        let columns = shallow.columns();
        let room = |index: usize| columns.ceilings()[index] - columns.bases()[index];
        let outside = (0..columns.len()).find(|&index| !(0..=room(index)).contains(&shallow.depths()[index]));
        assert_eq!(outside, None, "turn {turn}");
        shallow.restore(&saved).unwrap();
    }
    assert!(flowed > 50, "{flowed} states were accepted");
}
