//! The surface of fine and coarse cells: one mesh, without a crack or an overlap along the edge.

use std::collections::BTreeMap;
use std::ops::Range;

use frazil::geometry::DVec3;
use frazil::shallow::columns::NONE;
use frazil::shallow::surface::{Counts, Depths, Indices, Layout, Target, Up};
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::two_level::surface::{Surface, bound};
use frazil::shallow::{Detail, Params};
use frazil::{Context, Pool};

use crate::common::flowing::FRAME;
use crate::common::shallow::{context, floors, ground, waves};

const CELL: f64 = 1.0 / 1024.0;

/// A mesh in metres.
struct Mesh {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    depths: Vec<f32>,
    columns: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    counts: Counts,
}

fn depths(detail: &Detail) -> [Depths<'_>; 2] {
    [detail.fine(), detail.coarse()].map(|liquid| Depths { depth: liquid.depths(), ..Depths::default() })
}

fn mesh(surface: &mut Surface, detail: &Detail, layout: &Layout) -> Mesh {
    let [fine, coarse] = depths(detail);
    let both = [&fine, &coarse];
    let most = bound(detail);
    let counts = surface.count(detail, both).unwrap();
    assert!(counts.vertices <= most.vertices && counts.indices <= most.indices, "{counts:?} of {most:?}");
    let vectors = || vec![f32::NAN; 3 * counts.vertices];
    let (mut positions, mut normals, mut deep) = (vectors(), vectors(), vec![f32::NAN; counts.vertices]);
    let (mut columns, mut indices) = (vec![7; counts.vertices], vec![u32::MAX; counts.indices]);
    let mut target = Target {
        positions: Some(&mut positions),
        normals: Some(&mut normals),
        depths: Some(&mut deep),
        columns: Some(&mut columns),
        indices: Indices::U32(&mut indices),
        ..Target::default()
    };
    assert_eq!(surface.build(detail, both, layout, &mut target).unwrap(), counts);
    assert!(positions.iter().chain(&normals).chain(&deep).all(|number| number.is_finite()));
    let triangles = indices.as_chunks().0.to_vec();
    Mesh {
        positions: positions.as_chunks().0.to_vec(),
        normals: normals.as_chunks().0.to_vec(),
        depths: deep,
        columns,
        triangles,
        counts,
    }
}

/// Twice the area of a triangle seen from above, over 0 where it faces up (fine cells).
fn area(mesh: &Mesh, triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|vertex| {
        let [x, _, z] = mesh.positions[vertex as usize];
        [x, z].map(|at| f64::from(at) / CELL)
    });
    (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1])
}

/// Edges that one triangle only has.
fn borders(mesh: &Mesh) -> Vec<[u32; 2]> {
    let mut count = BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *count.entry([*from, *to]).or_insert(0) += 1;
            assert_eq!(count[&[*from, *to]], 1, "an edge has triangles on the same side");
        }
    }
    count.keys().filter(|[from, to]| !count.contains_key(&[*to, *from])).copied().collect()
}

/// Twice the area within the outermost vertices (fine cells): half a cell from the border beside near cells, and a cell beside others.
fn whole([nx, nz]: [usize; 2], near: &[Range<usize>; 2]) -> f64 {
    let touches = |axis: usize, end: usize| {
        let side = &near[axis];
        if end == 0 { side.start == 0 } else { side.end == [nx, nz][axis] }
    };
    let mut out = 2.0 * ((nx - 2) * (nz - 2)) as f64;
    for axis in 0..2 {
        for _ in (0..2).filter(|end| touches(axis, *end)) {
            // Twice the area of a trapezoid half a cell wide, which slants to the coarse cells beside; corners are counted apart.
            let length = near[1 - axis].len() as f64;
            let corners = [0, 1].map(|end| touches(1 - axis, end));
            let inner: f64 = corners.iter().map(|is_corner| if *is_corner { -1.0 } else { 1.0 }).sum();
            let outer: f64 = corners.iter().map(|is_corner| if *is_corner { -1.0 } else { -0.5 }).sum();
            out += 0.5 * (length + inner + length + outer);
            out += if axis == 0 {
                0.5 * corners.iter().filter(|is_corner| **is_corner).count() as f64
            } else {
                0.0
            };
        }
    }
    out
}

