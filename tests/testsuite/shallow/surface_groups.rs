//! The surface of random layers of shallow liquids against its definition, quartet by quartet, and as a mesh.

use std::collections::{BTreeMap, BTreeSet};

use super::surface_mesh::{
    Mesh, Random, any_depths, build, build_with, columns, ground, pool, random_scene, rough_columns, units,
};
use frazil::shallow::columns::{Columns, NONE, STRIP};
use frazil::shallow::surface::{Check, Depths, Layout, Surface, bound, check};

/// The definition of links, groups and walls.
struct Definition<'a> {
    columns: &'a Columns,
    depth: &'a [i32],
}

impl Definition<'_> {
    fn height(&self, i: usize) -> i32 {
        self.columns.bases()[i] + self.depth[i]
    }

    fn holds(&self, i: usize, height: i32) -> bool {
        (self.columns.unders()[i]..self.columns.ceilings()[i]).contains(&height)
    }

    fn fit(&self, i: usize, j: usize) -> bool {
        let both_dry = self.depth[i] == 0 && self.depth[j] == 0;
        both_dry || self.holds(i, self.height(j)) && self.holds(j, self.height(i))
    }

    fn is_group(&self, group: &[usize]) -> bool {
        let pairs = group.iter().enumerate().all(|(at, &i)| group[at + 1..].iter().all(|&j| self.fit(i, j)));
        pairs && group.iter().any(|&i| self.depth[i] > 0)
    }

    fn ends_at(&self, i: usize, wall: usize) -> bool {
        let (height, ceiling) = (self.height(i), self.columns.ceilings()[i]);
        self.depth[i] > 0
            && self.holds(wall, height)
            && height < ceiling
            && ceiling <= self.columns.bases()[wall]
    }

    /// The triangles of a quartet, as sorted columns; none if a surface ends at a wall in it.
    fn triangles(&self, [x, z]: [usize; 2]) -> Option<BTreeSet<[usize; 3]>> {
        let cells = [[x, z], [x + 1, z], [x, z + 1], [x + 1, z + 1]];
        let corners = cells.map(|cell| self.columns.of_cell(cell).collect::<Vec<_>>());
        let all: Vec<usize> = corners.iter().flatten().copied().collect();
        if all
            .iter()
            .any(|&i| all.iter().any(|&j| self.columns.cell(i) != self.columns.cell(j) && self.ends_at(i, j)))
        {
            return None;
        }
        let [a, b, c, d] = &corners;
        let mut fours = Vec::new();
        for (&a, &b) in a.iter().flat_map(|a| b.iter().map(move |b| (a, b))) {
            for (&c, &d) in c.iter().flat_map(|c| d.iter().map(move |d| (c, d))) {
                fours.extend(self.is_group(&[a, b, c, d]).then_some([a, b, c, d]));
            }
        }
        let mut out = BTreeSet::new();
        let mut add = |mut triangle: [usize; 3]| {
            triangle.sort_unstable();
            out.insert(triangle);
        };
        for &[a, b, c, d] in &fours {
            let wet = [a, b, c, d].map(|i| self.depth[i] > 0);
            let height = [a, b, c, d].map(|i| i64::from(self.height(i)));
            let alike = [wet[0] == wet[3], wet[1] == wet[2]];
            let from_east = match alike {
                [true, false] => false,
                [false, true] => true,
                [true, true] if wet[0] != wet[1] => wet[1],
                _ => height[1] + height[2] > height[0] + height[3],
            };
            if from_east { [[a, b, c], [b, c, d]] } else { [[a, c, d], [a, b, d]] }
                .into_iter()
                .for_each(&mut add);
        }
        for omitted in 0..4 {
            let [p, q, r] =
                [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][omitted].map(|corner: usize| &corners[corner]);
            for (&p, &q) in p.iter().flat_map(|p| q.iter().map(move |q| (p, q))) {
                for &r in r {
                    let three = [p, q, r];
                    let in_four = fours.iter().any(|four| three.iter().all(|i| four.contains(i)));
                    if !in_four && self.is_group(&three) {
                        add(three);
                    }
                }
            }
        }
        Some(out)
    }
}

