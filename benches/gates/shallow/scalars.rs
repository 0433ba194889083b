//! Gates of what a shallow liquid carries: each scalar adds up to the last amount, and what a frame with one takes.

use frazil::geometry::{DVec3, Vec3};
use frazil::numeric::cpu::cpu_level;
use frazil::shallow::free_fall::Falls;
use frazil::shallow::sources::Kind;
use frazil::shallow::stains::Absorbing;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Law, Scalar, Shallow, Staining, Stains};

use crate::common::bodies::Dice;
use crate::common::shallow::{Plan, Turn, busy, context};
use crate::harness::{Harness, median};
use crate::shallow::ground;
use crate::shallow::speed::{five_floors, one_floor, thread_seconds};

/// Steps of the run.
const STEPS: u32 = 100_000;
/// Frames between changes.
const EVERY: u32 = 25;
const FRAME: f64 = 1.0 / 60.0;
/// Frames that are timed as one, and how often.
const FRAMES: usize = 20;
const TIMES: usize = 31;

/// All of them.
pub fn run(h: &mut Harness) {
    h.measure("shallow.scalars", || sums(false));
    h.measure("shallow.mass_all", || sums(true));
    h.measure("shallow.dyed_one_floor", || slowdown(one_floor));
    h.measure("shallow.dyed_five_floors", || slowdown(five_floors));
}

/// A dye, an age, a warmth that goes, and a dye that is everywhere the same.
fn four() -> [Scalar; 4] {
    let scalar = |name: &str, law, range| Scalar { name: name.into(), law, range };
    [
        Scalar::dye("dye"),
        scalar("age", Law::Ages, 3600.0),
        scalar("warmth", Law::Decays(2.0), 50.0),
        Scalar::dye("plain"),
    ]
}

/// Ground that blood stains and that takes it in, as a mesh with a vertex at each cell.
fn stains(liquid: &Shallow, plan: &Plan) -> (Stains, Vec<Vec3>) {
    let grid = liquid.columns().grid;
    let [nx, nz] = plan.size.map(|count| count as u32);
    let position = |cell: usize| {
        let [x, z] = grid.centre([cell % plan.size[0], cell / plan.size[0]]);
        let top = plan.solids[cell].first().map_or(0.0, |solid| plan.heights.metres(solid[1]));
        Vec3::new(x as f32, top as f32, z as f32)
    };
    let positions: Vec<Vec3> = (0..grid.cells()).map(position).collect();
    let quads = (0..nz - 1).flat_map(|z| (0..nx - 1).map(move |x| z * nx + x));
    let triangles: Vec<[u32; 3]> =
        quads.flat_map(|at| [[at, at + nx, at + 1], [at + 1, at + nx, at + nx + 1]]).collect();
    let absorbs = Some(Absorbing { capacity: 1e-3, rate: 1e-5 });
    let staining = Staining { scalar: Some(0), absorbs, ..Staining::default() };
    let stains = Stains::new(liquid, &positions, &triangles, staining).expect("stains");
    (stains, positions)
}

