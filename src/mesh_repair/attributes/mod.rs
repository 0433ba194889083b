//! Carries attributes and texture coordinates over to a changed mesh.
//!
//! Vertices and triangles that are still there keep their values bit for bit. New ones take those of positions on the old mesh: a new
//! vertex those of the nearest position, the corners of a new triangle those of positions on a single old triangle, its chart, so that it
//! never crosses a seam. Where the liquid's position at the first frame is known, the mesh of that frame is used instead
//! (`attributes/traced.rs`).

pub(in crate::mesh_repair) mod charts;
mod texture;
pub(in crate::mesh_repair) mod traced;
pub(in crate::mesh_repair) mod weights;

use rayon::prelude::*;

use super::Source;
use crate::geometry::check::deviation::NearestTree;
use crate::geometry::mesh::attributes::{DetailedMesh, MeshArray, On};
use crate::geometry::{DVec3, TriMesh, Uvs, Vec3};
use charts::Traced;
use traced::is_mask;
use weights::{Weights, at_corner, blended, heaviest, interpolated, weights};

/// Vertices or triangles per task.
pub(super) const GRAIN: usize = 1024;

/// Carries the arrays and texture coordinates of `detail` over to the changed mesh `mesh`; `vertices` gives the old vertex of each vertex,
/// and `sources` the origin of each triangle.
///
/// Old vertices keep their values, and so do triangles that are [`Source::Whole`], with their corners. The corners of a [`Source::Part`]
/// take the values at their positions in the triangle that it is a part of, those of a [`Source::New`] at the nearest positions on the old
/// triangle that is nearest to its middle; new vertices take those at the nearest position on the old mesh. Floats are interpolated there,
/// and so are colours in 8-bit integers (`red`, `green`, `blue`, `alpha`); other integers are those of the nearest corner. If vertices with
/// different texture coordinates were joined, coordinates are then stored at the corners. In other vertex arrays, joined vertices keep the
/// value of the first.
///
/// With `traced`, new geometry takes the values of the first frame instead, where it is known what the liquid there had then, and an array
/// [`Traced::MASK`] is added.
pub fn carried(
    detail: &DetailedMesh,
    mesh: TriMesh,
    vertices: &[Option<u32>],
    sources: &[Source],
    traced: Option<&Traced<'_>>,
) -> DetailedMesh {
    let mut out = match &detail.arrays[..] {
        [mask] if traced.is_some() && detail.uvs.is_none() && is_mask(mask) => of_mask(mask, mesh, sources),
        _ => from_old_mesh(detail, mesh, vertices, sources, traced.is_some()),
    };
    if let Some(traced) = traced {
        traced.apply(&mut out, vertices, sources);
    }
    out
}

/// The values that come from the previous mesh alone. In a tracked mesh no vertices were joined, but remaining vertices may have absorbed
/// others.
fn from_old_mesh(
    detail: &DetailedMesh,
    mesh: TriMesh,
    vertices: &[Option<u32>],
    sources: &[Source],
    is_tracked: bool,
) -> DetailedMesh {
    if detail.uvs.is_none() && detail.arrays.is_empty() {
        return DetailedMesh { mesh, ..DetailedMesh::default() };
    }
    if detail.mesh.triangles.is_empty() {
        return zeros(detail, mesh);
    }
    let origins = Origins::of(&detail.mesh, &mesh, vertices, sources);
    let uvs = detail.uvs.as_ref().map(|uvs| origins.uvs(uvs, &mesh.triangles, sources, is_tracked));
    let arrays = detail.arrays.iter().map(|array| origins.array(array)).collect();
    DetailedMesh { mesh, uvs, arrays }
}

/// As [`from_old_mesh`], for a mesh that carries only the mask of rebuilt faces: no positions are needed.
fn of_mask(mask: &MeshArray, mesh: TriMesh, sources: &[Source]) -> DetailedMesh {
    let value = |source: &Source| match *source {
        Source::Whole(triangle) | Source::Part(triangle) => mask.values[triangle as usize],
        Source::New => 1.0,
    };
    let values = sources.iter().map(value).collect();
    DetailedMesh { mesh, uvs: None, arrays: vec![mask.with(values)] }
}

