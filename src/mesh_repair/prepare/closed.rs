//! Triangles that are closed as a chain, and what was done to close them.

use crate::geometry::check::edges::{Use, agree};
use crate::geometry::mesh::drop_marked;
use crate::geometry::mesh::weld::Weld;
use crate::geometry::shape::{normal, six_volumes};
use crate::geometry::{DVec3, TriMesh};

/// Triangles that are closed as a chain and turned outward: along every edge as many run in one direction as in the other.
#[derive(Debug)]
pub(in crate::mesh_repair) struct Closed {
    /// All of the input's vertices first, in their order, then those that close holes; triangles likewise. A flipped triangle keeps
    /// its first corner.
    pub mesh: TriMesh,
    /// For each triangle, its index in the input; none if it closes a hole.
    pub sources: Vec<Option<u32>>,
    /// What was done.
    pub prepared: Prepared,
}

impl Closed {
    /// Joins coinciding vertices of the triangles that are not part of a closed manifold: each takes the index of the first.
    pub fn join(&mut self, is_closed_manifold: &[bool]) {
        let mut is_used = vec![false; self.mesh.positions.len()];
        for (triangle, _) in
            self.mesh.triangles.iter().zip(is_closed_manifold).filter(|(_, is_closed)| !**is_closed)
        {
            triangle.iter().for_each(|&vertex| is_used[vertex as usize] = true);
        }
        let mut targets: Vec<u32> = (0..self.mesh.positions.len() as u32).collect();
        let used: Vec<u32> = targets.iter().copied().filter(|&vertex| is_used[vertex as usize]).collect();
        let positions: Vec<DVec3> =
            used.iter().map(|&vertex| self.mesh.positions[vertex as usize].cast()).collect();
        let others = self.mesh.triangles.iter().zip(is_closed_manifold).filter(|(_, is_closed)| !**is_closed);
        let number = |vertex: u32| used.partition_point(|other| *other < vertex) as u32;
        let triangles: Vec<[u32; 3]> = others.map(|(triangle, _)| triangle.map(number)).collect();
        let weld = Weld::of(&positions, &triangles);
        self.prepared.ambiguous_vertices = weld.ambiguous.len();
        for (&vertex, first) in used.iter().zip(weld.firsts) {
            targets[vertex as usize] = used[first as usize];
            self.prepared.joined_vertices += usize::from(targets[vertex as usize] != vertex);
        }
        for (triangle, _) in
            self.mesh.triangles.iter_mut().zip(is_closed_manifold).filter(|(_, is_closed)| !**is_closed)
        {
            *triangle = triangle.map(|vertex| targets[vertex as usize]);
        }
    }

    /// Flips triangles so that at each edge with exactly two triangles these agree.
    pub fn make_agree(&mut self, uses: &[Use]) {
        let area = |at: usize| normal(&self.mesh.corners(at)).norm();
        let turned = agree(&self.mesh.triangles, uses, area).turned;
        for (triangle, _) in self.mesh.triangles.iter_mut().zip(&turned).filter(|(_, turned)| **turned) {
            triangle.swap(1, 2);
            self.prepared.turned_triangles += 1;
        }
    }

    /// Leaves out triangles, and counts them; triangles beyond the end of `is_out` stay.
    pub(in crate::mesh_repair) fn leave_out(&mut self, is_out: &[bool]) {
        let count = is_out.iter().filter(|is_out| **is_out).count();
        if count == 0 {
            return;
        }
        drop_marked(&mut self.mesh.triangles, is_out);
        drop_marked(&mut self.sources, is_out);
        self.prepared.dropped_triangles += count;
    }

    /// Flips the triangles of parts with negative volume.
    pub fn turn_outward(&mut self, parts: &[u32]) {
        let mut six = vec![0.0f64; parts.len()];
        for (triangle, &part) in parts.iter().enumerate() {
            let [origin, ..] = self.mesh.corners(part as usize);
            six[part as usize] += six_volumes(&self.mesh.corners(triangle), &origin);
        }
        for (triangle, &part) in self.mesh.triangles.iter_mut().zip(parts) {
            if six[part as usize] < 0.0 {
                triangle.swap(1, 2);
            }
        }
        self.prepared.turned_parts = six.iter().filter(|six| **six < 0.0).count();
    }
}

/// What was done to a mesh before anything was cut.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Prepared {
    /// Vertices joined with others at the same position, or within rounding of it on open edges ([`Weld`]).
    pub joined_vertices: usize,
    /// Vertices on open edges that are within rounding of others, where it is ambiguous which of them to join.
    pub ambiguous_vertices: usize,
    /// Triangles left out because they have no area, are duplicates or are alone, and those of parts that coincide with another part.
    pub dropped_triangles: usize,
    /// Triangles flipped to agree with their neighbours.
    pub turned_triangles: usize,
    /// Parts turned outward as a whole.
    pub turned_parts: usize,
    /// Holes closed.
    pub holes: usize,
    /// Triangles that close them.
    pub added_triangles: usize,
}
