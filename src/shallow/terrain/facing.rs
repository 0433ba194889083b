//! The direction that the triangles of a terrain face: closed parts outward.

use crate::geometry::TriMesh;
use crate::geometry::check::orientation::{Closing, Orientation};

/// The orientation of a terrain's mesh, or of a mesh that stands on it. Open sheets stay as they are, as a sheet that faces up is ground.
/// But if the whole mesh is inside out (its closed parts judged by their volume, its sheets all facing down), the sheets are flipped with
/// it.
pub fn facing(mesh: &TriMesh) -> Orientation {
    let mut orientation = Orientation::of_mesh(mesh, Closing::Below);
    if orientation.has_open() && orientation.volumes()[0] < 0.0 {
        let faces_down = |triangle: usize| {
            let [a, b, c] = mesh.corners(triangle);
            let up = (b - a).cross(&(c - a)).y;
            if orientation.is_turned(triangle) { up >= 0.0 } else { up <= 0.0 }
        };
        if (0..mesh.triangles.len()).filter(|at| orientation.is_open(*at)).all(faces_down) {
            orientation.turn_open();
        }
    }
    orientation
}
