//! Grains of a small layer into which a ball is pressed: balances, the same bytes whatever does the work, damage.

use crate::common::liquids::context;
use crate::common::shapes::sphere;
use frazil::Context;
use frazil::geometry::points::Values;
use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::initial::{Cover, Ground, layer};
use frazil::snow::base_layer::{BaseLayer, Params as BaseParams};
use frazil::snow::grains::heap::{Colliders, Division, Floor, Heap, Shell};
use frazil::snow::grains::{Base, Grains, Object, PACKING, Params, Surroundings, removals};
use frazil::sweep::Body;
use frazil::vdb::FloatGrid;

const CELL: f64 = 0.01;
const FRAMES: i32 = 12;

/// A ball that is pressed 6 cm into the snow and drawn through it.
fn ball() -> Body {
    let key = |time, at: [f64; 3]| Key { time, at: DVec3::from(at), turn: DVec3::zeros() };
    let keys =
        Keys::new(vec![key(0.0, [-0.1, 0.4, 0.0]), key(0.25, [-0.1, 0.19, 0.0]), key(0.5, [0.1, 0.19, 0.0])]);
    Body::new(Box::new(Rigid::new(sphere(0.1, 24), keys.unwrap())), 0.0).unwrap()
}

/// What happened to the base: its state after each frame, and the volume that each frame removed.
struct Story {
    layers: Vec<FloatGrid>,
    removed: Vec<f64>,
    body: Body,
}

fn story(ctx: &Context) -> Story {
    let ground = Ground::Plane { height: 0.0, area: [-0.3, -0.25, 0.3, 0.25] };
    let snow = layer(ctx, &ground, &[], &Cover::Depth(0.15), CELL, 3.0).unwrap();
    let mut base = BaseLayer::new(ctx, snow, BaseParams::for_cell(CELL)).unwrap();
    let bodies = [ball()];
    let (mut layers, mut removed) = (vec![base.surface().deep_copy().unwrap()], Vec::new());
    for frame in 1..=FRAMES {
        let time = |frame: i32| f64::from(frame) / 24.0;
        let report = base.step(ctx, &bodies, time(frame - 1), time(frame), frame).unwrap();
        layers.push(base.surface().deep_copy().unwrap());
        removed.push(report.removed_volume);
    }
    Story { layers, removed, body: ball() }
}

/// Objects over a level ground.
pub fn on_floor<'a>(base: Base<'a>, objects: &'a [Object<'a>]) -> Surroundings<'a> {
    Surroundings { base, objects, statics: &[], ground: &[], floor: Some(0.0), lowest: -1.0 }
}

/// Where there is no floor.
pub fn in_air<'a>(base: Base<'a>, objects: &'a [Object<'a>]) -> Surroundings<'a> {
    Surroundings { floor: None, ..on_floor(base, objects) }
}

fn params() -> Params {
    Params { compression: 0.5, ..Params::for_cell(CELL) }
}

/// Steps grains through some frames; born, owed and the removed volume (m3) at the end.
fn run(
    ctx: &Context,
    story: &Story,
    grains: &mut Grains,
    frames: std::ops::RangeInclusive<i32>,
) -> (usize, f64, f64) {
    let (mut born, mut owed, mut removed) = (0, 0.0, 0.0);
    for frame in frames {
        let at = frame as usize;
        let objects = [Object::new(&story.body, 0.3)];
        let around = on_floor(Base::Whole([&story.layers[at - 1], &story.layers[at]]), &objects);
        let time = |frame: i32| f64::from(frame) / 24.0;
        let report = grains.step(ctx, &around, [time(frame - 1), time(frame)], frame).unwrap();
        assert_eq!(report.dropped, 0);
        born += report.born;
        (owed, removed) = (report.owed, removed + report.removed_volume);
    }
    (born, owed, removed)
}

#[test]
fn every_grain_is_paid_for_by_removed_snow() {
    let ctx = context(2);
    let story = story(&ctx);
    let mut grains = Grains::new(params()).unwrap();
    let (born, owed, removed) = run(&ctx, &story, &mut grains, 1..=FRAMES);
    let reported: f64 = story.removed.iter().sum();
    assert!((removed / reported - 1.0).abs() < 1e-5, "{removed} {reported}");
    let grain = std::f64::consts::PI / 6.0 * (2.0 * params().radius).powi(3);
    let paid = 0.5 * removed * PACKING / grain;
    assert!((born as f64 + owed - paid).abs() < 1e-6 * paid, "{born} + {owed} of {paid}");
    assert!(born > 500 && owed < 0.05 * paid, "{born} {owed}");
    assert_eq!(grains.count(), born);
}

