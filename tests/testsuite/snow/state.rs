//! A layer's saved state: a layer resumed from it equals one that never stopped, and damaged states are refused.

use crate::common::liquids::context;
use crate::common::shapes::sphere;
use frazil::Context;
use frazil::geometry::DVec3;
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::initial::{Cover, Ground, layer};
use frazil::snow::base_layer::{BaseLayer, Params};
use frazil::sweep::Body;
use frazil::vdb::FloatGrid;
use frazil::vdb::file::{WriteOptions, to_bytes};

const CELL: f64 = 0.01;

fn snow(ctx: &Context, depth: f64) -> FloatGrid {
    let ground = Ground::Plane { height: 0.0, area: [-0.7, -0.5, 0.7, 0.5] };
    layer(ctx, &ground, &[], &Cover::Depth(depth), CELL, 3.0).unwrap()
}

fn ball() -> Body {
    let key = |frame: i32, at: [f64; 3]| Key {
        time: f64::from(frame),
        at: DVec3::from(at),
        turn: DVec3::new(0.1, 0.9, 0.4) * f64::from(frame) * 0.5,
    };
    let keys = vec![key(0, [-0.4, 0.35, 0.0]), key(3, [0.0, 0.2, 0.1]), key(8, [0.4, 0.3, -0.1])];
    Body::new(Box::new(Rigid::new(sphere(0.15, 12), Keys::new(keys).unwrap())), 0.0).unwrap()
}

fn step(ctx: &Context, base: &mut BaseLayer, frame: i32) {
    let time = f64::from(frame);
    base.step(ctx, &[ball()], (time - 1.0).max(0.0), time, frame).unwrap();
}

fn bytes(base: &BaseLayer) -> Vec<u8> {
    let mut grids = base.grids().list().to_vec();
    grids.push(base.removed());
    to_bytes(&grids, &WriteOptions::default()).unwrap()
}

#[test]
fn a_restored_layer_continues_with_the_same_bytes_on_any_number_of_threads() {
    let ctx = context(2);
    let params = Params::for_cell(CELL);
    let mut straight = BaseLayer::new(&ctx, snow(&ctx, 0.3), params).unwrap();
    let mut states = vec![straight.save(&ctx).unwrap()];
    let mut frames = Vec::new();
    for frame in 0..=6 {
        step(&ctx, &mut straight, frame);
        states.push(straight.save(&ctx).unwrap());
        frames.push(bytes(&straight));
    }
    for threads in [0, 1, 8] {
        let ctx = context(threads);
        for first in [0, 1, 4] {
            let mut base =
                BaseLayer::restore(&ctx, snow(&ctx, 0.3), params, &states[first as usize]).unwrap();
            assert_eq!(base.save(&ctx).unwrap(), states[first as usize], "{threads} threads, before {first}");
            for frame in first..=6 {
                step(&ctx, &mut base, frame);
                assert!(
                    bytes(&base) == frames[frame as usize],
                    "{threads} threads, from {first}, frame {frame}"
                );
            }
            assert_eq!(base.volume(), straight.volume());
            assert_eq!(base.save(&ctx).unwrap(), states[7]);
        }
    }
    assert!(states.iter().all(|state| state.len() <= straight.save_bound()));
}

#[test]
fn blocks_that_go_whole_or_have_odd_values_outside_the_band_come_back() {
    let ctx = context(2);
    let mut odd = snow(&ctx, 0.3);
    // Inactive values that differ from the background, as another program may leave them.
    for leaf in odd.leaves_mut().unwrap() {
        let quiet = |index: usize| leaf.mask[index >> 6] >> (index & 63) & 1 == 0;
        for index in (0..512).filter(|&index| quiet(index)) {
            leaf.values[index] *= 1.25;
        }
    }
    let mut base = BaseLayer::new(&ctx, odd.deep_copy().unwrap(), Params::for_cell(CELL)).unwrap();
    (0..4).for_each(|frame| step(&ctx, &mut base, frame));
    let state = base.save(&ctx).unwrap();
    let mut back = BaseLayer::restore(&ctx, odd, *base.params(), &state).unwrap();
    base.take_changes().unwrap();
    assert!(bytes(&back) == bytes(&base));
    assert_eq!(back.dirty().count(), 0);
    step(&ctx, &mut back, 4);
    assert!(back.dirty().count() > 0);
}

#[test]
fn a_state_of_another_layer_is_refused() {
    let ctx = context(1);
    let params = Params::for_cell(CELL);
    let mut base = BaseLayer::new(&ctx, snow(&ctx, 0.3), params).unwrap();
    step(&ctx, &mut base, 0);
    step(&ctx, &mut base, 1);
    let state = base.save(&ctx).unwrap();
    let refused = |initial: FloatGrid, state: &[u8]| {
        BaseLayer::restore(&ctx, initial, params, state).err().expect("refused").to_string()
    };
    assert_eq!(refused(snow(&ctx, 0.25), &state), "the saved state belongs to another initial layer");
    assert_eq!(refused(snow(&ctx, 0.3), &[]), "the saved state is not of a base layer");
    let mut newer = state.clone();
    newer[8] = 2;
    assert_eq!(refused(snow(&ctx, 0.3), &newer), "the saved state has format 2, this library reads 1");
    for position in (0..state.len()).step_by(state.len() / 40) {
        let mut flipped = state.clone();
        flipped[position] ^= 0x10;
        assert!(refused(snow(&ctx, 0.3), &flipped).starts_with("the saved state "));
        assert!(refused(snow(&ctx, 0.3), &state[..position]).starts_with("the saved state "));
    }
}