/// Frames after which an amount is missing, or too many, or a concentration is beyond those that came in, and how it went; with falls and stains or
/// without.
fn sums(is_all: bool) -> (f64, String) {
    let ctx = context();
    let mut plan = busy([93, 61]);
    plan.params.falls = is_all.then(|| Falls { height: 0.001, drop: 0.0, ..Falls::default() });
    let mut liquid = plan.make(&ctx, Turn::NONE);
    liquid.set_scalars(&four()).expect("four scalars");
    for (at, point) in plan.points.iter().enumerate() {
        if point.kind == Kind::Source {
            let sourced = [at as f64, 0.0, 37.0, 0.0];
            liquid.set_sourced(at, &sourced).expect("a source");
        }
    }
    let mut stains = is_all.then(|| stains(&liquid, &plan));
    let (mut falling, mut soaked) = (0.0_f64, 0.0);
    let mut dice = Dice(18);
    let (mut steps, mut frame, mut wrong, mut held) = (0, 0, 0, 0.0_f64);
    let mut out = vec![0.0; liquid.columns().len()];
    while steps < STEPS {
        if frame % EVERY == 0 {
            change(&mut liquid, &mut dice);
            held = held.max(liquid.scalar_balance(0).expect("a dye").held);
        }
        steps += liquid.step(&ctx, FRAME).expect("a frame").steps;
        if let Some((stains, positions)) = &mut stains {
            soaked += stains.update(&mut liquid, positions).expect("stains");
            falling = falling.max(liquid.scalar_balance(0).expect("a dye").falling);
        }
        let balances = [0, 1, 2, 3].map(|scalar| liquid.scalar_balance(scalar).expect("a scalar"));
        out.resize(liquid.columns().len(), 0.0);
        liquid.concentrations(0, &mut out).expect("concentrations");
        // A level, and half an amount for each pipe.
        let is_off = |(own, depth): (&f32, &i32)| {
            let off = (1.0 + 16.0 / f64::from((*depth).max(1))) / f64::from(1 << 20) + 1e-7;
            !(-off..=1.0 + off).contains(&f64::from(*own))
        };
        let is_beyond = out.iter().zip(liquid.depths()).any(is_off);
        let is_wrong = is_beyond || liquid.balance().error != 0 || balances.iter().any(|all| all.error != 0);
        wrong += u32::from(is_wrong);
        frame += 1;
    }
    let all = liquid.scalar_balance(0).expect("a dye");
    let ml =
        [all.poured, all.sourced, all.drained, all.absorbed, all.lost, all.inside, held].map(|v| v * 1e6);
    let [poured, sourced, drained, absorbed, lost, inside, held] = ml;
    let note = format!(
        "{steps} steps, terrain that moves; ml of dye poured {poured:.1}, sourced {sourced:.1}, drained {drained:.1}, \
         absorbed {absorbed:.1}, lost {lost:.1}, inside {inside:.1}, waiting at most {held:.2}, left by rounding {:.1e}; in the air \
         at most {:.2}; ml of liquid that the ground took {:.2}",
        all.dried * 1e6,
        falling * 1e6,
        soaked * 1e6
    );
    (f64::from(wrong), note)
}

/// Something that a trainer does between frames.
fn change(liquid: &mut Shallow, dice: &mut Dice) {
    let poured = [dice.between(0.0, 1.0), dice.between(0.0, 100.0), dice.between(-50.0, 50.0), 0.5];
    liquid.set_poured(&poured).expect("concentrations");
    ground::change(liquid, dice);
    // A ball dips in, and a pillar that leaves no room where it stands.
    let mut position =
        || DVec3::new(dice.between(-0.04, 0.04), dice.between(0.0, 0.03), dice.between(-0.025, 0.025));
    let (ball, pillar) = (position(), position());
    let axes = [DVec3::x(), DVec3::y(), DVec3::z()];
    let bodies = [
        Shape::Sphere { centre: ball, radius: 0.007 },
        Shape::Cuboid { centre: pillar, axes, half: [0.005, 1.0, 0.004] },
    ];
    liquid.set_bodies(&bodies[..dice.below(3)]).expect("bodies");
}

/// How many times as long a frame takes with a dye, in thread CPU time; both liquids take turns.
fn slowdown(make: fn() -> Shallow) -> (f64, String) {
    let ctx = context();
    let mut liquids = [make(), make()];
    liquids[1].set_scalars(&[Scalar::dye("dye")]).expect("a dye");
    liquids[1].set_poured(&[1.0]).expect("a concentration");
    // Stripes of dye.
    for column in liquids[1].columns().indices().collect::<Vec<_>>() {
        if liquids[1].columns().cell(column)[0] % 20 < 10 {
            let depth = liquids[1].depths()[column];
            let depth = liquids[1].columns().heights.length(f64::from(depth));
            liquids[1].pour(column, -depth);
            liquids[1].pour(column, depth);
        }
    }
    let mut times = [Vec::new(), Vec::new()];
    for turn in 0..=TIMES {
        for (liquid, times) in liquids.iter_mut().zip(&mut times) {
            let start = thread_seconds();
            for _ in 0..FRAMES {
                liquid.step(&ctx, FRAME).expect("a frame");
            }
            // The first fills the caches.
            if turn > 0 {
                times.push(1e3 * (thread_seconds() - start) / FRAMES as f64);
            }
        }
    }
    assert_eq!(liquids[0].depths(), liquids[1].depths(), "what is carried changes the flow");
    let [plain, dyed] = times.map(median);
    let note =
        format!("{:?} {dyed:.3} ms for {plain:.3} ms, {} columns", cpu_level(), liquids[0].columns().count());
    (dyed / plain, note)
}
