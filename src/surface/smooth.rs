//! Smoothing that keeps volume (Taubin 1995, "A signal processing approach to fair surface design"): vertices go toward the mean of
//! their neighbours, then a little farther back. Lumps a few edges long go first, shapes that are longer stay.
//!
//! That pair of steps still shrinks drops of a few triangles, so each connected part gets its volume back after every pass.

use rayon::prelude::*;

use super::specks::root;
use crate::base::{DVec3, TriMesh};
use crate::context::Context;
use crate::error::Result;

/// Frequency (0 to 2; 0 is a constant) up to which a pass takes nothing away: k_PB.
const PASS_BAND: f64 = 0.01;
/// Share of the way to the mean of the neighbours: lambda.
const SHRINK: f64 = 0.63;
/// The way back: mu, of 1 / lambda + 1 / mu = k_PB.
const GROW: f64 = 1.0 / (PASS_BAND - 1.0 / SHRINK);
/// Largest factor by which a pass may stretch a part; one that lost more is degenerate.
const MOST: f64 = 4.0;
/// Vertices of a task.
const PIECE: usize = 1024;

/// Smooths a closed mesh in `passes` passes; each of its connected parts keeps its volume. Triangles stay as they are.
///
/// # Errors
/// Cancel.
pub fn smooth(ctx: &Context, mesh: &mut TriMesh, passes: u32) -> Result<()> {
    let rings = Rings::of(mesh);
    let parts = Parts::of(mesh);
    let mut places: Vec<DVec3> = mesh.positions.iter().map(|place| place.cast()).collect();
    let volumes = parts.volumes(&places, &mesh.triangles, &parts.centres(&places));
    for _ in 0..passes {
        ctx.check()?;
        places = rings.moved(&places, SHRINK);
        places = rings.moved(&places, GROW);
        parts.restore(&mut places, &mesh.triangles, &volumes);
    }
    mesh.positions = places.iter().map(|place| place.cast()).collect();
    Ok(())
}

/// The neighbours of each vertex, one vertex after another.
struct Rings {
    /// For each vertex its first neighbour; then the count of all.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Rings {
    /// In a closed mesh each edge is run along both ways: every vertex has each of its neighbours once.
    fn of(mesh: &TriMesh) -> Self {
        let edges = || mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut starts = vec![0u32; mesh.positions.len() + 1];
        edges().for_each(|[from, _]| starts[from as usize + 1] += 1);
        for vertex in 1..starts.len() {
            starts[vertex] += starts[vertex - 1];
        }
        let mut ends = starts.clone();
        let mut neighbours = vec![0; mesh.triangles.len() * 3];
        for [from, to] in edges() {
            let end = &mut ends[from as usize];
            neighbours[*end as usize] = to;
            *end += 1;
        }
        Self { starts, neighbours }
    }

    /// Places after a step of a share of the way toward the means of the neighbours.
    fn moved(&self, places: &[DVec3], share: f64) -> Vec<DVec3> {
        let step = |(vertex, here): (usize, &DVec3)| {
            let ring = &self.neighbours[self.starts[vertex] as usize..self.starts[vertex + 1] as usize];
            if ring.is_empty() {
                return *here;
            }
            let sum: DVec3 = ring.iter().map(|&at| places[at as usize]).sum();
            here + (sum / ring.len() as f64 - here) * share
        };
        places.par_iter().enumerate().with_min_len(PIECE).map(step).collect()
    }
}

/// The connected parts of a mesh.
struct Parts {
    /// The part of each vertex, counted in the order of their first vertices.
    of: Vec<u32>,
    count: usize,
}

impl Parts {
    fn of(mesh: &TriMesh) -> Self {
        let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        for &[a, b, c] in &mesh.triangles {
            for other in [b, c] {
                let [one, two] = [a, other].map(|vertex| root(&mut parent, vertex));
                // The lesser is the root: it comes first.
                parent[one.max(two) as usize] = one.min(two);
            }
        }
        let mut of = vec![0; parent.len()];
        let mut count = 0;
        for vertex in 0..parent.len() {
            let root = root(&mut parent, vertex as u32) as usize;
            of[vertex] = if root == vertex { count } else { of[root] };
            count += u32::from(root == vertex);
        }
        Self { of, count: count as usize }
    }

