//! The surface of shallow liquids on shapes whose mesh is known.

use std::collections::BTreeSet;

use super::surface_mesh::{Mesh, build, build_with, columns, ground, pool, units};
use frazil::shallow::columns::{Columns, NONE, STRIP};
use frazil::shallow::surface::{Counts, Depths, Indices, Layout, Surface, Target, Up, bound};

#[test]
fn a_pool_that_fills_its_domain_is_a_plane_of_cells() {
    // Strips of 16 cells: shorter, exactly one, and longer.
    for n in [2, 3, 15, 16, 17, 18, 33, 48] {
        let columns = columns([n, n + 1], |x, z| vec![ground(0.1 * ((x + 2 * z) % 5) as f64)]);
        let mesh = build(&columns, &pool(&columns, 0, 1.0));
        assert_eq!(mesh.counts, Counts { vertices: n * (n + 1), extras: 0, indices: 6 * (n - 1) * n }, "{n}");
        assert_eq!(mesh.counts, bound(&columns), "{n}");
        mesh.assert_manifold();
        assert_eq!(mesh.euler(), 1, "{n}");
        assert!(mesh.positions.iter().all(|position| (position[1] - 1.0).abs() < 1e-6), "{n}");
        assert!(mesh.normals.iter().all(|normal| *normal == [0.0, 1.0, 0.0]), "{n}");
        assert!(mesh.triangles.iter().all(|&triangle| mesh.up(triangle)[1] > 0.0), "{n}");
    }
}

#[test]
fn dry_columns_around_a_pool_take_its_level() {
    // A basin of 5 x 20 cells in a steep bank, and an island of 2 x 3 in it.
    let is_wet = |x: usize, z: usize| {
        (3..23).contains(&x) && (2..7).contains(&z) && !((9..11).contains(&x) && (3..6).contains(&z))
    };
    let columns =
        columns([26, 9], |x, z| vec![ground(if is_wet(x, z) { 0.5 } else { 2.0 + 0.05 * x as f64 })]);
    let mesh = build(&columns, &pool(&columns, 0, 1.0));
    mesh.assert_manifold();
    // The shore of the island is a ring of its cells: no quartet within it has a wet column.
    assert_eq!(mesh.counts.indices, 3 * 2 * (21 * 6 - 2));
    assert_eq!(mesh.euler(), 0, "a disc with a hole");
    assert!(mesh.positions.iter().all(|position| (position[1] - 1.0).abs() < 1e-6));
    assert!(mesh.normals.iter().all(|normal| *normal == [0.0, 1.0, 0.0]));
    let dry = mesh.depths.iter().filter(|depth| **depth == 0.0).count();
    assert_eq!(dry, 2 * 22 + 2 * 5 + 6, "around, and the island");
    let of_columns = mesh.columns.iter().zip(&mesh.depths);
    assert!(of_columns.clone().all(|(&column, &depth)| {
        let [x, z] = columns.cell(column as usize);
        (depth - if is_wet(x, z) { 0.5 } else { 0.0 }).abs() < 1e-6
    }));
    assert!(mesh.columns.is_sorted(), "in order of columns");
}

#[test]
fn a_pool_has_the_same_vertices_wherever_its_strips_begin() {
    // Waves on rolling ground with islands, 40 cells long, in strips of 16 that begin anywhere in it.
    let mut first = None;
    for shift in 0..STRIP {
        let wave = |x: usize, z: usize| ((3 * x + 5 * z) as f64 * 0.7).sin();
        let columns = columns([STRIP + 40, 11], |x, z| match x.checked_sub(shift) {
            Some(x) if x < 40 => {
                vec![ground(1.0 + 0.05 * wave(x, z) + f64::from(x % 19 == 12 && z % 4 == 1))]
            }
            _ => vec![],
        });
        let mut depth = vec![0; columns.len()];
        for index in columns.indices() {
            let [x, z] = columns.cell(index);
            let level = units(1.2 + 0.04 * wave(z, x - shift));
            depth[index] = (level - columns.bases()[index]).max(0);
        }
        let mesh = build(&columns, &depth);
        let vertex = |at: usize| {
            let [x, z] = mesh.cell(&columns, at as u32);
            let ([_, height, _], normal) = (mesh.positions[at], mesh.normals[at]);
            ([x - shift, z], [height, mesh.depths[at]].map(f32::to_bits), normal.map(f32::to_bits))
        };
        let vertices: Vec<_> = (0..mesh.positions.len()).map(vertex).collect();
        assert!(vertices.len() > 400, "{}", vertices.len());
        let sorted = vertices.into_iter().collect::<BTreeSet<_>>();
        assert!(*first.get_or_insert_with(|| sorted.clone()) == sorted, "shifted by {shift}");
    }
}

