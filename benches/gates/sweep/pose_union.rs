//! The union of many poses of a moving mesh, by counting crossings along lines: nothing of the sweep is used.

use frazil::geometry::DVec3;
use frazil::motion::Motion;
use frazil::sweep::Topology;
use rayon::prelude::*;

/// Points of a lattice that lie in any of the poses.
pub struct Union {
    step: f64,
    low: DVec3,
    size: [usize; 3],
    inside: Vec<bool>,
}

/// Moves the lattice off the coordinates that meshes like.
const SHIFT: f64 = 0.000_000_917;

impl Union {
    /// The union of `poses` poses of a motion from one time to another (s), on a lattice of `step` m. Open loops are
    /// closed by fans to their centres.
    pub fn new(motion: &dyn Motion, from: f64, to: f64, poses: usize, step: f64) -> Self {
        let identity: Vec<u32> = (0..motion.vertex_count() as u32).collect();
        let topology = Topology::new(motion.triangles(), identity.len(), &identity, true);
        let posed = |index: usize| {
            let mut pose = Vec::new();
            let time = from + (to - from) * index as f64 / (poses - 1) as f64;
            motion.pose(time, &mut pose).expect("a pose");
            topology.complete(&mut pose);
            pose
        };
        let poses: Vec<Vec<DVec3>> = (0..poses).into_par_iter().map(posed).collect();
        let points = || poses.iter().flatten();
        let start = (DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY));
        let (low, high) = points().fold(start, |(low, high), p| (low.inf(p), high.sup(p)));
        let low = (low / step).map(f64::floor) * step - DVec3::repeat(4.0 * step - SHIFT);
        let size = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / step) as usize + 6);
        let mut union = Self { step, low, size, inside: Vec::new() };
        let [_, ny, nz] = size;
        let mut inside = vec![false; size.iter().product()];
        inside.par_chunks_mut(ny * nz).enumerate().for_each(|(x, slab)| {
            let at = low.x + x as f64 * step;
            poses.iter().for_each(|pose| union.add_slab(&topology, pose, at, slab));
        });
        union.inside = inside;
        union
    }

    /// Marks the points of the plane x = `at` inside one pose.
    fn add_slab(&self, topology: &Topology, pose: &[DVec3], at: f64, slab: &mut [bool]) {
        let [_, ny, nz] = self.size;
        let mut crossings: Vec<(u32, f64, i32)> = Vec::new();
        for simplex in &topology.simplices {
            let [a, b, c] = simplex.v.map(|vertex| pose[vertex as usize]);
            let (least, most) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
            if at < least || at > most {
                continue;
            }
            let row = |y: f64| (y - self.low.y) / self.step;
            let first = row(a.y.min(b.y).min(c.y)).ceil().max(0.0) as usize;
            let last = row(a.y.max(b.y).max(c.y)).floor() as usize;
            for y in first..=last.min(ny - 1) {
                let p = [at, self.low.y + y as f64 * self.step];
                // Corners are in ascending order: both triangles beside an edge see it the same way.
                let [ab, bc, ac] = [side(a, b, p), side(b, c, p), side(a, c, p)];
                let within = if ab > 0.0 { bc > 0.0 && ac <= 0.0 } else { bc <= 0.0 && ac > 0.0 };
                if within {
                    let normal = (b - a).cross(&(c - a));
                    let z = a.z - (normal.x * (p[0] - a.x) + normal.y * (p[1] - a.y)) / normal.z;
                    let up = if ab > 0.0 { 1 } else { -1 } * i32::from(simplex.sign);
                    crossings.push((y as u32, z, up));
                }
            }
        }
        crossings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        for column in crossings.chunk_by(|a, b| a.0 == b.0) {
            let mut winding = 0;
            for pair in column.windows(2) {
                // Coming from below, a face that looks up is left behind: the solid ends.
                winding -= pair[0].2;
                if winding > 0 {
                    let [first, end] =
                        [pair[0].1, pair[1].1].map(|z| ((z - self.low.z) / self.step).ceil() as usize);
                    let row = column[0].0 as usize * nz;
                    slab[row + first..row + end.min(nz)].fill(true);
                }
            }
        }
    }

    /// Number of the point nearest to a position on each axis; none beyond the lattice.
    fn index(&self, p: DVec3) -> Option<[i64; 3]> {
        let index = [0, 1, 2].map(|axis| ((p[axis] - self.low[axis]) / self.step).round() as i64);
        (0..3).all(|axis| index[axis] >= 0 && index[axis] < self.size[axis] as i64).then_some(index)
    }

    /// Whether all points within a number of steps of a position lie inside.
    pub fn is_deep(&self, p: DVec3, steps: i64) -> bool {
        self.around(p, steps).is_some_and(|mut around| around.all(|inside| inside))
    }

    /// Whether no point within a number of steps of a position lies inside.
    pub fn is_far(&self, p: DVec3, steps: i64) -> bool {
        self.around(p, steps).is_none_or(|mut around| !around.any(|inside| inside))
    }

    fn around(&self, p: DVec3, steps: i64) -> Option<impl Iterator<Item = bool> + '_> {
        let [x, y, z] = self.index(p)?;
        let ball = (-steps..=steps)
            .flat_map(move |i| (-steps..=steps).flat_map(move |j| (-steps..=steps).map(move |k| [i, j, k])))
            .filter(move |[i, j, k]| i * i + j * j + k * k <= steps * steps);
        Some(ball.map(move |[i, j, k]| {
            let at = [x + i, y + j, z + k];
            let within = (0..3).all(|axis| at[axis] >= 0 && at[axis] < self.size[axis] as i64);
            within
                && self.inside
                    [(at[0] as usize * self.size[1] + at[1] as usize) * self.size[2] + at[2] as usize]
        }))
    }
}

/// On which side of the line from a to b, seen along z, a point lies: positive to the left.
fn side(a: DVec3, b: DVec3, p: [f64; 2]) -> f64 {
    (b.x - a.x) * (p[1] - a.y) - (b.y - a.y) * (p[0] - a.x)
}
