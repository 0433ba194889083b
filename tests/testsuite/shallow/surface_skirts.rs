//! Skirts: the surface comes down to the ground where that ends.

use std::collections::BTreeMap;

use frazil::geometry::Vec3;
use frazil::shallow::columns::Columns;
use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use frazil::shallow::surface::rim::ledges::Ledges;
use frazil::shallow::surface::rim::silhouette::Silhouette;
use frazil::shallow::surface::{Depths, Layout, Surface};
use frazil::shallow::terrain::{Solids, triangles};

use super::surface_mesh::{Mesh, build_with, columns, ground, units};

/// A shelf of some cells of 12 x 10, 1 m over the ground and 0.3 m thick.
fn shelf(is_shelf: impl Fn(usize, usize) -> bool) -> Columns {
    columns([12, 10], |x, z| {
        if is_shelf(x, z) { vec![ground(0.5), [units(1.2), units(1.5)]] } else { vec![ground(0.5)] }
    })
}

/// So much liquid on the columns of a layer (m).
fn film(columns: &Columns, layer: usize, deep: f64) -> Vec<i32> {
    let is_wet = |index: usize| columns.is_column(index) && columns.layer(index) == layer;
    (0..columns.len()).map(|index| if is_wet(index) { units(deep) } else { 0 }).collect()
}

fn skirted(columns: &Columns, depth: &[i32], ledges: &Ledges) -> Mesh {
    let liquid = Depths { depth, ledges: Some(ledges), ..Depths::default() };
    build_with(&mut Surface::default(), columns, &liquid, &Layout::default())
}

/// Edges of one triangle only, as positions: vertices of the mesh may be doubled where none is.
fn open_edges(mesh: &Mesh) -> Vec<[u32; 2]> {
    let edges = mesh.edges();
    edges.keys().filter(|&&[a, b]| !edges.contains_key(&[b, a])).copied().collect()
}

#[test]
fn a_film_on_a_shelf_ends_at_its_edge_and_nowhere_over_it() {
    // Rectangles, a hole, steps along a diagonal, and a bridge one cell wide.
    let shelves: [fn(usize, usize) -> bool; 4] = [
        |x, z| (3..9).contains(&x) && (2..8).contains(&z),
        |x, z| (1..11).contains(&x) && (1..9).contains(&z) && !((4..7).contains(&x) && (4..6).contains(&z)),
        |x, z| (2..8).contains(&x) && (2..8).contains(&z) && x + z < 11,
        |x, z| (2..4).contains(&z) && (1..11).contains(&x) || (2..9).contains(&z) && (4..6).contains(&x),
    ];
    for is_shelf in shelves {
        let columns = shelf(is_shelf);
        let depth = film(&columns, 1, 0.1);
        let mut ledges = Ledges::default();
        ledges.find(&columns);
        let mesh = skirted(&columns, &depth, &ledges);
        let bare = build_with(
            &mut Surface::default(),
            &columns,
            &Depths { depth: &depth, ..Depths::default() },
            &Layout::default(),
        );
        assert_eq!(mesh.triangles[..bare.triangles.len()], bare.triangles, "the surface itself is the same");
        mesh.assert_manifold();
        let skirt_vertices = bare.positions.len()..;
        let open = open_edges(&mesh);
        assert!(!open.is_empty());
        for edge in open {
            for vertex in edge {
                assert!(skirt_vertices.contains(&(vertex as usize)), "the surface is open over the shelf");
                let [_, y, _] = mesh.positions[vertex as usize];
                assert!((y - 1.5).abs() < 1e-6, "a skirt vertex lies on the shelf: {y}");
            }
        }
    }
}

#[test]
fn the_surface_beside_a_hole_goes_on_under_another_shelf() {
    // Over the whole of a floor with a hole a second one: in the cells of the hole it is of another layer.
    let columns = columns([40, 10], |x, z| {
        let is_hole = (14..20).contains(&x) && (4..7).contains(&z);
        let (low, high) = ([units(1.2), units(1.5)], [units(2.2), units(2.5)]);
        if is_hole { vec![ground(0.5), high] } else { vec![ground(0.5), low, high] }
    });
    let deep = |index: usize| if columns.bases()[index] > units(1.0) { units(0.1) } else { 0 };
    let depth: Vec<i32> =
        (0..columns.len()).map(|index| if columns.is_column(index) { deep(index) } else { 0 }).collect();
    let mut ledges = Ledges::default();
    ledges.find(&columns);
    let mesh = skirted(&columns, &depth, &ledges);
    let bare = Depths { depth: &depth, ..Depths::default() };
    let bare = build_with(&mut Surface::default(), &columns, &bare, &Layout::default());
    mesh.assert_manifold();
    // 6 x 3 cells, whose corners the surface cuts: 2 x (6 + 3) columns beside it, in a ring.
    assert_eq!(mesh.positions.len() - bare.positions.len(), 18);
    assert_eq!(mesh.triangles.len() - bare.triangles.len(), 2 * 18);
}

