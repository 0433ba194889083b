//! Scenes of shallow liquids, and the meshes of their surfaces, for the tests beside this file.

use std::collections::{BTreeMap, BTreeSet};

use frazil::shallow::columns::Columns;
use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights, TOP};
use frazil::shallow::surface::{Counts, Depths, Indices, Layout, Surface, Target, bound};
use frazil::shallow::terrain::Solids;

/// Cells of 0.5 m and heights from 0 to 4 m, as `TOP` units.
pub fn columns(size: [usize; 2], solids: impl Fn(usize, usize) -> Vec<[i32; 2]>) -> Columns {
    let grid = Grid { cell: 0.5, origin: [-1.0, 2.0], size };
    let heights = Heights::between(0.0, 4.0).unwrap();
    Columns::new(&Solids::new(
        grid,
        heights,
        (0..grid.cells()).map(|cell| solids(cell % size[0], cell / size[0])),
    ))
}

/// Units of metres.
pub fn units(metres: f64) -> i32 {
    (metres / 4.0 * f64::from(TOP)).round() as i32
}

pub fn ground(top: f64) -> [i32; 2] {
    [BOTTOMLESS, units(top)]
}

/// Fills the columns of a layer up to a level (m), or to their ceilings.
pub fn pool(columns: &Columns, layer: usize, level: f64) -> Vec<i32> {
    let mut depth = vec![0; columns.len()];
    for index in columns.indices().filter(|&index| columns.layer(index) == layer) {
        depth[index] = (units(level).min(columns.ceilings()[index]) - columns.bases()[index]).max(0);
    }
    depth
}

#[derive(Debug, Default, PartialEq)]
pub struct Mesh {
    pub counts: Counts,
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub depths: Vec<f32>,
    pub opacities: Vec<f32>,
    pub velocities: Vec<[f32; 3]>,
    pub layers: Vec<u32>,
    pub columns: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
}

pub fn build_with(surface: &mut Surface, columns: &Columns, liquid: &Depths<'_>, layout: &Layout) -> Mesh {
    let mut most = bound(columns);
    if let Some(ledges) = liquid.ledges {
        most.vertices += ledges.bound().vertices;
        most.indices += ledges.bound().indices;
    }
    let mut vectors = [(); 3].map(|()| vec![f32::NAN; 3 * most.vertices]);
    let mut numbers = [(); 2].map(|()| vec![f32::NAN; most.vertices]);
    let mut labels = [(); 2].map(|()| vec![77; most.vertices]);
    let mut indices = vec![u32::MAX; most.indices];
    let [positions, normals, velocities] = &mut vectors;
    let ([depth, opacity], [layers, of_columns]) = (&mut numbers, &mut labels);
    let mut target = Target {
        positions: Some(positions),
        normals: Some(normals),
        depths: Some(depth),
        opacities: Some(opacity),
        velocities: (!liquid.velocity.is_empty()).then_some(velocities),
        layers: Some(layers),
        columns: Some(of_columns),
        indices: Indices::U32(&mut indices),
        ..Target::default()
    };
    let counts = surface.build(columns, liquid, layout, &mut target).unwrap();
    assert!(counts.vertices <= most.vertices && counts.indices <= most.indices, "{counts:?} of {most:?}");
    let [positions, normals, velocities] = vectors.map(|all| all.as_chunks().0[..counts.vertices].to_vec());
    let [depths, opacities] = numbers.map(|all| all[..counts.vertices].to_vec());
    let [layers, of_columns] = labels.map(|all| all[..counts.vertices].to_vec());
    let triangles = indices[..counts.indices].as_chunks().0.to_vec();
    let velocities = if liquid.velocity.is_empty() { Vec::new() } else { velocities };
    Mesh { counts, positions, normals, depths, opacities, velocities, layers, columns: of_columns, triangles }
}

pub fn build(columns: &Columns, depth: &[i32]) -> Mesh {
    build_with(&mut Surface::default(), columns, &Depths { depth, ..Depths::default() }, &Layout::default())
}

impl Mesh {
    pub fn edges(&self) -> BTreeMap<[u32; 2], usize> {
        let mut edges = BTreeMap::new();
        for &[a, b, c] in &self.triangles {
            for edge in [[a, b], [b, c], [c, a]] {
                *edges.entry(edge).or_insert(0) += 1;
            }
        }
        edges
    }