#[test]
fn a_lake_has_one_closed_surface() {
    let ctx = context();
    let size = [48, 36];
    let solids = ground(size, CELL, [-0.02, 0.1], |_| 0.0);
    let mut surface = Surface::default();
    for near in [
        [16..32, 8..28],
        [16..18, 8..10],
        [0..20, 8..28],
        [0..20, 0..20],
        [28..48, 16..36],
        [0..48, 10..20],
        [10..20, 0..36],
        [0..48, 0..36],
        [0..2, 34..36],
        [2..46, 2..34],
    ] {
        let mut detail = Detail::new(&ctx, &solids, Params::default(), near.clone()).unwrap();
        detail.fill(0.004);
        surface.reserve(&detail);
        let mesh = mesh(&mut surface, &detail, &Layout::default());
        let middle = size.map(|count| 0.5 * count as f64 * CELL);
        for edge in borders(&mesh) {
            // On the domain's border: at the centre of an outermost cell.
            let ends = edge.map(|vertex| mesh.positions[vertex as usize]);
            let off = |axis: usize| {
                let of = [0, 2][axis];
                let inner = ends.map(|end| (middle[axis] - f64::from(end[of]).abs()) / CELL);
                inner.iter().all(|inner| *inner < 1.1)
            };
            assert!(off(0) || off(1), "{near:?}: {ends:?}");
        }
        let areas: Vec<f64> = mesh.triangles.iter().map(|triangle| area(&mesh, *triangle)).collect();
        assert!(areas.iter().all(|area| *area > 0.0), "{near:?}: a triangle faces down");
        let sum: f64 = areas.iter().sum();
        assert!((sum - whole(size, &near)).abs() < 1e-3, "{near:?}: {sum} of {}", whole(size, &near));
        let heights = mesh.positions.iter().map(|[_, y, _]| *y);
        assert!(heights.clone().all(|y| (y - 0.004).abs() < 1e-7), "{near:?}");
        assert!(mesh.normals.iter().all(|normal| *normal == [0.0, 1.0, 0.0]));
        assert!(mesh.depths.iter().all(|depth| (depth - 0.004).abs() < 1e-7));
        let all = detail.fine().columns().count() + detail.coarse().columns().count();
        assert_eq!((mesh.counts.vertices, mesh.counts.extras), (all, 0), "{near:?}");
        let first = detail.fine().columns().len();
        for (vertex, &column) in mesh.columns.iter().enumerate() {
            let (liquid, column) = match (column as usize).checked_sub(first) {
                Some(column) => (detail.coarse(), column),
                None => (detail.fine(), column as usize),
            };
            let columns = liquid.columns();
            let [x, z] = columns.grid.centre(columns.cell(column));
            assert_eq!(mesh.positions[vertex][0], x as f32);
            assert_eq!(mesh.positions[vertex][2], z as f32);
        }
    }
}

/// A rough pond, whose shore crosses the edge; with two floors, a bridge over a part of it.
fn pond(ctx: &Context, near: [Range<usize>; 2], floor_count: usize) -> Detail {
    let solids = floors([48, 36], CELL, [-0.02, 0.1], floor_count, |at @ [x, z], floor| {
        let top = 0.012 * floor as f64 + 2e-3 * waves(at, CELL) + 4.0 * (x * x + z * z);
        (floor == 0 || z.abs() < 0.003).then_some([top - 0.003, top])
    });
    let mut detail = Detail::new(ctx, &solids, Params::default(), near).unwrap();
    detail.fill(0.002);
    detail.pour_at([-0.0075, 0.02, 0.0], 0.004, 2e-8).unwrap();
    detail
}