#[test]
fn every_quartet_has_the_triangles_of_its_groups() {
    let (mut compared, mut walled) = (0, 0);
    for seed in 0..300 {
        let (columns, depth) = random_scene(seed, [1, 4, 12][seed as usize % 3]);
        let mesh = build(&columns, &depth);
        let definition = Definition { columns: &columns, depth: &depth };
        let mut found: BTreeMap<[usize; 2], BTreeSet<[usize; 3]>> = BTreeMap::new();
        for triangle in &mesh.triangles {
            let cells = triangle.map(|vertex| mesh.cell(&columns, vertex));
            let corner = [0, 1].map(|axis| cells.iter().map(|cell| cell[axis]).min().unwrap());
            let mut triangle = triangle.map(|vertex| mesh.columns[vertex as usize] as usize);
            triangle.sort_unstable();
            let is_new = found.entry(corner).or_default().insert(triangle);
            assert!(is_new || triangle.contains(&(NONE as usize)), "seed {seed}: {triangle:?} twice");
        }
        let [nx, nz] = columns.grid.size;
        for (x, z) in (0..nx - 1).flat_map(|x| (0..nz - 1).map(move |z| (x, z))) {
            match definition.triangles([x, z]) {
                Some(expected) => {
                    assert_eq!(
                        found.remove(&[x, z]).unwrap_or_default(),
                        expected,
                        "seed {seed}: quartet ({x}, {z})"
                    );
                    compared += 1;
                }
                None => walled += 1,
            }
        }
    }
    assert!(compared > 20_000 && walled > 1_000, "{compared} quartets compared, {walled} with walls");
}

#[test]
fn random_surfaces_face_up_and_join_what_is_linked() {
    let (mut doubled, mut total) = (0, 0);
    for seed in 0..600 {
        let (columns, depth) = random_scene(1000 + seed, [1, 4, 12][seed as usize % 3]);
        let mesh = build(&columns, &depth);
        let indices = mesh.triangles.as_flattened();
        let checked = check(&columns, &depth, &mesh.columns, indices);
        assert_eq!(checked.unlinked, 0, "seed {seed}");
        for &triangle in &mesh.triangles {
            // Twice the area of half a cell, seen from above.
            assert!((mesh.up(triangle)[1] - 0.25).abs() < 1e-4, "seed {seed}: {triangle:?}");
        }
        let used: BTreeSet<u32> = indices.iter().copied().collect();
        assert_eq!(used.len(), mesh.positions.len(), "seed {seed}: a vertex without a triangle");
        for (normal, &column) in mesh.normals.iter().zip(&mesh.columns) {
            let length = normal.iter().map(|n| n * n).sum::<f32>();
            assert!((length - 1.0).abs() < 1e-5 && normal[1] > 0.0, "seed {seed}: {normal:?} of {column}");
        }
        // An edge with two triangles on one side: their third columns are not linked, the liquid parts into two layers.
        let definition = Definition { columns: &columns, depth: &depth };
        let mut thirds: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for &[a, b, c] in &mesh.triangles {
            for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
                thirds.entry([a, b]).or_default().push(c);
            }
        }
        for (edge, thirds) in thirds.iter().filter(|(_, thirds)| thirds.len() > 1) {
            doubled += thirds.len() - 1;
            let of_columns: Vec<u32> = thirds.iter().map(|&third| mesh.columns[third as usize]).collect();
            let is_linked = |a: u32, b: u32| {
                let cells = [a, b].map(|column| columns.cell(column as usize));
                let any_wet = depth[a as usize] + depth[b as usize] > 0;
                cells[0] != cells[1] && any_wet && definition.fit(a as usize, b as usize)
            };
            let any_linked = of_columns.iter().enumerate().any(|(at, &a)| {
                of_columns[at + 1..].iter().any(|&b| a != NONE && b != NONE && is_linked(a, b))
            });
            let cells = [edge[0], edge[1], thirds[0], thirds[1]].map(|vertex| mesh.cell(&columns, vertex));
            let corner = [0, 1].map(|axis| cells.iter().map(|cell| cell[axis]).min().unwrap());
            let has_walls = definition.triangles(corner).is_none();
            assert!(has_walls || !any_linked, "seed {seed}: {edge:?}, {of_columns:?}");
        }
        total += checked.doubled;
    }
    assert_eq!(doubled, total);
}