#[test]
fn normals_follow_a_slope_and_end_with_it() {
    // A film of constant depth on a plane that falls by 0.1 a cell (of 0.5 m) to the east.
    let columns = columns([40, 20], |x, _| vec![ground(4.0 - 0.1 * x as f64 / 1.1)]);
    let depth: Vec<i32> =
        (0..columns.len()).map(|index| if columns.is_column(index) { units(0.01) } else { 0 }).collect();
    let mesh = build(&columns, &depth);
    let slope = 0.1 / 1.1 / 0.5;
    let expected = [slope / f64::hypot(slope, 1.0), 1.0 / f64::hypot(slope, 1.0), 0.0];
    for normal in &mesh.normals {
        assert!(
            (0..3).all(|n| (f64::from(normal[n]) - expected[n]).abs() < 1e-5),
            "{normal:?} is not {expected:?}"
        );
    }
}

#[test]
fn each_layout_points_triangles_along_their_normals() {
    let columns = columns([5, 4], |x, z| vec![ground(0.1 * x as f64 + 0.2 * z as f64)]);
    let depth: Vec<i32> =
        (0..columns.len()).map(|index| i32::from(columns.is_column(index)) * units(0.2)).collect();
    let velocity = vec![[2.0, 4.0]; columns.len()];
    let depths = Depths { depth: &depth, velocity: &velocity, ..Depths::default() };
    for (up, left_handed) in [(Up::Y, false), (Up::Y, true), (Up::Z, false), (Up::Z, true)] {
        let layout = Layout { scale: 100.0, up, left_handed, opaque_depth: 0.4, ..Layout::default() };
        let mesh = build_with(&mut Surface::default(), &columns, &depths, &layout);
        // East, up and south of each layout.
        let south = if left_handed == (up == Up::Y) { -1.0 } else { 1.0 };
        let order = |[x, y, z]: [f32; 3]| if up == Up::Y { [x, y, z * south] } else { [x, z * south, y] };
        for (vertex, &column) in mesh.columns.iter().enumerate() {
            let [x, z] = columns.grid.centre(columns.cell(column as usize)).map(|at| at as f32 * 100.0);
            let y = (columns.heights.metres(columns.bases()[column as usize]) + 0.2) as f32 * 100.0;
            let expected = order([x, y, z]);
            assert!(
                (0..3).all(|n| (mesh.positions[vertex][n] - expected[n]).abs() < 1e-3),
                "{up:?} {left_handed}"
            );
            assert_eq!(mesh.velocities[vertex], order([300.0, 0.0, 600.0]), "1.5 times the mean, in cm/s");
            assert!((mesh.depths[vertex] - 20.0).abs() < 1e-4 && (mesh.opacities[vertex] - 0.5).abs() < 1e-6);
            let normal = order([-0.2, 1.0, -0.4].map(|n: f32| n / 1.2f32.sqrt()));
            assert!(
                (0..3).all(|n| (mesh.normals[vertex][n] - normal[n]).abs() < 1e-5),
                "{up:?} {left_handed}"
            );
        }
        for &triangle in &mesh.triangles {
            let (along, normal) = (mesh.up(triangle), mesh.normals[triangle[0] as usize]);
            assert!((0..3).map(|n| along[n] * normal[n]).sum::<f32>() > 0.0, "{up:?} {left_handed}");
        }
    }
}

