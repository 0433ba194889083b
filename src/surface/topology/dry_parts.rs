//! Removes parts of the mesh that contain no or too few particles, such as crumbs left where the liquid disappeared.

use super::change::Change;
use super::particle_count::{Bounds, ParticleCountTest, are_inside, seen_from};
use crate::geometry::DVec3;
use crate::geometry::check::topology;
use crate::geometry::check::topology::components;
use crate::geometry::mesh::{compact, drop_marked};
use crate::geometry::shape::six_volumes;

impl Change {
    /// Removes the parts of the mesh with a volume over 0 that contain too few particles, and the hollows in them. Returns the count of
    /// parts that contained none, and of those that contained some; hollows are not counted. A mesh of one part stays.
    pub(in crate::surface) fn drop_dry(&mut self, particle_count: &ParticleCountTest<'_>) -> [usize; 2] {
        // Mostly there is only one part.
        if topology::parts(self.vertices.len(), &self.triangles) < 2 {
            return [0; 2];
        }
        let (mut parts, mut bounds): (Vec<Vec<u32>>, Vec<Bounds>) = Default::default();
        let mut hollows: Vec<Vec<u32>> = Vec::new();
        for part in components(&self.triangles) {
            match self.bounds(&part) {
                Some(own) => {
                    parts.push(part);
                    bounds.push(own);
                }
                None => hollows.push(part),
            }
        }
        let mesh = |at: usize| {
            let corners: Vec<[DVec3; 3]> = self.corners(&parts[at]).collect();
            seen_from(bounds[at][0], &corners)
        };
        let counts = particle_count.counts(&bounds, mesh);
        let out: Vec<usize> =
            (0..parts.len()).filter(|part| counts[*part] < particle_count.min_count).collect();
        let mut gone = [0; 2];
        out.iter().for_each(|part| gone[usize::from(counts[*part] > 0)] += 1);
        if gone == [0; 2] {
            return gone;
        }
        // Parts do not intersect, so one corner shows in which part a hollow lies. If a removed part contains another one, that one has too
        // few particles as well.
        let corners = hollows.iter().filter_map(|hollow| self.corners(hollow).next());
        let firsts: Vec<DVec3> = corners.map(|[first, ..]| first).collect();
        let out_bounds: Vec<Bounds> = out.iter().map(|part| bounds[*part]).collect();
        let are_out = are_inside(&firsts, &out_bounds, |at| mesh(out[at]));
        let hollows = hollows.iter().zip(are_out).filter(|(_, is_out)| *is_out).map(|(hollow, _)| hollow);
        let mut is_out = vec![false; self.triangles.len()];
        for triangle in out.iter().map(|part| &parts[*part]).chain(hollows).flatten() {
            is_out[*triangle as usize] = true;
        }
        drop_marked(&mut self.triangles, &is_out);
        drop_marked(&mut self.sources, &is_out);
        let (kept, triangles) = compact(self.vertices.len(), &self.triangles);
        self.triangles = triangles;
        self.vertices = kept.iter().map(|vertex| self.vertices[*vertex as usize]).collect();
        self.origins = kept.iter().map(|vertex| self.origins[*vertex as usize]).collect();
        gone
    }

    /// The bounds of a part (m), if it has a volume over 0.
    fn bounds(&self, part: &[u32]) -> Option<Bounds> {
        let [first, ..] = self.corners(part).next()?;
        let (mut low, mut high, mut six) = (first, first, 0.0);
        for [a, b, c] in self.corners(part) {
            (low, high) = (low.inf(&a).inf(&b).inf(&c), high.sup(&a).sup(&b).sup(&c));
            six += six_volumes(&[a, b, c], &first);
        }
        (six > 0.0).then_some([low, high])
    }

    /// Positions (m) of the corners of some triangles.
    fn corners<'a>(&'a self, part: &'a [u32]) -> impl Iterator<Item = [DVec3; 3]> + 'a {
        part.iter()
            .map(move |triangle| self.triangles[*triangle as usize].map(|at| self.vertices[at as usize]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::coords::between;
    use crate::surface::test_particles::{context, numbered, own_surface, shell};
    use crate::surface::{Params, Particles, Tracker};

    const FRAMES: i32 = 28;
    /// From this frame on both drops are far from the ball.
    const AWAY: i32 = 23;

    /// A box of positions 1 m apart.
    fn lattice(low: DVec3, counts: [i32; 3]) -> impl Iterator<Item = DVec3> {
        between([0; 3], counts.map(|count| count - 1)).map(move |at| low + DVec3::from(at.map(f64::from)))
    }

    /// A ball, from which a drop of 4 particles flies one way and a drop of 20 the other, and the centres of these drops.
    fn splash(frame: i32) -> (Particles, [DVec3; 2]) {
        let distance = 3.6 + 0.25 * f64::from(frame);
        let [small, large] = [DVec3::new(distance, 0.4, 0.4), DVec3::new(-distance - 4.0, 0.4, 0.4)];
        let ball = shell(DVec3::zeros(), 0.0, 4.5);
        let four = lattice(small, [2, 2, 1]);
        let twenty = lattice(large, [5, 2, 2]);
        let positions = ball.into_iter().chain(four).chain(twenty).collect();
        let middles = [small + DVec3::new(0.5, 0.5, 0.0), large + DVec3::new(2.0, 0.5, 0.5)];
        (numbered(positions), middles)
    }

    /// Tracks the splash to its end: the count of specks removed, and the counts of vertices at both drops in each of the last frames.
    fn followed(min_drop: usize) -> (usize, Vec<[usize; 2]>) {
        let ctx = context(2);
        let mut from = splash(0).0;
        let mesh = own_surface(&ctx, &from.positions);
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
                    tracker.vertices().iter().filter(|position| (**position - middle).norm() < 2.2).count()
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

    #[test]
    fn a_hollow_goes_with_the_drop_around_it() {
        const LEAST: usize = 1200;
        let ctx = context(2);
        let ball = shell(DVec3::zeros(), 0.0, 7.0);
        let hollow = shell(DVec3::new(-20.0, 0.3, 0.2), 4.0, 6.5);
        assert!(hollow.len() < LEAST && ball.len() >= LEAST, "{} and {}", hollow.len(), ball.len());
        let particles = numbered([ball, hollow].concat());
        let mesh = own_surface(&ctx, &particles.positions);
        assert_eq!(components(&mesh.triangles).len(), 3);
        for every in [false, true] {
            let params = Params { rebuild: true, every, min_drop: LEAST, ..Params::for_spacing(1.0) };
            let mut tracker = Tracker::new(&ctx, params, &mesh, &particles).unwrap();
            let mut specks = 0;
            for step in 0..3 {
                let report = tracker.step(&ctx, &particles, &particles, 1.0 / 24.0).unwrap();
                specks += report.change.map_or(0, |change| change.specks);
                let left = tracker.vertices().iter().filter(|position| position.x < -10.0).count();
                assert!(left == 0, "{left} vertices after step {step}, every = {every}");
            }
            assert!(specks == 1 && components(tracker.triangles()).len() == 1, "{specks}, every = {every}");
        }
    }
}