#[test]
fn a_missing_triangle_is_counted() {
    let columns = columns([6, 5], |_, _| vec![ground(0.5)]);
    let depth = pool(&columns, 0, 1.0);
    let mut mesh = build(&columns, &depth);
    let count = |mesh: &Mesh| check(&columns, &depth, &mesh.columns, mesh.triangles.as_flattened());
    assert_eq!(count(&mesh), Check::default());
    let first = mesh.triangles[0];
    mesh.triangles.push(first);
    assert_eq!(count(&mesh).doubled, 3);
    mesh.triangles.retain(|triangle| !triangle.contains(&0));
    assert_eq!(count(&mesh), Check { unlinked: 2, alone: 0, doubled: 0 });
}

#[test]
fn a_level_lake_in_caves_is_one_sheet_without_folds() {
    for seed in 0..30 {
        let phase = f64::from(seed);
        let wave = |x: usize, z: usize, layer: f64| {
            let (x, z) = (x as f64, z as f64);
            let waves = (0.13 * x + 1.7 * layer + phase).sin() + (0.11 * z + 0.9 * layer + 1.3 * phase).cos();
            (waves + (0.07 * (x + z) + layer + 0.7 * phase).sin()) / 3.0
        };
        // Rolling ground, and two ceilings above each other that come and go.
        let columns = columns([70, 50], |x, z| {
            let mut solids = vec![ground(0.8 + 0.6 * wave(x, z, 0.0))];
            for layer in [1.0, 2.0] {
                let (middle, half) =
                    (0.5 + 0.9 * layer + 0.6 * wave(x, z, layer), 0.5 * wave(x, z, 10.0 + layer));
                if half > 0.0 {
                    solids.push([units(middle - half), units(middle + half)]);
                }
            }
            solids
        });
        let level = 0.6 + 0.04 * phase;
        let mut depth = vec![0; columns.len()];
        for index in columns.indices() {
            depth[index] = (units(level).min(columns.ceilings()[index]) - columns.bases()[index]).max(0);
        }
        let mesh = build(&columns, &depth);
        mesh.assert_manifold();
        let is_level = |position: &[f32; 3]| (f64::from(position[1]) - level).abs() < 1e-6;
        assert!(mesh.positions.iter().all(is_level), "seed {seed}");
        // The lake's own columns have no hole: around each with a free surface are all triangles of its quartets.
        let mut corners = vec![0; columns.len()];
        for &vertex in
            mesh.triangles.as_flattened().iter().filter(|vertex| mesh.columns[**vertex as usize] != NONE)
        {
            corners[mesh.columns[vertex as usize] as usize] += 1;
        }
        let [nx, nz] = columns.grid.size;
        for index in columns.indices().filter(|&index| depth[index] > 0) {
            let [x, z] = columns.cell(index);
            let is_free = columns.bases()[index] + depth[index] < columns.ceilings()[index];
            let is_inner = x > 0 && z > 0 && x + 1 < nx && z + 1 < nz;
            assert!(
                !is_free || !is_inner || corners[index] >= 4,
                "seed {seed}: ({x}, {z}) in {} triangles",
                corners[index]
            );
        }
    }
}

#[test]
fn a_step_between_layers_is_a_surface_without_doubled_edges() {
    // Terraces that overhang: each cell's floor is drawn among three heights, with ceilings far above any level.
    for seed in 0..200 {
        let mut random = Random(seed);
        let floors: Vec<u32> = (0..30 * 12).map(|_| random.below(3)).collect();
        let columns = columns([30, 12], |x, z| vec![ground(0.2 + 0.3 * f64::from(floors[z * 30 + x]))]);
        let depth = pool(&columns, 0, 0.2 + 0.05 * f64::from(random.below(20)));
        let mesh = build(&columns, &depth);
        mesh.assert_manifold();
    }
}