/// Ground at 0.5 m, and a bridge 3 cells wide along z from 1.5 to 2 m.
fn bridge() -> Columns {
    columns([20, 12], |x, _| {
        if (8..11).contains(&x) { vec![ground(0.5), [units(1.5), units(2.0)]] } else { vec![ground(0.5)] }
    })
}

#[test]
fn a_surface_passes_under_a_bridge_into_it_and_over_it() {
    let columns = bridge();
    let level =
        |mesh: &Mesh, level: f32| mesh.positions.iter().all(|position| (position[1] - level).abs() < 1e-6);
    let under = build(&columns, &pool(&columns, 0, 1.0));
    under.assert_manifold();
    assert_eq!((under.counts.indices, under.euler()), (6 * 19 * 11, 1));
    assert!(level(&under, 1.0) && under.layers.iter().all(|layer| *layer == 0));
    // Between underside and deck: the space under it is full, and the surface ends within the bridge.
    let within = build(&columns, &pool(&columns, 0, 1.75));
    within.assert_manifold();
    assert_eq!((within.counts.indices, within.euler()), (6 * 17 * 11, 2), "two pools");
    assert!(level(&within, 1.75));
    assert_eq!(within.layers.iter().filter(|layer| **layer == 1).count(), 2 * 12, "dry columns of the deck");
    // Over it.
    let mut depth = pool(&columns, 0, 3.0);
    for index in columns.indices().filter(|&index| columns.layer(index) == 1) {
        depth[index] = units(1.0);
    }
    let over = build(&columns, &depth);
    over.assert_manifold();
    assert_eq!((over.counts.indices, over.euler()), (6 * 19 * 11, 1));
    assert!(level(&over, 3.0));
    // A film on the deck, and water under it: two sheets, and no triangle joins them.
    let mut depth = pool(&columns, 0, 1.0);
    for index in columns.indices().filter(|&index| columns.layer(index) == 1) {
        depth[index] = units(0.01);
    }
    let both = build(&columns, &depth);
    both.assert_manifold();
    assert_eq!((both.counts.indices, both.euler()), (6 * 19 * 11 + 6 * 2 * 11, 2));
    for triangle in &both.triangles {
        assert!(
            triangle.iter().all(|&vertex| both.layers[vertex as usize] == both.layers[triangle[0] as usize])
        );
    }
}

#[test]
fn extra_vertices_carry_a_surface_into_the_walls_of_a_cave() {
    // A cave of 4 x 3 cells in a hill, 1 m high, open to the west.
    let is_cave = |x: usize, z: usize| x < 8 && (3..6).contains(&z);
    let hill = |x: usize, z: usize| match (x < 4, is_cave(x, z)) {
        (true, _) => vec![ground(0.5)],
        (_, true) => vec![ground(0.5), [units(1.5), units(3.0)]],
        _ => vec![ground(3.0)],
    };
    let columns = columns([12, 9], hill);
    let mesh = build(&columns, &pool(&columns, 0, 1.0));
    mesh.assert_manifold();
    assert_eq!(mesh.euler(), 1);
    assert!(mesh.positions.iter().all(|position| (position[1] - 1.0).abs() < 1e-6));
    assert!(mesh.normals.iter().all(|normal| *normal == [0.0, 1.0, 0.0]));
    // Along both sides and around the end; beside the mouth the hill's own columns serve, which are linked with the open water.
    assert_eq!(mesh.counts.extras, 2 * 3 + 3 + 2);
    assert_eq!(mesh.columns.iter().filter(|column| **column == NONE).count(), mesh.counts.extras);
    // Open water with the foot of the hill, and the cave with its walls.
    assert_eq!(mesh.counts.indices, 6 * (4 * 8 + 4 * 4));
    let ends: BTreeSet<[usize; 2]> = (0..mesh.positions.len() as u32)
        .filter(|&vertex| mesh.columns[vertex as usize] == NONE)
        .map(|vertex| mesh.cell(&columns, vertex))
        .collect();
    let expected = (5..9).flat_map(|x| [[x, 2], [x, 6]]).chain((3..6).map(|z| [8, z])).collect();
    assert_eq!(ends, expected);
}

