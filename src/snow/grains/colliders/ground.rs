//! Ground as a collider: a mesh that does not move and has a front side, on which grains stay.
//!
//! The front of a solid is its outside. A sheet is oriented as in the base layer: faces that disagree with their neighbours follow the
//! larger part, and the sheet as a whole faces up. Beyond its rim a sheet has no front: grains may fall past it.

use rayon::prelude::*;

use super::shell::{RIM_CORNER, Shell};
use crate::geometry::mesh::weld::Weld;
use crate::geometry::{DVec3, TriMesh};

/// A mesh that does not move and has a front.
#[derive(Clone)]
pub struct Ground {
    pub(in crate::snow::grains) shell: Shell,
}

/// Friction of grains against the floor, ground and static meshes.
pub const FRICTION: f32 = 0.5;

impl Ground {
    /// The ground formed by a mesh (m).
    pub fn new(mesh: &TriMesh) -> Self {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
        let sides = HalfEdges::of(&mesh.triangles, &positions);
        let mut triangles = sides.reoriented(&mesh.triangles, &positions);
        if sides.is_closed() && six_volumes(&triangles, &positions) < 0.0
            || !sides.is_closed() && area_up(&triangles, &positions) < 0.0
        {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        let rims = |triangles: &[[u32; 3]]| HalfEdges::of(triangles, &positions).rims(triangles.len());
        Self { shell: Shell::ground(FRICTION, triangles, rims, positions.clone()) }
    }

    /// Whether a mesh bounds a solid, so that it can be ground: each of its edges belongs to an even number of faces.
    pub fn is_solid(mesh: &TriMesh) -> bool {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
        !mesh.triangles.is_empty() && HalfEdges::of(&mesh.triangles, &positions).is_closed()
    }

    /// Whether a position (m) is behind it, at most `within` (m) deep.
    pub fn is_behind(&self, position: DVec3, within: f64) -> bool {
        self.shell.is_behind(position, within)
    }
}

/// The half-edges of a mesh, sorted by edge; coincident corners count as one.
struct HalfEdges {
    sides: Vec<HalfEdge>,
    /// The corner that each corner coincides with.
    same: Vec<u32>,
}

/// A half-edge: a side of one triangle.
#[derive(Clone, Copy)]
struct HalfEdge {
    /// Its ends, the smaller index first.
    edge: [u32; 2],
    triangle: u32,
    /// The corner opposite to it.
    corner: u8,
    /// Whether it runs from the smaller index to the larger.
    ascends: bool,
}

impl HalfEdges {
    fn of(triangles: &[[u32; 3]], positions: &[DVec3]) -> Self {
        let same = Weld::of(positions, triangles).firsts;
        let side = |(index, triangle): (usize, &[u32; 3])| {
            let ends = triangle.map(|vertex| same[vertex as usize]);
            [0, 1, 2].map(|corner: usize| {
                let [a, b] = [ends[(corner + 1) % 3], ends[(corner + 2) % 3]];
                let edge = [a.min(b), a.max(b)];
                HalfEdge { edge, triangle: index as u32, corner: corner as u8, ascends: a < b }
            })
        };
        let has_area = |sides: &[HalfEdge; 3]| sides.iter().all(|side| side.edge[0] != side.edge[1]);
        let mut sides: Vec<HalfEdge> =
            triangles.iter().enumerate().map(side).filter(has_area).flatten().collect();
        sides.par_sort_unstable_by_key(|side| (side.edge, side.triangle, side.corner));
        Self { sides, same }
    }

    /// The sides along each edge.
    fn edges(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.sides.chunk_by(|a, b| a.edge == b.edge)
    }

    fn is_closed(&self) -> bool {
        self.edges().all(|sides| sides.len() % 2 == 0)
    }

    /// The triangles, flipped so that neighbours agree, with the original orientation of most of each component's area.
    fn reoriented(&self, triangles: &[[u32; 3]], positions: &[DVec3]) -> Vec<[u32; 3]> {
        let pairs = self.edges().filter_map(|sides| match sides {
            [a, b] => Some((a.triangle, b.triangle, a.ascends == b.ascends)),
            _ => None,
        });
        let mut links: Vec<(u32, u32, bool)> =
            pairs.flat_map(|(a, b, differ)| [(a, b, differ), (b, a, differ)]).collect();
        links.par_sort_unstable();
        let mut out = triangles.to_vec();
        if !links.iter().any(|(_, _, differ)| *differ) {
            return out;
        }
        let mut turns: Vec<Option<bool>> = vec![None; triangles.len()];
        for first in 0..triangles.len() {
            if turns[first].is_some() {
                continue;
            }
            turns[first] = Some(false);
            let mut component = vec![first];
            let mut next = 0;
            while let Some(&at) = component.get(next) {
                next += 1;
                let from = links.partition_point(|link| link.0 < at as u32);
                for &(_, other, differ) in links[from..].iter().take_while(|link| link.0 == at as u32) {
                    let other = other as usize;
                    if turns[other].is_none() {
                        turns[other] = turns[at].map(|turn| turn != differ);
                        component.push(other);
                    }
                }
            }
            let area = |triangle: &usize| {
                let [a, b, c] = triangles[*triangle].map(|vertex| positions[vertex as usize]);
                (b - a).cross(&(c - a)).norm()
            };
            let is_turned = |triangle: &&usize| turns[**triangle] == Some(true);
            let turned: f64 = component.iter().filter(is_turned).map(area).sum();
            let all: f64 = component.iter().map(area).sum();
            for triangle in component {
                if turns[triangle] == Some(2.0 * turned <= all) {
                    out[triangle].swap(1, 2);
                }
            }
        }
        out
    }

