//! Triangle meshes.

pub mod attributes;
pub mod normals;
pub mod polygons;
pub mod uvs;
pub mod weld;

use super::check::edges::{Use, edge_uses, imbalance, is_same_edge};
use super::shape::{normal, six_volumes};
use super::{DVec3, Vec3};
use crate::error::{Error, Result, fail_if};

/// A triangle mesh: positions in metres, counter-clockwise triangles seen from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions (m).
    pub positions: Vec<Vec3>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// A closed box between two opposite corners (m), the first the minimum on each axis; triangles are counter-clockwise seen from
    /// outside.
    pub fn cuboid(low: [f32; 3], high: [f32; 3]) -> Self {
        // Bit n of a vertex index is the end that it has on axis n.
        let position = |n: u32| {
            Vec3::from([0, 1, 2].map(|axis| if n >> axis & 1 == 0 { low[axis] } else { high[axis] }))
        };
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self { positions: (0..8).map(position).collect(), triangles }
    }

    /// Triangles of three consecutive positions each.
    pub fn soup(positions: Vec<Vec3>) -> Self {
        let triangles = (0..positions.len() as u32 / 3).map(|at| [3 * at, 3 * at + 1, 3 * at + 2]).collect();
        Self { positions, triangles }
    }

    /// Checks that there is a triangle, that positions are finite and indices in range.
    ///
    /// # Errors
    /// Names the first invalid vertex or triangle, counted from 1.
    pub fn validate(&self) -> Result<()> {
        validate(&self.positions, self.triangles.iter().map(|triangle| triangle.as_slice()))
    }

    /// Corners of a triangle in 64 bits.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|index| self.positions[index as usize].cast())
    }

    /// Minimum and maximum corner (m) of the triangles; `None` without any. Vertices that no triangle uses do not count.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.corner_positions().map(|p| (p, p)).reduce(|(low, high), (l, h)| (low.inf(&l), high.sup(&h)))
    }

    /// Largest absolute coordinate of the triangles' corners (m); 0 without any.
    pub fn farthest(&self) -> f64 {
        f64::from(self.corner_positions().map(|p| p.amax()).fold(0.0, f32::max))
    }

    /// Positions of the triangles' corners, in their order.
    fn corner_positions(&self) -> impl Iterator<Item = Vec3> {
        self.triangles.as_flattened().iter().map(|&vertex| self.positions[vertex as usize])
    }

    /// Unit normals of the vertices: means over the triangles around, weighted by area; zero where there is none.
    pub fn normals(&self) -> Vec<Vec3> {
        normals::smooth(&self.positions, &self.triangles)
    }

    /// Enclosed volume by the divergence theorem (m3); exact for a closed mesh.
    pub fn volume(&self) -> f64 {
        let Some((low, _)) = self.bounds() else { return 0.0 };
        let origin: DVec3 = low.cast();
        let six = (0..self.triangles.len()).map(|triangle| six_volumes(&self.corners(triangle), &origin));
        six.sum::<f64>() / 6.0 + 0.0
    }

    /// Surface area (m2).
    pub fn area(&self) -> f64 {
        let twice = (0..self.triangles.len()).map(|triangle| normal(&self.corners(triangle)).norm());
        twice.sum::<f64>() / 2.0 + 0.0
    }

    fn edge_uses(&self) -> Vec<Use> {
        edge_uses(self.positions.len(), &self.triangles)
    }

    /// Whether every edge is used as often in one direction as in the other.
    ///
    /// # Panics
    /// An index out of range: see [`TriMesh::validate`].
    pub fn is_closed(&self) -> bool {
        self.edge_uses().chunk_by(is_same_edge).all(|run| imbalance(&self.triangles, run) == 0)
    }

    /// Whether it is closed and no edge has more than two triangles.
    ///
    /// # Panics
    /// As [`TriMesh::is_closed`].
    pub fn is_manifold(&self) -> bool {
        let is_whole = |run: &[Use]| run.len() == 2 && imbalance(&self.triangles, run) == 0;
        self.edge_uses().chunk_by(is_same_edge).all(is_whole)
    }

    /// Vertices minus edges plus faces, counting only used vertices: 2 for a sphere.
    ///
    /// # Panics
    /// As [`TriMesh::is_closed`].
    pub fn euler_characteristic(&self) -> i64 {
        let used =
            used(self.positions.len(), &self.triangles).map_or(self.positions.len(), |used| used.len());
        let edges = self.edge_uses().chunk_by(is_same_edge).count();
        used as i64 - edges as i64 + self.triangles.len() as i64
    }

    /// The mesh with its triangles flipped.
    pub fn reversed(mut self) -> Self {
        self.triangles.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
        self
    }

    /// The mesh without the vertices that no triangle uses; the others keep their order.
    pub fn without_unused(self) -> Self {
        let Some(used) = used(self.positions.len(), &self.triangles) else { return self };
        let positions = used.iter().map(|&vertex| self.positions[vertex as usize]).collect();
        Self { positions, triangles: renumbered(&self.triangles, &used) }
    }

    /// Adds another mesh's triangles.
    pub fn append(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|index| index + first)));
    }
}

