//! New geometry takes the values that the liquid there had at the first frame, where its position at that frame is known: textures survive
//! merges and splits.
//!
//! A *charted* triangle is a new triangle that has a chart on the first mesh: the triangle there that is nearest to where its middle was.
//! Where separate bodies of liquid meet, the corners of a new triangle come from positions far apart: such triangles are *torn*. They take
//! their values from one of the two bodies, and are marked.

use super::charts::{Chart, Charts, Traced};
use super::texture::textured;
use crate::geometry::mesh::attributes::{DetailedMesh, MeshArray, Number, On};
use crate::mesh_repair::Source;

impl Traced<'_> {
    /// Name of the face array that marks rebuilt faces: 0 a triangle of the first mesh, unchanged; 1 a part of one, or a new triangle; 2 a
    /// new triangle, or a part of one, whose corners come from positions far apart. It is carried from change to change; if the mesh has
    /// none yet, all triangles are those of the first mesh.
    pub const MASK: &'static str = "rebuilt";

    /// Writes the values of the first frame over those taken from the previous mesh.
    pub(in crate::mesh_repair) fn apply(
        &self,
        out: &mut DetailedMesh,
        vertices: &[Option<u32>],
        sources: &[Source],
    ) {
        let mut charts = Charts::of(self, &out.mesh, sources);
        let is_kept = charts.kept(vertices, &out.mesh.triangles);
        for (n, array) in out.arrays.iter_mut().enumerate() {
            charts.fill(n, array, &is_kept);
        }
        if let (Some(first), Some(uvs)) = (&self.first.uvs, &mut out.uvs) {
            textured(&mut charts, first, uvs, &out.mesh, &is_kept);
        }
        mark(out, sources, &charts.list);
    }
}

/// Whether an array is the mask, `Traced::MASK`.
pub(in crate::mesh_repair) fn is_mask(array: &MeshArray) -> bool {
    array.name == Traced::MASK && array.on == On::Faces
}

