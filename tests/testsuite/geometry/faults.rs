//! Faults of meshes made to have them: fans, edges, and triangles that meet where they should not, to the last bit.

use crate::common::shapes;
use frazil::geometry::check::faults::Faults;
use frazil::geometry::{TriMesh, Vec3};

fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> TriMesh {
    TriMesh { positions: positions.iter().map(|p| Vec3::from(*p)).collect(), triangles: triangles.to_vec() }
}

/// A tetrahedron over the unit axes, then other positions and triangles.
fn tetrahedron_and(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> TriMesh {
    let own = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    mesh(&[&own[..], positions].concat(), &[&faces[..], triangles].concat())
}

/// The mesh with vertices of its own for each triangle.
fn apart(mesh: &TriMesh) -> TriMesh {
    let corners = mesh.triangles.as_flattened();
    let positions = corners.iter().map(|&vertex| mesh.positions[vertex as usize]).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriMesh { positions, triangles }
}

/// Pairs that meet: crossings, corner_crossings, folds, overlaps, touches.
fn pairs(mesh: &TriMesh) -> [usize; 5] {
    let f = Faults::of(mesh);
    let pairs = [f.crossings, f.corner_crossings, f.folds, f.overlaps, f.touches];
    assert_eq!(f.is_embedded(), pairs == [0; 5]);
    pairs
}

#[test]
fn bodies_that_share_a_vertex_are_non_manifold_there() {
    // The second is the first seen through the origin.
    let others = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    let joined = tetrahedron_and(&others, &[[0, 4, 5], [0, 6, 4], [4, 6, 5], [5, 6, 0]]);
    let faults = Faults::of(&joined);
    assert!(faults.is_solid() && faults.is_embedded() && !faults.by_index.is_watertight());
    assert_eq!((faults.non_manifold_vertices, faults.by_index.non_manifold_vertices), (1, 1));
    assert_eq!((faults.parts, faults.genus), (1, Some(0)));
    // By index they are apart when each has a vertex there.
    let others = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [-0.0; 3]];
    let faults = Faults::of(&tetrahedron_and(&others, &[[7, 4, 5], [7, 6, 4], [4, 6, 5], [5, 6, 7]]));
    assert!(faults.by_index.is_watertight());
    assert_eq!((faults.non_manifold_vertices, faults.by_index.non_manifold_vertices), (1, 0));
}

#[test]
fn bodies_that_share_an_edge_crowd_it() {
    // The second is the first turned half about z.
    let others = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    let joined = tetrahedron_and(&others, &[[0, 5, 4], [0, 4, 3], [4, 5, 3], [5, 0, 3]]);
    let faults = Faults::of(&joined);
    assert!(!faults.is_solid() && faults.is_embedded() && !faults.by_index.is_watertight());
    assert_eq!((faults.non_manifold_edges, faults.non_manifold_vertices, faults.genus), (1, 2, None));
    assert_eq!((faults.by_index.non_manifold_edges, faults.by_index.non_manifold_vertices), (1, 2));
    assert_eq!((faults.open_edges, faults.turned_edges), (0, 0));
}

#[test]
fn a_cube_of_loose_triangles_is_closed_by_position_only() {
    let cube = shapes::cuboid([1.0; 3]);
    let whole = Faults::of(&cube);
    assert!(whole.is_solid() && whole.is_embedded() && whole.by_index.is_watertight());
    let faults = Faults::of(&apart(&cube));
    assert!(faults.is_solid() && faults.is_embedded() && !faults.by_index.is_watertight());
    assert_eq!((faults.open_edges, faults.by_index.open_edges, faults.doubled_vertices), (0, 36, 28));
    // Turned by index, and by position.
    let mut turned = cube.clone();
    turned.triangles[0].swap(0, 1);
    let faults = Faults::of(&turned);
    assert_eq!((faults.turned_edges, faults.by_index.turned_edges), (3, 3));
    let faults = Faults::of(&apart(&turned));
    assert_eq!((faults.turned_edges, faults.by_index.turned_edges), (3, 0));
}

