//! Smoothing that preserves volume (Taubin 1995, "A signal processing approach to fair surface design"): vertices move toward the mean of
//! their neighbours, then slightly farther back. Lumps a few edges long are removed first, longer shapes stay.
//!
//! This pair of steps still shrinks drops of a few triangles, so each connected part is scaled back to its volume after every pass. A small
//! part may shrink faster along some axes than along others, and would become a needle or a plate: its smoothing stops before that.

use rayon::prelude::*;

use crate::context::Context;
use crate::error::Result;
use crate::geometry::check::topology::Sets;
use crate::geometry::lists::Lists;
use crate::geometry::shape::six_volumes;
use crate::geometry::{DVec3, TriMesh};

/// Frequency (0 to 2; 0 is a constant) up to which a pass removes nothing: k_PB.
const PASS_BAND: f64 = 0.01;
/// Fraction of the displacement to the mean of the neighbours: lambda.
const SHRINK: f64 = 0.63;
/// The step back: mu, from 1 / lambda + 1 / mu = k_PB.
const GROW: f64 = 1.0 / (PASS_BAND - 1.0 / SHRINK);
/// Largest factor by which a pass may rescale a part; one that would need more is degenerate.
const MAX_SCALE: f64 = 4.0;
/// How far a part may reach from its centre, relative to its initial reach.
const MAX_REACH: f64 = 1.1;
/// Vertices of a task.
const PIECE: usize = 1024;

/// Smooths a closed mesh in `passes` passes; each of its connected parts keeps its volume. A part whose reach from its centre would be
/// over 1.1 times the initial reach after a pass stays as it was before that pass: it is as smooth as possible. Triangles do not change.
///
/// # Errors
/// Cancel.
pub fn smooth(ctx: &Context, mesh: &mut TriMesh, passes: u32) -> Result<()> {
    // A closed mesh uses each edge once in each direction: every vertex has each of its neighbours once.
    let edges = mesh.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let rings = Lists::new(mesh.positions.len(), edges);
    let parts = Parts::of(mesh);
    let mut positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
    let volumes = parts.volumes(&positions, &mesh.triangles, &parts.centres(&positions));
    let reaches = parts.reaches(&positions);
    let mut is_done = vec![false; reaches.len()];
    for _ in 0..passes {
        ctx.check()?;
        let mut next = moved(&rings, &moved(&rings, &positions, SHRINK), GROW);
        parts.restore(&mut next, &mesh.triangles, &volumes);
        for (is_done, (now, first)) in is_done.iter_mut().zip(parts.reaches(&next).iter().zip(&reaches)) {
            *is_done |= *now > MAX_REACH * first;
        }
        parts.take(&mut positions, &next, &is_done);
    }
    mesh.positions = positions.iter().map(|position| position.cast()).collect();
    Ok(())
}

/// Positions after a step by a fraction of the displacement toward the means of the neighbours.
fn moved(rings: &Lists<u32>, positions: &[DVec3], share: f64) -> Vec<DVec3> {
    let step = |(vertex, here): (usize, &DVec3)| {
        let ring = rings.get(vertex);
        if ring.is_empty() {
            return *here;
        }
        let sum: DVec3 = ring.iter().map(|&at| positions[at as usize]).sum();
        here + (sum / ring.len() as f64 - here) * share
    };
    positions.par_iter().enumerate().with_min_len(PIECE).map(step).collect()
}

/// The connected parts of a mesh.
struct Parts {
    /// The part of each vertex, numbered in the order of the parts' first vertices.
    of: Vec<u32>,
    count: usize,
}

impl Parts {
    fn of(mesh: &TriMesh) -> Self {
        let mut sets = Sets::new(mesh.positions.len());
        for &[a, b, c] in &mesh.triangles {
            sets.join(a, b);
            sets.join(a, c);
        }
        let (of, count) = sets.numbered();
        Self { of, count }
    }

    /// The mean of each part's vertices.
    fn centres(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let mut sums = vec![(DVec3::zeros(), 0.0); self.count];
        for (position, &part) in positions.iter().zip(&self.of) {
            let (sum, count) = &mut sums[part as usize];
            *sum += position;
            *count += 1.0;
        }
        sums.into_iter().map(|(sum, count)| sum / count).collect()
    }

    /// Largest distance (m) of each part's vertices from its centre.
    fn reaches(&self, positions: &[DVec3]) -> Vec<f64> {
        let centres = self.centres(positions);
        let mut squares = vec![0.0f64; centres.len()];
        for (position, &part) in positions.iter().zip(&self.of) {
            let square = &mut squares[part as usize];
            *square = square.max((position - centres[part as usize]).norm_squared());
        }
        squares.into_iter().map(f64::sqrt).collect()
    }