/// The vertices out of `count` that triangles use, ascending; `None` if they use all.
pub fn used(count: usize, triangles: &[[u32; 3]]) -> Option<Vec<u32>> {
    let mut is_used = vec![false; count];
    triangles.as_flattened().iter().for_each(|&vertex| is_used[vertex as usize] = true);
    let used = || (0..count as u32).filter(|&vertex| is_used[vertex as usize]).collect();
    is_used.contains(&false).then(used)
}

/// Triangles re-indexed to the vertices `used`, which ascend and include all that the triangles use.
pub fn renumbered(triangles: &[[u32; 3]], used: &[u32]) -> Vec<[u32; 3]> {
    let mut positions = vec![0; used.last().map_or(0, |&last| last as usize + 1)];
    used.iter().zip(0..).for_each(|(&vertex, position)| positions[vertex as usize] = position);
    triangles.iter().map(|triangle| triangle.map(|vertex| positions[vertex as usize])).collect()
}

/// The vertices out of `count` that triangles use, ascending, and the triangles re-indexed to these.
pub fn compact(count: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<[u32; 3]>) {
    let used = used(count, triangles).unwrap_or_else(|| (0..count as u32).collect());
    let triangles = renumbered(triangles, &used);
    (used, triangles)
}

/// Drops values whose mark is set; those beyond the marks stay.
pub fn drop_marked<T>(values: &mut Vec<T>, marks: &[bool]) {
    let mut marks = marks.iter();
    values.retain(|_| marks.next() != Some(&true));
}

/// Re-indexes corners to the items that remain when the marked ones are dropped; no corner may refer to a dropped item.
pub fn renumber_kept(corners: &mut [u32], is_dropped: &[bool]) {
    let mut kept = 0;
    let number = |is_dropped: &bool| {
        kept += u32::from(!is_dropped);
        kept - u32::from(!is_dropped)
    };
    let numbers: Vec<u32> = is_dropped.iter().map(number).collect();
    corners.iter_mut().for_each(|vertex| *vertex = numbers[*vertex as usize]);
}

/// Spacing of 32-bit numbers at a coordinate: the resolution of a mesh file there.
pub fn spacing(coordinate: f64) -> f64 {
    let at = coordinate.abs() as f32;
    f64::from(at.next_up()) - f64::from(at)
}

/// A warning about vertices or particles so far from the origin (in a file's unit of `scale` m) that their 32-bit coordinates are coarse
/// relative to a cell (m), with advice.
pub fn too_far_warning(name: &str, farthest: f64, scale: f64, cell: f64, advice: &str) -> Option<String> {
    // Rounding by half the gap may use up the default tolerance of a sweep: 0.02 cell.
    let gap = spacing(farthest) * scale;
    (gap > 0.04 * cell).then(|| {
        format!(
            "{name}: it reaches {:.0} m from the origin, where 32-bit numbers are {:.1} mm apart: {advice}",
            farthest * scale,
            gap * 1e3
        )
    })
}

/// As [`too_far_warning`], for a mesh as it is read (m), relative to the mean length of its edges.
pub fn coarse_warning(name: &str, mesh: &TriMesh, advice: &str) -> Option<String> {
    let lengths = (0..mesh.triangles.len()).map(|triangle| {
        let [a, b, c] = mesh.corners(triangle);
        (b - a).norm() + (c - b).norm() + (a - c).norm()
    });
    let edge = lengths.sum::<f64>() / (3 * mesh.triangles.len()).max(1) as f64;
    too_far_warning(name, mesh.farthest(), 1.0, edge, advice)
}

/// Advice for a mesh too far from the origin: a key of a scene, or an option of a command.
pub const BY_KEY: &str = "give it an `origin` nearby, which is subtracted in 64 bits, or save it near the origin and bring it there by keys";
/// See [`BY_KEY`].
pub const BY_OPTION: &str =
    "give --origin X,Y,Z nearby, which is subtracted in 64 bits, or save it near the origin";