/// Attributes of a mesh that has no old mesh to take them from: zeros.
fn zeros(detail: &DetailedMesh, mesh: TriMesh) -> DetailedMesh {
    let [vertices, faces] = [mesh.positions.len(), mesh.triangles.len()];
    let array = |array: &MeshArray| array.with(vec![0.0; array.on.count(vertices, faces)]);
    let uvs = |uvs: &Uvs| Uvs::zeros(uvs.corners.is_some(), vertices, faces);
    let (arrays, uvs) = (detail.arrays.iter().map(array).collect(), detail.uvs.as_ref().map(uvs));
    DetailedMesh { mesh, uvs, arrays }
}

/// Where a vertex takes its values from.
enum Origin {
    /// A vertex of the old mesh.
    Vertex(u32),
    /// A position on a triangle of the old mesh.
    Position(usize, Weights),
}

/// The origins of all values.
struct Origins<'a> {
    /// The triangles of the old mesh.
    old: &'a [[u32; 3]],
    /// For each vertex.
    vertices: Vec<Origin>,
    /// For each triangle: its chart, a triangle of the old mesh, and the positions of its corners there.
    triangles: Vec<(usize, [Weights; 3])>,
}

impl<'a> Origins<'a> {
    /// For a mesh that was made from another one, which has triangles.
    fn of(old: &'a TriMesh, new: &TriMesh, vertices: &[Option<u32>], sources: &[Source]) -> Self {
        let tree = NearestTree::new(old);
        let nearest = |position: DVec3| tree.nearest(position).map_or(0, |nearest| nearest.triangle);
        let vertex = |(own, position): (&Option<u32>, &Vec3)| match own {
            Some(vertex) => Origin::Vertex(*vertex),
            None => {
                let position = position.cast();
                let triangle = nearest(position);
                Origin::Position(triangle, weights(&old.corners(triangle), position))
            }
        };
        let triangle = |(number, source): (usize, &Source)| {
            let chart = match *source {
                Source::Whole(chart) | Source::Part(chart) => chart as usize,
                Source::New => {
                    let [a, b, c] = new.corners(number);
                    nearest((a + b + c) / 3.0)
                }
            };
            let corner = |vertex: u32| {
                let is_own = |corner: &u32| vertices[vertex as usize] == Some(*corner);
                match old.triangles[chart].iter().position(is_own) {
                    Some(corner) => at_corner(corner),
                    None => weights(&old.corners(chart), new.positions[vertex as usize].cast()),
                }
            };
            (chart, new.triangles[number].map(corner))
        };
        Self {
            old: &old.triangles,
            vertices: vertices.par_iter().zip(&new.positions).with_min_len(GRAIN).map(vertex).collect(),
            triangles: sources.par_iter().enumerate().with_min_len(GRAIN).map(triangle).collect(),
        }
    }

    fn array(&self, array: &MeshArray) -> MeshArray {
        let of_vertex = |origin: &Origin| match origin {
            Origin::Vertex(vertex) => array.values[*vertex as usize],
            Origin::Position(triangle, weights) => blended(array, self.old, *triangle, weights),
        };
        let of_corners = |(chart, weights): &(usize, [Weights; 3])| {
            weights.map(|weights| blended(array, self.old, *chart, &weights))
        };
        let values = match array.on {
            On::Vertices => self.vertices.iter().map(of_vertex).collect(),
            On::Corners => self.triangles.iter().flat_map(of_corners).collect(),
            On::Faces => self.triangles.iter().map(|(chart, _)| array.values[*chart]).collect(),
        };
        array.with(values)
    }

    /// Texture coordinates for these triangles of the new mesh, with their sources.
    fn uvs(&self, uvs: &Uvs, triangles: &[[u32; 3]], sources: &[Source], is_tracked: bool) -> Uvs {
        if uvs.corners.is_none() && (is_tracked || !self.joins_seams(uvs, triangles)) {
            let coordinate = |origin: &Origin| match origin {
                Origin::Vertex(vertex) => uvs.coordinates[*vertex as usize],
                Origin::Position(triangle, weights) => {
                    interpolated(self.old[*triangle].map(|vertex| uvs.coordinates[vertex as usize]), weights)
                }
            };
            let coordinates = self.vertices.iter().map(coordinate).collect();
            return Uvs { coordinates, corners: None, missing: uvs.missing };
        }
        let mut coordinates = uvs.coordinates.clone();
        let mut corners = Vec::with_capacity(3 * self.triangles.len());
        let mut off_chart = self.off_chart(uvs, triangles, sources).into_iter().peekable();
        for (chart, weights) in &self.triangles {
            let own = uvs.indices(self.old, *chart);
            for weights in weights {
                let nearest = heaviest(weights);
                if let Some((_, index)) = off_chart.next_if(|(corner, _)| *corner == corners.len()) {
                    corners.push(index);
                } else if weights[nearest] == 1.0 {
                    corners.push(own[nearest]);
                } else {
                    corners.push(coordinates.len() as u32);
                    coordinates.push(interpolated(own.map(|index| uvs.coordinates[index as usize]), weights));
                }
            }
        }
        Uvs { coordinates, corners: Some(corners), missing: uvs.missing }
    }