    /// Takes over the moved positions of the parts that are not done.
    fn take(&self, positions: &mut [DVec3], moved: &[DVec3], is_done: &[bool]) {
        for ((position, moved), &part) in positions.iter_mut().zip(moved).zip(&self.of) {
            if !is_done[part as usize] {
                *position = *moved;
            }
        }
    }

    /// Volume that each part encloses (m3), by the divergence theorem about its centre; negative for a cavity.
    fn volumes(&self, positions: &[DVec3], triangles: &[[u32; 3]], centres: &[DVec3]) -> Vec<f64> {
        let mut volumes = vec![0.0; self.count];
        for triangle in triangles {
            let part = self.of[triangle[0] as usize] as usize;
            let corners = triangle.map(|vertex| positions[vertex as usize]);
            volumes[part] += six_volumes(&corners, &centres[part]) / 6.0;
        }
        volumes
    }

    /// Scales each part about its centre to a volume (m3).
    fn restore(&self, positions: &mut [DVec3], triangles: &[[u32; 3]], volumes: &[f64]) {
        let centres = self.centres(positions);
        let now = self.volumes(positions, triangles, &centres);
        let scale = |(before, now): (&f64, &f64)| {
            let scale = libm::cbrt(before / now);
            if (1.0 / MAX_SCALE..=MAX_SCALE).contains(&scale) { scale } else { 1.0 }
        };
        let scales: Vec<f64> = volumes.iter().zip(&now).map(scale).collect();
        for (position, &part) in positions.iter_mut().zip(&self.of) {
            let centre = centres[part as usize];
            *position = centre + (*position - centre) * scales[part as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::surface::test_particles::context;

    /// An octahedron with its corners at a distance `size` (m) from a centre.
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

    /// A drop (m): rings of corners around y between two ends, longer along x than along z.
    fn spindle(rings: u32, sides: u32) -> TriMesh {
        let end = 1 + rings * sides;
        let ring = |n: u32| {
            let (ring, side) = (n / sides, n % sides);
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            let height = 0.7 * ((2 * ring + 1) as f32 / rings as f32 - 1.0);
            Vec3::new(1.1 * libm::cos(angle) as f32, height, 0.9 * libm::sin(angle) as f32) * 0.01
        };
        let mut positions = vec![Vec3::new(0.0, -0.01, 0.0)];
        positions.extend((0..rings * sides).map(ring));
        positions.push(Vec3::new(0.0, 0.01, 0.0));
        let mut triangles = Vec::new();
        for side in 0..sides {
            let at = |ring: u32, step: u32| 1 + ring * sides + (side + step) % sides;
            triangles.push([0, at(0, 0), at(0, 1)]);
            for ring in 1..rings {
                let [a, b, c, d] = [at(ring - 1, 0), at(ring - 1, 1), at(ring, 0), at(ring, 1)];
                triangles.extend([[a, d, b], [a, c, d]]);
            }
            triangles.push([at(rings - 1, 0), end, at(rings - 1, 1)]);
        }
        TriMesh { positions, triangles }
    }

    #[test]
    fn a_small_drop_and_a_small_cavity_become_no_needles() {
        let ctx = context(2);
        for (mut mesh, corners) in [(spindle(1, 6).reversed(), 8), (spindle(2, 4), 10)] {
            assert!(mesh.is_closed() && mesh.positions.len() == corners);
            let far = |mesh: &TriMesh| {
                let middle = mesh.positions.iter().sum::<Vec3>() / corners as f32;
                mesh.positions.iter().map(|position| (position - middle).norm()).fold(0.0, f32::max)
            };
            let (reach, volume) = (far(&mesh), mesh.volume());
            smooth(&ctx, &mut mesh, 100).unwrap();
            assert!(far(&mesh) < 1.101 * reach, "{corners} corners: {} of {reach}", far(&mesh));
            assert!((mesh.volume() / volume - 1.0).abs() < 1e-3, "{} is not {volume}", mesh.volume());
        }
    }

    #[test]
    fn the_smallest_drop_and_its_larger_neighbour_keep_their_volumes() {
        let ctx = context(2);
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
        // The corner no longer sticks out: opposite corners are about equally far from the middle.
        let far = |vertex: usize| {
            let middle = mesh.positions[6..].iter().sum::<Vec3>() / 6.0;
            (mesh.positions[vertex] - middle).norm()
        };
        assert!((far(6) / far(9) - 1.0).abs() < 0.2, "{} is not {}", far(6), far(9));
    }
}
