//! What a repair has lost of a mesh, by its area, its volume and its bounds.

use super::prepare::Closed;
use crate::geometry::check::faults::counted_area;
use crate::geometry::{DVec3, TriMesh};

/// Of the area and of the volume, if less is left, something is missing.
const HALF: f64 = 0.5;
/// If less is left, nearly all is missing.
const NEARLY_NONE: f64 = 0.1;
/// Bounds may shrink by so much of the longest side, or by so many cells.
const SHRUNK: f64 = 0.05;
const CELLS: f64 = 2.0;

/// A mesh before and after a repair.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Losses {
    /// Areas (m2) before and after; before without triangles that lie on others.
    pub areas: [f64; 2],
    /// Volumes (m3) before and after; before once it was closed and each part turned outward, so that parts that overlap count twice.
    pub volumes: [f64; 2],
    /// Longest sides of the boxes around it (m) before and after.
    pub sides: [f64; 2],
    /// By how much the box has shrunk, at most, on a side (m).
    pub shrunk: f64,
}

impl Losses {
    /// Of a mesh, what closed it, and what has come out.
    pub(super) fn of(before: &TriMesh, closed: &Closed, after: &TriMesh) -> Self {
        let volume =
            TriMesh { positions: closed.positions.clone(), triangles: closed.triangles.clone() }.volume();
        let [old, new] = [before, after].map(named_bounds);
        let side = |[low, high]: [DVec3; 2]| (high - low).max().max(0.0);
        let shrunk = (new[0] - old[0]).sup(&(old[1] - new[1])).max();
        Self {
            areas: [counted_area(before), after.area()],
            volumes: [volume, after.volume()],
            sides: [side(old), side(new)],
            shrunk: if shrunk.is_finite() { shrunk.max(0.0) } else { side(old) },
        }
    }

    /// Whether nearly all of the mesh is lost: most of its area, and its extent or volume with it. Parts that lie within others have an
    /// area, too, but neither of these.
    pub fn is_nearly_all(&self) -> bool {
        let is_flat = self.volumes[1] < NEARLY_NONE * self.volumes[0];
        self.areas[1] < NEARLY_NONE * self.areas[0] && (is_flat || self.shrunk > HALF * self.sides[0])
    }

    /// What to say where much is lost, in cells of an edge (m); none where all is there.
    pub fn warning(&self, cell: f64) -> Option<String> {
        let [area, area_now] = self.areas;
        let [volume, volume_now] = self.volumes;
        let mut lost = Vec::new();
        if self.shrunk > (SHRUNK * self.sides[0]).max(CELLS * cell) {
            lost.push(format!("its box has shrunk by {:.4} m on a side", self.shrunk));
        }
        if volume_now < HALF * volume {
            lost.push(format!("of {volume:.6} m3 {volume_now:.6} are left"));
        }
        // The area of what overlaps goes with its volume.
        if area_now < HALF * area && (volume_now < HALF * volume || !lost.is_empty()) {
            lost.push(format!("of {area:.6} m2 {area_now:.6} are left"));
        }
        (!lost.is_empty()).then(|| {
            format!(
                "the solid is not all of the mesh: {}: what encloses nothing, or is thinner than a cell where it was rebuilt, is gone, and \
                 parts that overlap count once",
                lost.join(", ")
            )
        })
    }

    /// The error where nearly all is lost.
    pub(super) fn refusal(&self, cell: f64) -> String {
        let [area, area_now] = self.areas;
        format!(
            "nearly all of the mesh would be lost: of {area:.6} m2 {area_now:.6} would be left in cells of {cell} m, as most of it encloses \
             no volume (`frazil mesh check` says what it is)"
        )
    }
}

/// Least and greatest corner (m) of the vertices that triangles name.
fn named_bounds(mesh: &TriMesh) -> [DVec3; 2] {
    let nowhere = [DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY)];
    let corners =
        mesh.triangles.as_flattened().iter().map(|&vertex| mesh.positions[vertex as usize].cast::<f64>());
    corners.fold(nowhere, |[low, high], position| [low.inf(&position), high.sup(&position)])
}