/// Writes the mask.
fn mark(out: &mut DetailedMesh, sources: &[Source], charts: &[Chart]) {
    let at = out.arrays.iter().position(is_mask).unwrap_or(out.arrays.len());
    if at == out.arrays.len() {
        let values = vec![0.0; sources.len()];
        let name = Traced::MASK.into();
        out.arrays.push(MeshArray { name, on: On::Faces, number: Number::U8, values });
    }
    let values = &mut out.arrays[at].values;
    for (value, source) in values.iter_mut().zip(sources) {
        match source {
            Source::Whole(_) => {}
            // A part of a torn triangle is torn.
            Source::Part(_) => *value = value.max(1.0),
            Source::New => *value = 1.0,
        }
    }
    charts.iter().filter(|chart| chart.is_torn).for_each(|chart| values[chart.number] = 2.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{DVec3, TriMesh, Uvs, Vec3};
    use crate::mesh_repair::carry_attributes as carried;

    /// Cells along an edge of the sheet, whose vertices in the middle are rebuilt.
    const SIDE: usize = 16;
    const MADE: std::ops::RangeInclusive<usize> = 3..=5;
    /// Texture coordinates per metre.
    const SCALE: f32 = 0.125;
    /// Displacement of the liquid along x, and the distance of coordinates across a seam.
    const SHIFT: f32 = 32.0;
    const SEAM: f32 = 5.0;

    /// A sheet of square cells of 1 m, two triangles each.
    fn sheet(along: f32) -> TriMesh {
        let on = || 0..=SIDE;
        let position = |x: usize, y: usize| Vec3::new(x as f32 + along, y as f32, 0.0);
        let positions = on().flat_map(|x| on().map(move |y| position(x, y))).collect();
        let name = |x: usize, y: usize| (x * (SIDE + 1) + y) as u32;
        let cell = |n: usize| {
            let (x, y) = (n / SIDE, n % SIDE);
            let [a, b, c, d] = [name(x, y), name(x + 1, y), name(x + 1, y + 1), name(x, y + 1)];
            [[a, b, c], [a, c, d]]
        };
        TriMesh { positions, triangles: (0..SIDE * SIDE).flat_map(cell).collect() }
    }

    /// How the sheet's texture coordinates are stored.
    #[derive(Clone, Copy, PartialEq)]
    enum Kind {
        OfVertices,
        OfCorners,
        /// From x = 4 on they lie elsewhere.
        WithSeam,
    }

    /// The sheet at the first frame, with what it carries.
    fn first(kind: Kind) -> DetailedMesh {
        let mesh = sheet(0.0);
        let positions: Vec<[f32; 2]> = mesh.positions.iter().map(|p| [SCALE * p.x, SCALE * p.y]).collect();
        let count = positions.len() as u32;
        let beyond: Vec<[f32; 2]> = positions.iter().map(|[u, v]| [u + SEAM, *v]).collect();
        let corner = |names: &[u32; 3]| {
            let is_beyond = names.iter().all(|name| mesh.positions[*name as usize].x >= 4.0);
            names.map(|name| if is_beyond { name + count } else { name })
        };
        let uvs = match kind {
            Kind::OfVertices => Uvs { coordinates: positions, corners: None, missing: 0 },
            Kind::OfCorners => Uvs {
                coordinates: positions,
                corners: Some(mesh.triangles.as_flattened().to_vec()),
                missing: 0,
            },
            Kind::WithSeam => {
                let corners = mesh.triangles.iter().flat_map(corner).collect();
                Uvs { coordinates: [positions, beyond].concat(), corners: Some(corners), missing: 0 }
            }
        };
        let x = mesh.positions.iter().map(|position| f64::from(position.x)).collect();
        let numbers = (0..mesh.triangles.len()).map(|triangle| triangle as f64).collect();
        let array = |name: &str, on, values| MeshArray { name: name.into(), on, number: Number::F32, values };
        let arrays = vec![array("x", On::Vertices, x), array("number", On::Faces, numbers)];
        DetailedMesh { mesh, uvs: Some(uvs), arrays }
    }

    fn is_made(vertex: usize) -> bool {
        MADE.contains(&(vertex / (SIDE + 1))) && MADE.contains(&(vertex % (SIDE + 1)))
    }

    /// The sheet after the liquid moved and a part of it was rebuilt. According to the particles, the liquid was `astray` (m) farther along
    /// x at the first frame than according to the previous mesh, and within `lost` (m) of x = 4 also 8 m to the side.
    fn after(kind: Kind, astray: f64, lost: f32) -> (DetailedMesh, Vec<Source>) {
        let first = first(kind);
        let old = DetailedMesh { mesh: sheet(SHIFT), ..first.clone() };
        let mut new = sheet(SHIFT);
        let mut origins: Vec<Option<u32>> = (0..new.positions.len() as u32).map(Some).collect();
        for vertex in (0..origins.len()).filter(|vertex| is_made(*vertex)) {
            origins[vertex] = None;
            new.positions[vertex] += Vec3::new(0.25, -0.125, 0.0);
        }
        let source = |(triangle, names): (u32, &[u32; 3])| match names.iter().any(|n| is_made(*n as usize)) {
            true => Source::New,
            false => Source::Whole(triangle),
        };
        let sources: Vec<Source> = (0..).zip(&new.triangles).map(source).collect();
        let position = |position: &Vec3| {
            let aside = if (position.x - SHIFT - 4.0).abs() < lost { 8.0 } else { 0.0 };
            Some(position.cast::<f64>() - DVec3::new(f64::from(SHIFT) - astray, -aside, 0.0))
        };
        let positions: Vec<Option<DVec3>> = new.positions.iter().map(position).collect();
        let traced = Traced { first: &first, tree: None, positions: &positions, spacing: 1.0 };
        let out = carried(&old, new, &origins, &sources, Some(&traced));
        (out, sources)
    }

    /// Coordinates of a triangle's corners, and the positions of these (m).
    fn corners(detail: &DetailedMesh, triangle: usize) -> [([f32; 2], Vec3); 3] {
        let uvs = detail.uvs.as_ref().unwrap();
        let indices = uvs.indices(&detail.mesh.triangles, triangle);
        let names = detail.mesh.triangles[triangle];
        [0, 1, 2].map(|n| (uvs.coordinates[indices[n] as usize], detail.mesh.positions[names[n] as usize]))
    }

    fn mask(detail: &DetailedMesh) -> &[f64] {
        &detail.arrays.iter().find(|array| array.name == Traced::MASK).unwrap().values
    }

    #[test]
    fn a_texture_goes_on_without_a_seam_where_the_mesh_before_drifted() {
        // The vertex in the middle of the rebuilt part.
        let middle = 4 * (SIDE + 1) + 4;
        for kind in [Kind::OfVertices, Kind::OfCorners] {
            for astray in [0.0, 0.3] {
                let (out, sources) = after(kind, astray, 0.0);
                let mut corners_there = 0;
                for (triangle, source) in sources.iter().enumerate() {
                    assert_eq!(mask(&out)[triangle], f64::from(u8::from(*source == Source::New)));
                    let names = out.mesh.triangles[triangle];
                    for (name, ([u, v], position)) in names.into_iter().zip(corners(&out, triangle)) {
                        let off =
                            (u - SCALE * (position.x - SHIFT)).abs().max((v - SCALE * position.y).abs());
                        // Away from kept triangles the particles' own texture counts more and more.
                        let most = if *source == Source::New { SCALE * astray as f32 } else { 0.0 };
                        assert!(off < most + 1e-5, "{triangle}, {source:?}: {u} {v} at {position}");
                        if name as usize == middle {
                            // Two edges from the rim, 0.475 of the difference there is left.
                            let wanted = 0.525 * most;
                            assert!((off - wanted).abs() < 0.05 * most + 1e-5, "{off}, not {wanted}");
                            corners_there += 1;
                        }
                    }
                }
                assert_eq!(corners_there, 6);
                let [x, number] = [0, 1].map(|n: usize| &out.arrays[n].values);
                for (vertex, position) in out.mesh.positions.iter().enumerate() {
                    let wanted = f64::from(position.x - SHIFT) + if is_made(vertex) { astray } else { 0.0 };
                    assert!((x[vertex] - wanted).abs() < 1e-4, "{vertex}: {} {wanted}", x[vertex]);
                }
                assert!((0..sources.len()).all(|n| astray > 0.0 || (number[n] - n as f64).abs() < 40.0));
                let made = out.uvs.as_ref().unwrap().coordinates.len() - (SIDE + 1) * (SIDE + 1);
                assert_eq!(made, if kind == Kind::OfVertices { 0 } else { 9 });
            }
        }
    }

    #[test]
    fn no_triangle_lies_across_a_seam() {
        for astray in [0.0, 0.3] {
            let (out, sources) = after(Kind::WithSeam, astray, 0.0);
            let made = (0..sources.len()).filter(|triangle| sources[*triangle] == Source::New);
            for triangle in made {
                assert_eq!(mask(&out)[triangle], 1.0);
                let [a, b, c] = corners(&out, triangle).map(|([u, _], _)| u);
                let span = a.max(b).max(c) - a.min(b).min(c);
                assert!(span < 3.0 * SCALE, "{triangle}: {a} {b} {c}");
            }
        }
    }

    #[test]
    fn liquid_from_elsewhere_leaves_a_seam_or_a_mark() {
        let astray = 6.0;
        for kind in [Kind::OfVertices, Kind::OfCorners] {
            let (out, sources) = after(kind, astray, 0.0);
            for (triangle, source) in sources.iter().enumerate() {
                let is_new = *source == Source::New;
                let has_kept = out.mesh.triangles[triangle].iter().any(|name| !is_made(*name as usize));
                let is_marked = kind == Kind::OfVertices && is_new && has_kept;
                let wanted = f64::from(u8::from(is_new)) + f64::from(u8::from(is_marked));
                assert_eq!(mask(&out)[triangle], wanted, "{triangle}");
                if is_marked {
                    continue;
                }
                let by = if is_new { astray as f32 } else { 0.0 };
                for ([u, _], position) in corners(&out, triangle) {
                    assert!(
                        (u - SCALE * (position.x - SHIFT + by)).abs() < 1e-5,
                        "{triangle}: {u} at {position}"
                    );
                }
            }
        }
    }

    #[test]
    fn triangles_between_separate_bodies_of_liquid_are_marked_and_not_smeared() {
        let (out, sources) = after(Kind::OfCorners, 0.0, 0.6);
        let is_lost = |position: &Vec3| (position.x - SHIFT - 4.0).abs() < 0.6;
        let mut torn = 0;
        for (triangle, source) in sources.iter().enumerate().filter(|(_, source)| **source == Source::New) {
            let corners = corners(&out, triangle);
            let lost = corners.iter().filter(|(_, position)| is_lost(position)).count();
            let is_torn = lost % 3 != 0;
            torn += usize::from(is_torn);
            assert_eq!(mask(&out)[triangle], if is_torn { 2.0 } else { 1.0 }, "{triangle}, {source:?}");
            if is_torn {
                let (low, high) =
                    corners.iter().fold(([f32::MAX; 2], [f32::MIN; 2]), |(low, high), (uv, _)| {
                        ([0, 1].map(|n| low[n].min(uv[n])), [0, 1].map(|n| high[n].max(uv[n])))
                    });
                assert!((0..2).all(|n| high[n] - low[n] < 1.01 * SCALE), "{triangle}: {corners:?}");
            }
        }
        assert!(torn > 4, "{torn}");
    }

    #[test]
    fn the_mask_goes_on_from_change_to_change() {
        let (old, _) = after(Kind::OfCorners, 0.0, 0.6);
        let first = first(Kind::OfCorners);
        let torn = mask(&old).iter().position(|value| *value == 2.0).unwrap();
        let mut sources: Vec<Source> = (0..old.mesh.triangles.len() as u32).map(Source::Whole).collect();
        (sources[0], sources[1], sources[torn]) = (Source::Part(0), Source::New, Source::Part(torn as u32));
        let origins: Vec<Option<u32>> = (0..old.mesh.positions.len() as u32).map(Some).collect();
        // The liquid's earlier positions are unknown.
        let traced = Traced { first: &first, tree: None, positions: &[], spacing: 1.0 };
        let out = carried(&old, old.mesh.clone(), &origins, &sources, Some(&traced));
        let mut wanted = mask(&old).to_vec();
        (wanted[0], wanted[1]) = (1.0, 1.0);
        assert_eq!((wanted[torn], mask(&out) == wanted), (2.0, true));
        assert_eq!(out.arrays.len(), old.arrays.len());
        // The same where the mesh carries no other array, and is passed with its triangles.
        let arrays = old.arrays.iter().filter(|array| is_mask(array)).cloned().collect();
        let alone = DetailedMesh { mesh: old.mesh.clone(), uvs: None, arrays };
        (sources[2], wanted[2]) = (Source::Whole(torn as u32), 2.0);
        let out = carried(&alone, old.mesh.clone(), &origins, &sources, Some(&traced));
        assert!(mask(&out) == wanted && out.arrays.len() == 1);
        sources[2] = Source::Whole(2);
        let bare = DetailedMesh { mesh: old.mesh.clone(), ..DetailedMesh::default() };
        let out = carried(&bare, old.mesh.clone(), &origins, &sources, Some(&traced));
        assert_eq!(mask(&out).iter().sum::<f64>(), 3.0);
        assert!(carried(&bare, old.mesh.clone(), &origins, &sources, None).arrays.is_empty());
    }
}