    /// The bits of each triangle's rim.
    fn rims(&self, count: usize) -> Vec<u8> {
        let mut rims = vec![0u8; count];
        let mut ends = vec![false; self.same.len()];
        for sides in self.edges() {
            if let [only] = sides {
                rims[only.triangle as usize] |= 1 << only.corner;
                only.edge.iter().for_each(|&end| ends[end as usize] = true);
            }
        }
        for side in &self.sides {
            // The two corners that are not opposite.
            let [low, high] = side.edge;
            let [first, second] = if side.ascends { [low, high] } else { [high, low] };
            for (end, corner) in [(first, (side.corner + 1) % 3), (second, (side.corner + 2) % 3)] {
                if ends[end as usize] {
                    rims[side.triangle as usize] |= 1 << (RIM_CORNER + corner);
                }
            }
        }
        rims
    }
}

/// Six times the volume (m3) of a solid whose faces run counter-clockwise seen from outside.
fn six_volumes(triangles: &[[u32; 3]], positions: &[DVec3]) -> f64 {
    // Relative to one of the positions, so that no precision is lost far from the world's origin.
    let origin = positions.first().copied().unwrap_or_default();
    let six = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize] - origin);
        a.dot(&b.cross(&c))
    };
    triangles.iter().map(six).sum()
}

/// Twice the difference (m2), seen from above, between the area that faces up and the area that faces down.
fn area_up(triangles: &[[u32; 3]], positions: &[DVec3]) -> f64 {
    let up = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        (b - a).cross(&(c - a)).y
    };
    triangles.iter().map(up).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet over the square from 0 to 1 m, with heights given by a function.
    fn sheet(height: impl Fn(f64, f64) -> f64) -> TriMesh {
        let at = |index: u32| f64::from(index) / 8.0;
        let corners = (0..9).flat_map(|x| (0..9).map(move |z| (at(x), at(z))));
        let mut mesh = TriMesh::default();
        mesh.positions.extend(corners.map(|(x, z)| DVec3::new(x, height(x, z), z).cast::<f32>()));
        for (x, z) in (0..8).flat_map(|x| (0..8).map(move |z| (x, z))) {
            let at = x * 9 + z;
            mesh.triangles.extend([[at, at + 1, at + 10], [at, at + 10, at + 9]]);
        }
        mesh
    }

    #[test]
    fn a_sheet_has_a_front_above_and_none_beyond_its_rim_however_its_faces_are_turned() {
        let slope = sheet(|x, z| 0.8 * x + 0.1 * z * z);
        for turned in 0..4 {
            let mut mesh = slope.clone();
            let is_turned =
                |index: usize| [false, true, index.is_multiple_of(3), !index.is_multiple_of(3)][turned];
            let triangles = mesh.triangles.iter_mut().enumerate();
            triangles.filter(|(index, _)| is_turned(*index)).for_each(|(_, triangle)| triangle.swap(0, 1));
            let ground = Ground::new(&mesh);
            assert!(!Ground::is_solid(&mesh));
            for (x, z) in [(0.5, 0.5), (0.11, 0.93), (0.25, 0.25), (0.9, 0.1)] {
                let height = 0.8 * x + 0.1 * z * z;
                assert!(!ground.is_behind(DVec3::new(x, height + 0.02, z), 0.1), "{turned}: above {x} {z}");
                assert!(ground.is_behind(DVec3::new(x, height - 0.02, z), 0.1), "{turned}: below {x} {z}");
                assert!(!ground.is_behind(DVec3::new(x, height - 0.5, z), 0.1), "{turned}: deep");
            }
            for at in [[-0.05, -0.1, 0.5], [0.5, 0.3, 1.03], [-0.02, -0.05, -0.02], [1.05, 0.85, 0.5]] {
                assert!(!ground.is_behind(DVec3::from(at), 0.2), "{turned}: beyond the rim at {at:?}");
            }
        }
    }

    #[test]
    fn the_front_of_a_solid_is_its_outside() {
        let mut cube = TriMesh::cuboid([0.0; 3], [1.0; 3]);
        for turned in [false, true] {
            if turned {
                cube.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
            }
            assert!(Ground::is_solid(&cube));
            let ground = Ground::new(&cube);
            assert!(ground.is_behind(DVec3::new(0.5, 0.95, 0.5), 0.1), "{turned}");
            assert!(!ground.is_behind(DVec3::new(0.5, 1.05, 0.5), 0.1), "{turned}");
            assert!(!ground.is_behind(DVec3::new(1.02, 1.02, 1.02), 0.1), "{turned}");
        }
    }
}
