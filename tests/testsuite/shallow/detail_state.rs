//! Saved states of liquid in cells of two sizes: what is restored flows on to the same bytes, and what is damaged changes nothing.

use std::ops::Range;

use frazil::geometry::DVec3;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::FlowPoint;
use frazil::shallow::terrain::Solids;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Detail, Params};
use frazil::{Context, Error, Pool};

use crate::common::bodies::Dice;
use crate::common::flowing::{FRAME, Frames, bridged, damaged, four_points, seal};
use crate::common::shallow::context;

fn terrain(phase: f64) -> Solids {
    bridged([40, 30], |x| 1e-3 * phase * x)
}

fn points() -> Vec<FlowPoint> {
    four_points([0.015, 0.012])
}

const NEAR: [Range<usize>; 2] = [12..28, 8..20];
const ELSEWHERE: [Range<usize>; 2] = [0..8, 0..30];

fn scene(ctx: &Context, phase: f64, params: &Params, near: [Range<usize>; 2]) -> Detail {
    let mut detail = Detail::new(ctx, &terrain(phase), params.clone(), near).unwrap();
    detail.set_flows(&points(), |at| format!("point {at}")).unwrap();
    detail.set_bodies(&[Shape::Sphere { centre: DVec3::new(-0.008, 0.0, 0.0), radius: 0.004 }]).unwrap();
    detail.fill(0.001);
    detail
}

fn params(border: Border) -> Params {
    Params { border, pace: TimeStepping::Realtime(0.003), ..Params::default() }
}

#[test]
fn a_restored_liquid_flows_on_to_the_same_bytes() {
    let ctx = context();
    for border in [Border::Closed, Border::Open, Border::Absorbing] {
        let params = params(border);
        let mut straight = scene(&ctx, 0.0, &params, NEAR);
        let mut resumed: Vec<Detail> = Vec::new();
        for frame in 0..40 {
            if frame == 25 {
                for detail in resumed.iter_mut().chain([&mut straight]) {
                    detail.set_near([6..24, 8..26]).unwrap();
                }
            }
            let report = straight.step(&ctx, FRAME).unwrap();
            let bytes = straight.save();
            for (at, detail) in resumed.iter_mut().enumerate() {
                assert_eq!(detail.step(&ctx, FRAME).unwrap(), report, "{border:?}, frame {frame}, {at}");
                assert!(detail.save() == bytes, "{border:?}, frame {frame}, {at}");
                assert_eq!(detail.balance(), straight.balance());
            }
            if [0, 5, 20, 30].contains(&frame) {
                // One with the same near cells, and one whose cells are elsewhere.
                for near in [straight.near().clone(), ELSEWHERE] {
                    let mut detail = scene(&ctx, 0.0, &params, near);
                    detail.step(&ctx, 3.0 * FRAME).unwrap();
                    detail.restore(&bytes).unwrap();
                    assert_eq!(detail.near(), straight.near());
                    assert!(detail.save() == bytes, "{border:?}, frame {frame}");
                    assert_eq!(detail.time(), straight.time());
                    resumed.push(detail);
                }
            }
        }
        assert_eq!(straight.balance().error, 0);
        assert!(straight.balance().held > 0.0, "something waits: {:?}", straight.balance());
    }
}

#[test]
fn all_cells_may_be_near_in_a_state() {
    let ctx = context();
    let params = params(Border::Closed);
    let mut straight = scene(&ctx, 0.0, &params, [0..40, 0..30]);
    straight.step(&ctx, FRAME).unwrap();
    let bytes = straight.save();
    assert_eq!(straight.save_size(), bytes.len());
    let mut room = vec![7; bytes.len() + 3];
    assert_eq!(straight.save_to(&mut room).unwrap(), bytes.len());
    assert!(room[..bytes.len()] == bytes && room[bytes.len()..] == [7; 3]);
    let error = straight.save_to(&mut room[..bytes.len() - 1]).unwrap_err().to_string();
    assert_eq!(error, format!("a state of {} bytes does not fit into {}", bytes.len(), bytes.len() - 1));
    let mut other = scene(&ctx, 0.0, &params, NEAR);
    other.restore(&bytes).unwrap();
    straight.step(&ctx, FRAME).unwrap();
    other.step(&ctx, FRAME).unwrap();
    assert!(other.save() == straight.save());
}

