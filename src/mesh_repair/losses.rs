//! How much of a mesh a repair has lost, by area, volume and bounds.

use super::prepare::Closed;
use crate::geometry::check::faults::counted_area;
use crate::geometry::{DVec3, TriMesh, Vec3};

/// If less than this share of the area or of the volume is left, something is missing.
const HALF: f64 = 0.5;
/// If less than this share is left, nearly all is missing.
const NEARLY_NONE: f64 = 0.1;
/// Bounds may shrink without a warning by this share of the longest side or by this many cells, whichever is more.
const SHRUNK: f64 = 0.05;
const CELLS: f64 = 2.0;

/// A mesh before and after a repair.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Losses {
    /// Areas (m2) before and after; the area before excludes triangles that lie on others.
    pub areas: [f64; 2],
    /// Volumes (m3) before and after; the volume before is that of the closed mesh with each part turned outward, so that overlapping parts
    /// count twice.
    pub volumes: [f64; 2],
    /// Longest sides of the bounding boxes (m) before and after.
    pub sides: [f64; 2],
    /// Largest shrinkage of the box on any side (m).
    pub shrunk: f64,
}

impl Losses {
    /// Compares a mesh, its closed version and the result.
    pub(super) fn of(before: &TriMesh, closed: &Closed, after: &TriMesh) -> Self {
        let volume = closed.mesh.volume();
        let [old, new] = [before, after].map(bounds);
        let side = |[low, high]: [DVec3; 2]| (high - low).max().max(0.0);
        let shrunk = (new[0] - old[0]).sup(&(old[1] - new[1])).max();
        Self {
            areas: [counted_area(before), after.area()],
            volumes: [volume, after.volume()],
            sides: [side(old), side(new)],
            shrunk: if shrunk.is_finite() { shrunk.max(0.0) } else { side(old) },
        }
    }

    /// Whether nearly all of the mesh is lost: most of its area, and with it most of its extent or volume. Parts that lie within others have
    /// area, but contribute neither extent nor volume.
    pub fn is_nearly_all(&self) -> bool {
        let is_flat = self.volumes[1] < NEARLY_NONE * self.volumes[0];
        self.areas[1] < NEARLY_NONE * self.areas[0] && (is_flat || self.shrunk > HALF * self.sides[0])
    }

    /// A warning if much is lost; `cell` is the edge of a cell (m).
    pub fn warning(&self, cell: f64) -> Option<String> {
        let [area, area_now] = self.areas;
        let [volume, volume_now] = self.volumes;
        let mut lost = Vec::new();
        if self.shrunk > (SHRUNK * self.sides[0]).max(CELLS * cell) {
            lost.push(format!("its box has shrunk by {:.4} m on a side", self.shrunk));
        }
        if volume_now < HALF * volume {
            lost.push(format!("{volume_now:.6} of {volume:.6} m3 are left"));
        }
        // Overlapping parts lose area together with volume.
        if area_now < HALF * area && (volume_now < HALF * volume || !lost.is_empty()) {
            lost.push(format!("{area_now:.6} of {area:.6} m2 are left"));
        }
        (!lost.is_empty()).then(|| {
            format!(
                "the solid lacks parts of the mesh: {}: what encloses nothing, or is thinner than a cell where it was rebuilt, is gone, and \
                 parts that overlap count once",
                lost.join(", ")
            )
        })
    }

    /// The error text if nearly all is lost.
    pub(super) fn refusal(&self, cell: f64) -> String {
        let [area, area_now] = self.areas;
        format!(
            "nearly all of the mesh would be lost: {area_now:.6} of {area:.6} m2 would be left in cells of {cell} m, as most of it encloses \
             no volume (`frazil mesh check` shows why)"
        )
    }
}

/// Minimum and maximum corner (m) of a mesh; without triangles, infinity and -infinity.
fn bounds(mesh: &TriMesh) -> [DVec3; 2] {
    let empty = (Vec3::repeat(f32::INFINITY), Vec3::repeat(f32::NEG_INFINITY));
    let (low, high) = mesh.bounds().unwrap_or(empty);
    [low.cast(), high.cast()]
}
