//! Parts of the mesh without liquid: crumbs that were left where it went. They are taken away.

use super::change::Change;
use super::repair::Source;
use crate::base::bvh::Bvh;
use crate::base::mesh::{renumbered, used};
use crate::base::topology::{bodies, groups};
use crate::base::{DVec3, TriMesh, Vec3};

/// A direction along which no edges of made meshes run.
const ASLANT: DVec3 = DVec3::new(0.5773, 0.6533, 0.4896);

/// A closed part of a mesh in which no particle has been found yet.
struct Part {
    triangles: Vec<u32>,
    low: DVec3,
    high: DVec3,
    /// Made when the first particle comes near.
    tree: Option<Bvh>,
}

impl Change {
    /// Takes away the parts of the mesh with a volume over 0 in which no particle lies, of those at these places (m). Returns how many.
    pub(super) fn drop_dry(&mut self, particles: &[DVec3]) -> usize {
        // Mostly there is one.
        let links = self.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c]]);
        if groups(self.vertices.len(), links) < 2 {
            return 0;
        }
        let mut parts: Vec<Part> =
            bodies(&self.triangles).into_iter().filter_map(|triangles| self.part(triangles)).collect();
        for place in particles {
            parts.retain_mut(|part| !self.is_in(part, *place));
            if parts.is_empty() {
                return 0;
            }
        }
        let mut is_dry = vec![false; self.triangles.len()];
        parts.iter().flat_map(|part| &part.triangles).for_each(|triangle| is_dry[*triangle as usize] = true);
        let mut marks = is_dry.iter();
        self.triangles.retain(|_| !marks.next().copied().unwrap_or_default());
        let mut marks = is_dry.iter();
        self.sources.retain(|_: &Source| !marks.next().copied().unwrap_or_default());
        let names = used(self.vertices.len(), &self.triangles)
            .unwrap_or_else(|| (0..self.vertices.len() as u32).collect());
        self.triangles = renumbered(&self.triangles, &names);
        self.vertices = names.iter().map(|name| self.vertices[*name as usize]).collect();
        self.origins = names.iter().map(|name| self.origins[*name as usize]).collect();
        parts.len()
    }

    /// A part, if it has a volume over 0.
    fn part(&self, triangles: Vec<u32>) -> Option<Part> {
        let corners =
            |triangle: &u32| self.triangles[*triangle as usize].map(|at| self.vertices[at as usize]);
        let first = corners(triangles.first()?)[0];
        let (mut low, mut high, mut six) = (first, first, 0.0);
        for [a, b, c] in triangles.iter().map(corners) {
            (low, high) = (low.inf(&a).inf(&b).inf(&c), high.sup(&a).sup(&b).sup(&c));
            six += (a - first).dot(&(b - first).cross(&(c - first)));
        }
        (six > 0.0).then_some(Part { triangles, low, high, tree: None })
    }

    fn is_in(&self, part: &mut Part, place: DVec3) -> bool {
        if (0..3).any(|axis| place[axis] < part.low[axis] || place[axis] > part.high[axis]) {
            return false;
        }
        let low = part.low;
        let tree = part.tree.get_or_insert_with(|| {
            let triangles: Vec<[u32; 3]> =
                part.triangles.iter().map(|triangle| self.triangles[*triangle as usize]).collect();
            let names = used(self.vertices.len(), &triangles);
            let names = names.unwrap_or_else(|| (0..self.vertices.len() as u32).collect());
            let positions: Vec<Vec3> =
                names.iter().map(|name| (self.vertices[*name as usize] - low).cast()).collect();
            Bvh::new(&TriMesh { positions, triangles: renumbered(&triangles, &names) })
        });
        tree.surrounding(place - low, ASLANT) > 0
    }
}