#[test]
fn removed_snow_without_a_surface_before_and_after_counts() {
    let ctx = context(2);
    let story = story(&ctx);
    let all: f64 =
        removals(&story.layers[0], &story.layers[FRAMES as usize]).unwrap().iter().map(|r| r.volume).sum();
    let reported: f64 = story.removed.iter().sum();
    assert!((all / reported - 1.0).abs() < 1e-5, "{all} {reported}");
}

#[test]
fn the_same_grains_from_one_and_two_threads_and_after_a_resume() {
    let (one, two) = (context(1), context(2));
    let story = story(&two);
    let mut straight = Grains::new(params()).unwrap();
    run(&two, &story, &mut straight, 1..=FRAMES);
    let mut stopped = Grains::new(params()).unwrap();
    run(&one, &story, &mut stopped, 1..=7);
    let mut resumed = Grains::resume(params(), &stopped.save()).unwrap();
    run(&one, &story, &mut resumed, 8..=FRAMES);
    assert!(straight.count() > 500);
    assert!(straight.save() == resumed.save());
    assert!(straight.points() == resumed.points());
}

#[test]
fn grains_stay_out_of_the_ball_and_the_base() {
    let ctx = context(2);
    let story = story(&ctx);
    let mut grains = Grains::new(params()).unwrap();
    run(&ctx, &story, &mut grains, 1..=FRAMES);
    let points = grains.points();
    points.validate().unwrap();
    let mut centre = Vec::new();
    story.body.motion().pose(0.5, &mut centre).unwrap();
    let middle = centre.iter().sum::<DVec3>() / centre.len() as f64;
    let positions: Vec<DVec3> = (0..points.count()).map(|index| points.position(index)).collect();
    let radius = params().radius;
    let mut distances = Vec::new();
    story.layers[FRAMES as usize].sample_linear(&ctx, &positions, &mut distances).unwrap();
    let apart = positions
        .iter()
        .zip(&distances)
        .map(|(position, base)| [(position - middle).norm() - 0.1, f64::from(*base)]);
    // Those between the ball and the snow have no room there: no position near theirs is a radius away from both.
    let (pressed, others): (Vec<_>, Vec<_>) = apart.partition(|[ball, base]| ball + base < 2.0 * radius);
    let deep = |[ball, base]: &&[f64; 2]| ball.min(*base) < 0.8 * radius;
    let inside = others.iter().filter(deep).count();
    assert!(inside <= others.len() / 500, "{inside} of {}", others.len());
    assert!(
        pressed.len() < others.len() / 5 && pressed.iter().all(|[ball, _]| *ball > -radius),
        "{}",
        pressed.len()
    );
    let Some(Values::Float(sizes)) = points.attribute("pscale") else { panic!("no pscale") };
    assert_eq!(sizes.get(0), radius as f32);
}

#[test]
fn a_layer_that_remembers_its_changed_blocks_gives_the_same_grains() {
    let ctx = context(2);
    let story = story(&ctx);
    let mut whole = Grains::new(params()).unwrap();
    run(&ctx, &story, &mut whole, 1..=FRAMES);
    let mut base =
        BaseLayer::new(&ctx, story.layers[0].deep_copy().unwrap(), BaseParams::for_cell(CELL)).unwrap();
    let mut changed = Grains::new(params()).unwrap();
    assert!(base.before().is_empty());
    for frame in 1..=FRAMES {
        let time = |frame: i32| f64::from(frame) / 24.0;
        let times = [time(frame - 1), time(frame)];
        base.step(&ctx, &[ball()], times[0], times[1], frame).unwrap();
        let objects = [Object::new(&story.body, 0.3)];
        let around = on_floor(Base::Changed(base.surface(), base.before()), &objects);
        changed.step(&ctx, &around, times, frame).unwrap();
    }
    assert!(changed.count() > 500);
    assert!(changed.save() == whole.save());
    base.take_changes().unwrap();
    assert!(base.before().is_empty());
}

