//! Ledges: where the surface ends between wet columns, as at the rim of a shelf or of a hole in it. It would end half a cell before the
//! ground does and be open below; a skirt (`surface/rim/skirts.rs`) closes it.
//!
//! | word | meaning |
//! |---|---|
//! | hem | where the surface of a column comes down to the ground, on the sides where nothing is linked with it |
//! | silhouette | where the ground itself ends, between the middles of the cells |

use crate::shallow::columns::Columns;
use crate::shallow::surface::Counts;
use crate::shallow::surface::rim::hem::Hem;

/// Distance of hems from the middle of their cell where no mesh gives the edge of the ground (cells).
const HALF: f32 = 0.5;

/// Where the ground of columns ends: see [`Depths::ledges`](crate::shallow::surface::Depths::ledges). Reuses its memory.
#[derive(Debug, Default)]
pub struct Ledges {
    /// Where films end, and the ground with them, in order of columns.
    pub(super) hems: Vec<Hem>,
    /// Count of column indices.
    pub(in crate::shallow::surface) columns: usize,
    /// Count of columns, each of which may have a hem.
    pub(in crate::shallow::surface) most: usize,
}

impl Ledges {
    /// Finds the ledges of columns: their surface extends half a cell beyond the middle of the last one. Call it again when they have
    /// changed.
    pub fn find(&mut self, columns: &Columns) {
        self.hems.clear();
        self.columns = columns.len();
        self.most = columns.count();
    }

    /// Copies the ledges of another.
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