#[test]
fn triangles_with_a_common_corner_cross_touch_or_pass_by_the_last_bit() {
    let of = |z: f32| {
        let flat = [[0.0, 0.0, 1.0], [2.0, -1.0, 1.0], [2.0, 1.0, 1.0]];
        let positions = [&flat[..], &[[1.0, 0.0, 2.0], [1.0, 0.0, z]]].concat();
        pairs(&mesh(&positions, &[[0, 1, 2], [0, 3, 4]]))
    };
    let (cross, touch) = ([0, 1, 0, 0, 0], [0, 0, 0, 0, 1]);
    assert_eq!([of(1f32.next_down()), of(1.0), of(1f32.next_up())], [cross, touch, [0; 5]]);
    // Away from each other: only the corner is common.
    let away = mesh(
        &[[0.0; 3], [2.0, -1.0, 0.0], [2.0, 1.0, 0.0], [-1.0, 0.0, 1.0], [-1.0, 0.0, -1.0]],
        &[[0, 1, 2], [0, 3, 4]],
    );
    assert_eq!(pairs(&away), [0; 5]);
}

#[test]
fn triangles_folded_along_an_edge_lie_on_each_other_to_the_last_bit() {
    let of = |z: f32| {
        let positions = [[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.25, 1.0], [1.0, 0.5, z]];
        pairs(&mesh(&positions, &[[0, 1, 2], [1, 0, 3]]))
    };
    let folded = [0, 0, 1, 0, 0];
    assert_eq!([of(1f32.next_down()), of(1.0), of(1f32.next_up())], [[0; 5], folded, [0; 5]]);
    // Folded, but as two sides of one sheet should be: no fault.
    assert_eq!(of(-1.0), [0; 5]);
}

#[test]
fn triangles_without_a_common_corner_cross_touch_or_pass_by_the_last_bit() {
    let of = |z: f32| {
        let leaning = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let tip = [[0.25, 0.25, z], [1.0, 1.0, 1.0], [1.0, 1.5, 1.0]];
        pairs(&mesh(&[leaning, tip].concat(), &[[0, 1, 2], [3, 4, 5]]))
    };
    let (cross, touch) = ([1, 0, 0, 0, 0], [0, 0, 0, 0, 1]);
    assert_eq!([of(0.5f32.next_down()), of(0.5), of(0.5f32.next_up())], [cross, touch, [0; 5]]);
    // Through each other although every edge meets an edge: no face is pierced within.
    let edges: [[f32; 3]; 3] = [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [2.0, -1.0, 0.0]];
    let other = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [2.0, 0.0, -1.0]];
    assert_eq!(pairs(&mesh(&[edges, other].concat(), &[[0, 1, 2], [3, 4, 5]])), cross);
    // In one plane: an area, a side, nothing.
    let beside = |x: f32| {
        let first = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        let second = first.map(|[a, b, _]| [x - a, 1.0 - b, x - a]);
        pairs(&mesh(&[first, second].concat(), &[[0, 1, 2], [3, 4, 5]]))
    };
    let overlap = [0, 0, 0, 1, 0];
    assert_eq!([beside(0.75), beside(1.25)], [overlap, [0; 5]]);
    let upon = mesh(
        &[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [0.7, -1.0, 0.0]],
        &[[0, 1, 2], [3, 4, 5]],
    );
    assert_eq!(pairs(&upon), touch);
}

#[test]
fn the_area_of_a_triangle_is_told_exactly() {
    // In 64 bits the far corners leave nothing of the near one.
    let far = (1u64 << 60) as f32;
    let of = |y: f32| {
        Faults::of(&mesh(&[[-far, -far, 0.0], [far, far, 0.0], [1.0, y, 0.0]], &[[0, 1, 2]])).degenerate
    };
    assert_eq!([of(1f32.next_down()), of(1.0), of(1f32.next_up())], [0, 1, 0]);
}

