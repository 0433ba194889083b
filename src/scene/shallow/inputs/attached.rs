//! Positions attached to the triangles of a terrain, with which sources, drains and absorbers move.

use crate::context::Context;
use crate::geometry::check::deviation::{Nearest, NearestTree};
use crate::geometry::{DVec3, TriMesh};
use crate::scene::shallow::Shallow;

/// A triangle is degenerate if its height over the longest edge is at most this fraction of that edge.
const NEEDLE: f64 = 1e-10;

/// A position on a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene::shallow) struct Attached {
    triangle: usize,
    /// Barycentric weights of its corners; they sum to 1.
    shares: [f64; 3],
}

impl Attached {
    fn of(nearest: &Nearest, mesh: &TriMesh) -> Self {
        let shares = shares(corners(mesh, nearest.triangle), nearest.position);
        Self { triangle: nearest.triangle, shares }
    }

    /// Its position on a mesh with these triangles (m).
    pub fn position(&self, mesh: &TriMesh) -> [f64; 3] {
        let [a, b, c] = corners(mesh, self.triangle);
        let [of_a, of_b, of_c] = self.shares;
        (a * of_a + b * of_b + c * of_c).into()
    }
}

/// For each flow point of a scene that follows the terrain, the nearest position on the terrain's mesh at the first frame.
pub(in crate::scene::shallow) fn attach(
    ctx: &Context,
    setup: &Shallow,
    mesh: &TriMesh,
) -> Vec<Option<Attached>> {
    if setup.points.iter().all(|point| !point.follows) {
        return vec![None; setup.points.len()];
    }
    let tree = ctx.pool().install(|| NearestTree::new(mesh));
    let attach = |at: [f64; 3]| tree.nearest(at.into()).map(|nearest| Attached::of(&nearest, mesh));
    setup.points.iter().map(|point| attach(point.flow_point.at).filter(|_| point.follows)).collect()
}

fn corners(mesh: &TriMesh, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].map(|vertex| mesh.positions[vertex as usize].cast())
}

/// Barycentric weights of a position on a triangle.
fn shares(corners: [DVec3; 3], position: DVec3) -> [f64; 3] {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let square = normal.norm_squared();
    let edges = [b - a, c - b, a - c];
    let lengths = edges.map(|edge| edge.norm_squared());
    let longest = lengths.into_iter().fold(0.0, f64::max);
    if square <= NEEDLE * NEEDLE * longest * longest {
        // A degenerate triangle is treated as its longest edge, or as its first corner if all of them coincide.
        let from = lengths.iter().position(|length| *length == longest).unwrap_or(0);
        let along = (position - corners[from]).dot(&edges[from]);
        let share = if longest > 0.0 { (along / longest).clamp(0.0, 1.0) } else { 0.0 };
        let mut shares = [0.0; 3];
        (shares[from], shares[(from + 1) % 3]) = (1.0 - share, share);
        return shares;
    }
    let share = |corner: usize| {
        let (from, edge) = (corners[(corner + 1) % 3], edges[(corner + 1) % 3]);
        (edge.cross(&(position - from)).dot(&normal) / square).clamp(0.0, 1.0)
    };
    let of_b = share(1);
    let of_c = share(2).min(1.0 - of_b);
    [1.0 - of_b - of_c, of_b, of_c]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn a_position_moves_as_its_triangle_does() {
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let flat =
            vec![corner(0.0, 0.0, 0.0), corner(0.0, 0.0, 2.0), corner(2.0, 0.0, 2.0), corner(2.0, 0.0, 0.0)];
        let mesh = TriMesh { positions: flat, triangles };
        // An affine map of the plane, which keeps barycentric weights.
        let bend = |position: DVec3| {
            let [x, _, z]: [f64; 3] = position.into();
            DVec3::new(3.0 + 0.5 * x, 0.25 * x - z, z + 0.5 * x)
        };
        let bent = mesh.positions.iter().map(|position| bend(position.cast()).cast()).collect();
        let bent = TriMesh { positions: bent, triangles: mesh.triangles.clone() };
        let tree = NearestTree::new(&mesh);
        for (at, on) in [
            ([0.5, 3.0, 1.5], [0.5, 0.0, 1.5]),
            ([1.75, -1.0, 0.25], [1.75, 0.0, 0.25]),
            ([1.0, 0.0, 1.0], [1.0, 0.0, 1.0]),
            // Outside it, on an edge and on a corner.
            ([-1.0, 0.5, 0.75], [0.0, 0.0, 0.75]),
            ([5.0, 5.0, 5.0], [2.0, 0.0, 2.0]),
        ] {
            let attached = Attached::of(&tree.nearest(DVec3::from(at)).unwrap(), &mesh);
            let off = |mesh: &TriMesh, wanted: DVec3| (DVec3::from(attached.position(mesh)) - wanted).norm();
            let on = DVec3::from(on);
            assert!(off(&mesh, on) < 1e-15 && off(&bent, bend(on)) < 1e-15, "{at:?}: {attached:?}");
        }
    }

    #[test]
    fn needles_have_positions_too() {
        let [a, b] = [DVec3::zeros(), DVec3::new(1.0, 0.0, 0.0)];
        let middle = DVec3::new(0.25, 0.0, 0.0);
        assert_eq!(shares([a, b, middle], DVec3::new(0.5, 0.0, 0.0)), [0.5, 0.5, 0.0]);
        assert_eq!(shares([middle, a, b], DVec3::new(0.5, 0.0, 0.0)), [0.0, 0.5, 0.5]);
        assert_eq!(shares([b, middle, a], DVec3::new(0.25, 0.0, 0.0)), [0.25, 0.0, 0.75]);
        assert_eq!(shares([a; 3], b), [1.0, 0.0, 0.0]);
    }
}