    /// The vertex of the old mesh that a vertex of the new mesh was.
    fn own(&self, vertex: u32) -> Option<u32> {
        match self.vertices[vertex as usize] {
            Origin::Vertex(own) => Some(own),
            Origin::Position(..) => None,
        }
    }

    /// Corners of parts that are vertices of the old mesh but not of their chart, ascending (three corners per triangle), with the indices
    /// of these vertices' coordinates: a collapse of two vertices leaves such corners. The index is taken from a triangle that the vertex
    /// shares with the removed corner, where that corner has the same index as on the chart: on the same side of a seam. Corners without
    /// such a triangle are left out.
    fn off_chart(&self, uvs: &Uvs, triangles: &[[u32; 3]], sources: &[Source]) -> Vec<(usize, u32)> {
        // Each with its vertex, and the vertex and index of the removed corner.
        let mut corners: Vec<(usize, u32, [u32; 2])> = Vec::new();
        let parts = sources.iter().enumerate().filter(|(_, source)| matches!(source, Source::Part(_)));
        for (number, _) in parts {
            let (chart, weights) = &self.triangles[number];
            let of_chart = self.old[*chart];
            let vertices = triangles[number].map(|vertex| self.own(vertex));
            for (corner, (vertex, weights)) in vertices.iter().zip(weights).enumerate() {
                let Some(vertex) = vertex.filter(|vertex| !of_chart.contains(vertex)) else { continue };
                let gone = (0..3usize).filter(|other| !vertices.contains(&Some(of_chart[*other])));
                let nearest = gone.max_by(|a, b| weights[*a].total_cmp(&weights[*b]));
                let index = |other: usize| uvs.indices(self.old, *chart)[other];
                corners.extend(nearest.map(|at| (3 * number + corner, vertex, [of_chart[at], index(at)])));
            }
        }
        let count = corners.iter().map(|(_, vertex, _)| *vertex as usize + 1).max().unwrap_or(0);
        if count == 0 {
            return Vec::new();
        }
        let mut is_wanted = vec![false; count];
        corners.iter().for_each(|(_, vertex, _)| is_wanted[*vertex as usize] = true);
        let mut around: Vec<(u32, usize)> = Vec::new();
        for (triangle, vertices) in self.old.iter().enumerate() {
            let wanted = vertices.iter().filter(|vertex| is_wanted.get(**vertex as usize) == Some(&true));
            around.extend(wanted.map(|vertex| (*vertex, triangle)));
        }
        around.sort_unstable();
        let index_in = |triangle: usize, vertex: u32, [gone, index]: [u32; 2]| {
            let (vertices, indices) = (self.old[triangle], uvs.indices(self.old, triangle));
            let is_same_side = (0..3usize).any(|at| (vertices[at], indices[at]) == (gone, index));
            let at = vertices.iter().position(|other| *other == vertex)?;
            is_same_side.then_some(indices[at])
        };
        let found = |(corner, vertex, gone): (usize, u32, [u32; 2])| {
            let begin = around.partition_point(|(other, _)| *other < vertex);
            let mut own = around[begin..].iter().take_while(|(other, _)| *other == vertex);
            own.find_map(|(_, triangle)| index_in(*triangle, vertex, gone)).map(|index| (corner, index))
        };
        corners.into_iter().filter_map(found).collect()
    }