#[test]
fn loose_grains_are_added_or_refused_all_together() {
    let ctx = context(1);
    let mut grains = Grains::new(Params { max_grains: 4, ..params() }).unwrap();
    let at = |x: f64| DVec3::new(x, 1.0, 0.0);
    assert_eq!(grains.emit(&[at(0.0), at(1.0)], &[], 3).unwrap(), 0);
    assert_eq!(grains.emit(&[at(2.0)], &[[1.0, 2.0, 3.0]], 5).unwrap(), 2);
    let before = grains.save();
    type Refused<'a> = (&'a [DVec3], &'a [[f32; 3]], &'a str);
    let refused: [Refused<'_>; 6] = [
        (&[at(3.0), at(1e12)], &[], "positions: element 1 is too far from the origin"),
        (&[at(f64::NAN)], &[], "positions: element 0 is too far from the origin"),
        (&[at(3.0)], &[[0.0, f32::NAN, 0.0]], "velocities: element 0 has a component"),
        (&[at(3.0)], &[[0.0, 2e4, 0.0]], "velocities: element 0 has a component"),
        (&[at(3.0)], &[[0.0; 3]; 2], "velocities: 2 elements, but there are 1 positions"),
        (&[at(3.0), at(4.0)], &[], "more than max = 4"),
    ];
    for (positions, velocities, words) in refused {
        let error = grains.emit(positions, velocities, 6).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
        assert!(grains.save() == before);
    }
    let around = in_air(Base::Missing, &[]);
    let report = grains.step(&ctx, &around, [0.0, 0.1], 6).unwrap();
    assert_eq!((report.count, report.born, report.removed_volume), (3, 0, 0.0));
    let mut ids = grains.ids().to_vec();
    ids.sort_unstable();
    assert_eq!(ids, [0, 1, 2]);
    // Only the radius cannot change.
    let error = grains.set_params(Params { radius: 0.5, ..params() }).unwrap_err().to_string();
    assert!(error.contains("cannot change"), "{error}");
    grains.set_params(Params { gravity: 0.0, ..params() }).unwrap();
    assert_eq!(grains.params().gravity, 0.0);
}

#[test]
fn too_many_grains_are_refused_and_leave_the_others_as_they_were() {
    let ctx = context(2);
    let story = story(&ctx);
    let mut grains = Grains::new(Params { max_grains: 200, ..params() }).unwrap();
    run(&ctx, &story, &mut grains, 1..=3);
    let before = grains.save();
    let around = on_floor(Base::Whole([&story.layers[3], &story.layers[FRAMES as usize]]), &[]);
    let error = grains.step(&ctx, &around, [0.0, 1.0 / 24.0], 4).unwrap_err();
    assert!(error.to_string().contains("max = 200"), "{error}");
    assert!(grains.save() == before);
}

#[test]
fn damaged_states_are_refused() {
    let ctx = context(2);
    let story = story(&ctx);
    let mut grains = Grains::new(params()).unwrap();
    run(&ctx, &story, &mut grains, 1..=5);
    let whole = grains.save();
    let mut random = 0x2545_f491_4f6c_dd1du64;
    let mut next = || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    let mut refused = 0;
    for round in 0..10_000 {
        let mut bytes = whole.clone();
        if round % 4 == 0 {
            bytes.truncate(next() as usize % whole.len());
        } else {
            for _ in 0..1 + next() % 3 {
                let at = next() as usize % if round % 2 == 0 { 64 } else { whole.len() };
                bytes[at] = next() as u8;
            }
        }
        refused += usize::from(bytes == whole || Grains::resume(params(), &bytes).is_err());
    }
    assert_eq!(refused, 10_000);
}

