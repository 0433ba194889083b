//! Terrain to columns: the solids of meshes against exact winding numbers, and against each other where their makers differ.

use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::shallow::columns::grid::{Grid, Heights};
use frazil::shallow::terrain::solids::Solid;
use frazil::shallow::terrain::{Solids, height, sampler, shapes::Shape, triangles};

use crate::common::bodies::Dice;
use crate::common::exact_lines::{random, wrong};
use crate::common::shapes;

#[test]
fn solids_are_where_the_exact_winding_number_is_above_zero() {
    let (mut layers, mut ties) = ([0; 6], 0);
    for seed in 0..1000 {
        let mut dice = Dice(seed);
        let cell = [0.25, 0.1][dice.below(2)];
        let mesh = random(&mut dice, cell);
        // Powers of two, so that the middle of each unit is a number.
        let reach = [4.0, 0.25][dice.below(2)];
        let heights = Heights::between(-reach, reach).unwrap();
        let grid = Grid { cell, origin: [-8.0 * cell; 2], size: [16, 16] };
        let found = triangles::solids(&mesh.positions, &mesh.triangles, grid, heights).unwrap();
        for _ in 0..16 {
            let cell = [3 + dice.below(10), 3 + dice.below(10)];
            let (solids, at) = (found.cell(grid.index(cell)), grid.centre(cell));
            let wrong = wrong(&mesh, at, &heights, solids);
            assert!(wrong.is_empty(), "seed {seed}, cell {cell:?}: {solids:?} is wrong at {wrong:?}");
            layers[solids.len().min(5)] += 1;
            ties += usize::from(mesh.positions.iter().any(|p| [p.x, p.z].map(f64::from) == at));
        }
    }
    assert!(layers[0] > 1000 && layers[1] > 3000 && layers[2] > 300 && layers[3] > 30, "{layers:?}");
    assert!(ties > 100, "{ties} lines meet a vertex");
}

#[test]
fn a_mirrored_or_turned_scene_has_the_same_solids() {
    for seed in 0..50 {
        let mut dice = Dice(seed);
        let grid = Grid { cell: 0.1, origin: [-0.8, -0.8], size: [16, 16] };
        let heights = Heights::between(-1.0, 1.0).unwrap();
        let mut mesh = random(&mut dice, 0.1);
        // No line meets an edge exactly.
        mesh.positions.iter_mut().for_each(|p| *p += dice.vector(1e-3).cast::<f32>());
        let solids = |change: &dyn Fn(&Vec3) -> Vec3, is_mirror: bool| {
            let changed = TriMesh {
                positions: mesh.positions.iter().map(change).collect(),
                triangles: mesh.triangles.clone(),
            };
            let changed = if is_mirror { changed.reversed() } else { changed };
            triangles::solids(&changed.positions, &changed.triangles, grid, heights).unwrap()
        };
        let same = solids(&|p| *p, false);
        let mirrored = solids(&|p| Vec3::new(-p.x, p.y, p.z), true);
        let turned = solids(&|p| Vec3::new(p.z, p.y, -p.x), false);
        for z in 0..16 {
            for x in 0..16 {
                let expected = same.cell(grid.index([x, z]));
                assert_eq!(
                    mirrored.cell(grid.index([15 - x, z])),
                    expected,
                    "seed {seed}: ({x}, {z}) mirrored"
                );
                assert_eq!(turned.cell(grid.index([z, 15 - x])), expected, "seed {seed}: ({x}, {z}) turned");
            }
        }
    }
}

/// Greatest difference of ends (m) where both have the same layers, and count of cells where they do not.
fn difference(a: &Solids, b: &Solids) -> (f64, usize) {
    let (mut worst, mut others) = (0, 0);
    for cell in 0..a.grid.cells() {
        let [a, b] = [a.cell(cell), b.cell(cell)].map(|solids| solids.as_flattened());
        if a.len() != b.len() {
            others += 1;
            continue;
        }
        let far = |(a, b): (&i32, &i32)| (i64::from(*a) - i64::from(*b)).abs();
        worst = a.iter().zip(b).map(far).fold(worst, i64::max);
    }
    (a.heights.length(worst as f64), others)
}

#[test]
fn a_sphere_is_the_same_from_triangles_distances_and_its_formula() {
    let grid = Grid { cell: 0.02, origin: [-0.6, -0.6], size: [60, 60] };
    let heights = Heights::between(-1.0, 1.0).unwrap();
    let mesh = shapes::sphere(0.5, 40);
    let cast = triangles::solids(&mesh.positions, &mesh.triangles, grid, heights).unwrap();
    let sampled = sampler::solids(grid, heights, 0.02, [-0.6, 0.6], |positions, out| {
        out.clear();
        out.extend(positions.iter().map(|position| (position.norm() - 0.5) as f32));
        Ok(())
    });
    let sampled = sampled.unwrap();
    let mut cells = vec![Vec::new(); grid.cells()];
    let sphere = Shape::Sphere { centre: DVec3::zeros(), radius: 0.5 };
    sphere.each_cell(&grid, &heights, |cell, solid| cells[grid.index(cell)].push(solid));
    let exact = Solids::new(grid, heights, cells);
    // At the rim lines are almost tangents.
    let (worst, others) = difference(&cast, &exact);
    assert!(worst < 0.03 && others < 60, "triangles: {worst} m, {others} cells");
    let (worst, others) = difference(&sampled, &exact);
    assert!(worst < 0.03 && others < 60, "distances: {worst} m, {others} cells");
    assert_eq!((cast.layers(), sampled.layers(), exact.layers()), (1, 1, 1));
}

#[test]
fn a_sheet_of_triangles_is_the_height_field_of_its_vertices() {
    // Vertices at the centres of cells.
    let grid = Grid { cell: 0.125, origin: [-2.0, 1.0], size: [33, 17] };
    let heights = Heights::between(-1.0, 1.0).unwrap();
    let mut dice = Dice(7);
    let tops: Vec<f32> = (0..grid.cells()).map(|_| dice.between(-0.9, 0.9) as f32).collect();
    let [nx, nz] = grid.size;
    let position = |index: usize| {
        let [x, z] = grid.centre([index % nx, index / nx]);
        Vec3::new(x as f32, tops[index], z as f32)
    };
    let square = |x: usize, z: usize| {
        let [a, b] = [grid.index([x, z]), grid.index([x, z + 1])].map(|index| index as u32);
        [[a, b, b + 1], [a, b + 1, a + 1]]
    };
    let sheet = TriMesh {
        positions: (0..grid.cells()).map(position).collect(),
        triangles: (0..nz - 1).flat_map(|z| (0..nx - 1).flat_map(move |x| square(x, z))).collect(),
    };
    let field = height::solids(tops.iter().map(|&top| top.into()), grid, heights).unwrap();
    let cast = triangles::solids(&sheet.positions, &sheet.triangles, grid, heights).unwrap();
    for z in 0..nz {
        for x in 0..nx {
            let index = grid.index([x, z]);
            // The last row and column are at the sheet's rim, which belongs to the side of greater x and z.
            let expected: &[Solid] = if x + 1 == nx || z + 1 == nz { &[] } else { field.cell(index) };
            assert_eq!(cast.cell(index), expected, "({x}, {z})");
        }
    }
}
