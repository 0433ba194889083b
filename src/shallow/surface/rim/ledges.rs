//! Ledges: where the surface ends between wet columns, as at the rim of a shelf or of a hole in it. It would end half a cell before the
//! ground does and be open below; a skirt (`surface/rim/skirts.rs`) closes it.
//!
//! | word | meaning |
//! |---|---|
//! | skirt vertex | lower end of a skirt: where the surface of a column comes down to the ground, on sides where nothing is linked with it |
//! | silhouette | where the ground itself ends, between the middles of the cells |

use crate::shallow::columns::Columns;
use crate::shallow::surface::Counts;
use crate::shallow::surface::rim::skirt_vertex::SkirtVertex;

/// Distance of skirt vertices from the middle of their cell, where the ground's edge is not known from a mesh (cells).
const HALF: f32 = 0.5;

/// Where the ground of columns ends: see [`Depths::ledges`](crate::shallow::surface::Depths::ledges). Reuses its memory.
#[derive(Debug, Default)]
pub struct Ledges {
    /// Where films end on the ground of the mesh, in order of columns.
    pub(super) skirt_vertices: Vec<SkirtVertex>,
    /// Count of column indices.
    pub(in crate::shallow::surface) columns: usize,
    /// Maximum count of skirt vertices: one for each column.
    pub(in crate::shallow::surface) max_vertices: usize,
}

impl Ledges {
    /// Finds the ledges of columns: their surface extends half a cell beyond the middle of the last one. Call it again when they have
    /// changed.
    pub fn find(&mut self, columns: &Columns) {
        self.skirt_vertices.clear();
        self.columns = columns.len();
        self.max_vertices = columns.count();
    }

    /// Copies the ledges of another.
    pub fn copy_from(&mut self, other: &Self) {
        self.skirt_vertices.clone_from(&other.skirt_vertices);
        self.columns = other.columns;
        self.max_vertices = other.max_vertices;
    }

    /// Sets how far the ground reaches on the sides of a skirt vertex.
    pub(in crate::shallow::surface) fn reach(&self, skirt_vertex: &mut SkirtVertex) {
        let known = self.skirt_vertices.binary_search_by_key(&skirt_vertex.column, |known| known.column).ok();
        let known = known.map(|at| &self.skirt_vertices[at]);
        for (at, reach) in skirt_vertex.sides.iter_mut().enumerate() {
            *reach = reach.map(|_| known.and_then(|known| known.sides[at]).unwrap_or(HALF));
        }
        skirt_vertex.rise = known.map_or(0.0, |known| known.rise);
    }

    /// Upper bound of what skirts add to a surface; in practice it is far less.
    pub fn bound(&self) -> Counts {
        // A column has at most eight edges, and each is shared by two columns.
        Counts { vertices: self.max_vertices, extras: 0, indices: 6 * 4 * self.max_vertices }
    }
}