#[test]
fn indices_of_16_bits_are_the_same() {
    let columns = columns([40, 30], |x, z| vec![ground(0.02 * ((7 * x + 5 * z) % 11) as f64)]);
    let depth = pool(&columns, 0, 0.15);
    let mesh = build(&columns, &depth);
    let mut indices = vec![0u16; mesh.counts.indices];
    let mut target = Target { indices: Indices::U16(&mut indices), ..Target::default() };
    let depths = Depths { depth: &depth, ..Depths::default() };
    let counts = Surface::default().build(&columns, &depths, &Layout::default(), &mut target).unwrap();
    assert_eq!(counts, mesh.counts);
    assert!(indices.iter().map(|&index| u32::from(index)).eq(mesh.triangles.as_flattened().iter().copied()));
}

#[test]
fn what_does_not_fit_is_an_error_and_writes_nothing() {
    let columns = columns([300, 300], |_, _| vec![ground(0.5)]);
    let depth = pool(&columns, 0, 1.0);
    let fails = |depths: &Depths<'_>, layout: &Layout, target: &mut Target<'_>, message: &str| {
        let error = Surface::default().build(&columns, depths, layout, target).unwrap_err();
        assert_eq!(error.to_string(), message);
    };
    let (good, layout) = (Depths { depth: &depth, ..Depths::default() }, Layout::default());
    let mut indices = vec![7u16; bound(&columns).indices];
    let mut positions = vec![7.0; 300 * 300 * 3 - 1];
    let mut target = Target { indices: Indices::U16(&mut indices), ..Target::default() };
    fails(&good, &layout, &mut target, "90000 vertices are too many for indices of 16 bits: use those of 32");
    assert!(indices.iter().all(|index| *index == 7));
    let mut target = Target { positions: Some(&mut positions), ..Target::default() };
    fails(&good, &layout, &mut target, "positions has room for 269999 numbers, and the surface has 270000");
    assert!(positions.iter().all(|number| *number == 7.0));
    let mut target = Target { indices: Indices::U16(&mut indices[..6]), ..Target::default() };
    fails(&good, &layout, &mut target, "indices has room for 6 numbers, and the surface has 536406");
    let mut target = Target { velocities: Some(&mut positions), ..Target::default() };
    fails(&good, &layout, &mut target, "velocities of the surface are wanted, and the liquid has none");
    let mut none = Target::default();
    let len = columns.len();
    fails(
        &Depths { depth: &depth[1..], ..good },
        &layout,
        &mut none,
        &format!("{} depths for {len} indices: one each is needed", len - 1),
    );
    fails(
        &Depths { velocity: &[[0.0; 2]], ..good },
        &layout,
        &mut none,
        &format!("1 velocities for {len} indices: one each is needed"),
    );
    fails(
        &Depths { active: Some(&[true]), ..good },
        &layout,
        &mut none,
        &format!("1 flags of activity for {} strips: one each is needed", len / 16),
    );
    let bad = |name: &str, layout: Layout, what: &str| {
        fails(&good, &layout, &mut Target::default(), &format!("{name} = {what}"));
    };
    bad("scale", Layout { scale: 0.0, ..layout }, "0 is not positive and finite");
    bad("opaque_depth", Layout { opaque_depth: f64::NAN, ..layout }, "NaN is not positive and finite");
    bad("least_depth", Layout { least_depth: -0.5, ..layout }, "-0.5 is negative or not finite");
}

#[test]
fn depths_that_no_liquid_has_are_no_panic() {
    let columns = columns([20, 20], |x, _| vec![ground(0.5), [units(1.0 + 0.01 * x as f64), units(2.0)]]);
    for fill in [i32::MIN, -1, 0, 1, i32::MAX] {
        let depth = vec![fill; columns.len()];
        let mesh = build(&columns, &depth);
        assert_eq!(mesh.triangles.is_empty(), fill <= 0, "{fill}");
    }
}

