//! Ledges: where the surface ends between wet columns, as at the rim of a shelf or of a hole in it. It would end half a cell before the
//! ground does and be open below; a skirt (`surface/rim/skirts.rs`) closes it.
//!
//! | word | meaning |
//! |---|---|
//! | hem | where the surface of a column comes down to the ground, on the sides where nothing is linked with it |
//! | silhouette | where the ground itself ends, between the middles of the cells |

use super::silhouette::Silhouette;
use crate::error::{Error, Result};
use crate::geometry::Vec3;
use crate::shallow::surface::{Columns, Counts};

/// Distance of hems from the middle of their cell where no mesh gives the edge of the ground (cells).
const HALF: f32 = 0.5;

/// Where the surface of a column ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::shallow::surface) struct Hem {
    /// Index of the column.
    pub column: u32,
    /// For east, north, west and south: how far the ground reaches (cells) where the surface ends there.
    pub sides: [Option<f32>; 4],
    /// How much higher the ground is there than the column's base (m).
    pub rise: f32,
}

impl Hem {
    /// Offset from the middle of the cell along x and z (cells).
    pub fn offset(&self) -> [f32; 2] {
        let [east, north, west, south] = self.sides.map(|reach| reach.unwrap_or(0.0));
        [east - west, south - north]
    }
}

/// Where the ground of columns ends: see [`Depths::ledges`](crate::shallow::surface::Depths::ledges). Reuses its memory.
#[derive(Debug, Default)]
pub struct Ledges {
    /// Where films end, and the ground with them, in order of columns.
    hems: Vec<Hem>,
    /// Count of column indices.
    pub(in crate::shallow::surface) columns: usize,
    /// Count of columns, each of which may have a hem.
    pub(in crate::shallow::surface) most: usize,
    silhouette: Silhouette,
}

impl Ledges {
    /// Finds the ledges of columns: their surface extends half a cell beyond the middle of the last one. Call it again when they have
    /// changed.
    pub fn find(&mut self, columns: &Columns) {
        self.hems.clear();
        self.columns = columns.len();
        self.most = columns.count();
    }

    /// Finds the ledges of columns and where the ground ends in the mesh that they were made from: the surface extends to there. 8 ms for
    /// 380,000 triangles on 200 x 200 cells in several layers (`make bench`).
    ///
    /// # Errors
    /// `Argument`: a vertex that is not finite, or a face with a vertex that does not exist.
    pub fn fit(&mut self, columns: &Columns, positions: &[Vec3], faces: &[[u32; 3]]) -> Result<()> {
        if !positions.iter().all(|at| at.x.is_finite() && at.y.is_finite() && at.z.is_finite()) {
            return Err(Error::argument("a vertex of the ground is not finite"));
        }
        if faces.iter().flatten().any(|&vertex| vertex as usize >= positions.len()) {
            return Err(Error::argument("a face of the ground has a vertex that is not there"));
        }
        self.find(columns);
        self.hems.extend_from_slice(self.silhouette.find(columns, positions, faces)?);
        Ok(())
    }

    /// Copies the ledges of another, without its scratch buffers.
    pub fn copy_from(&mut self, other: &Self) {
        self.hems.clone_from(&other.hems);
        self.columns = other.columns;
        self.most = other.most;
    }

    /// Sets how far the ground reaches on the sides of a hem.
    pub(in crate::shallow::surface) fn reach(&self, hem: &mut Hem) {
        let known = self.hems.binary_search_by_key(&hem.column, |known| known.column).ok();
        let known = known.map(|at| &self.hems[at]);
        for (at, reach) in hem.sides.iter_mut().enumerate() {
            *reach = reach.map(|_| known.and_then(|known| known.sides[at]).unwrap_or(HALF));
        }
        hem.rise = known.map_or(0.0, |known| known.rise);
    }

    /// Upper bound of what skirts add to a surface; they add far less.
    pub fn bound(&self) -> Counts {
        // Each link between a column and those around it is counted at one of its ends.
        Counts { vertices: self.most, extras: 0, indices: 6 * 4 * self.most }
    }
}