#[test]
fn sound_surfaces_have_no_faults_in_any_position() {
    let globe = shapes::globe(1.0, 24, 12);
    let whole = Faults::of(&globe);
    assert!(whole.is_solid() && whole.is_embedded() && whole.by_index.is_watertight());
    let loose = Faults::of(&apart(&globe));
    assert!(loose.is_solid() && loose.is_embedded());
    assert_eq!(
        (loose.by_index.open_edges, loose.by_index.non_manifold_vertices),
        (3 * globe.triangles.len(), 0)
    );
    assert_eq!((whole.genus, loose.genus), (Some(0), Some(0)));
    // A sheet of squares in planes of every kind: all triangles around a vertex in one plane, many edges in line.
    let n = 12u32;
    let planes: [fn(f32, f32) -> [f32; 3]; 3] = [|s, t| [s, t, 0.0], |s, t| [s, s, t], |s, t| [s, t, s + t]];
    for position in planes {
        let positions: Vec<[f32; 3]> =
            (0..n * n).map(|at| position((at / n) as f32 * 0.1, (at % n) as f32 * 0.1)).collect();
        let mut triangles = Vec::new();
        for corner in (0..n * n).filter(|at| at / n + 1 < n && at % n + 1 < n) {
            triangles.extend([[corner, corner + n, corner + n + 1], [corner, corner + n + 1, corner + 1]]);
        }
        let sheet = Faults::of(&mesh(&positions, &triangles));
        assert!(sheet.is_embedded() && sheet.degenerate == 0, "{sheet:?}");
        assert_eq!((sheet.open_edges, sheet.non_manifold_vertices, sheet.holes), (44, 0, 1));
    }
    // Nothing, and less than that.
    let nothing = Faults::of(&TriMesh::default());
    assert!(!nothing.is_solid() && nothing.is_embedded() && !nothing.by_index.is_watertight());
    let point = Faults::of(&mesh(&[[1.0; 3]], &[[0, 0, 0]]));
    assert_eq!((point.degenerate, point.by_index.collapsed_triangles, point.parts), (1, 1, 0));
}

#[test]
fn parts_are_inside_out_unless_all_are_or_they_are_cavities() {
    let cube = |at: f32, size: f32| TriMesh::cuboid([at; 3], [at + size; 3]);
    let of = |parts: &[TriMesh]| {
        let mut mesh = TriMesh::default();
        parts.iter().for_each(|part| mesh.append(part));
        let [faults, flipped] = [Faults::of(&mesh), Faults::of(&mesh.reversed())];
        assert_eq!((faults.volume, faults.area), (-flipped.volume, flipped.area));
        assert_eq!(faults.is_solid(), faults.inverted_parts == 0);
        (faults.inverted_parts, flipped.inverted_parts)
    };
    let (out, cavity) = (cube(0.0, 4.0), cube(1.0, 2.0).reversed());
    assert_eq!(of(&[out.clone(), cube(8.0, 2.0)]), (0, 0));
    assert_eq!(of(&[out.clone(), cube(8.0, 2.0).reversed()]), (1, 1));
    assert_eq!(of(&[out.clone(), cavity.clone()]), (0, 0));
    assert_eq!(of(&[out.clone(), cavity.clone(), cube(1.5, 1.0)]), (0, 0));
    assert_eq!(of(&[out.clone(), cube(3.0, 2.0).reversed(), cube(6.0, 1.0).reversed()]), (2, 2));
    // In the box of another, but outside of it.
    let corner = mesh(
        &[[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]],
        &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    );
    assert_eq!(of(&[corner.clone(), cube(3.0, 0.5).reversed()]), (1, 1));
    assert_eq!(of(&[corner, cube(0.25, 0.5).reversed()]), (0, 0));
    // Doubled triangles do not count; bodies that touch in a vertex do apart.
    assert_eq!(of(&[out.clone(), out.clone(), out.clone().reversed()]), (0, 0));
    assert_eq!(of(&[out, cube(4.0, 1.0).reversed()]), (1, 1));
}

#[test]
fn many_triangles_around_a_vertex_meet_in_it_alone() {
    // A cap around its centre, and half of one from a vertex of its rim: every pair has a corner in common.
    let n = 20_000u32;
    let on_rim = |at: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(at) / f64::from(n)).sin_cos();
        [1e3 * cos as f32, 1e3 * sin as f32, 0.0]
    };
    let mut positions: Vec<[f32; 3]> = (0..n).map(on_rim).chain([[0.0; 3]]).collect();
    let mut around: Vec<[u32; 3]> = (0..n).map(|at| [n, at, (at + 1) % n]).collect();
    let across = (3 * n / 4..5 * n / 4).map(|at| [n / 2, at % n, (at + 1) % n]);
    let from_rim: Vec<[u32; 3]> = across.collect();
    assert_eq!(pairs(&mesh(&positions, &around)), [0; 5]);
    assert_eq!(pairs(&mesh(&positions, &from_rim)), [0; 5]);
    // One more at the centre: under the cap, then through one triangle of it.
    positions.extend([[400.0, -0.9, -1.0], [400.0, 1.1, -1.0]]);
    around.push([n, n + 1, n + 2]);
    assert_eq!(pairs(&mesh(&positions, &around)), [0; 5]);
    positions[n as usize + 2][2] = 1.0;
    assert_eq!(pairs(&mesh(&positions, &around)), [0, 1, 0, 0, 0]);
}
