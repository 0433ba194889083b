//! Meshes of polygons, and their triangles.

use super::mesh::validate;
use super::{DVec3, TriMesh, Vec3};
use crate::error::Result;

/// Polygons as files hold them: with any number of corners, convex or not, hardly ever quite flat.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PolygonMesh {
    /// Vertex positions (m).
    pub positions: Vec<Vec3>,
    /// Vertex indices of all polygons, one after another, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
    /// Where each polygon ends in `corners`.
    pub ends: Vec<u32>,
}

impl PolygonMesh {
    /// Adds a polygon; one of fewer than three corners is passed over.
    pub fn push(&mut self, polygon: impl IntoIterator<Item = u32>) {
        let begin = self.corners.len();
        self.corners.extend(polygon);
        if self.corners.len() - begin < 3 {
            return self.corners.truncate(begin);
        }
        self.ends.push(self.corners.len() as u32);
    }

    /// Checks that there is a polygon, that positions are finite and indices in range.
    ///
    /// # Errors
    /// Names the first vertex or face at fault, counted from 1.
    pub fn validate(&self) -> Result<()> {
        validate(&self.positions, self.polygons())
    }

    /// The vertex indices of each polygon.
    pub fn polygons(&self) -> impl Iterator<Item = &[u32]> {
        let begins = std::iter::once(&0).chain(&self.ends);
        begins.zip(&self.ends).map(|(&begin, &end)| &self.corners[begin as usize..end as usize])
    }

    /// Whether another mesh has the same vertices and polygons, wherever the vertices are.
    pub fn has_faces_of(&self, other: &Self) -> bool {
        self.positions.len() == other.positions.len()
            && self.corners == other.corners
            && self.ends == other.ends
    }

    /// The polygons as triangles: a fan where the polygon is convex, else ears cut off one after another.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut out = Vec::with_capacity(self.corners.len().saturating_sub(2 * self.ends.len()));
        self.polygons().for_each(|polygon| self.cut(polygon, &mut out));
        out
    }

    /// The mesh in triangles.
    pub fn into_triangles(self) -> TriMesh {
        TriMesh { triangles: self.triangles(), positions: self.positions }
    }

    fn cut(&self, polygon: &[u32], out: &mut Vec<[u32; 3]>) {
        if let &[a, b, c] = polygon {
            return out.push([a, b, c]);
        }
        let fan = || (1..polygon.len() - 1).map(|i| [polygon[0], polygon[i], polygon[i + 1]]);
        // Indices beyond the vertices are left for the check of the whole mesh to refuse.
        let places: Option<Vec<DVec3>> =
            polygon.iter().map(|&i| self.positions.get(i as usize).map(|p| p.cast())).collect();
        let Some(places) = places else { return out.extend(fan()) };
        let flat = flattened(&places);
        let count = polygon.len();
        if (0..count).all(|i| turn(flat[(i + count - 1) % count], flat[i], flat[(i + 1) % count]) >= 0.0) {
            return out.extend(fan());
        }
        let mut left: Vec<usize> = (0..count).collect();
        while left.len() > 3 {
            // A polygon that crosses itself may have no ear: the corner that comes nearest to one then goes.
            let ear =
                (0..left.len()).find(|&at| is_ear(&flat, &left, at)).unwrap_or_else(|| widest(&flat, &left));
            let [before, _, after] = around(&left, ear);
            out.push([before, left[ear], after].map(|i| polygon[i]));
            left.remove(ear);
        }
        out.push([left[0], left[1], left[2]].map(|i| polygon[i]));
    }
}

/// Positions in the plane that a polygon mostly lies in (Newell's normal), counter-clockwise.
fn flattened(places: &[DVec3]) -> Vec<[f64; 2]> {
    let next = places.iter().cycle().skip(1);
    let normal: DVec3 = places.iter().zip(next).map(|(p, q)| (p - places[0]).cross(&(q - places[0]))).sum();
    let length = normal.norm();
    if length == 0.0 {
        return vec![[0.0; 2]; places.len()];
    }
    let normal = normal / length;
    let least = normal.iamin();
    let across = normal.cross(&DVec3::ith(least, 1.0)).normalize();
    let up = normal.cross(&across);
    places.iter().map(|p| [(p - places[0]).dot(&across), (p - places[0]).dot(&up)]).collect()
}

/// Twice the area of a triangle, positive when it is counter-clockwise.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The corners before, at and after a place.
fn around(left: &[usize], at: usize) -> [usize; 3] {
    [left[(at + left.len() - 1) % left.len()], left[at], left[(at + 1) % left.len()]]
}

fn is_ear(flat: &[[f64; 2]], left: &[usize], at: usize) -> bool {
    let [a, b, c] = around(left, at).map(|i| flat[i]);
    let holds = |p: [f64; 2]| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    let others = left.iter().map(|&i| flat[i]).filter(|p| ![a, b, c].contains(p));
    turn(a, b, c) > 0.0 && !others.into_iter().any(holds)
}

fn widest(flat: &[[f64; 2]], left: &[usize]) -> usize {
    let area = |at: usize| {
        let [a, b, c] = around(left, at).map(|i| flat[i]);
        turn(a, b, c)
    };
    (1..left.len()).fold(0, |best, at| if area(at) > area(best) { at } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(points: &[[f32; 2]]) -> PolygonMesh {
        let positions = points.iter().map(|[x, z]| Vec3::new(*x, 0.3 * x + 0.1 * z, -z)).collect();
        let mut mesh = PolygonMesh { positions, ..PolygonMesh::default() };
        mesh.push(0..points.len() as u32);
        mesh
    }

    #[test]
    fn a_concave_polygon_keeps_its_area_and_no_triangle_is_turned_round() {
        let comb = [
            [0.0, 0.0],
            [5.0, 0.0],
            [5.0, 3.0],
            [4.0, 3.0],
            [4.0, 1.0],
            [3.0, 1.0],
            [3.0, 3.0],
            [2.0, 3.0],
            [2.0, 1.0],
            [0.0, 2.0],
        ];
        for start in 0..comb.len() {
            let mut points = comb;
            points.rotate_left(start);
            let mesh = flat(&points).into_triangles();
            assert_eq!(mesh.triangles.len(), comb.len() - 2);
            let area: DVec3 = (0..mesh.triangles.len())
                .map(|t| mesh.corners(t))
                .map(|[a, b, c]| (b - a).cross(&(c - a)) / 2.0)
                .sum();
            assert!((area.norm() - mesh.area()).abs() < 1e-6, "from {start}: {area} and {}", mesh.area());
        }
    }

    #[test]
    fn a_convex_polygon_is_a_fan_and_a_bow_tie_still_has_triangles() {
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(square.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]).triangles().len(), 2);
        assert_eq!(flat(&[[0.0, 0.0]; 5]).triangles().len(), 3);
        let mut beyond = square;
        beyond.push([0, 1, 2, 9]);
        assert_eq!(beyond.triangles().len(), 4);
    }
}