/// A plate comes down on a layer of grains until they have no room, and leaves: they are not thrown.
#[test]
fn grains_that_are_pressed_are_not_thrown_when_they_are_free() {
    let ctx = context(1);
    let params = Params { friction: 0.3, ..Params::for_cell(CELL) };
    let diameter = 2.0 * params.radius;
    let mut heap = Heap::new(diameter);
    for index in 0..36u32 {
        let at = [f64::from(index % 6), f64::from(index / 6)].map(|x| (x - 2.5) * 1.05 * diameter);
        heap.add(index, DVec3::new(at[0], 0.5 * diameter, at[1]), [0.0; 3]).unwrap();
    }
    let plate = TriMesh::cuboid([-0.2, 0.0, -0.2], [0.2, 0.01, 0.2]);
    let division = Division { dt: 1.0 / 24.0, sub_steps: 14 };
    let coefficients = params.coefficients(&division);
    // Heights of its lower side at the frames.
    let heights = [2.0, 1.0, 0.3, 0.3, 0.3, 0.3, 4.0, 30.0, 60.0, 60.0].map(|height| height * diameter);
    let mut fastest: f32 = 0.0;
    for (frame, ends) in heights.windows(2).enumerate() {
        let at = |height: f64| -> Vec<DVec3> {
            plate
                .positions
                .iter()
                .map(|position| position.cast::<f64>() + DVec3::new(0.0, height, 0.0))
                .collect()
        };
        let shell = Shell::new(0.3, plate.triangles.clone(), true, at(ends[0]));
        let pose = |share: f64, out: &mut Vec<DVec3>| {
            *out = at(ends[0] + (ends[1] - ends[0]) * share);
            Ok(())
        };
        let floor = Some(Floor { height: 0.0, friction: 0.3 });
        let mut colliders =
            Colliders { floor, shells: vec![(shell, Box::new(pose))], ..Colliders::default() };
        ctx.phase("move", || heap.step(&ctx, division, coefficients, &mut colliders)).unwrap();
        if frame >= 5 {
            fastest = fastest.max(heap.fastest());
        }
    }
    assert!(fastest < 1.0, "{fastest}");
    assert!(heap.positions().all(|position| position.y < 3.0 * diameter && position.y > 0.0));
}

/// Grains of a small heap on a plane, so many layers high.
fn heap(layers: u32, params: &Params) -> Heap {
    let diameter = 2.0 * params.radius;
    let mut heap = Heap::new(diameter);
    let side = 2 * layers + 2;
    for layer in 0..layers {
        let from = layer..side - layer;
        for (x, z) in from.clone().flat_map(|x| from.clone().map(move |z| (x, z))) {
            let shift = f64::from((x * 7 + z * 3 + layer) % 5) * 0.02;
            let at = [f64::from(x) + shift, 0.5 + f64::from(layer), f64::from(z) - shift];
            heap.add(heap.count() as u32, DVec3::from(at) * (1.04 * diameter), [0.0; 3]).unwrap();
        }
    }
    heap
}

/// Steps a heap through some frames on a plane; a ball that rolls into it on request.
fn settle(heap: &mut Heap, params: &Params, frames: usize, visits_all: bool, ball: bool) {
    let ctx = context(2);
    let division = Division { dt: 1.0 / 24.0, sub_steps: params.sub_steps(1.0 / 24.0, 0.0) };
    let mut coefficients = params.coefficients(&division);
    coefficients.visits_all = visits_all;
    let mesh = sphere(4.0 * params.radius as f32, 12);
    for frame in 0..frames {
        let at = |share: f64| -> Vec<DVec3> {
            let x = (frame as f64 + share - 12.0) * params.radius;
            let middle = DVec3::new(x, 4.0 * params.radius, 8.0 * params.radius);
            mesh.positions.iter().map(|position| position.cast::<f64>() + middle).collect()
        };
        let floor = Some(Floor { height: 0.0, friction: 0.3 });
        let mut colliders = Colliders { floor, ..Colliders::default() };
        if ball {
            let shell = Shell::new(0.3, mesh.triangles.clone(), true, at(0.0));
            let pose = |share: f64, out: &mut Vec<DVec3>| {
                *out = at(share);
                Ok(())
            };
            colliders.shells.push((shell, Box::new(pose)));
            ctx.phase("move", || heap.step(&ctx, division, coefficients, &mut colliders)).unwrap();
        } else {
            ctx.phase("move", || heap.step(&ctx, division, coefficients, &mut colliders)).unwrap();
        }
    }
}

#[test]
fn a_heap_comes_to_rest_and_a_ball_wakes_what_it_pushes() {
    let params = Params { friction: 0.3, ..Params::for_cell(CELL) };
    let mut heap = heap(6, &params);
    assert_eq!(heap.resting(), 0);
    settle(&mut heap, &params, 96, false, false);
    assert_eq!((heap.resting(), heap.fastest()), (heap.count(), 0.0));
    let positions: Vec<DVec3> = heap.positions().collect();
    settle(&mut heap, &params, 24, false, false);
    assert!(heap.positions().eq(positions.iter().copied()), "grains that rest stay where they are");
    settle(&mut heap, &params, 24, false, true);
    let awake = heap.count() - heap.resting();
    assert!(awake > heap.count() / 20 && awake < heap.count(), "{awake} of {}", heap.count());
    settle(&mut heap, &params, 96, false, false);
    assert_eq!(heap.resting(), heap.count());
}

