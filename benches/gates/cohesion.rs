//! Walls of snow that holds together.

use frazil::base::DVec3;
use frazil::snow::grain_friction::of_repose;
use frazil::snow::grains::heap::{Pose, Shell};

use crate::grains::Experiment;
use crate::harness::Harness;

const D: f64 = 0.005;

pub fn run(h: &mut Harness) {
    if !h.wants("snow.grains.wall") {
        return;
    }
    let env = |name: &str, usual: f64| std::env::var(name).ok().and_then(|x| x.parse().ok()).unwrap_or(usual);
    let repose = env("REPOSE", 32.0);
    let list = |name: &str, usual: &str| -> Vec<f64> {
        std::env::var(name).unwrap_or(usual.into()).split(',').map(|x| x.parse().unwrap()).collect()
    };
    for repose in list("REPOSE", "32") {
        for layers in list("LAYERS", "8,16,32") {
            let (mut low, mut high) = (0.0f64, 4.0 * layers);
            while high - low > 0.06 * high {
                let middle = 0.5 * (low + high);
                if stands(layers, middle, of_repose(repose)) { high = middle } else { low = middle }
            }
            println!(
                "# repose {repose} layers {layers}: attraction {low:.2} to {high:.2}, {:.3} a layer",
                high / layers
            );
        }
    }
    let _ = repose;
}

/// Share of its height that the edge of a wall keeps for a second.
fn stands(layers: f64, attraction: f64, friction: f64) -> bool {
    let mut wall = Experiment::new(2, D, friction, 1);
    let height = layers * D;
    let (length, width) = (1.2 * height + 6.0 * D, 8.0 * D);
    wall.colliders.shells = vec![sides(9, length, width, true)];
    let apart = 1.12 * D;
    let count = |size: f64| (size / apart) as u32;
    for y in 0..count(1.4 * height) {
        for x in 0..count(length) {
            for z in 0..count(width) {
                let mut jitter = || (wall.random.next() - 0.5) * 0.1 * D;
                let place = DVec3::new(
                    -length + (f64::from(x) + 0.5) * apart + jitter(),
                    (f64::from(y) + 0.5) * apart + jitter(),
                    -0.5 * width + (f64::from(z) + 0.5) * apart + jitter(),
                );
                wall.heap.add(wall.heap.count() as u32, place, [0.0; 3]).expect("add");
            }
        }
    }
    wall.division.sub_steps *= std::env::var("SUB").map_or(1, |x| x.parse().unwrap());
    (0..(36.0 * (layers / 20.0).sqrt().max(0.5)) as u32).for_each(|_| wall.step());
    wall.heap.retain(|_, place| place.y < height - 0.5 * D);
    wall.heap.wake(|_| true);
    wall.params.attraction = attraction;
    (0..12).for_each(|_| wall.step());
    wall.heap.wake(|_| true);
    let before = edge(&wall);
    wall.colliders.shells = vec![sides(9, length, width, false)];
    for _ in 0..30 {
        wall.step();
        let out = wall.heap.places().filter(|p| p.x > D).count() as f64 / wall.heap.count() as f64;
        if out > 0.01 || edge(&wall) < 0.9 * before {
            return false;
        }
    }
    true
}

/// Mean height of the uppermost grains of the strip behind the edge.
fn edge(wall: &Experiment) -> f64 {
    let mut tops = std::collections::BTreeMap::new();
    for place in wall.heap.places().filter(|place| place.x > -4.0 * D && place.x < 0.0) {
        let column = [(place.x / (1.5 * D)).floor() as i32, (place.z / (1.5 * D)).floor() as i32];
        let top = tops.entry(column).or_insert(0.0f64);
        *top = top.max(place.y);
    }
    tops.values().sum::<f64>() / tops.len().max(1) as f64
}

fn sides(number: u32, length: f64, width: f64, front: bool) -> (Shell, Pose<'static>) {
    let half = 0.5 * width;
    let far = if front { 0.0 } else { length };
    let corners = [[-length, -half], [far, -half], [far, half], [-length, half]];
    let places: Vec<DVec3> =
        [-0.1, 3.0 * length].iter().flat_map(|y| corners.map(|[x, z]| DVec3::new(x, *y, z))).collect();
    let side = |a: u32| {
        let b = (a + 1) % 4;
        [[a, b, b + 4], [a, b + 4, a + 4]]
    };
    let shell = Shell::new(number, 0.0, (0..4).flat_map(side).collect(), false, places.clone());
    let pose = move |_: f64, out: &mut Vec<DVec3>| {
        out.clone_from(&places);
        Ok(())
    };
    (shell, Box::new(pose))
}
