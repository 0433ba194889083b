//! The motion of vertices from one frame to the next, through changes of the mesh.

use crate::geometry::check::topology::neighbour_sums;
use crate::geometry::{DVec3, Vec3};
use crate::surface::Change;

/// Number of passes in which new vertices take the mean velocity of their neighbours.
const PASSES: usize = 4;

/// The displacements of a frame's vertices on their way to the next frame, through changes of the mesh.
pub struct VertexPaths {
    /// Their initial positions (m).
    from: Vec<DVec3>,
    /// The displacement of each so far (m), and the share of the frame in which it happened.
    displacements: Vec<(DVec3, f64)>,
    /// For each current vertex, its index at the start of the frame; `None`: it is new.
    start_vertices: Vec<Option<u32>>,
}

impl VertexPaths {
    /// Vertices that start from these positions (m).
    pub fn of(from: &[DVec3]) -> Self {
        let start_vertices = (0..from.len() as u32).map(Some).collect();
        Self { from: from.to_vec(), displacements: vec![(DVec3::zeros(), 0.0); from.len()], start_vertices }
    }

    /// Records the positions (m) of the current vertices after a share of the frame.
    pub fn record(&mut self, positions: &[DVec3], share: f64) {
        for (position, start) in positions.iter().zip(&self.start_vertices) {
            if let Some(start) = start {
                let at = *start as usize;
                self.displacements[at] = (position - self.from[at], share);
            }
        }
    }

    /// Follows a change that removes vertices and creates others.
    pub fn apply_change(&mut self, change: &Change) {
        let start = |origin: &Option<u32>| origin.and_then(|at| self.start_vertices[at as usize]);
        self.start_vertices = change.origins.iter().map(start).collect();
    }

    /// Velocities over the frame, at `fps` frames per second: removed vertices keep their last velocity.
    pub fn velocities(&self, positions: &[DVec3], triangles: &[[u32; 3]], fps: f64) -> VertexVelocities {
        let velocity = |(displacement, share): &(DVec3, f64)| -> Vec3 {
            if *share > 0.0 { (displacement * (fps / share)).cast() } else { Vec3::zeros() }
        };
        let before: Vec<Vec3> = self.displacements.iter().map(velocity).collect();
        if positions.len() == self.from.len()
            && self.start_vertices.iter().zip(0..).all(|(start, at)| *start == Some(at))
        {
            return VertexVelocities { after: before.clone(), before };
        }
        let mut known: Vec<Option<Vec3>> =
            self.start_vertices.iter().map(|start| start.map(|start| before[start as usize])).collect();
        for _ in 0..PASSES {
            let sums = neighbour_sums(known.len(), triangles, |vertex| known[vertex as usize]);
            for (known, (sum, count)) in known.iter_mut().zip(sums) {
                if known.is_none() && count > 0 {
                    *known = Some(sum / count as f32);
                }
            }
        }
        let after = known.into_iter().map(Option::unwrap_or_default).collect();
        VertexVelocities { before, after }
    }
}

/// The velocities of vertices from the previous frame to this one.
#[derive(Default)]
pub(in crate::scene::surface) struct VertexVelocities {
    /// Velocities (m/s) of the previous frame's vertices; empty at the first frame.
    pub before: Vec<Vec3>,
    /// Velocities (m/s) of this frame's vertices.
    pub after: Vec<Vec3>,
}
