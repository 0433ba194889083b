//! Ways to move vertices back to the distance that they keep from the particles' surface: ours, Eq. 2.1 of the thesis, and along
//! the normals of the mesh (Yu et al. 2012; Fig. 2.18). All read the same distances, and leave vertices that they would move too far
//! where advection put them.

use frazil::Context;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{Distances, Params, Particles, Sampler, carried, foot};
use rayon::prelude::*;

/// A vertex that advection carried.
pub struct Vertex {
    /// Cells.
    pub position: DVec3,
    /// Unit normal of the mesh.
    pub normal: DVec3,
    /// Distance from the surface that it is to have (cells), negative inside.
    pub delta: f64,
}

/// Where a vertex goes (cells); none where no such position is found.
pub type Project = fn(&mut Sampler<'_>, &Vertex) -> Option<DVec3>;

/// The ways, with their names.
pub const WAYS: [(&str, Project); 4] = [
    ("ours: to the foot on phi = 0, then to delta", by_foot),
    ("Eq. 2.1: one step along the gradient", by_gradient),
    ("along normals, to delta", by_normal),
    ("along normals, to phi = 0 (Yu et al. 2012)", onto_surface),
];
/// A march along a normal has arrived so near to the distance that it looks for (cells), as our steps to a foot have.
const ARRIVED: f64 = 0.005;
/// Most steps of a march.
const STEPS: usize = 64;

fn by_foot(sampler: &mut Sampler<'_>, vertex: &Vertex) -> Option<DVec3> {
    foot(sampler, vertex.position).map(|foot| foot.at(vertex.delta))
}

fn by_gradient(sampler: &mut Sampler<'_>, vertex: &Vertex) -> Option<DVec3> {
    let (phi, slope) = sampler.at(vertex.position)?;
    let unit = DVec3::from(slope.map(f64::from)).try_normalize(1e-3)?;
    Some(vertex.position - unit * (f64::from(phi) - vertex.delta))
}

/// The nearer of the positions outward and inward.
fn by_normal(sampler: &mut Sampler<'_>, vertex: &Vertex) -> Option<DVec3> {
    let ways = [vertex.normal, -vertex.normal].map(|way| march(sampler, vertex, way).map(|far| way * far));
    let nearest = ways.into_iter().flatten().min_by(|a, b| a.norm().total_cmp(&b.norm()));
    nearest.map(|way| vertex.position + way)
}

fn onto_surface(sampler: &mut Sampler<'_>, vertex: &Vertex) -> Option<DVec3> {
    by_normal(sampler, &Vertex { delta: 0.0, ..*vertex })
}

/// How far along a way (cells) the surface is as far away as it is to be. No step passes such a position: a distance changes by no
/// more than one moves.
fn march(sampler: &mut Sampler<'_>, vertex: &Vertex, way: DVec3) -> Option<f64> {
    let mut far = 0.0;
    for _ in 0..STEPS {
        let (phi, _) = sampler.at(vertex.position + way * far)?;
        let left = (f64::from(phi) - vertex.delta).abs();
        if left < ARRIVED {
            return Some(far);
        }
        far += left;
    }
    None
}

/// The distance (m) of each position from the surface; NaN where it is too far to have one.
pub fn measured(distances: &Distances, positions: &[DVec3]) -> Vec<f64> {
    let mut sampler = Sampler::new(distances);
    let cell = distances.cell();
    let one =
        |position: &DVec3| foot(&mut sampler, position / cell).map_or(f64::NAN, |foot| foot.distance * cell);
    positions.iter().map(one).collect()
}

/// A mesh that follows particles, projected in one of the ways.
pub struct Follower {
    project: Project,
    /// With the triangles, and the positions that advection gave last (m).
    mesh: TriMesh,
    /// m.
    pub vertices: Vec<DVec3>,
    /// What each vertex keeps (m); NaN: nothing.
    pub delta: Vec<f64>,
    /// Which vertices the last step projected.
    pub is_placed: Vec<bool>,
    /// Vertices that were not projected though they keep a distance, over all steps.
    pub missed: usize,
    /// Triangles that projection turned over, over all steps.
    pub turned_over: usize,
}

impl Follower {
    /// Vertices at positions (m) that keep distances `delta` (m).
    pub fn new(project: Project, mesh: &TriMesh, vertices: Vec<DVec3>, delta: Vec<f64>) -> Self {
        let is_placed = vec![true; vertices.len()];
        Self { project, mesh: mesh.clone(), vertices, delta, is_placed, missed: 0, turned_over: 0 }
    }

    /// Follows particles to a frame whose surface's distances are known, `dt` (s) later.
    pub fn step(
        &mut self,
        ctx: &Context,
        params: &Params,
        [from, to]: [&Particles; 2],
        dt: f64,
        distances: &Distances,
    ) {
        let there = carried(ctx, &self.vertices, from, to, dt, params).expect("a step");
        self.mesh.positions = there.iter().map(|position| position.cast()).collect();
        let normals = self.mesh.normals();
        let (project, cell, most) = (self.project, distances.cell(), params.change * params.spacing);
        let one = |sampler: &mut Sampler<'_>, n: usize| {
            let (position, delta) = (there[n] / cell, self.delta[n] / cell);
            let to = project(sampler, &Vertex { position, normal: normals[n].cast(), delta })? * cell;
            ((to - there[n]).norm() <= most).then_some(to)
        };
        let all = (0..there.len()).into_par_iter().with_min_len(1024);
        let placed: Vec<Option<DVec3>> = all.map_init(|| Sampler::new(distances), one).collect();
        let after: Vec<DVec3> =
            placed.iter().zip(&there).map(|(placed, there)| placed.unwrap_or(*there)).collect();
        let has_missed = |(placed, delta): &(&Option<DVec3>, &f64)| placed.is_none() && !delta.is_nan();
        self.missed += placed.iter().zip(&self.delta).filter(has_missed).count();
        self.turned_over += turned_over(&self.mesh.triangles, &there, &after);
        self.is_placed = placed.iter().map(Option::is_some).collect();
        self.vertices = after;
    }
}

/// How many triangles look the other way than before.
fn turned_over(triangles: &[[u32; 3]], before: &[DVec3], after: &[DVec3]) -> usize {
    let normal = |positions: &[DVec3], corners: [u32; 3]| {
        let [a, b, c] = corners.map(|vertex| positions[vertex as usize]);
        (b - a).cross(&(c - a))
    };
    triangles.iter().filter(|corners| normal(before, **corners).dot(&normal(after, **corners)) < 0.0).count()
}