    /// Whether a vertex joins several old vertices that had different texture coordinates.
    fn joins_seams(&self, uvs: &Uvs, triangles: &[[u32; 3]]) -> bool {
        let coordinate = |vertex: u32| uvs.coordinates[vertex as usize];
        let is_other = |chart: usize, weights: &Weights, vertex: u32| {
            let nearest = heaviest(weights);
            let own = self.own(vertex);
            own.is_some_and(|own| {
                weights[nearest] == 1.0 && coordinate(self.old[chart][nearest]) != coordinate(own)
            })
        };
        self.triangles.iter().zip(triangles).any(|((chart, weights), vertices)| {
            weights.iter().zip(vertices).any(|(weights, vertex)| is_other(*chart, weights, *vertex))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::repair;
    use super::*;
    use crate::context::{Context, Pool};
    use crate::geometry::mesh::attributes::Number;

    fn array(name: &str, on: On, number: Number, values: &[f64]) -> MeshArray {
        MeshArray { name: name.into(), on, number, values: values.to_vec() }
    }

    /// A square of two triangles, and the same square with its first triangle flipped and its second cut in two, one half of which is
    /// new.
    fn squares() -> (TriMesh, TriMesh) {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 1.0]];
        let positions: Vec<Vec3> = corners.iter().map(|[x, y]| Vec3::new(*x, *y, 0.0)).collect();
        let old = TriMesh { positions: positions[..4].to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] };
        (old, TriMesh { positions, triangles: vec![[0, 2, 1], [0, 2, 4], [0, 4, 3]] })
    }

    const VERTICES: [Option<u32>; 5] = [Some(0), Some(1), Some(2), Some(3), None];
    const SOURCES: [Source; 3] = [Source::Whole(0), Source::Part(1), Source::New];

