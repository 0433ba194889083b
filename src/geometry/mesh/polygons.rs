//! Polygon meshes, and their triangulation.

use super::validate;
use crate::error::{Error, Result};
use crate::geometry::triangulate::ear_clipping::turn;
use crate::geometry::triangulate::{ear_clipping, monotone};
use crate::geometry::{DVec3, DetailedMesh, MeshArray, TriMesh, Uvs, Vec3};

/// Maximum corners of a polygon: triangulation takes some 300 bytes for each, which the memory limit does not count.
const MAX_CORNERS: usize = 1 << 22;
/// Maximum corners of a polygon that is triangulated by ear clipping: larger ones could take minutes.
const MAX_EAR_CLIPPED: usize = 500;

/// Polygons as in files: with any number of corners, convex or not, rarely exactly planar.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PolygonMesh {
    /// Vertex positions (m).
    pub positions: Vec<Vec3>,
    /// Vertex indices of all polygons, one after another, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
    /// Where each polygon ends in `corners`.
    pub ends: Vec<u32>,
    /// Texture coordinates, where the file has any.
    pub uvs: Option<Uvs>,
    /// Other arrays that the file has.
    pub arrays: Vec<MeshArray>,
}

impl PolygonMesh {
    /// Adds a polygon; polygons of fewer than three corners are skipped.
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
    /// Names the first invalid vertex or face, counted from 1; a face of more than 4,194,304 corners is invalid.
    pub fn validate(&self) -> Result<()> {
        validate(&self.positions, self.polygons())?;
        match self.polygons().position(|polygon| polygon.len() > MAX_CORNERS) {
            Some(face) => {
                Err(Error::argument(format!("face {} has more than {MAX_CORNERS} corners", face + 1)))
            }
            None => Ok(()),
        }
    }

    /// The vertex indices of each polygon.
    pub fn polygons(&self) -> impl Iterator<Item = &[u32]> {
        let begins = std::iter::once(&0).chain(&self.ends);
        begins.zip(&self.ends).map(|(&begin, &end)| &self.corners[begin as usize..end as usize])
    }

    /// Whether another mesh has the same vertices and polygons, regardless of positions.
    pub fn has_faces_of(&self, other: &Self) -> bool {
        self.positions.len() == other.positions.len()
            && self.corners == other.corners
            && self.ends == other.ends
    }

    /// The polygons as triangles: a fan if the polygon is convex, else by ear clipping, or large polygons by monotone pieces.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let mut out = Vec::with_capacity(self.triangle_count());
        self.cut_all(|_, polygon, triangle| out.push(triangle.map(|corner| polygon[corner])));
        out
    }

    /// The mesh as triangles.
    pub fn into_triangles(self) -> TriMesh {
        TriMesh { triangles: self.triangles(), positions: self.positions }
    }

    /// The mesh as triangles, with its texture coordinates.
    pub fn into_textured(self) -> (TriMesh, Option<Uvs>) {
        let DetailedMesh { mesh, uvs, .. } = Self { arrays: Vec::new(), ..self }.into_detailed();
        (mesh, uvs)
    }

    /// The mesh as triangles, with everything that it carries.
    pub fn into_detailed(mut self) -> DetailedMesh {
        let (arrays, uvs) = (std::mem::take(&mut self.arrays), self.uvs.take());
        let (mut corners, mut faces) = (Vec::new(), Vec::new());
        if !arrays.is_empty() || uvs.as_ref().is_some_and(|uvs| uvs.corners.is_some()) {
            corners.reserve(self.triangle_count());
            self.cut_all(|begin, _, triangle| corners.push(triangle.map(|corner| begin + corner)));
        }
        if !arrays.is_empty() {
            let face = |corner: usize| self.ends.partition_point(|end| *end as usize <= corner);
            faces.extend(corners.iter().map(|triangle| face(triangle[0])));
        }
        let uvs = uvs.map(|uvs| uvs.of_triangles(&corners));
        let arrays = arrays.into_iter().map(|array| array.of_triangles(&corners, &faces)).collect();
        DetailedMesh { mesh: self.into_triangles(), uvs, arrays }
    }

    fn triangle_count(&self) -> usize {
        self.corners.len().saturating_sub(2 * self.ends.len())
    }

    /// Triangulates all polygons: calls `each` for each triangle with the start of its polygon in `corners`, the polygon's vertices, and
    /// the indices of the triangle's corners among these.
    fn cut_all(&self, mut each: impl FnMut(usize, &[u32], [usize; 3])) {
        let mut begin = 0;
        for polygon in self.polygons() {
            self.cut(polygon, |triangle| each(begin, polygon, triangle));
            begin += polygon.len();
        }
    }

    fn cut(&self, polygon: &[u32], mut each: impl FnMut([usize; 3])) {
        if polygon.len() == 3 {
            return each([0, 1, 2]);
        }
        let fan = |each: &mut dyn FnMut([usize; 3])| (1..polygon.len() - 1).for_each(|i| each([0, i, i + 1]));
        // Indices out of range are refused by the check of the whole mesh.
        let positions: Option<Vec<DVec3>> =
            polygon.iter().map(|&i| self.positions.get(i as usize).map(|p| p.cast())).collect();
        let Some(positions) = positions else { return fan(&mut each) };
        let flat = flattened(&positions);
        let count = polygon.len();
        if (0..count).all(|i| turn(flat[(i + count - 1) % count], flat[i], flat[(i + 1) % count]) >= 0.0) {
            return fan(&mut each);
        }
        let cut = if count > MAX_EAR_CLIPPED { monotone::triangles } else { ear_clipping::triangles };
        cut(&flat).into_iter().for_each(each);
    }
}