#[test]
fn leaving_out_what_rests_changes_no_bit() {
    let params = Params { friction: 0.3, ..Params::for_cell(CELL) };
    let run = |visits_all: bool| {
        let mut heap = heap(7, &params);
        settle(&mut heap, &params, 40, visits_all, false);
        let some = heap.resting();
        settle(&mut heap, &params, 20, visits_all, true);
        (
            some,
            heap.resting(),
            heap.positions().map(|x| [x.x, x.y, x.z].map(f64::to_bits)).collect::<Vec<_>>(),
        )
    };
    let (skipped, all) = (run(false), run(true));
    assert!(skipped.0 > 100 && skipped.1 > 100 && skipped.1 < skipped.2.len(), "{} {}", skipped.0, skipped.1);
    assert!(skipped == all);
}

#[test]
fn grains_that_rest_wake_when_the_base_below_them_or_gravity_changes() {
    let ctx = context(2);
    let story = story(&ctx);
    let mut grains = Grains::new(params()).unwrap();
    run(&ctx, &story, &mut grains, 1..=FRAMES);
    let last = &story.layers[FRAMES as usize];
    let step = |grains: &mut Grains, base: [&FloatGrid; 2]| {
        let around = on_floor(Base::Whole(base), &[]);
        grains.step(&ctx, &around, [0.0, 1.0 / 24.0], 99).unwrap().resting
    };
    let mut resting = 0;
    for _ in 0..150 {
        resting = step(&mut grains, [last, last]);
    }
    assert!(resting > grains.count() * 9 / 10, "{resting} of {}", grains.count());
    let mut lighter = Grains::resume(Params { gravity: -5.0, ..params() }, &grains.save()).unwrap();
    assert_eq!(step(&mut lighter, [last, last]), 0);
    let mut same = Grains::resume(params(), &grains.save()).unwrap();
    assert!(step(&mut same, [last, last]) >= resting);
    // Nor may they rest on a floor that has gone.
    let around = in_air(Base::Whole([last, last]), &[]);
    assert_eq!(same.step(&ctx, &around, [0.0, 1.0 / 24.0], 99).unwrap().resting, 0);
    // Nor on an object that has jumped.
    let mut beside = Grains::resume(params(), &grains.save()).unwrap();
    let mut at = |from: f64, objects: &[Object<'_>]| {
        let base = Base::Whole([last, last]);
        beside.step(&ctx, &on_floor(base, objects), [from, from + 1.0 / 24.0], 99).unwrap().resting
    };
    let far = ball();
    // It stands still from 0.5 s on; where it was before is elsewhere.
    assert_eq!(at(2.0, &[Object::new(&far, 0.3)]), 0);
    for _ in 0..150 {
        at(2.0, &[Object::new(&far, 0.3)]);
    }
    assert!(at(3.0, &[Object::new(&far, 0.3)]) > resting * 9 / 10);
    assert_eq!(at(0.1, &[Object::new(&far, 0.3)]), 0);
    // The layer loses what the ball has not taken yet.
    let gone = step(&mut grains, [&story.layers[2], last]);
    assert!(gone < resting * 3 / 4, "{gone} of {resting}");
}