#[test]
fn hems_are_half_a_cell_out_and_their_normals_lean_out() {
    let columns = shelf(|x, z| (3..9).contains(&x) && (2..8).contains(&z));
    let depth = film(&columns, 1, 0.25);
    let mut ledges = Ledges::default();
    ledges.find(&columns);
    let mesh = skirted(&columns, &depth, &ledges);
    let skirt_vertices =
        mesh.positions.iter().zip(&mesh.normals).filter(|([_, y, _], _)| (y - 1.5).abs() < 1e-6);
    // Cells of 0.5 m from (-1, 2): the shelf from 0.5 to 3.5 and from 3 to 6.
    let (mut count, low) = (0, [0.5, 3.0]);
    for (&[x, _, z], normal) in skirt_vertices {
        count += 1;
        let [a, b] = [x - low[0], z - low[1]];
        let out = [
            if a.abs() < 1e-6 { -1.0 } else { f32::from(u8::from((a - 3.0).abs() < 1e-6)) },
            if b.abs() < 1e-6 { -1.0 } else { f32::from(u8::from((b - 3.0).abs() < 1e-6)) },
        ];
        assert!(out != [0.0; 2], "({x}, {z}) is not at an edge of the shelf");
        assert!(normal[0] * out[0] >= 0.0 && normal[2] * out[1] >= 0.0 && normal[1] > 0.0, "{normal:?}");
        let length = normal.iter().map(|n| n * n).sum::<f32>();
        assert!((length - 1.0).abs() < 1e-5);
        if out[0] * out[1] == 0.0 {
            // 0.25 m over a quarter of a metre.
            let side = (normal[0] * out[0]).max(normal[2] * out[1]);
            assert!((side - normal[1]).abs() < 1e-5, "{normal:?}");
        }
    }
    assert_eq!(count, 20, "one for each cell along the shelf's edge");
    assert_eq!(mesh.counts.vertices, 36 + 20);
    assert_eq!(mesh.counts.indices, 3 * (2 * 25 + 2 * 20));
}

#[test]
fn liquid_below_that_reaches_the_shelf_needs_no_skirt() {
    let columns = shelf(|x, z| (3..9).contains(&x) && (2..8).contains(&z));
    let mut depth = film(&columns, 1, 0.1);
    for index in columns.indices().filter(|&index| columns.layer(index) == 0) {
        depth[index] = (units(1.55).min(columns.ceilings()[index]) - columns.bases()[index]).max(0);
    }
    let mut ledges = Ledges::default();
    ledges.find(&columns);
    let mesh = skirted(&columns, &depth, &ledges);
    assert!(mesh.positions.iter().all(|[_, y, _]| *y > 1.5 + 1e-3), "a skirt vertex under water");
}

#[test]
fn dry_shelves_and_other_columns() {
    let columns = shelf(|x, z| (3..9).contains(&x) && (2..8).contains(&z));
    let mut ledges = Ledges::default();
    ledges.find(&columns);
    let dry = vec![0; columns.len()];
    assert_eq!(skirted(&columns, &dry, &ledges).counts, Default::default());
    // Level ground has no ledge, nor has the domain's border.
    let level = super::surface_mesh::columns([12, 10], |_, _| vec![ground(0.5)]);
    let depth = film(&level, 0, 0.1);
    let liquid = Depths { depth: &depth, ledges: Some(&ledges), ..Depths::default() };
    let failure = Surface::default().count(&level, &liquid).unwrap_err().to_string();
    assert_eq!(failure, "the ledges are those of other columns");
    ledges.find(&level);
    let bare = Depths { depth: &depth, ..Depths::default() };
    let [with, without] =
        [liquid_of(&depth, &ledges), bare].map(|liquid| Surface::default().count(&level, &liquid).unwrap());
    assert_eq!(with, without);
}

fn liquid_of<'a>(depth: &'a [i32], ledges: &'a Ledges) -> Depths<'a> {
    Depths { depth, ledges: Some(ledges), ..Depths::default() }
}

/// A closed box.
fn boxed([a, b]: [[f32; 3]; 2], positions: &mut Vec<Vec3>, faces: &mut Vec<[u32; 3]>) {
    let first = positions.len() as u32;
    for corner in 0..8 {
        let at = |axis: usize| if corner >> axis & 1 == 1 { b[axis] } else { a[axis] };
        positions.push(Vec3::new(at(0), at(1), at(2)));
    }
    for [a, b, c, d] in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        faces.extend([[a, b, c], [a, c, d]].map(|face: [u32; 3]| face.map(|corner| first + corner)));
    }
}