    #[test]
    fn old_geometry_keeps_its_values_and_those_of_new_geometry_are_interpolated() {
        let (old, new) = squares();
        let arrays = vec![
            array("wet", On::Vertices, Number::F32, &[0.25, 0.5, 0.125, 0.375]),
            array("id", On::Vertices, Number::U32, &[5.0, 6.0, 7.0, 8.0]),
            array("red", On::Vertices, Number::U8, &[0.0, 10.0, 100.0, 201.0]),
            array("part", On::Faces, Number::U16, &[3.0, 4.0]),
            array("dry", On::Corners, Number::F64, &[10.0, 20.0, 30.0, 40.0, 50.0, 60.0]),
            array("kind", On::Corners, Number::I8, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
            array("hole", On::Vertices, Number::F64, &[f64::NAN, 1.0, 2.0, 3.0]),
            array("spread", On::Vertices, Number::F64, &[0.0, 1.0, f64::NAN, 3.0]),
        ];
        let positions = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let uvs = Uvs { coordinates: positions.clone(), corners: None, missing: 2 };
        let detail = DetailedMesh { mesh: old, uvs: Some(uvs), arrays };
        let carried = carried(&detail, new.clone(), &VERTICES, &SOURCES, None);
        assert_eq!(carried.mesh, new);
        let wanted: [&[f64]; 6] = [
            &[0.25, 0.5, 0.125, 0.375, 0.25],
            &[5.0, 6.0, 7.0, 8.0, 7.0],
            &[0.0, 10.0, 100.0, 201.0, 151.0],
            &[3.0, 4.0, 4.0],
            &[10.0, 30.0, 20.0, 40.0, 50.0, 55.0, 40.0, 55.0, 60.0],
            &[1.0, 3.0, 2.0, 4.0, 5.0, 5.0, 4.0, 5.0, 6.0],
        ];
        for (found, wanted) in carried.arrays.iter().zip(wanted) {
            assert_eq!(found.values, wanted, "{}", found.name);
        }
        let [hole, spread] = [6, 7].map(|n: usize| &carried.arrays[n].values);
        assert!(hole[0].is_nan() && hole[1..] == [1.0, 2.0, 3.0, 2.5], "{hole:?}");
        assert!(spread[2].is_nan() && spread[4].is_nan() && spread[3] == 3.0, "{spread:?}");
        let uvs = carried.uvs.unwrap();
        assert_eq!((uvs.corners, uvs.missing), (None, 2));
        assert!(
            uvs.coordinates[..4] == positions && uvs.coordinates[4] == [0.5, 1.0],
            "{:?}",
            uvs.coordinates
        );
    }

    #[test]
    fn coordinates_with_seams_stay_coordinates_of_corners() {
        let (old, new) = squares();
        let positions: Vec<[f32; 2]> = (0..6u8).map(|n| [f32::from(n), 0.125 * f32::from(n)]).collect();
        let uvs = Uvs { coordinates: positions.clone(), corners: Some((0..6).collect()), missing: 0 };
        let detail = DetailedMesh { mesh: old, uvs: Some(uvs), arrays: Vec::new() };
        let uvs = carried(&detail, new, &VERTICES, &SOURCES, None).uvs.unwrap();
        assert_eq!(uvs.corners.unwrap(), [0, 2, 1, 3, 4, 6, 3, 7, 5]);
        assert!(uvs.coordinates.starts_with(&positions));
        assert_eq!(uvs.coordinates[6..], [[4.5, 0.5625]; 2]);
    }

    #[test]
    fn a_collapse_tears_no_texture() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]];
        let positions: Vec<Vec3> = corners.iter().map(|[x, y]| Vec3::new(*x, *y, 0.0)).collect();
        let old = TriMesh { positions, triangles: vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]] };
        // The second vertex became the first.
        let kept = [0, 2, 3, 4, 5];
        let positions = kept.map(|n: usize| old.positions[n]).to_vec();
        let new = TriMesh { positions, triangles: vec![[0, 1, 4], [0, 4, 3], [0, 3, 2]] };
        let vertices = kept.map(|n| Some(n as u32));
        let sources = [Source::Part(2), Source::Part(3), Source::Whole(1)];
        let coordinates: Vec<[f32; 2]> = (0..7u8).map(|n| [f32::from(n), 0.5 * f32::from(n)]).collect();
        let found = |coordinates: &[[f32; 2]], corners| {
            let uvs = Some(Uvs { coordinates: coordinates.to_vec(), corners, missing: 0 });
            let detail = DetailedMesh { mesh: old.clone(), uvs, arrays: Vec::new() };
            let traced = Traced { first: &detail, tree: None, positions: &[], spacing: 1.0 };
            carried(&detail, new.clone(), &vertices, &sources, Some(&traced)).uvs.unwrap()
        };
        let uvs = found(&coordinates[..6], None);
        assert_eq!((uvs.coordinates, uvs.corners), (kept.map(|n| coordinates[n]).to_vec(), None));
        let mut indices = old.triangles.as_flattened().to_vec();
        for has_seam in [false, true] {
            if has_seam {
                // The third triangle's coordinates lie elsewhere: the first vertex has none there.
                indices[6] = 6;
            }
            let uvs = found(&coordinates, Some(indices.clone()));
            let first = if has_seam { 6 } else { 0 };
            assert_eq!(
                (uvs.coordinates, uvs.corners),
                (coordinates.clone(), Some(vec![first, 2, 5, 0, 5, 4, 0, 4, 3]))
            );
        }
    }

    #[test]
    fn unused_coordinates_are_removed_where_nothing_is_traced() {
        let (old, mut new) = squares();
        let positions: Vec<[f32; 2]> = (0..6u8).map(|n| [f32::from(n), 0.125 * f32::from(n)]).collect();
        let uvs = Some(Uvs { coordinates: positions.clone(), corners: Some((0..6).collect()), missing: 0 });
        let first = DetailedMesh { mesh: old, uvs, arrays: Vec::new() };
        let traced = Traced { first: &first, tree: None, positions: &[], spacing: 1.0 };
        let [mut with, mut without] = [first.clone(), first.clone()];
        for change in 0..3 {
            with = carried(&with, new.clone(), &VERTICES, &SOURCES, Some(&traced));
            without = carried(&without, new.clone(), &VERTICES, &SOURCES, None);
            let (uvs, all) = (with.uvs.as_ref().unwrap(), without.uvs.as_ref().unwrap());
            assert!(uvs.coordinates.starts_with(&positions));
            let corners = uvs.corners.as_ref().unwrap();
            assert!((6..uvs.coordinates.len() as u32).all(|index| corners.contains(&index)), "{corners:?}");
            assert_eq!(all.coordinates.len() > uvs.coordinates.len(), change > 0);
            for triangle in 0..3 {
                let of = |uvs: &Uvs| {
                    uvs.indices(&new.triangles, triangle).map(|index| uvs.coordinates[index as usize])
                };
                assert_eq!(of(uvs), of(all));
            }
            // The new vertex is rebuilt again, a little farther on.
            new.positions[4].x += 0.125;
        }
    }

    #[test]
    fn joined_vertices_do_not_tear_the_texture_of_their_triangles() {
        let (square, _) = squares();
        let positions = [0, 1, 2, 0, 2, 3].map(|n: usize| square.positions[n]).to_vec();
        let soup = TriMesh { positions, triangles: vec![[0, 1, 2], [3, 4, 5]] };
        let vertices = [0, 1, 2, 5].map(Some);
        let sources = [0, 1].map(Source::Whole);
        for has_seam in [false, true] {
            let mut coordinates =
                vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            if has_seam {
                coordinates[4] = [7.0, 7.0];
            }
            let uvs = Some(Uvs { coordinates: coordinates.clone(), corners: None, missing: 0 });
            let detail = DetailedMesh { mesh: soup.clone(), uvs, arrays: Vec::new() };
            let uvs = carried(&detail, square.clone(), &vertices, &sources, None).uvs.unwrap();
            if has_seam {
                assert_eq!((uvs.coordinates, uvs.corners), (coordinates, Some(vec![0, 1, 2, 3, 4, 5])));
            } else {
                let kept = [0, 1, 2, 5].map(|n: usize| coordinates[n]);
                assert_eq!((&uvs.coordinates[..], uvs.corners), (&kept[..], None));
            }
        }
    }

    #[test]
    fn arrays_go_through_a_repair() {
        let mut mesh = TriMesh::cuboid([0.0; 3], [1.0; 3]);
        mesh.append(&TriMesh::cuboid([0.55, 0.45, 0.35], [1.5, 1.4, 1.3]));
        let x = |vertex: u32| f64::from(mesh.positions[vertex as usize].x);
        let of_corners: Vec<f64> = mesh.triangles.as_flattened().iter().map(|vertex| x(*vertex)).collect();
        let numbers: Vec<f64> = (0..24u8).map(f64::from).collect();
        let arrays = vec![
            array("x", On::Vertices, Number::F32, &(0..16).map(x).collect::<Vec<_>>()),
            array("x", On::Corners, Number::F32, &of_corners),
            array("number", On::Faces, Number::I32, &numbers),
        ];
        let ctx = Context::new(Pool::new(2).unwrap());
        let cell = 0.06;
        let repaired = repair(&ctx, &mesh, cell).unwrap();
        let detail = DetailedMesh { mesh, uvs: None, arrays };
        let carried = carried(&detail, repaired.mesh, &repaired.vertices, &repaired.sources, None);
        let (mesh, [of_vertices, of_corners, of_faces]) =
            (&carried.mesh, [0, 1, 2].map(|n: usize| &carried.arrays[n]));
        let [vertices, triangles] = [mesh.positions.len(), mesh.triangles.len()];
        let lengths = [of_vertices, of_corners, of_faces].map(|array| array.values.len());
        assert_eq!(lengths, [vertices, 3 * triangles, triangles]);
        // Rebuilt geometry lies within a cell of the solid, but the nearest triangle of the old mesh may belong to another face of it.
        let is_near = |value: f64, vertex: u32, tolerance: f64| {
            (value - f64::from(mesh.positions[vertex as usize].x)).abs() <= tolerance
        };
        for (vertex, own) in (0..).zip(&repaired.vertices) {
            let tolerance = if own.is_some() { 0.0 } else { 2.0 * cell };
            assert!(is_near(of_vertices.values[vertex as usize], vertex, tolerance), "{own:?}");
        }
        let mut whole = 0;
        for (triangle, source) in repaired.sources.iter().enumerate() {
            let tolerance = match source {
                Source::Whole(from) => {
                    whole += 1;
                    assert_eq!(of_faces.values[triangle], f64::from(*from));
                    0.0
                }
                Source::Part(_) => 1e-3,
                Source::New => 3.0 * cell,
            };
            let values = &of_corners.values[3 * triangle..];
            let are_near = mesh.triangles[triangle]
                .iter()
                .zip(values)
                .all(|(vertex, x)| is_near(*x, *vertex, tolerance));
            assert!(are_near, "{source:?} {:?}", &values[..3]);
        }
        assert!(whole > 4, "{whole}");
    }
}