    /// The mean of each part's vertices.
    fn centres(&self, places: &[DVec3]) -> Vec<DVec3> {
        let mut sums = vec![(DVec3::zeros(), 0.0); self.count];
        for (place, &part) in places.iter().zip(&self.of) {
            let (sum, count) = &mut sums[part as usize];
            *sum += place;
            *count += 1.0;
        }
        sums.into_iter().map(|(sum, count)| sum / count).collect()
    }

    /// Volume that each part encloses (m3), by the divergence theorem about its centre; that of a cavity is below 0.
    fn volumes(&self, places: &[DVec3], triangles: &[[u32; 3]], centres: &[DVec3]) -> Vec<f64> {
        let mut volumes = vec![0.0; self.count];
        for triangle in triangles {
            let part = self.of[triangle[0] as usize] as usize;
            let [a, b, c] = triangle.map(|vertex| places[vertex as usize] - centres[part]);
            volumes[part] += a.dot(&b.cross(&c)) / 6.0;
        }
        volumes
    }

    /// Scales each part about its centre to a volume (m3).
    fn restore(&self, places: &mut [DVec3], triangles: &[[u32; 3]], volumes: &[f64]) {
        let centres = self.centres(places);
        let now = self.volumes(places, triangles, &centres);
        let scale = |(before, now): (&f64, &f64)| {
            let scale = libm::cbrt(before / now);
            if (1.0 / MOST..=MOST).contains(&scale) { scale } else { 1.0 }
        };
        let scales: Vec<f64> = volumes.iter().zip(&now).map(scale).collect();
        for (place, &part) in places.iter_mut().zip(&self.of) {
            let centre = centres[part as usize];
            *place = centre + (*place - centre) * scales[part as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Vec3;
    use crate::context::Pool;

    /// An octahedron with its corners so far from a centre (m).
    fn octahedron(centre: [f32; 3], size: f32) -> TriMesh {
        let corners = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]];
        let position =
            |corner: [i32; 3]| Vec3::from([0, 1, 2].map(|axis| centre[axis] + size * corner[axis] as f32));
        let triangle = |n: u32| {
            let [a, b, c] = [0, 1, 2].map(|axis| axis + 3 * (n >> axis & 1));
            if n.count_ones().is_multiple_of(2) { [a, b, c] } else { [a, c, b] }
        };
        TriMesh {
            positions: corners.into_iter().map(position).collect(),
            triangles: (0..8).map(triangle).collect(),
        }
    }

    #[test]
    fn the_smallest_drop_and_its_larger_neighbour_keep_their_volumes() {
        let ctx = Context::new(Pool::new(2).unwrap());
        let mut mesh = octahedron([0.0; 3], 0.01);
        mesh.append(&octahedron([5.0, 1.0, 0.0], 0.02));
        // A corner that sticks out.
        mesh.positions[6].x += 0.01;
        let volume = |mesh: &TriMesh, range: std::ops::Range<usize>| {
            TriMesh { positions: mesh.positions.clone(), triangles: mesh.triangles[range].to_vec() }.volume()
        };
        let before = [volume(&mesh, 0..8), volume(&mesh, 8..16)];
        assert!(before[0] > 0.0 && before[1] > before[0]);
        smooth(&ctx, &mut mesh, 20).unwrap();
        let after = [volume(&mesh, 0..8), volume(&mesh, 8..16)];
        for (before, after) in before.into_iter().zip(after) {
            assert!((after / before - 1.0).abs() < 1e-3, "{after} is not {before}");
        }
        // What stuck out has gone: opposite corners are about as far from the middle.
        let far = |vertex: usize| {
            let middle = mesh.positions[6..].iter().sum::<Vec3>() / 6.0;
            (mesh.positions[vertex] - middle).norm()
        };
        assert!((far(6) / far(9) - 1.0).abs() < 0.2, "{} is not {}", far(6), far(9));
    }
}