#[test]
fn snow_is_pressed_together_as_the_object_that_took_it_says() {
    let ctx = context(2);
    let ground = Ground::Plane { height: 0.0, area: [-0.5, -0.25, 0.5, 0.25] };
    let snow = layer(&ctx, &ground, &[], &Cover::Depth(0.15), CELL, 3.0).unwrap();
    let mut base =
        BaseLayer::new(&ctx, snow, BaseParams { noise: None, ..BaseParams::for_cell(CELL) }).unwrap();
    let before = base.surface().deep_copy().unwrap();
    let ball = |x: f64| {
        let key = |time, y: f64| Key { time, at: DVec3::new(x, y, 0.0), turn: DVec3::zeros() };
        let keys = Keys::new(vec![key(0.0, 0.26), key(1.0 / 24.0, 0.19)]).unwrap();
        Body::new(Box::new(Rigid::new(sphere(0.1, 24), keys)), 0.0).unwrap()
    };
    // Side by side: there are blocks from which both take snow.
    let bodies = [ball(-0.1), ball(0.1)];
    base.step(&ctx, &bodies, 0.0, 1.0 / 24.0, 1).unwrap();
    let born = |compressions: [Option<f64>; 2], removes: bool| {
        let object = |index: usize| Object {
            compression: compressions[index],
            removes: removes || index == 1,
            pushes: false,
            ..Object::new(&bodies[index], 0.3)
        };
        let objects = [object(0), object(1)];
        let around = in_air(Base::Whole([&before, base.surface()]), &objects);
        let mut grains = Grains::new(params()).unwrap();
        let report = grains.step(&ctx, &around, [0.0, 1.0 / 24.0], 1).unwrap();
        let left = grains.rests().filter(|rest| rest[0] < 0.0).count();
        (left, report.born - left, report.born as f64 + report.owed)
    };
    let (left, right, all) = born([None, None], true);
    let (none, half, some) = born([Some(1.0), None], true);
    assert!(left > 200 && right > 200);
    // What is left over of the other side's blocks may lie a little over the middle.
    assert!(none < left / 50 && half > right * 9 / 10, "{none} of {left}, {half} of {right}");
    assert!((some / all - 0.5).abs() < 0.02, "{some} of {all}");
    // One that takes no snow has no say.
    assert_eq!(born([Some(1.0), None], false), (left, right, all));
}

#[test]
fn grains_grow_old_and_leave_their_box() {
    let ctx = context(1);
    let mut grains = Grains::new(Params { lifetime: Some(0.25), gravity: 0.0, ..params() }).unwrap();
    grains.emit(&[DVec3::zeros(), DVec3::new(0.1, 0.0, 0.0)], &[[0.0; 3], [1.0, 0.0, 0.0]], 3).unwrap();
    let around = in_air(Base::Missing, &[]);
    let step = |grains: &mut Grains, frame: i32| {
        let report = grains.step(&ctx, &around, [0.0, 1.0 / 24.0], frame).unwrap();
        (report.count, report.expired, report.dropped)
    };
    assert_eq!(step(&mut grains, 8), (2, 0, 0));
    let position = DVec3::new(0.13, 1.0, 1.0);
    grains.set_params(Params { keep_box: Some([-position, position]), ..*grains.params() }).unwrap();
    assert_eq!(step(&mut grains, 8), (1, 0, 1));
    assert_eq!(step(&mut grains, 9), (0, 1, 0));
    assert!(Grains::new(Params { keep_box: Some([position, position]), ..params() }).is_err());
    assert!(Grains::new(Params { lifetime: Some(0.0), ..params() }).is_err());
}

#[test]
fn pressed_grains_are_moved_out_or_trapped() {
    let ctx = context(2);
    let plate = |from: f64, to: f64| {
        let key = |time, y: f64| Key { time, at: DVec3::new(0.0, y, 0.0), turn: DVec3::zeros() };
        let keys = Keys::new(vec![key(0.0, from), key(1.0, to)]).unwrap();
        Body::new(Box::new(Rigid::new(TriMesh::cuboid([-0.1; 3], [0.1; 3]), keys)), 0.0).unwrap()
    };
    let radius = params().radius;
    let pressed = |room: f64| {
        let mut grains = Grains::new(params()).unwrap();
        grains.emit(&[DVec3::new(0.001, radius, 0.002)], &[], 0).unwrap();
        // Its lower side comes down from two diameters to `room` over the floor.
        let body = plate(0.1 + 4.0 * radius, 0.1 + room);
        let objects = [Object::new(&body, 0.3)];
        let around = on_floor(Base::Missing, &objects);
        for frame in 1..=24 {
            let times = [frame - 1, frame].map(|frame| f64::from(frame) / 24.0);
            grains.step(&ctx, &around, times, frame).unwrap();
        }
        let points = grains.points();
        let Some(Values::Bool(marks)) = points.attribute("trapped") else { panic!() };
        assert_eq!(grains.trapped().len(), usize::from(marks.get(0)));
        (marks.get(0), grains.positions().next().unwrap().y / radius)
    };
    let (free, low) = pressed(2.05 * radius);
    assert!(!free && (low - 1.0).abs() < 0.1, "{low}");
    assert!(pressed(1.2 * radius).0);
}
