//! Gates of poured piles: the requested slope, for any size and count of grains, on snow as in a scene.

use frazil::geometry::DVec3;
use frazil::snow::grain_friction::of_repose;

use crate::harness::Harness;
use crate::snow::grains::Experiment;

impl Experiment {
    /// Pours grains through a hole with a radius of 2.5 diameters, slightly above the pile, then waits.
    pub fn pour(&mut self, count: usize, frames: usize, wait: usize) {
        self.pour_through(2.5 * self.diameter(), count, frames, wait);
    }

    /// Pours grains through a hole of a radius (m), at a speed that suits it.
    pub fn pour_through(&mut self, hole: f64, count: usize, frames: usize, wait: usize) {
        let (d, unit) = (self.diameter(), hole / 2.5);
        let speed = -0.6 * (unit / 0.005).sqrt();
        let each = count.div_ceil(frames);
        // Range of heights in which they find room.
        let span = each as f64 / 6.0 * d * (d / unit).powi(2);
        while self.heap.count() < count {
            let rests = |velocity: [f32; 3]| velocity.iter().map(|x| x * x).sum::<f32>() < 0.04;
            let positions = self.heap.positions().zip(self.heap.velocities());
            let near = positions
                .filter(|(position, velocity)| position.xz().norm() < 6.0 * unit && rests(*velocity));
            let top = near.map(|(position, _)| position.y).fold(0.0, f64::max);
            let mut born: Vec<DVec3> = Vec::new();
            for _ in 0..30 * each {
                if born.len() == each || self.heap.count() == count {
                    break;
                }
                let (angle, radius) =
                    (self.random.next() * std::f64::consts::TAU, self.random.next().sqrt() * hole);
                let height = top + 2.0 * unit + self.random.next() * span;
                let position = DVec3::new(angle.cos() * radius, height, angle.sin() * radius);
                if born.iter().all(|other| (other - position).norm() > d) {
                    self.heap.add(self.heap.count() as u32, position, [0.0, speed as f32, 0.0]).expect("add");
                    born.push(position);
                }
            }
            self.step();
        }
        self.steps(wait);
    }

    /// Slope of the pile (degrees): a line fitted to the mean heights of rings, in the middle 60 % of its radius.
    pub fn slope(&self) -> f64 {
        let (d, width) = (self.diameter(), 1.5 * self.diameter());
        let mut tops = std::collections::BTreeMap::new();
        for position in self.heap.positions() {
            let column = [position.x, position.z].map(|x| (x / width).floor() as i32);
            let top = tops.entry(column).or_insert(0.0f64);
            *top = top.max(position.y + 0.5 * d);
        }
        let ring = |column: &[i32; 2]| {
            (column.iter().map(|x| (f64::from(*x) + 0.5).powi(2)).sum::<f64>().sqrt()) as usize
        };
        let rings = tops.keys().map(ring).max().unwrap_or(0).min(1000) + 1;
        let (mut sums, mut columns) = (vec![0.0; rings], vec![0.0; rings]);
        for x in -(rings as i32)..=rings as i32 {
            for z in -(rings as i32)..=rings as i32 {
                let ring = ring(&[x, z]);
                if ring < rings {
                    columns[ring] += 1.0;
                    sums[ring] += tops.get(&[x, z]).copied().unwrap_or(0.0);
                }
            }
        }
        let heights: Vec<f64> = sums.iter().zip(&columns).map(|(sum, count)| sum / count).collect();
        let edge = heights.iter().position(|height| *height < 0.8 * d).unwrap_or(rings);
        let middle = (0.2 * edge as f64) as usize..(0.8 * edge as f64).ceil() as usize;
        let points: Vec<(f64, f64)> =
            middle.map(|ring| ((ring as f64 + 0.5) * width, heights[ring])).collect();
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        let slope = mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2));
        (-slope).atan().to_degrees()
    }
}

pub fn run(h: &mut Harness) {
    piles(h);
    h.measure_all(["snow.grains.pile_size", "snow.grains.pile_creep"], sizes);
}

/// Slopes of poured piles against the requested ones.
fn piles(h: &mut Harness) {
    let worst = |angles: &[f64], seeds: u64, count: usize, frames: usize| {
        let mut worst: f64 = 0.0;
        for &asked in angles {
            for seed in 1..=seeds {
                let mut pile = Experiment::new(2, 0.005, of_repose(asked, false), seed);
                pile.stand_on_snow();
                pile.pour(count, frames, 30);
                let slope = pile.slope();
                println!("# asked {asked} degrees, seed {seed}: {slope:.2}");
                worst = worst.max((slope - asked).abs());
            }
        }
        worst
    };
    if h.wants("snow.grains.pile_asked") {
        h.gate("snow.grains.pile_asked", worst(&[25.0, 30.0, 35.0], 2, 10_000, 220), "");
    }
    if h.wants("snow.grains.pile_10k") {
        h.gate("snow.grains.pile_10k", worst(&[18.0, 25.0, 32.0, 38.0], 3, 10_000, 220), "");
    }
    if h.wants("snow.grains.pile_100k") {
        h.gate("snow.grains.pile_100k", worst(&[25.0, 32.0], 1, 100_000, 500), "");
    }
}

/// Slopes of piles of three grain sizes for the same angle, and their change in ten seconds.
fn sizes() -> [(f64, &'static str); 2] {
    let mut slopes = Vec::new();
    let mut creep: f64 = 0.0;
    for diameter in [0.0015, 0.005, 0.02] {
        let frames = (220.0 * f64::sqrt(diameter / 0.005)).ceil() as usize;
        let mut pile = Experiment::new(2, diameter, of_repose(32.0, false), 1);
        pile.stand_on_snow();
        pile.pour(10_000, frames, frames / 6);
        let slope = pile.slope();
        (0..240).for_each(|_| pile.step());
        println!("# {} mm: {slope:.2} degrees, after 240 frames {:.2}", diameter * 1e3, pile.slope());
        creep = creep.max((slope - pile.slope()).abs());
        slopes.push(slope);
    }
    let most = slopes.iter().copied().fold(f64::MIN, f64::max);
    let least = slopes.iter().copied().fold(f64::MAX, f64::min);
    [(most - least, ""), (creep, "")]
}