#[test]
fn skirts_end_at_the_silhouette_of_the_ground() {
    // A floor, and a slab whose edges lie somewhere between the middles of cells.
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    boxed([[-1.0, -0.2, -1.0], [1.0, 0.0, 1.0]], &mut positions, &mut faces);
    let (low, high) = ([-0.463f32, -0.377], [0.418f32, 0.507]);
    boxed([[low[0], 0.3, low[1]], [high[0], 0.4, high[1]]], &mut positions, &mut faces);
    let grid = Grid { cell: 0.05, origin: [-1.0, -1.0], size: [40, 40] };
    let solids = triangles::solids(&positions, &faces, grid, Heights::between(-0.5, 1.0).unwrap()).unwrap();
    let columns = Columns::new(&solids);
    let depth: Vec<i32> = {
        let unit = columns.heights.unit;
        let is_wet = |index: usize| columns.is_column(index) && columns.layer(index) == 1;
        (0..columns.len()).map(|index| if is_wet(index) { (0.02 / unit) as i32 } else { 0 }).collect()
    };
    let (mut ledges, mut silhouette) = (Ledges::default(), Silhouette::default());
    silhouette.fit(&mut ledges, &columns, &positions, &faces).unwrap();
    let mesh = skirted(&columns, &depth, &ledges);
    let skirt_vertices: Vec<_> = mesh.positions.iter().filter(|[_, y, _]| (y - 0.4).abs() < 1e-5).collect();
    assert!(skirt_vertices.len() > 60, "{}", skirt_vertices.len());
    let mut corners: BTreeMap<[bool; 2], usize> = BTreeMap::new();
    for [x, _, z] in skirt_vertices {
        let on = |at: f32, ends: [f32; 2]| ends.into_iter().any(|end| (at - end).abs() < 2e-6);
        let [along, across] = [on(*x, [low[0], high[0]]), on(*z, [low[1], high[1]])];
        assert!(along || across, "({x}, {z}) is not on the edge of the slab");
        assert!(low[0] - 2e-6 < *x && *x < high[0] + 2e-6 && low[1] - 2e-6 < *z && *z < high[1] + 2e-6);
        *corners.entry([along, across]).or_default() += 1;
    }
    assert_eq!(corners[&[true, true]], 4);
    // Those of ground that has moved are as if they were the first.
    let turned: Vec<Vec3> = positions.iter().map(|at| Vec3::new(at.z, at.y, -at.x)).collect();
    let other = Columns::new(
        &triangles::solids(&turned, &faces, grid, Heights::between(-0.5, 1.0).unwrap()).unwrap(),
    );
    silhouette.fit(&mut ledges, &other, &turned, &faces).unwrap();
    silhouette.fit(&mut ledges, &columns, &positions, &faces).unwrap();
    let mut copy = Ledges::default();
    copy.copy_from(&ledges);
    for ledges in [&ledges, &copy] {
        assert!(skirted(&columns, &depth, ledges).positions == mesh.positions);
    }
    // Bad meshes.
    let error = silhouette.fit(&mut ledges, &columns, &positions, &[[0, 1, 99]]).unwrap_err().to_string();
    assert!(error.contains("does not exist"), "{error}");
    positions[3].y = f32::NAN;
    let error = silhouette.fit(&mut ledges, &columns, &positions, &faces).unwrap_err().to_string();
    assert!(error.contains("not finite"), "{error}");
}

#[test]
fn films_over_the_void_have_skirts_too() {
    // No ground at all beyond a table.
    let grid = Grid { cell: 0.5, origin: [0.0; 2], size: [8, 8] };
    let solids = |cell: usize| {
        if (2..6).contains(&(cell % 8)) && (2..6).contains(&(cell / 8)) {
            vec![[BOTTOMLESS + 1, 9]]
        } else {
            vec![]
        }
    };
    let columns = Columns::new(&Solids::new(grid, Heights::between(0.0, 4.0).unwrap(), (0..64).map(solids)));
    let depth: Vec<i32> = (0..columns.len()).map(|index| i32::from(columns.is_column(index)) << 20).collect();
    let mut ledges = Ledges::default();
    ledges.find(&columns);
    let mesh = skirted(&columns, &depth, &ledges);
    mesh.assert_manifold();
    assert_eq!(mesh.counts.vertices, 16 + 12);
    assert_eq!(open_edges(&mesh).len(), 12);
}