/// Largest absolute coordinate of positions.
pub fn farthest<'a>(positions: impl Iterator<Item = &'a DVec3>) -> f64 {
    positions.map(|p| p.amax()).fold(0.0, f64::max)
}

/// For each position the index of the first equal one.
pub fn coincident(positions: impl Iterator<Item = DVec3>) -> Vec<u32> {
    // Adding zero turns -0 into 0.
    let keys: Vec<[u64; 3]> =
        positions.map(|p| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits)).collect();
    // Open addressing, at most half full: several times faster than a map; a host needs this in every step.
    let bits = (2 * keys.len().max(1)).next_power_of_two().ilog2().max(1);
    let mut slots = vec![u32::MAX; 1 << bits];
    let first = |(key, number): (&[u64; 3], u32)| {
        let mut slot = home(key, bits);
        loop {
            match slots[slot] {
                u32::MAX => {
                    slots[slot] = number;
                    return number;
                }
                other if keys[other as usize] == *key => return other,
                _ => slot = (slot + 1) & ((1 << bits) - 1),
            }
        }
    };
    keys.iter().zip(0..).map(first).collect()
}

/// The slot of a key in a hash table of 2^`bits` slots.
fn home(key: &[u64; 3], bits: u32) -> usize {
    let mixed = key.iter().fold(0u64, |hash, part| {
        let hash = (hash.rotate_left(23) ^ part).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        hash ^ hash >> 32
    });
    (mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - bits)) as usize
}

/// Checks the vertices and faces of a mesh.
pub(super) fn validate<'a>(positions: &[Vec3], faces: impl Iterator<Item = &'a [u32]>) -> Result<()> {
    let mut faces = faces.peekable();
    fail_if(faces.peek().is_none(), || Error::argument("the mesh has no faces"))?;
    let finite = |p: &Vec3| p.iter().all(|value| value.is_finite());
    if let Some(vertex) = positions.iter().position(|p| !finite(p)) {
        return Err(Error::argument(format!("vertex {} is not finite", vertex + 1)));
    }
    let count = positions.len();
    let is_out_of_range = |face: &[u32]| face.iter().any(|&index| index as usize >= count);
    if let Some(face) = faces.position(is_out_of_range) {
        let what = format!("face {} names a vertex beyond the {count} there are", face + 1);
        return Err(Error::argument(what));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::test_meshes::tetrahedron;

    #[test]
    fn a_cuboid_is_closed_and_faces_outward() {
        let cuboid = TriMesh::cuboid([-1.0, 0.0, 2.0], [1.0, 3.0, 2.5]);
        assert!(cuboid.is_closed() && cuboid.is_manifold());
        assert_eq!((cuboid.volume(), cuboid.area()), (3.0, 2.0 * (6.0 + 1.0 + 1.5)));
    }

    #[test]
    fn a_tetrahedron_has_its_volume_area_and_genus() {
        let mesh = tetrahedron(0.0);
        assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-12);
        assert!((mesh.area() - (1.5 + 0.75f64.sqrt())).abs() < 1e-7);
        assert!(mesh.is_manifold());
        assert_eq!(mesh.euler_characteristic(), 2);
    }

    #[test]
    fn coordinates_far_from_the_origin_are_reported() {
        assert_eq!(spacing(60_000.0), 1.0 / 256.0);
        assert_eq!(too_far_warning("a.obj", 1_200.0, 1.0, 0.0075, BY_KEY), None);
        let said = too_far_warning("a.obj", 60_000.0, 1.0, 0.0075, BY_KEY).unwrap();
        assert!(said.contains("a.obj") && said.contains("60000 m") && said.contains("3.9 mm"), "{said}");
        assert!(too_far_warning("a.obj", 6_000_000.0, 0.01, 0.0075, BY_KEY).is_some());
    }

    #[test]
    fn a_missing_face_and_bad_numbers_are_seen() {
        let mut mesh = tetrahedron(0.0);
        mesh.triangles.pop();
        assert!(!mesh.is_closed());
        mesh.positions[2].y = f32::NAN;
        assert_eq!(mesh.validate().unwrap_err().to_string(), "vertex 3 is not finite");
        mesh.positions[2].y = 0.0;
        mesh.triangles[1][0] = 9;
        assert!(mesh.validate().unwrap_err().to_string().starts_with("face 2 "));
    }
}
