//! Gates of materials: walls that stand or fall as requested, bounces, and grains that stick to an object.

use frazil::Context;
use frazil::geometry::DVec3;
use frazil::motion::Motion;
use frazil::snow::grain_cohesion::of_wall;
use frazil::snow::grain_friction::of_repose;
use frazil::snow::grains::heap::{Colliders, Floor, Pose, Shell};
use frazil::snow::grains::{Grains, Object, Params, Surroundings};
use frazil::sweep::Body;

use crate::common::shapes::cuboid;
use crate::harness::Harness;
use crate::scenes::context;
use crate::snow::grains::{Experiment, FRAME, ON_A_FLOOR, walls};

/// Diameter of the grains (m).
const D: f64 = 0.005;

pub fn run(h: &mut Harness) {
    h.measure("snow.grains.wall", cohesion);
    h.measure("snow.grains.restitution", restitution);
    h.measure_all(["snow.grains.stick_stops", "snow.grains.stick_shakes"], stick);
}

/// Seeds of the heaps that walls are made of.
const SEEDS: [u64; 2] = [1, 2];

/// Walls of three heights and three frictions, made to stand up to a height: at 0.85 of it they stand, at 1.15 they fall.
fn cohesion() -> (bool, &'static str) {
    let mut holds = true;
    for (repose, layers) in [(32.0, 16.0), (32.0, 32.0), (25.0, 20.0), (38.0, 20.0)] {
        let friction = of_repose(repose, true);
        let attraction = of_wall(layers * D, D, repose);
        for seed in SEEDS {
            let [low, high] = [0.85, 1.15].map(|share| stands(share * layers, attraction, friction, seed));
            println!(
                "# {repose} degrees, made for {layers} diameters by {attraction:.2} weights, seed {seed}: 0.85 of it {}, 1.15 {}",
                if low { "stands" } else { "falls" },
                if high { "stands" } else { "falls" }
            );
            holds &= low && !high;
        }
    }
    (holds, "0.85 of the height stands, 1.15 falls")
}

/// Whether a wall whose support is removed keeps 90 % of the height of its edge, and 99 % of its grains, for 1.25 s.
fn stands(layers: f64, attraction: f64, friction: f64, seed: u64) -> bool {
    let mut wall = Experiment::new(2, D, friction, seed);
    let height = layers * D;
    let (length, width) = (1.2 * height + 6.0 * D, 8.0 * D);
    let sides = |front: f64| {
        let half = 0.5 * width;
        walls(&[[-length, -half], [front, -half], [front, half], [-length, half]], 3.0 * length)
    };
    wall.colliders.shells = vec![sides(0.0)];
    let apart = 1.16 * D;
    let sites = [2.0 * length, 1.5 * height, width].map(|size| (size / apart) as u32);
    wall.scatter(sites, |position| position.x < -0.5 * D);
    wall.steps((36.0 * (layers / 20.0).sqrt().max(0.5)) as usize);
    wall.heap.retain(|_, position| position.y < height - 0.5 * D);
    wall.params.attraction = attraction;
    wall.heap.wake(|_| true);
    wall.steps(12);
    wall.heap.wake(|_| true);
    let before = edge(&wall);
    wall.colliders.shells = vec![sides(length)];
    (0..30).all(|_| {
        wall.step();
        let fallen = wall.heap.positions().filter(|position| position.x > D).count();
        fallen * 100 < wall.heap.count() && edge(&wall) > 0.9 * before
    })
}

/// Mean height (m) of the topmost grains of the strip behind the edge.
fn edge(wall: &Experiment) -> f64 {
    let mut tops = std::collections::BTreeMap::new();
    for position in wall.heap.positions().filter(|position| position.x > -4.0 * D && position.x < 0.0) {
        let column = [position.x, position.z].map(|x| (x / (1.5 * D)).floor() as i32);
        let top = tops.entry(column).or_insert(0.0f64);
        *top = top.max(position.y);
    }
    tops.values().sum::<f64>() / tops.len().max(1) as f64
}

/// Two grains that collide, and one that falls on the floor and on a mesh: speed after over speed before.
fn restitution() -> (f64, &'static str) {
    let mut worst: f64 = 0.0;
    for asked in [0.2, 0.5, 0.9] {
        let mut pair = Experiment::new(1, D, 0.3, 1);
        pair.colliders = Colliders::default();
        (pair.params.restitution, pair.params.gravity, pair.params.air) = (asked, 0.0, 1.0);
        pair.heap.add(0, DVec3::new(-0.013, 0.0, 0.0), [1.0, 0.0, 0.0]).expect("add");
        pair.heap.add(1, DVec3::new(0.0, 0.0, 0.0), [0.0; 3]).expect("add");
        pair.step();
        let speeds: Vec<[f32; 3]> = pair.heap.velocities().collect();
        let met = f64::from(speeds[1][0] - speeds[0][0]).abs();
        let floor = Colliders { floor: Some(Floor { height: 0.0, friction: 0.3 }), ..Colliders::default() };
        let mesh = Colliders { shells: vec![plane()], ..Colliders::default() };
        let [floor, mesh] = [floor, mesh].map(|colliders| bounce(asked, colliders));
        println!("# restitution {asked}: two grains {met:.3}, floor {floor:.3}, mesh {mesh:.3}");
        worst = [met, floor, mesh].iter().map(|got| (got / asked - 1.0).abs() * 100.0).fold(worst, f64::max);
    }
    (worst, "")
}