#[test]
fn any_number_of_threads_saves_the_same_bytes() {
    let saved = |threads: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let mut detail = scene(&ctx, 0.0, &params(Border::Open), NEAR);
        detail.frames(&ctx, FRAME, 5);
        detail.save()
    };
    assert!(saved(0) == saved(2));
}

fn refusal(detail: &mut Detail, bytes: &[u8]) -> String {
    let before = detail.save();
    let Err(Error::Bytes(what)) = detail.restore(bytes) else { panic!("it was not refused as bytes") };
    assert!(detail.save() == before, "{what}");
    what
}

#[test]
fn a_state_of_something_else_is_refused_with_a_sentence() {
    let ctx = context();
    let closed = params(Border::Closed);
    let mut detail = scene(&ctx, 0.0, &closed, NEAR);
    detail.step(&ctx, FRAME).unwrap();
    let saved = detail.save();
    for near in [NEAR, ELSEWHERE] {
        let mut elsewhere = scene(&ctx, 1.0, &closed, near.clone());
        elsewhere.step(&ctx, FRAME).unwrap();
        assert_eq!(refusal(&mut elsewhere, &saved), "the saved state belongs to another terrain");
        assert_eq!(*elsewhere.near(), near);
        let mut open = scene(&ctx, 0.0, &params(Border::Open), near.clone());
        assert_eq!(refusal(&mut open, &saved), "the saved state belongs to a liquid with another border");
        let mut fewer = scene(&ctx, 0.0, &closed, near);
        fewer.set_flows(&points()[..3], |at| format!("point {at}")).unwrap();
        let expected = "the saved state has 4 flow points, and the liquid 3: set the same ones first";
        assert_eq!(refusal(&mut fewer, &saved), expected);
    }
    let other = detail.fine().save();
    let expected = "the saved state is not of a shallow liquid in cells of two sizes";
    assert_eq!(refusal(&mut detail, &other), expected);
    assert_eq!(refusal(&mut detail, &[]), expected);
    let mut newer = saved.clone();
    newer[8] = 9;
    seal(&mut newer);
    assert_eq!(refusal(&mut detail, &newer), "the saved state has format 9, and this library reads 1");
    assert_eq!(refusal(&mut detail, &saved[..50]), "the saved state is cut short");
    assert_eq!(refusal(&mut detail, &saved[..saved.len() - 1]), "the saved state is cut short");
    assert_eq!(refusal(&mut detail, &[&saved[..], &[0]].concat()), "the saved state is damaged");
    let mut moved = saved.clone();
    moved[24] += 1;
    seal(&mut moved);
    assert_eq!(refusal(&mut detail, &moved), "the saved state belongs to another terrain");
    detail.restore(&saved).unwrap();
}

#[test]
fn damaged_states_are_refused_or_flow() {
    let ctx = context();
    let mut detail = scene(&ctx, 0.0, &params(Border::Open), NEAR);
    detail.frames(&ctx, FRAME, 10);
    let saved = detail.save();
    let mut dice = Dice(17);
    let mut flowed = 0;
    for turn in 0..10_000 {
        let mut bytes = damaged(&saved, 1200, &mut dice);
        // Half of them with the right hash.
        let is_sealed = turn % 2 == 1 && bytes.len() > 16;
        if is_sealed {
            seal(&mut bytes);
        }
        match detail.restore(&bytes) {
            Ok(()) => {
                assert!(is_sealed || bytes == saved, "turn {turn}");
                flowed += usize::from(bytes != saved);
                // A time or a length of a step may be so that a frame is refused.
                if turn % 8 == 1 {
                    let _ = detail.step(&ctx, FRAME);
                }
                detail.restore(&saved).unwrap();
            }
            Err(error) => {
                assert!(matches!(error, Error::Bytes(_)), "turn {turn}: {error}");
                assert!(detail.save() == saved, "turn {turn}");
            }
        }
    }
    assert!(flowed > 20, "{flowed} states were accepted");
}
