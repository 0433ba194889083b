//! Parts of the mesh without liquid, crumbs that were left where it went, and those with too little of it. They are taken away.

use super::change::Change;
use super::enclosed::{Bounds, Crowd, seen_from};
use super::repair::Source;
use crate::base::DVec3;
use crate::base::mesh::{renumbered, used};
use crate::base::topology::{bodies, groups};

impl Change {
    /// Takes away the parts of the mesh with a volume over 0 that hold too few particles. Returns how many held none, and how many some.
    /// A mesh of one part stays.
    pub(super) fn drop_dry(&mut self, crowd: &Crowd<'_>) -> [usize; 2] {
        // Mostly there is one.
        let links = self.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c]]);
        if groups(self.vertices.len(), links) < 2 {
            return [0; 2];
        }
        let (parts, bounds): (Vec<Vec<u32>>, Vec<Bounds>) = bodies(&self.triangles)
            .into_iter()
            .filter_map(|part| self.bounds(&part).map(|bounds| (part, bounds)))
            .unzip();
        let mesh = |at: usize| {
            let corners: Vec<[DVec3; 3]> = self.corners(&parts[at]).collect();
            seen_from(bounds[at][0], &corners)
        };
        let counts = crowd.held(&bounds, mesh);
        let mut is_out = vec![false; self.triangles.len()];
        let mut gone = [0; 2];
        for (part, count) in parts.iter().zip(counts).filter(|(_, count)| *count < crowd.least) {
            gone[usize::from(count > 0)] += 1;
            part.iter().for_each(|triangle| is_out[*triangle as usize] = true);
        }
        if gone == [0; 2] {
            return gone;
        }
        let mut marks = is_out.iter();
        self.triangles.retain(|_| !marks.next().copied().unwrap_or_default());
        let mut marks = is_out.iter();
        self.sources.retain(|_: &Source| !marks.next().copied().unwrap_or_default());
        let names = used(self.vertices.len(), &self.triangles)
            .unwrap_or_else(|| (0..self.vertices.len() as u32).collect());
        self.triangles = renumbered(&self.triangles, &names);
        self.vertices = names.iter().map(|name| self.vertices[*name as usize]).collect();
        self.origins = names.iter().map(|name| self.origins[*name as usize]).collect();
        gone
    }

    /// The bounds of a part (m), if it has a volume over 0.
    fn bounds(&self, part: &[u32]) -> Option<Bounds> {
        let [first, ..] = self.corners(part).next()?;
        let (mut low, mut high, mut six) = (first, first, 0.0);
        for [a, b, c] in self.corners(part) {
            (low, high) = (low.inf(&a).inf(&b).inf(&c), high.sup(&a).sup(&b).sup(&c));
            six += (a - first).dot(&(b - first).cross(&(c - first)));
        }
        (six > 0.0).then_some([low, high])
    }

    /// Places (m) of the corners of some triangles.
    fn corners<'a>(&'a self, part: &'a [u32]) -> impl Iterator<Item = [DVec3; 3]> + 'a {
        part.iter()
            .map(move |triangle| self.triangles[*triangle as usize].map(|at| self.vertices[at as usize]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Implicit, Isosurface, Params, Particles, Tracker};
    use super::*;
    use crate::context::{Context, Pool};

    const FRAMES: i32 = 28;
    /// From this frame on both drops are far from the ball.
    const AWAY: i32 = 23;

    /// A box of places 1 m apart.
    fn lattice(low: DVec3, counts: [u32; 3]) -> impl Iterator<Item = DVec3> {
        let on = move |axis: usize| (0..counts[axis]).map(f64::from);
        on(0).flat_map(move |x| on(1).flat_map(move |y| on(2).map(move |z| low + DVec3::new(x, y, z))))
    }

    /// A ball, from which a drop of 4 particles flies one way and one of 20 the other, and where the middles of these are.
    fn splash(frame: i32) -> (Particles, [DVec3; 2]) {
        let way = 3.6 + 0.25 * f64::from(frame);
        let [small, large] = [DVec3::new(way, 0.4, 0.4), DVec3::new(-way - 4.0, 0.4, 0.4)];
        let ball = lattice(DVec3::repeat(-4.0), [9; 3]).filter(|place| place.norm() <= 4.5);
        let four = lattice(small, [2, 2, 1]);
        let twenty = lattice(large, [5, 2, 2]);
        let places: Vec<DVec3> = ball.chain(four).chain(twenty).collect();
        let ids = (0..places.len() as i64).collect();
        let middles = [small + DVec3::new(0.5, 0.5, 0.0), large + DVec3::new(2.0, 0.5, 0.5)];
        (Particles { ids, velocities: Vec::new(), places }, middles)
    }

    /// Follows it to the end: how many specks were taken away, and in each of the last frames the counts of vertices at both drops.
    fn followed(min_drop: usize) -> (usize, Vec<[usize; 2]>) {
        let ctx = Context::new(Pool::new(2).unwrap());
        let mut from = splash(0).0;
        let phi = Implicit::new(&ctx, &from.places, 1.0, 0.5).unwrap();
        let mesh = Isosurface::new(&phi).mesh(&phi);
        let params = Params { rebuild: true, min_drop, ..Params::for_spacing(1.0) };
        let mut tracker = Tracker::new(&ctx, params, &mesh, &from).unwrap();
        let (mut specks, mut counts) = (0, Vec::new());
        for frame in 1..=FRAMES {
            let (to, middles) = splash(frame);
            let report = tracker.step(&ctx, &from, &to, 1.0 / 24.0).unwrap();
            from = to;
            specks += report.change.map_or(0, |change| change.specks);
            if frame >= AWAY {
                let near = |middle: DVec3| {
                    tracker.vertices().iter().filter(|place| (**place - middle).norm() < 2.2).count()
                };
                counts.push(middles.map(near));
            }
        }
        (specks, counts)
    }

    #[test]
    fn drops_of_too_few_particles_go_and_stay_away() {
        let (specks, counts) = followed(1);
        assert!(specks == 0 && counts.iter().flatten().all(|count| *count > 8), "{specks}: {counts:?}");
        let (specks, counts) = followed(8);
        assert!(specks > 0, "{counts:?}");
        assert!(counts.iter().all(|[small, large]| *small == 0 && *large > 8), "{counts:?}");
    }
}