/// Positions in the polygon's best plane (Newell's normal), counter-clockwise.
fn flattened(positions: &[DVec3]) -> Vec<[f64; 2]> {
    let next = positions.iter().cycle().skip(1);
    let normal: DVec3 =
        positions.iter().zip(next).map(|(p, q)| (p - positions[0]).cross(&(q - positions[0]))).sum();
    let length = normal.norm();
    if length == 0.0 {
        return vec![[0.0; 2]; positions.len()];
    }
    let normal = normal / length;
    let smallest = normal.iamin();
    let across = normal.cross(&DVec3::ith(smallest, 1.0)).normalize();
    let up = normal.cross(&across);
    positions.iter().map(|p| [(p - positions[0]).dot(&across), (p - positions[0]).dot(&up)]).collect()
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
    fn a_concave_polygon_keeps_its_area_and_no_triangle_is_flipped() {
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

    /// A star with `count` corners, every second one nearer to the centre, in a tilted plane.
    fn star(count: usize) -> PolygonMesh {
        let corner = |i: usize| {
            let (angle, radius) = (i as f64 / count as f64 * std::f64::consts::TAU, [1.0, 0.6][i % 2]);
            [(radius * angle.cos()) as f32, (radius * angle.sin()) as f32]
        };
        flat(&(0..count).map(corner).collect::<Vec<_>>())
    }

    /// A wall that winds inward and back out: cutting it always leaves long thin triangles.
    fn spiral(count: usize) -> PolygonMesh {
        let half = count / 2;
        let corner = |i: usize| {
            let (along, thick) = if i < half { (i, 0.0) } else { (count - 1 - i, 0.4) };
            let part = along as f64 / half as f64;
            let (angle, radius) = (part * 200.0, 100.0 - part * 95.0 + thick);
            [(radius * angle.cos()) as f32, (radius * angle.sin()) as f32]
        };
        flat(&(0..count).map(corner).collect::<Vec<_>>())
    }

    /// A square wave over a bar, with teeth that reach up from y = 1 and, with two sides, down from -1; turned by an angle.
    fn comb(count: usize, sides: usize, angle: f64) -> PolygonMesh {
        let teeth = count / 4 / sides;
        // Every two consecutive corners are on the same side of a tooth or gap.
        let across = |k: usize| k as f64 * 0.5 + 0.03 * (k % 7) as f64;
        let wave = |i: usize| [across(i.div_ceil(2)), 1.0 + 200.0 * (i % 4 / 2) as f64];
        let mut points: Vec<[f64; 2]> = (0..4 * teeth).map(|i| wave(i + 1)).collect();
        match sides {
            1 => points.extend([[teeth as f64 * 1.0 + 1.0, 0.0], [0.0, 0.0]]),
            _ => points.extend((0..4 * teeth).rev().map(|i| wave(i + 1)).map(|[x, y]| [x, -y])),
        }
        points.reverse();
        let (sin, cos) = angle.sin_cos();
        let turned = |p: &[f64; 2]| [(p[0] * cos - p[1] * sin) as f32, (p[0] * sin + p[1] * cos) as f32];
        let mut mesh = flat(&points.iter().map(turned).collect::<Vec<_>>());
        // In a sloping plane, 32-bit rounding would tilt its long slivers.
        mesh.positions.iter_mut().for_each(|p| p.y = 0.0);
        mesh
    }

    #[test]
    fn a_face_of_a_hundred_thousand_corners_takes_under_two_seconds() {
        let combs = [1, 2].into_iter().flat_map(|sides| {
            let comb = move |angle: f64| (format!("comb {sides} {angle}"), comb(100_000, sides, angle));
            [0.0, 0.4, 1.0, std::f64::consts::FRAC_PI_2, 2.5].map(comb)
        });
        let named = [("star".to_string(), star(100_000)), ("spiral".into(), spiral(100_000))];
        for (name, polygon) in named.into_iter().chain(combs) {
            let start = std::time::Instant::now();
            let count = polygon.positions.len();
            let mesh = polygon.into_triangles();
            assert_eq!(mesh.triangles.len(), count - 2);
            let seconds = start.elapsed().as_secs_f64();
            assert!(seconds < 2.0, "{name}: {seconds} s");
            let area: DVec3 = (0..mesh.triangles.len())
                .map(|t| mesh.corners(t))
                .map(|[a, b, c]| (b - a).cross(&(c - a)) / 2.0)
                .sum();
            assert!(
                (area.norm() / mesh.area() - 1.0).abs() < 1e-4,
                "{name}: {} of {}",
                area.norm(),
                mesh.area()
            );
        }
    }

    #[test]
    fn a_face_that_crosses_itself_everywhere_takes_under_ten_seconds() {
        let mut at = 1u32;
        let mut random = || {
            at = at.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (at >> 8) as f32
        };
        let tangle: Vec<[f32; 2]> = (0..100_000).map(|_| [random(), random()]).collect();
        let start = std::time::Instant::now();
        assert_eq!(flat(&tangle).triangles().len(), 99_998);
        assert!(start.elapsed().as_secs_f64() < 10.0, "{} s", start.elapsed().as_secs_f64());
    }

    /// Signed area of a polygon by its corners, and unsigned area of its triangles.
    fn areas(points: &[[f64; 2]], triangles: &[[usize; 3]]) -> (f64, f64) {
        let around = (0..points.len()).map(|i| turn(points[0], points[i], points[(i + 1) % points.len()]));
        let parts = triangles.iter().map(|t| turn(points[t[0]], points[t[1]], points[t[2]]).abs());
        (around.sum(), parts.sum())
    }

    /// Whether the triangles' sides, except inner ones, are the polygon's.
    fn has_its_sides(count: usize, triangles: &[[usize; 3]]) -> bool {
        let mut sides = std::collections::HashMap::new();
        for [a, b, c] in triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *sides.entry((*from.min(to), *from.max(to))).or_insert(0) += if from < to { 1 } else { -1 };
            }
        }
        let own = |i: usize| sides.get(&(i.min((i + 1) % count), i.max((i + 1) % count)));
        let inner = sides.values().filter(|sum| **sum == 0).count();
        (0..count).all(|i| own(i) == Some(&if i + 1 < count { 1 } else { -1 }))
            && sides.len() == count + inner
    }

    #[test]
    fn large_polygons_of_every_kind_keep_their_sides_and_simple_ones_their_area() {
        let mut at = 7u64;
        let mut random = || {
            at = at.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (at >> 40) as f64 / (1u64 << 24) as f64
        };
        for round in 0..300 {
            let count = 3 + (random() * 60.0) as usize;
            // Around a centre at growing angles it is simple; with few distinct positions many corners are doubled.
            let simple = round % 3 == 0;
            let few = |value: f64| (value * 5.0).floor();
            let points: Vec<[f64; 2]> = (0..count)
                .map(|i| match round % 3 {
                    0 => {
                        let (angle, radius) =
                            (i as f64 / count as f64 * std::f64::consts::TAU, 0.1 + random());
                        [radius * angle.cos(), radius * angle.sin()]
                    }
                    1 => [random(), random()],
                    _ => [few(random()), few(random())],
                })
                .collect();
            let triangles = monotone::triangles(&points);
            assert_eq!(triangles.len(), count - 2, "{points:?}");
            assert!(has_its_sides(count, &triangles), "{points:?}: {triangles:?}");
            if simple {
                let (around, parts) = areas(&points, &triangles);
                assert!((around - parts).abs() < 1e-6, "{around} {parts} {points:?}");
            }
        }
        for points in [vec![[0.0; 2]; 700], vec![[f64::NAN; 2]; 700], vec![[f64::INFINITY, 1.0]; 700]] {
            assert_eq!(monotone::triangles(&points).len(), 698);
        }
    }

    #[test]
    fn a_convex_polygon_is_a_fan_and_a_bow_tie_still_has_triangles() {
        let square = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(square.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(flat(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]).triangles().len(), 2);
        assert_eq!(flat(&[[0.0, 0.0]; 5]).triangles().len(), 3);
        let mut vast = square.clone();
        vast.push((0..=MAX_CORNERS as u32).map(|i| i % 4));
        assert_eq!(vast.validate().unwrap_err().to_string(), "face 2 has more than 4194304 corners");
        let mut beyond = square;
        beyond.push([0, 1, 2, 9]);
        assert_eq!(beyond.triangles().len(), 4);
    }
}
