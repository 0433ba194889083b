//! Improvement of stretched and squeezed meshes.

use std::collections::BTreeMap;

use super::shape::min_angle;
use super::*;
use crate::error::Error;
use crate::geometry::check::topology::Topology;
use crate::geometry::shape::normal;
use crate::geometry::test_meshes;
use crate::mesh_repair::Source;
use crate::surface::test_particles::context;

/// The drift of a vertex of which nothing is known: so large that no edge rests, and, unlike NaN, equal to itself.
const UNKNOWN: [f32; 3] = [f32::INFINITY; 3];

/// A mesh with all arrays that are improved along with it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Body {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub sizes: Vec<Size>,
    pub drifts: Vec<[f32; 3]>,
    pub origins: Vec<Option<u32>>,
    pub sources: Vec<Source>,
    pub flags: Vec<bool>,
    pub jitter: f64,
}

impl Body {
    /// A mesh at birth, with unknown earlier displacements.
    pub fn of(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            sizes: sizes(&positions, &triangles),
            drifts: vec![UNKNOWN; positions.len()],
            origins: (0..positions.len() as u32).map(Some).collect(),
            sources: (0..triangles.len() as u32).map(Source::Whole).collect(),
            flags: vec![false; positions.len()],
            jitter: 0.0,
            positions,
            triangles,
        }
    }

    pub fn improvable(&mut self) -> Improvable<'_> {
        Improvable {
            positions: &mut self.positions,
            triangles: &mut self.triangles,
            sizes: &mut self.sizes,
            drifts: &mut self.drifts,
            origins: &mut self.origins,
            sources: &mut self.sources,
            flags: &mut self.flags,
            jitter: self.jitter,
        }
    }

    /// Checks that arrays have matching lengths and that the mesh is closed.
    pub fn check(&self) {
        let vertices = self.positions.len();
        let counts = [self.sizes.len(), self.drifts.len(), self.origins.len(), self.flags.len()];
        assert_eq!(counts, [vertices; 4]);
        assert_eq!(self.sources.len(), self.triangles.len());
        let topology = Topology::of(vertices, &self.triangles);
        assert!(topology.is_watertight(), "{topology:?}");
        let mut is_used = vec![false; vertices];
        self.triangles.as_flattened().iter().for_each(|&corner| is_used[corner as usize] = true);
        assert!(!is_used.contains(&false));
    }

    fn stretched(mut self, by: [f64; 3]) -> Self {
        self.positions.iter_mut().for_each(|position| position.component_mul_assign(&DVec3::from(by)));
        self
    }

    /// Improves it and checks the invariants.
    fn improved(mut self, threads: usize) -> (Self, Improvements) {
        let before = self.clone();
        let ctx = context(threads);
        let done = ctx.phase("improve", || improve(&ctx, &mut self.improvable())).unwrap();
        self.check();
        for vertex in 0..self.positions.len() {
            if let Some(origin) = self.origins[vertex] {
                assert_eq!(self.positions[vertex], before.positions[origin as usize], "vertex {vertex}");
                assert_eq!(self.sizes[vertex], before.sizes[origin as usize], "vertex {vertex}");
            }
        }
        let mut last = None;
        for (at, source) in self.sources.iter().enumerate() {
            let Source::Whole(of) = *source else { continue };
            assert!(last < Some(of), "triangle {of} does not come after {last:?}");
            last = Some(of);
            let origins = self.triangles[at].map(|corner| self.origins[corner as usize]);
            let old = before.triangles[of as usize].map(|corner| before.origins[corner as usize]);
            assert_eq!(origins, old, "triangle {of} was changed");
        }
        (self, done)
    }

    /// Lengths of all edges over their targets.
    fn ratios(&mut self) -> Vec<f64> {
        let triangles = self.triangles.clone();
        let mesh = self.improvable();
        let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        edges.map(|ends| libm::sqrt(mesh.stretch(ends))).collect()
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|corner| self.positions[corner as usize])
    }

    fn volume(&self) -> f64 {
        let six = |triangle: usize| {
            let [a, b, c] = self.corners(triangle);
            a.dot(&b.cross(&c))
        };
        (0..self.triangles.len()).map(six).sum::<f64>() / 6.0
    }

    /// Count of edges whose triangles are folded onto each other.
    fn folds(&self) -> usize {
        let side = |triangle: usize| {
            let ([a, b, c], up) = (self.triangles[triangle], normal(&self.corners(triangle)).normalize());
            [[a, b], [b, c], [c, a]].map(|ends| (ends, up))
        };
        let sides: BTreeMap<[u32; 2], DVec3> = (0..self.triangles.len()).flat_map(side).collect();
        sides.iter().filter(|([a, b], up)| a < b && up.dot(&sides[&[*b, *a]]) < -0.94).count()
    }

    /// Its state at the start of the next frame.
    fn in_next_frame(mut self) -> Self {
        self.origins = (0..self.positions.len() as u32).map(Some).collect();
        self.sources = (0..self.triangles.len() as u32).map(Source::Whole).collect();
        self
    }
}