#[test]
fn a_shore_crosses_the_edge_without_a_crack() {
    let ctx = context();
    let mut surface = Surface::default();
    let layout = Layout { least_depth: 1e-4, fade_depth: 2e-4, ..Layout::default() };
    let mut sewn = 0;
    for near in [[16..32, 8..28], [4..24, 10..36], [22..24, 0..36]] {
        let mut detail = pond(&ctx, near.clone(), 1);
        surface.reserve(&detail);
        for frame in 0..40 {
            if frame == 20 {
                let at = DVec3::new(detail_edge(&near), 0.002, 0.0);
                detail.set_bodies(&[Shape::Sphere { centre: at, radius: 0.004 }]).unwrap();
                surface.reserve(&detail);
            }
            detail.step(&ctx, FRAME).unwrap();
            let mesh = mesh(&mut surface, &detail, &layout);
            let (fine, coarse) = (detail.fine(), detail.coarse());
            let first = fine.columns().len();
            let wet = |vertex: u32| {
                let column = mesh.columns[vertex as usize];
                column != NONE
                    && match (column as usize).checked_sub(first) {
                        Some(column) => coarse.depths()[column] > 0,
                        None => fine.depths()[column as usize] > 0,
                    }
            };
            // Each pair of wet vertices on a border of the mesh is on that of the domain, or of a wall.
            let deep = |vertex: u32| mesh.depths[vertex as usize] > 0.0;
            let mut open = 0;
            for edge in borders(&mesh) {
                assert_eq!(edge.map(wet), edge.map(deep));
                if edge.iter().all(|vertex| wet(*vertex)) {
                    let within = edge.iter().all(|vertex| {
                        let [x, _, z] = mesh.positions[*vertex as usize].map(|at| f64::from(at) / CELL);
                        x.abs() < 22.0 && z.abs() < 16.0
                    });
                    open += usize::from(within);
                }
            }
            if frame < 20 {
                assert_eq!(open, 0, "{near:?}, frame {frame}");
            }
            assert!(mesh.triangles.iter().all(|triangle| area(&mesh, *triangle) > 0.0));
            // Columns that only the strip has come last.
            let coarse_columns =
                mesh.columns.iter().filter(|&&column| column != NONE && column as usize >= first);
            sewn += usize::from(
                !coarse_columns.is_sorted()
                    || mesh.columns.last().is_some_and(|last| (*last as usize) < first),
            );
        }
    }
    assert!(sewn > 0, "the strip has no vertex of its own");
}

/// Where an edge of near cells lies along x (m).
fn detail_edge(near: &[Range<usize>; 2]) -> f64 {
    (near[0].end as f64 - 24.0) * CELL
}

#[test]
fn threads_and_layouts_have_the_same_surface() {
    let detail = pond(&context(), [16..32, 8..28], 2);
    let mut surface = Surface::default();
    surface.reserve(&detail);
    let straight = mesh(&mut surface, &detail, &Layout::default());
    let several = Context::new(Pool::new(3).unwrap());
    let other = mesh(&mut Surface::default(), &pond(&several, [16..32, 8..28], 2), &Layout::default());
    assert!(straight.positions == other.positions && straight.triangles == other.triangles);
    assert!(straight.normals == other.normals && straight.depths == other.depths);
    let left = mesh(
        &mut surface,
        &detail,
        &Layout { left_handed: true, up: Up::Z, scale: 100.0, ..Layout::default() },
    );
    for (own, other) in straight.positions.iter().zip(&left.positions) {
        let expected = [own[0], own[2], own[1]].map(|at| 100.0 * at);
        assert!(expected.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-5), "{expected:?} {other:?}");
    }
    for (own, other) in straight.triangles.iter().zip(&left.triangles) {
        assert_eq!([own[0], own[2], own[1]], *other);
    }
}

#[test]
fn buffers_that_are_too_short_are_a_sentence() {
    let detail = pond(&context(), [16..32, 8..28], 2);
    let mut surface = Surface::default();
    let [fine, coarse] = depths(&detail);
    let counts = surface.count(&detail, [&fine, &coarse]).unwrap();
    let mut positions = vec![7.0; 3 * counts.vertices - 1];
    let mut target = Target { positions: Some(&mut positions), ..Target::default() };
    let error = surface.build(&detail, [&fine, &coarse], &Layout::default(), &mut target).unwrap_err();
    let expected = format!(
        "positions has room for {} numbers, and the surface has {}",
        3 * counts.vertices - 1,
        3 * counts.vertices
    );
    assert_eq!(error.to_string(), expected);
    assert!(positions.iter().all(|number| *number == 7.0), "nothing is written");
    let mut target = Target { velocities: Some(&mut positions), ..Target::default() };
    let error = surface.build(&detail, [&fine, &coarse], &Layout::default(), &mut target).unwrap_err();
    assert_eq!(error.to_string(), "velocities of the surface are wanted, and the liquid has none");
}