#[test]
fn a_turned_scene_has_the_turned_surface() {
    for seed in 0..60 {
        let (columns, depth) = random_scene(5000 + seed, [1, 4, 12][seed as usize % 3]);
        let [nx, nz] = columns.grid.size;
        let mesh = build(&columns, &depth);
        // A quarter turn: (x, z) goes to (nz - 1 - z, x).
        let solids = |x: usize, z: usize| {
            let cell = [z, nz - 1 - x];
            columns.of_cell(cell).map(|index| [columns.unders()[index], columns.bases()[index]]).collect()
        };
        let turned = self::columns([nz, nx], solids);
        let mut turned_depth = vec![0; turned.len()];
        for index in turned.indices() {
            let [x, z] = turned.cell(index);
            turned_depth[index] = depth[columns.column([z, nz - 1 - x], turned.layer(index)).unwrap()];
        }
        let turned_mesh = build(&turned, &turned_depth);
        assert_eq!(turned_mesh.counts, mesh.counts, "seed {seed}");
        // Heights and normals are the same to the bit.
        let bits = |mesh: &Mesh, columns: &Columns, turn: bool| {
            let vertices = (0..mesh.positions.len()).map(|vertex| {
                let [x, z] = mesh.cell(columns, vertex as u32);
                let [nx, ny, nw] = mesh.normals[vertex];
                let (cell, normal) =
                    if turn { ([nz - 1 - z, x], [0.0 - nw, ny, nx]) } else { ([x, z], [nx, ny, nw]) };
                (
                    cell,
                    mesh.layers[vertex],
                    mesh.positions[vertex][1].to_bits(),
                    normal.map(|n| (n + 0.0).to_bits()),
                )
            });
            vertices.collect::<BTreeSet<_>>()
        };
        assert!(bits(&mesh, &columns, true) == bits(&turned_mesh, &turned, false), "seed {seed}");
    }
}

#[test]
fn one_maker_serves_all_scenes_and_activity_saves_only_time() {
    let mut surface = Surface::default();
    for seed in 0..60 {
        let (columns, mut depth) = random_scene(8000 + seed / 3, 4);
        // Half of the frames have a puddle only.
        if seed % 2 == 0 {
            depth.iter_mut().skip(columns.len() / 8).for_each(|depth| *depth = 0);
        }
        let active: Vec<bool> =
            depth.chunks(STRIP).map(|strip| strip.iter().any(|depth| *depth > 0)).collect();
        surface.reserve(&columns);
        let layout = Layout { least_depth: 0.02, ..Layout::default() };
        let (all, some) = (
            Depths { depth: &depth, ..Depths::default() },
            Depths { depth: &depth, active: Some(&active), ..Depths::default() },
        );
        let first = build_with(&mut Surface::default(), &columns, &all, &layout);
        for depths in [&all, &some] {
            assert!(build_with(&mut surface, &columns, depths, &layout) == first, "seed {seed}");
            assert_eq!(surface.count(&columns, depths).unwrap(), first.counts, "seed {seed}");
        }
    }
}

#[test]
fn no_liquid_in_rough_layers_needs_more_than_the_bound() {
    let mut surface = Surface::default();
    let mut close = 0;
    for seed in 0..5000 {
        let mut random = Random(seed);
        let columns = rough_columns(&mut random);
        let most = bound(&columns);
        for _ in 0..20 {
            let depth = any_depths(&columns, &mut random);
            let depths = Depths { depth: &depth, ..Depths::default() };
            let counts = surface.count(&columns, &depths).unwrap();
            assert!(
                counts.vertices <= most.vertices
                    && counts.extras <= most.extras
                    && counts.indices <= most.indices,
                "seed {seed}: {counts:?} of {most:?}, depths {depth:?}"
            );
            close += usize::from(3 * counts.indices > 2 * most.indices);
        }
    }
    assert!(close > 10_000, "{close} liquids need two thirds of the bound");
}

#[test]
fn the_bound_is_near_what_liquids_below_uneven_ceilings_need() {
    for seed in 0..3 {
        let mut random = Random(seed);
        let cells: Vec<f64> = (0..40 * 40).map(|_| 0.02 * f64::from(random.below(1000)) / 1000.0).collect();
        let columns = columns([40, 40], |x, z| {
            let at = cells[40 * z + x];
            vec![ground(0.3 + at), [units(0.9 + at), units(1.2 + at)], [units(1.8 + at), units(2.1 + at)]]
        });
        let most = bound(&columns);
        let mut depth = vec![0; columns.len()];
        for index in columns.indices() {
            depth[index] = columns.ceilings()[index] - columns.bases()[index] - 1;
        }
        let need = |depth: &[i32]| {
            Surface::default().count(&columns, &Depths { depth, ..Depths::default() }).unwrap()
        };
        let full = need(&depth);
        assert!(4 * full.vertices > 3 * most.vertices, "{full:?} of {most:?}");
        // Every other column, as on a chessboard.
        for index in columns.indices() {
            let [x, z] = columns.cell(index);
            depth[index] *= ((x + z) % 2) as i32;
        }
        let every_other = need(&depth);
        assert!(8 * every_other.indices > 5 * most.indices, "{every_other:?} of {most:?}");
    }
}