/// A unit sphere of 8 x 4^levels triangles.
pub(super) fn sphere(levels: u32) -> Body {
    let (positions, triangles) = test_meshes::sphere(levels);
    Body::of(positions, triangles)
}

/// A torus with edges of different lengths.
fn torus() -> Body {
    let (positions, triangles) = test_meshes::torus();
    Body::of(positions, triangles)
}

#[test]
fn sizes_are_the_shortest_and_the_longest_length() {
    let positions = [DVec3::zeros(), DVec3::x() * 3.0, DVec3::y() * 4.0, DVec3::z()];
    assert_eq!(sizes(&positions, &[[0, 1, 2], [1, 0, 2]]), [[3.0, 4.0], [3.0, 5.0], [4.0, 5.0], [0.0; 2]]);
}

#[test]
fn stretched_and_squeezed_meshes_get_their_edges_back() {
    for (name, body) in [("sphere", sphere(4)), ("torus", torus())] {
        for by in [2.0, 0.35] {
            let body = body.clone().stretched([by, 1.0, 1.0]);
            let volume = body.volume();
            let (mut body, done) = body.improved(2);
            let case = format!("{name} by {by}: {done:?}");
            assert!(if by > 1.0 { done.splits > 100 } else { done.splits == 0 }, "{case}");
            assert!(done.collapses > 50, "{case}");
            let ratios = body.ratios();
            let fit = ratios.iter().filter(|ratio| (0.45..=1.6).contains(*ratio)).count();
            let share = fit as f64 / ratios.len() as f64;
            assert!(share >= 0.98, "{case}: {share} of the edges");
            let change = body.volume() / volume;
            assert!((change - 1.0).abs() < 0.01, "{case}: volume by {change}");
            let mut angles: Vec<f64> =
                (0..body.triangles.len()).map(|triangle| min_angle(&body.corners(triangle))).collect();
            angles.sort_unstable_by(f64::total_cmp);
            let least = angles[angles.len() / 100];
            assert!(least >= 10.0, "{case}: {least} degrees");
            // Split edges do not collapse in the next frame, nor the reverse.
            let (_, again) = body.in_next_frame().improved(1);
            assert!(again.splits == 0 && again.collapses < 20, "{case}: then {again:?}");
        }
    }
}

#[test]
fn what_is_as_it_was_born_stays_bit_for_bit() {
    for body in [sphere(4), torus(), sphere(3).stretched([1.15, 1.0, 0.9])] {
        let (after, done) = body.clone().improved(2);
        assert_eq!(done, Improvements::default());
        assert!(after == body);
    }
}

#[test]
fn what_rests_stays_bit_for_bit_however_it_is_stretched() {
    let at_reference = |by: f64| {
        let mut body = torus().stretched([by, 1.0, 0.6]);
        body.drifts = vec![[0.0; 3]; body.positions.len()];
        body
    };
    for by in [0.4, 1.7, 4.0] {
        let (after, done) = at_reference(by).improved(2);
        assert_eq!(done, Improvements::default());
        assert!(after == at_reference(by));
        // If it was stretched since the reference, it is improved as if its drift were unknown.
        let mut body = at_reference(by);
        for (drift, (now, before)) in
            body.drifts.iter_mut().zip(body.positions.iter().zip(&torus().positions))
        {
            *drift = (now - before).cast::<f32>().into();
        }
        let (_, done) = body.improved(2);
        assert_eq!(done, torus().stretched([by, 1.0, 0.6]).improved(2).1);
        assert!(done.splits + done.collapses > 100, "{done:?}");
    }
}

