//! Gates of grains in free motion: one that nothing touches, and heaps that nothing holds.

use frazil::geometry::DVec3;
use frazil::snow::grains::heap::{Colliders, Division, Heap};

use crate::harness::Harness;
use crate::snow::grains::{Experiment, FRAME};

pub fn run(h: &mut Harness) {
    h.measure_all(["snow.grains.fall_speed", "snow.grains.fall_way", "snow.grains.air"], alone);
    h.measure_all(["snow.grains.free_momentum", "snow.grains.free_energy"], heap_in_the_air);
}

/// A grain that nothing touches.
fn alone() -> [(f64, &'static str); 3] {
    let one_grain = |air: f64, gravity: f64, speed: f32, sub_steps: usize| {
        let mut one = Experiment::new(2, 0.005, 0.2, 1);
        one.colliders = Colliders::default();
        (one.params.air, one.params.gravity, one.division.sub_steps) = (air, gravity, sub_steps);
        one.heap.add(0, DVec3::new(12.3, 45.6, -7.8), [speed, 0.0, 0.0]).expect("add");
        (0..24).for_each(|_| one.step());
        (one.heap.positions().next().expect("one"), one.heap.velocities().next().expect("one"))
    };
    let sub_steps = Experiment::new(2, 0.005, 0.2, 1).division.sub_steps;
    let (position, velocity) = one_grain(1.0, -9.81, 0.0, sub_steps);
    let dt = FRAME / sub_steps as f64;
    let kept = |sub_steps: usize| f64::from(one_grain(0.5, 0.0, 1.0, sub_steps).1[0]);
    [
        ((f64::from(velocity[1]) / -9.81 - 1.0).abs(), ""),
        (((45.6 - position.y) / (0.5 * 9.81 * (1.0 + dt)) - 1.0).abs(), ""),
        ([1, 40].map(|n| (kept(n) / 0.5 - 1.0).abs()).into_iter().fold(0.0, f64::max), ""),
    ]
}

/// A heap that nothing holds: grains that fly into each other.
fn heap_in_the_air() -> [(f64, &'static str); 2] {
    let mut heap = Experiment::new(2, 0.005, 0.3, 3);
    heap.colliders = Colliders::default();
    (heap.params.air, heap.params.gravity) = (1.0, 0.0);
    for index in 0..4096u32 {
        let site = DVec3::new(f64::from(index & 15), f64::from(index >> 4 & 15), f64::from(index >> 8))
            * 1.1
            * 0.005;
        let middle = DVec3::repeat(7.5 * 1.1 * 0.005);
        let inward = (middle - site) * 8.0;
        let mut speed = |inward: f64| (inward + heap.random.next() - 0.5) as f32;
        let velocity = [speed(inward.x) + 0.5, speed(inward.y), speed(inward.z)];
        heap.heap.add(index, site, velocity).expect("add");
    }
    let sums = |heap: &Heap| {
        heap.velocities().fold(([0.0f64; 3], 0.0f64), |(sum, energy), v| {
            let v = v.map(f64::from);
            ([0, 1, 2].map(|axis| sum[axis] + v[axis]), energy + v.iter().map(|x| x * x).sum::<f64>())
        })
    };
    let (start, mut energy) = sums(&heap.heap);
    let size = start.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut rise: f64 = 0.0;
    let mut lost: f64 = 0.0;
    let first = energy;
    for _ in 0..24 * heap.division.sub_steps {
        heap.division = Division { dt: heap.division.dt.min(FRAME / 14.0), sub_steps: 1 };
        heap.step();
        let (now, after) = sums(&heap.heap);
        rise = rise.max(after / energy - 1.0);
        energy = after;
        lost = lost.max((0..3).map(|axis| (now[axis] - start[axis]).powi(2)).sum::<f64>().sqrt() / size);
    }
    println!("# energy at the end: {:.3} of that at the start", energy / first);
    [(lost, ""), (rise, "")]
}
