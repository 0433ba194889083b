//! Grains and what moves them in the gates, by subject in the files beside this one.

pub mod beds;
pub mod behind_ground;
pub mod births;
pub mod cancel;
pub mod collapse;
pub mod collisions;
pub mod column_collapse;
pub mod crowd;
pub mod distance_rule;
pub mod free_motion;
pub mod materials;
pub mod memory;
pub mod passes;
pub mod piles;
pub mod planes;
pub mod preview;
pub mod rate;
pub mod readers;
pub mod rest;
pub mod turned_gravity;

use frazil::context::Context;
use frazil::geometry::DVec3;
use frazil::snow::grains::heap::{Colliders, Division, Floor, Heap, Pose, Shell};
use frazil::snow::grains::{Base, Params, Surroundings};

use super::{grains_alone, table_3_1};
use crate::harness::Harness;
use crate::scenes::context;

/// Length of a frame (s).
pub const FRAME: f64 = 1.0 / 24.0;

/// All of them.
pub fn run(h: &mut Harness) {
    piles::run(h);
    h.measure_all(["snow.grains.preview_volume", "snow.grains.preview_angle"], preview::measure);
    free_motion::run(h);
    beds::run(h);
    h.measure_all(["snow.grains.turned_bed_least", "snow.grains.turned_bed_most"], turned_gravity::measure);
    column_collapse::run(h);
    collapse::run(h);
    h.measure("snow.grains.behind_ground", behind_ground::measure);
    h.measure_all(["snow.grains.slope_rests", "snow.grains.slope_slides"], planes::measure);
    materials::run(h);
    collisions::run(h);
    h.measure("snow.grains.crowd", crowd::measure);
    grains_alone::run(h);
    births::run(h);
    rest::run(h);
    distance_rule::run(h);
    passes::run(h);
    readers::run(h);
    cancel::run(h);
    h.measure("snow.grains.speed", rate::measure);
    table_3_1::run(h);
    memory::run(h);
}

/// Grains on a floor at a height of 0; nothing else is around them.
pub const ON_A_FLOOR: Surroundings<'static> = Surroundings {
    base: Base::Missing,
    objects: &[],
    statics: &[],
    ground: &[],
    floor: Some(0.0),
    lowest: -1.0,
};

/// Grains and what moves them.
pub struct Experiment {
    pub ctx: Context,
    pub params: Params,
    pub heap: Heap,
    pub division: Division,
    pub colliders: Colliders<'static>,
    pub random: Random,
    /// Whether what rests is visited too.
    pub visits_all: bool,
    /// How far gravity is turned about z (degrees): grains then fall toward greater x.
    pub turn: f64,
}

/// Numbers in 0..1 (xorshift: Marsaglia 2003).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f64 / (1u64 << 24) as f64
    }
}

impl Experiment {
    pub fn new(threads: usize, diameter: f64, friction: f64, seed: u64) -> Self {
        let params = Params { radius: 0.5 * diameter, friction, ..Params::for_cell(1.5 * diameter) };
        let division = Division { dt: FRAME, sub_steps: params.sub_steps(FRAME, 0.0) };
        let floor = Some(Floor { height: 0.0, friction: friction as f32 });
        let colliders = Colliders { floor, ..Colliders::default() };
        let (ctx, heap) = (context(threads), Heap::new(diameter));
        let random = Random(seed * 7919 + 1);
        Self { ctx, params, heap, division, colliders, random, visits_all: false, turn: 0.0 }
    }

    /// Gives the floor the friction of the base layer.
    pub fn stand_on_snow(&mut self) {
        self.colliders.floor = Some(Floor { height: 0.0, friction: self.params.friction_of_base() as f32 });
    }

    pub fn diameter(&self) -> f64 {
        2.0 * self.params.radius
    }

    pub fn step(&mut self) {
        let Self { ctx, params, heap, division, colliders, visits_all, turn, .. } = self;
        let mut coefficients = params.coefficients(division);
        coefficients.visits_all = *visits_all;
        if *turn != 0.0 {
            let (sine, cosine) = turn.to_radians().sin_cos();
            let turned =
                |size: f32| [-sine * f64::from(size), cosine * f64::from(size), 0.0].map(|x| x as f32);
            coefficients.gravity = turned(coefficients.gravity[1]);
            coefficients.up = turned(coefficients.up[1]);
        }
        let step = || heap.step(ctx, *division, coefficients, colliders);
        ctx.phase("move", step).expect("step");
    }