#[test]
fn a_least_depth_lifts_thin_films() {
    let columns = columns([20, 5], |x, _| vec![ground(if x < 10 { 0.5 } else { 1.0 })]);
    let mut depth = pool(&columns, 0, 0.51);
    for index in columns.indices() {
        if depth[index] == 0 {
            depth[index] = units(0.2);
        }
    }
    let layout = Layout { least_depth: 0.1, ..Layout::default() };
    let mesh = build_with(
        &mut Surface::default(),
        &columns,
        &Depths { depth: &depth, ..Depths::default() },
        &layout,
    );
    for (position, &column) in mesh.positions.iter().zip(&mesh.columns) {
        let expected = if columns.cell(column as usize)[0] < 10 { 0.6 } else { 1.2 };
        assert!((position[1] - expected).abs() < 1e-6, "{position:?}");
    }
    assert!((mesh.depths[0] - 0.01).abs() < 1e-6, "depths are the liquid's");
}

#[test]
fn vertices_carry_what_their_columns_do_and_dry_ones_what_is_around() {
    // A pool with an island, of different concentrations.
    let is_dry = |[x, z]: [usize; 2]| (5..8).contains(&x) && z == 4;
    let columns = columns([20, 9], |x, z| vec![ground(if is_dry([x, z]) { 2.0 } else { 0.5 })]);
    let depth = pool(&columns, 0, 1.0);
    let dye: Vec<f32> = (0..columns.len())
        .map(|index| if depth[index] > 0 { (index * 37 % 101) as f32 / 100.0 } else { 0.0 })
        .collect();
    let more = vec![0.25; columns.len()];
    let mut carried = [&[][..]; 4];
    (carried[0], carried[2]) = (&dye, &more);
    let depths = Depths { depth: &depth, carried, ..Depths::default() };
    let mut surface = Surface::default();
    let count = surface.count(&columns, &depths).unwrap().vertices;
    let (mut own, mut same, mut of) = (vec![f32::NAN; count + 1], vec![f32::NAN; count], vec![0; count]);
    let mut target = Target { columns: Some(&mut of), ..Target::default() };
    target.carried[0] = Some(&mut own);
    target.carried[2] = Some(&mut same);
    surface.build(&columns, &depths, &Layout::default(), &mut target).unwrap();
    assert!(own[count].is_nan(), "nothing is written behind the mesh");
    let mut dry = 0;
    for (&column, &own) in of.iter().zip(&own) {
        let column = column as usize;
        if depth[column] > 0 {
            assert_eq!(own, dye[column]);
            continue;
        }
        let [x, z] = columns.cell(column);
        let cells = (z - 1..=z + 1).flat_map(|z| (x - 1..=x + 1).map(move |x| [x, z]));
        let wet = cells.map(|cell| columns.column(cell, 0).unwrap()).filter(|&index| depth[index] > 0);
        let around: Vec<f32> = wet.map(|index| dye[index]).collect();
        let mean = around.iter().sum::<f32>() / around.len() as f32;
        assert!((own - mean).abs() < 1e-6, "{own} at {x}, {z}, and not {mean}");
        dry += 1;
    }
    assert_eq!(dry, 3);
    assert!(same.iter().all(|number| *number == 0.25));
    let mut refused = |depths: &Depths<'_>, target: &mut Target<'_>, words: &str| {
        let error = surface.build(&columns, depths, &Layout::default(), target).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    let mut room = vec![f32::NAN; count];
    let mut target = Target::default();
    target.carried[1] = Some(&mut room);
    refused(&depths, &mut target, "concentrations of the surface are wanted");
    let mut short = vec![0.0; count - 1];
    let mut target = Target::default();
    target.carried[2] = Some(&mut short);
    refused(&depths, &mut target, "carried has room for");
    let depths = Depths { carried: [&dye[1..], &[], &[], &[]], ..depths };
    let len = columns.len();
    let words = format!("{} concentrations for {len} indices: one each is needed", len - 1);
    refused(&depths, &mut Target::default(), &words);
    assert!(room.iter().all(|number| number.is_nan()));
}