#[test]
fn triangles_at_flagged_vertices_are_left_alone() {
    let mut body = sphere(4).stretched([2.0, 1.0, 1.0]);
    for vertex in 0..body.positions.len() {
        body.flags[vertex] = body.positions[vertex].y > 0.5;
    }
    let flagged = |body: &Body| {
        let is_flagged = |corners: &[u32; 3]| corners.iter().any(|&corner| body.flags[corner as usize]);
        let all = body.triangles.iter().zip(&body.sources).filter(|(corners, _)| is_flagged(corners));
        all.map(|(_, source)| *source).collect::<Vec<_>>()
    };
    let before = flagged(&body);
    let (after, done) = body.improved(2);
    assert!(done.splits > 100 && before.len() > 300, "{done:?} {}", before.len());
    assert!(flagged(&after) == before);
}

#[test]
fn a_part_that_needs_nothing_is_whole() {
    let mut body = sphere(4);
    body.positions.iter_mut().filter(|position| position.x > 0.0).for_each(|position| position.x *= 2.0);
    let far = |body: &Body, triangle: usize| body.corners(triangle).iter().all(|position| position.x < -0.2);
    let expected: Vec<Source> = (0..body.triangles.len())
        .filter(|&triangle| far(&body, triangle))
        .map(|triangle| Source::Whole(triangle as u32))
        .collect();
    let (after, done) = body.improved(2);
    assert!(done.splits > 100 && expected.len() > 500, "{done:?}");
    let there = (0..after.triangles.len()).filter(|&triangle| far(&after, triangle));
    assert!(there.map(|triangle| after.sources[triangle]).collect::<Vec<_>>() == expected);
    assert!(after.sources.iter().any(|source| matches!(source, Source::Part(_))));
}

#[test]
fn what_was_rebuilt_stays_new() {
    let mut body = torus().stretched([2.0, 1.0, 0.7]);
    body.sources.iter_mut().for_each(|source| *source = Source::New);
    body.origins.iter_mut().for_each(|origin| *origin = None);
    let (after, done) = body.improved(2);
    assert!(done.splits > 100 && done.collapses > 50 && done.flips > 10, "{done:?}");
    assert!(after.sources.iter().all(|source| *source == Source::New));
}

#[test]
fn threads_change_nothing() {
    let body = torus().stretched([4.0, 1.0, 0.6]);
    let (one, done) = body.clone().improved(1);
    for threads in [1, 2, 3] {
        let (other, again) = body.clone().improved(threads);
        assert!(other == one && again == done, "{threads} threads: {again:?}, not {done:?}");
    }
}

#[test]
fn a_vertex_that_went_astray_takes_bounded_work() {
    for far in [10.0, 1000.0] {
        let mut body = sphere(3);
        body.positions[20] *= far;
        for _ in 0..2 {
            let (after, done) = body.improved(2);
            assert!(done.splits < 20_000, "{far}: {done:?}");
            body = after.in_next_frame();
            if far > 100.0 {
                // The longest edges have been halved as often as a frame allows.
                assert!(body.ratios().into_iter().fold(0.0, f64::max) > 1.5 && done.splits > 500);
                break;
            }
        }
    }
}

#[test]
fn folds_go() {
    let mut body = sphere(3);
    let vertex = 100;
    let around: Vec<usize> =
        (0..512).filter(|&triangle| body.triangles[triangle].contains(&vertex)).collect();
    let other = body.triangles[around[0]].into_iter().find(|&corner| corner != vertex).unwrap();
    let [p, q] = [vertex, other].map(|at| body.positions[at as usize]);
    body.positions[vertex as usize] = q + 0.6 * (q - p);
    body.origins[vertex as usize] = None;
    around.iter().for_each(|&triangle| body.sources[triangle] = Source::New);
    assert!(body.folds() > 2);
    let (after, done) = body.improved(1);
    assert!(done.collapses > 0 && after.folds() == 0, "{done:?}");
}

#[test]
fn nothing_stays_nothing_and_cancel_leaves_a_mesh_as_it_was() {
    let ctx = context(1);
    let mut nothing = Body::of(Vec::new(), Vec::new());
    assert_eq!(improve(&ctx, &mut nothing.improvable()).unwrap(), Improvements::default());
    ctx.cancel();
    let mut body = torus().stretched([2.0, 1.0, 1.0]);
    let before = body.clone();
    assert!(matches!(improve(&ctx, &mut body.improvable()), Err(Error::Cancelled)));
    assert!(body == before);
}