fn plane() -> (Shell, Pose<'static>) {
    let positions = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]].map(|[x, z]| DVec3::new(x, 0.0, z));
    crate::snow::grains::still(0.3, vec![[0, 1, 2], [0, 2, 3]], positions.to_vec())
}

/// Square root of the height to which a grain rebounds over that from which it fell.
fn bounce(restitution: f64, colliders: Colliders<'static>) -> f64 {
    let mut one = Experiment::new(1, D, 0.3, 1);
    one.colliders = colliders;
    (one.params.restitution, one.params.air) = (restitution, 1.0);
    let drop = 0.3;
    one.heap.add(0, DVec3::new(0.1, 0.5 * D + drop, 0.03), [0.0; 3]).expect("add");
    let (mut has_met, mut top) = (false, 0.0f64);
    // A twelfth of a frame is a small part of the way up.
    (one.division.dt, one.division.sub_steps) = (FRAME / 12.0, 4);
    for _ in 0..12 * 24 {
        one.step();
        let rises = one.heap.velocities().next().expect("one")[1] > 0.0;
        has_met |= rises;
        if has_met && !rises {
            break;
        }
        let height = one.heap.positions().next().expect("one").y - 0.5 * D;
        top = if has_met { top.max(height) } else { 0.0 };
    }
    (top / drop).sqrt()
}

/// A plate in the air that moves to the side, stops, and later shakes.
struct Plate(Vec<[u32; 3]>, Vec<DVec3>);

/// Time (s) at which the plate starts to shake.
const SHAKES: f64 = 1.5;

impl Motion for Plate {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.0
    }

    fn vertex_count(&self) -> usize {
        self.1.len()
    }

    fn breaks(&self, _: f64, _: f64) -> Vec<f64> {
        Vec::new()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> frazil::Result<()> {
        // Sideways for a second, accelerated by about a weight at most; then up and down by fifty.
        let moved = (time.clamp(0.0, 1.0) * std::f64::consts::PI).cos();
        let shaken = (time - SHAKES).max(0.0) * std::f64::consts::TAU * 15.0;
        let at = DVec3::new(1.0 - moved, 0.055 * shaken.sin(), 0.0);
        out.clear();
        out.extend(self.1.iter().map(|position| position + at));
        Ok(())
    }
}

/// Share (%) of the grains below a plate that still hang there after it has moved and stopped, and after it has shaken.
fn stick() -> [(f64, &'static str); 2] {
    let ctx: Context = context(2);
    let mesh = cuboid([0.2, 0.02, 0.2]);
    let positions = mesh.positions.iter().map(|position| position.cast::<f64>()).collect();
    let body = Body::new(Box::new(Plate(mesh.triangles.clone(), positions)), 0.0).expect("a body");
    let mut grains = Grains::new(Params { radius: 0.5 * D, ..Params::for_cell(1.5 * D) }).expect("grains");
    let bottom = body_bottom(&body);
    let sites: Vec<DVec3> = (0..20)
        .flat_map(|x| (0..20).map(move |z| [x, z]))
        .map(|[x, z]| DVec3::new(f64::from(x) - 9.5, 0.0, f64::from(z) - 9.5) * 1.5 * D)
        .map(|site| site + DVec3::new(0.0, bottom - 0.52 * D, 0.0))
        .collect();
    grains.emit(&sites, &[], 0).expect("grains");
    let objects = [Object { stick: 5.0, ..Object::new(&body, 0.5) }];
    let around = Surroundings { objects: &objects, floor: None, lowest: -100.0, ..ON_A_FLOOR };
    let mut hanging = |frames: std::ops::Range<i32>| {
        let last = f64::from(frames.end) * FRAME;
        for frame in frames {
            let time = |frame: i32| f64::from(frame) * FRAME;
            grains.step(&ctx, &around, [time(frame), time(frame + 1)], frame + 1).expect("a step");
        }
        let mut pose = Vec::new();
        body.motion().pose(last, &mut pose).expect("a pose");
        let under = pose.iter().map(|position| position.y).fold(f64::MAX, f64::min);
        let near =
            grains.positions().filter(|position| (position.y - under + 0.5 * D).abs() < 0.2 * D).count();
        near as f64 * 100.0 / sites.len() as f64
    };
    let (stopped, shaken) = (hanging(0..36), hanging(36..60));
    [
        (stopped, "share of 400 grains below a plate, by five weights"),
        (shaken, "after 24 frames by up to fifty weights"),
    ]
}

fn body_bottom(body: &Body) -> f64 {
    let mut pose = Vec::new();
    body.motion().pose(0.0, &mut pose).expect("a pose");
    pose.iter().map(|position| position.y).fold(f64::MAX, f64::min)
}
