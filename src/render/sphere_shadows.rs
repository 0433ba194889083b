//! Shadows of points: rays towards the light traverse a grid of cells that list the spheres in them.

use super::spheres::Cloud;
use crate::geometry::DVec3;

/// Edge of a cell, in mean diameters: within a heap, a cell holds some dozen spheres.
const CELL: f64 = 2.5;
/// Maximum number of cells: the starts of their lists take 64 MB.
const MAX_CELLS: f64 = 16.0e6;
/// Spheres nearer than this (in their radii) cast no shadow: light that enters snow leaves it about that far away, so the grains of a
/// smooth heap do not shade each other.
const MIN_DISTANCE: f64 = 1.5;

/// Spheres as shadow casters, in a grid of cells.
pub(super) struct Shadows {
    low: DVec3,
    edge: f64,
    counts: [usize; 3],
    /// For each cell, where its spheres begin in `list`; one more at the end.
    starts: Vec<u32>,
    /// Centres and radii (m) of the spheres that reach into a cell, cell by cell.
    list: Vec<(DVec3, f64)>,
}

impl Shadows {
    /// Shadows of clouds; none if they are empty.
    pub fn new(clouds: &[Cloud]) -> Option<Self> {
        let spheres = || clouds.iter().flat_map(Cloud::spheres).filter(|(_, radius)| *radius > 0.0);
        let (low, high) =
            clouds.iter().filter_map(Cloud::bounds).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))?;
        let (count, sum) = spheres().fold((0u32, 0.0), |(count, sum), (_, radius)| (count + 1, sum + radius));
        if count == 0 {
            return None;
        }
        let extent = high - low;
        let mut edge = CELL * 2.0 * sum / f64::from(count);
        let cells = |edge: f64| extent.map(|length| (length / edge).floor() + 1.0);
        while cells(edge).product() > MAX_CELLS {
            edge *= 1.25;
        }
        let counts = cells(edge).map(|count| count as usize);
        let mut out = Self { low, edge, counts: counts.into(), starts: Vec::new(), list: Vec::new() };
        out.starts = vec![0; counts.product() + 1];
        for (centre, radius) in spheres() {
            out.cells_of(centre, radius).for_each(|cell| out.starts[cell + 1] += 1);
        }
        (1..out.starts.len()).for_each(|cell| out.starts[cell] += out.starts[cell - 1]);
        let mut next = out.starts.clone();
        out.list = vec![(DVec3::zeros(), 0.0); next[next.len() - 1] as usize];
        for (centre, radius) in spheres() {
            for cell in out.cells_of(centre, radius) {
                out.list[next[cell] as usize] = (centre, radius);
                next[cell] += 1;
            }
        }
        Some(out)
    }

    /// The cells into which the box of a sphere reaches.
    fn cells_of(&self, centre: DVec3, radius: f64) -> impl Iterator<Item = usize> + use<> {
        let counts = self.counts;
        let range = |axis: usize| {
            let of = |at: f64| ((at - self.low[axis]) / self.edge).max(0.0) as usize;
            let last = counts[axis] - 1;
            of(centre[axis] - radius).min(last)..=of(centre[axis] + radius).min(last)
        };
        let [x, y, z] = [0, 1, 2].map(range);
        z.flat_map(move |z| {
            let x = x.clone();
            y.clone().flat_map(move |y| x.clone().map(move |x| (z * counts[1] + y) * counts[0] + x))
        })
    }

    /// Whether a sphere blocks a direction (a unit vector) from a point; cell by cell along the ray (Amanatides and Woo 1987).
    pub fn blocks(&self, origin: DVec3, toward: DVec3) -> bool {
        let size = [0, 1, 2].map(|axis| self.counts[axis] as f64 * self.edge);
        let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
        for axis in 0..3 {
            let ends = [0.0, size[axis]].map(|at| (self.low[axis] + at - origin[axis]) / toward[axis]);
            if toward[axis] != 0.0 {
                enter = enter.max(ends[0].min(ends[1]));
                leave = leave.min(ends[0].max(ends[1]));
            } else if !(self.low[axis]..=self.low[axis] + size[axis]).contains(&origin[axis]) {
                return false;
            }
        }
        if enter >= leave {
            return false;
        }
        let start = origin + toward * enter;
        let mut cell = [0, 1, 2].map(|axis| {
            let at = ((start[axis] - self.low[axis]) / self.edge).max(0.0) as usize;
            at.min(self.counts[axis] - 1)
        });
        // Distances along the ray at which it leaves the cell through each side.
        let mut exits = [0, 1, 2].map(|axis| {
            let next = cell[axis] as f64 + f64::from(u8::from(toward[axis] > 0.0));
            let distance = (self.low[axis] + next * self.edge - origin[axis]) / toward[axis];
            if toward[axis] == 0.0 { f64::INFINITY } else { distance }
        });
        loop {
            let index = (cell[2] * self.counts[1] + cell[1]) * self.counts[0] + cell[0];
            let [first, end] = [self.starts[index], self.starts[index + 1]];
            let is_hit = |(centre, radius): &(DVec3, f64)| {
                let offset = centre - origin;
                let along = offset.dot(&toward);
                let beside = offset.norm_squared() - along * along;
                beside < radius * radius && along > MIN_DISTANCE * radius
            };
            if self.list[first as usize..end as usize].iter().any(is_hit) {
                return true;
            }
            let axis = (0..3).fold(0, |best, axis| if exits[axis] < exits[best] { axis } else { best });
            let last = if toward[axis] > 0.0 { self.counts[axis] - 1 } else { 0 };
            if cell[axis] == last {
                return false;
            }
            cell[axis] = if toward[axis] > 0.0 { cell[axis] + 1 } else { cell[axis] - 1 };
            exits[axis] += self.edge / toward[axis].abs();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::points::{Column, Points, Values};

    #[test]
    fn rays_hit_the_spheres_on_their_path() {
        let mut state = 7u64;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let positions: Vec<DVec3> = (0..400).map(|_| DVec3::from([0.0; 3].map(|_: f64| random()))).collect();
        let mut points = Points::at(0.1, &positions).unwrap();
        points.set("pscale", Values::Float(Column::Uniform(0.03)));
        let cloud = Cloud::new(&points, None).unwrap();
        let shadows = Shadows::new(std::slice::from_ref(&cloud)).unwrap();
        let mut hidden = 0;
        for _ in 0..2000 {
            let origin = DVec3::from([0.0; 3].map(|_: f64| 2.0 * random() - 0.5));
            let toward = DVec3::from([0.0; 3].map(|_: f64| random() - 0.5)).normalize();
            let is_hit = cloud.spheres().any(|(centre, radius)| {
                let offset = centre - origin;
                let along = offset.dot(&toward);
                along > MIN_DISTANCE * radius && (offset - toward * along).norm() < radius
            });
            assert_eq!(shadows.blocks(origin, toward), is_hit, "{origin:?} {toward:?}");
            hidden += u32::from(is_hit);
        }
        assert!((50..1500).contains(&hidden), "{hidden}");
        assert!(Shadows::new(&[]).is_none());
    }
}
