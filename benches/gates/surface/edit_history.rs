//! What became of the vertices and triangles that a mesh had, by what its changes say of themselves.

use frazil::mesh_repair::Source;
use frazil::surface::Change;

/// Which of a mesh's first vertices and triangles those of now are.
pub struct History {
    /// The first triangles.
    first: Vec<[u32; 3]>,
    vertices: Vec<Option<u32>>,
    triangles: Vec<Option<u32>>,
}

impl History {
    /// Begins with so many vertices, and triangles.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        Self {
            first: triangles.to_vec(),
            vertices: (0..vertices as u32).map(Some).collect(),
            triangles: (0..triangles.len() as u32).map(Some).collect(),
        }
    }

    /// Goes on by a change.
    pub fn follow(&mut self, change: &Change) {
        let vertex = |at: &Option<u32>| at.and_then(|at| self.vertices[at as usize]);
        let triangle = |source: &Source| match *source {
            Source::Whole(at) => self.triangles[at as usize],
            Source::Part(_) | Source::New => None,
        };
        let vertices: Vec<Option<u32>> = change.origins.iter().map(vertex).collect();
        let triangles: Vec<Option<u32>> = change.sources.iter().map(triangle).collect();
        (self.vertices, self.triangles) = (vertices, triangles);
    }

    /// The first vertices that those of now are, and the first triangles.
    pub fn survivors(&self) -> [&[Option<u32>]; 2] {
        [&self.vertices, &self.triangles]
    }

    /// Share (percent) of the first triangles that are still there.
    pub fn alive(&self) -> f64 {
        100.0 * self.triangles.iter().flatten().count() as f64 / self.first.len() as f64
    }

    /// What is wrong with it, where the triangles of now are these: each that is said to be a first one must have its vertices, in its
    /// sense, and no two may be the same.
    pub fn fault(&self, now: &[[u32; 3]]) -> Option<String> {
        if now.len() != self.triangles.len() {
            return Some(format!("{} sources for {} triangles", self.triangles.len(), now.len()));
        }
        let mut named = vec![false; self.first.len()];
        for (triangle, (corners, from)) in now.iter().zip(&self.triangles).enumerate() {
            let Some(from) = *from else { continue };
            let were = corners.map(|corner| self.vertices.get(corner as usize).copied().flatten());
            let [a, b, c] = self.first[from as usize].map(Some);
            if ![[a, b, c], [b, c, a], [c, a, b]].contains(&were) {
                return Some(format!(
                    "triangle {triangle} is not triangle {from}: its corners were {were:?}"
                ));
            }
            if std::mem::replace(&mut named[from as usize], true) {
                return Some(format!("triangle {from} is there twice"));
            }
        }
        None
    }
}