    pub fn steps(&mut self, frames: usize) {
        (0..frames).for_each(|_| self.step());
    }

    /// Loose grains in a box that begins at a height of 0 and has its middle above the origin, a little off the sites of a
    /// cubic lattice, where `takes` wants them. Numbers are those of the lattice's sites.
    pub fn scatter(&mut self, sites: [u32; 3], takes: impl Fn(DVec3) -> bool) {
        self.scatter_apart([1.16, 0.1], sites, takes);
    }

    /// As [`Experiment::scatter`], with a distance of the sites (diameters) and how far grains are off them along each axis.
    pub fn scatter_apart(&mut self, [apart, off]: [f64; 2], sites: [u32; 3], takes: impl Fn(DVec3) -> bool) {
        let [apart, most] = [apart, off].map(|length| length * self.diameter());
        for layer in 0..sites[1] {
            for (x, z) in (0..sites[0]).flat_map(|x| (0..sites[2]).map(move |z| (x, z))) {
                let mut off = |at: u32| (f64::from(at) + 0.5) * apart + (self.random.next() - 0.5) * most;
                let [x, y, z] = [off(x), off(layer), off(z)];
                let [width, length] = [sites[0], sites[2]].map(|count| 0.5 * f64::from(count) * apart);
                let position = DVec3::new(x - width, y, z - length);
                if takes(position) {
                    self.heap.add(self.heap.count() as u32, position, [0.0; 3]).expect("add");
                }
            }
        }
    }

    /// A truncated cone of upright layers, of a radius in grains.
    pub fn fill(&mut self, radius: i32) {
        for layer in 0..2 * radius / 3 {
            let reach = f64::from(radius) - 1.5 * f64::from(layer);
            for (x, z) in (-radius..=radius).flat_map(|x| (-radius..=radius).map(move |z| (x, z))) {
                if f64::from(x * x + z * z) < reach * reach {
                    let site = [f64::from(x), f64::from(layer) + 0.5, f64::from(z)];
                    let position = DVec3::from(site) * 1.08 * self.diameter();
                    self.heap.add(self.heap.count() as u32, position, [0.0; 3]).expect("add");
                }
            }
        }
    }

    /// Positions and velocities, bit for bit.
    pub fn state(&self) -> Vec<u32> {
        let positions = self.heap.located().flat_map(|(at, position)| {
            at.map(|block| block as u32).into_iter().chain(position.map(f32::to_bits))
        });
        positions.chain(self.heap.velocities().flat_map(|velocity| velocity.map(f32::to_bits))).collect()
    }
}

/// An open mesh that stands still.
pub fn still(friction: f32, triangles: Vec<[u32; 3]>, positions: Vec<DVec3>) -> (Shell, Pose<'static>) {
    let shell = Shell::new(friction, triangles, false, positions.clone());
    let pose = move |_: f64, out: &mut Vec<DVec3>| {
        out.clone_from(&positions);
        Ok(())
    };
    (shell, Box::new(pose))
}

/// Walls without friction over the corners of a polygon (m, along x and z), up to a height (m).
pub fn walls(corners: &[[f64; 2]], height: f64) -> (Shell, Pose<'static>) {
    let level = |y: f64| corners.iter().map(move |[x, z]| DVec3::new(*x, y, *z));
    let count = corners.len() as u32;
    let side = |a: u32| {
        let b = (a + 1) % count;
        [[a, b, b + count], [a, b + count, a + count]]
    };
    still(0.0, (0..count).flat_map(side).collect(), level(-0.1).chain(level(height)).collect())
}

/// The corners of a rectangle (m).
pub fn rectangle(length: f64, width: f64) -> [[f64; 2]; 4] {
    let (x, z) = (0.5 * length, 0.5 * width);
    [[-x, -z], [x, -z], [x, z], [-x, z]]
}