    /// Vertices - edges + triangles.
    pub fn euler(&self) -> i64 {
        let edges: BTreeSet<[u32; 2]> = self.edges().keys().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
        self.positions.len() as i64 - edges.len() as i64 + self.triangles.len() as i64
    }

    /// Every vertex is in a triangle, and every edge in one triangle, or in two in opposite directions.
    pub fn assert_manifold(&self) {
        assert!(self.edges().values().all(|&count| count == 1), "an edge has two triangles on one side");
        let used: BTreeSet<u32> = self.triangles.iter().flatten().copied().collect();
        assert_eq!(used.len(), self.positions.len(), "a vertex without a triangle");
    }

    pub fn up(&self, triangle: [u32; 3]) -> [f32; 3] {
        let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize]);
        let (p, q) = ([0, 1, 2].map(|n| b[n] - a[n]), [0, 1, 2].map(|n| c[n] - a[n]));
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    }

    /// Cell of a vertex.
    pub fn cell(&self, columns: &Columns, vertex: u32) -> [usize; 2] {
        let [x, _, z] = self.positions[vertex as usize];
        columns.grid.cell_at([f64::from(x), f64::from(z)]).unwrap()
    }
}

/// Numbers from a seed.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, bound: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) % u64::from(bound)) as u32
    }
}

/// Up to four layers of random solids, and depths from dry to full; `bumps` in units of 0.05 m.
pub fn random_scene(seed: u64, bumps: u32) -> (Columns, Vec<i32>) {
    let mut random = Random(seed);
    let size = [2 + random.below(38) as usize, 2 + random.below(8) as usize];
    let mut cells = Vec::new();
    for _ in 0..size[0] * size[1] {
        let mut cell = Vec::new();
        for floor in 0..4 {
            let at = 0.9 * f64::from(floor) + 0.05 * f64::from(random.below(bumps));
            if random.below(8) > 0 {
                let bottom = if floor == 0 && random.below(20) > 0 { BOTTOMLESS } else { units(at) };
                cell.push([bottom, units(at + 0.05 * f64::from(1 + random.below(bumps)))]);
            }
        }
        cells.push(cell);
    }
    let columns = columns(size, |x, z| cells[z * size[0] + x].clone());
    let mut depth = vec![0; columns.len()];
    let levels: Vec<f64> =
        (0..4).map(|floor| 0.9 * f64::from(floor) + 0.05 * f64::from(random.below(20))).collect();
    for index in columns.indices() {
        let (base, ceiling) = (columns.bases()[index], columns.ceilings()[index]);
        depth[index] = match random.below(8) {
            0 => 0,
            1 => ceiling - base,
            2 => units(0.05) * random.below(20) as i32,
            _ => units(levels[columns.layer(index).min(3)]) - base,
        }
        .clamp(0, ceiling - base);
    }
    (columns, depth)
}

/// A few cells of one to three rough layers: steps up to the space between layers, some of which are missing.
pub fn rough_columns(random: &mut Random) -> Columns {
    let size = [[2, 2], [3, 2], [3, 3], [4, 4]][random.below(4) as usize];
    let (gap, rough, layers) =
        (4 + random.below(12) as i32, 1 + random.below(10), 1 + random.below(3) as i32);
    let mut cells = Vec::new();
    for _ in 0..size[0] * size[1] {
        let (mut cell, mut at) = (Vec::new(), random.below(rough) as i32);
        for layer in 0..layers {
            if layer > 0 && random.below(6) == 0 {
                at += gap;
                continue;
            }
            let top = at + 1 + random.below(rough) as i32;
            cell.push([if layer == 0 { BOTTOMLESS } else { at }, top]);
            at = (top + 1 + random.below(3) as i32).max((layer + 1) * gap + random.below(rough) as i32);
        }
        cells.push(cell);
    }
    columns(size, |x, z| cells[z * size[0] + x].clone())
}

/// Depths of all kinds: dry, anything, full and just below.
pub fn any_depths(columns: &Columns, random: &mut Random) -> Vec<i32> {
    let mut depth = vec![0; columns.len()];
    let wet = 1 + random.below(4);
    for index in columns.indices() {
        let room = columns.ceilings()[index].min(60) - columns.bases()[index];
        if random.below(wet + 1) > 0 && room > 0 {
            depth[index] = match random.below(4) {
                0 => room - 1,
                1 => room,
                _ => random.below(room as u32 + 1) as i32,
            };
        }
    }
    depth
}
