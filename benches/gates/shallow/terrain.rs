//! Gates of shallow's terrain: solids of triangles against exact winding numbers, and thread CPU time of casting moving triangles again.

use std::ops::Range;

use frazil::geometry::{TriMesh, Vec3};
use frazil::numeric::cpu::cpu_level;
use frazil::shallow::columns::grid::{Grid, Heights};
use frazil::shallow::terrain::triangles::{self, Caster};
use frazil::shallow::{Params, Shallow};

use crate::common::bodies::Dice;
use crate::common::exact_lines::{random, wrong};
use crate::common::shallow::context;
use crate::common::shapes;
use crate::harness::{Harness, median};
use crate::shallow::speed::thread_seconds;

/// Random solids, and lines through each.
const SOLIDS: u64 = 1000;
const LINES: usize = 24;
/// Cells of the domain along an edge, and of a box in its middle; a cell's edge (m).
const EDGE: usize = 200;
const BOX: usize = 40;
const CELL: f64 = 0.0005;
/// Casts that are timed, each of triangles that have moved.
const CASTS: usize = 41;

/// All of them.
pub fn run(h: &mut Harness) {
    h.measure("shallow.terrain_wrong", against_windings);
    let middle = (EDGE - BOX) / 2..(EDGE + BOX) / 2;
    let all = 0..EDGE;
    let terrains = terrains();
    let [sheet, sphere, spheres] = terrains.each_ref();
    // Each vertical line meets a sheet or a closed surface once or twice, and the many spheres some seven times.
    h.measure("shallow.terrain_all", || time(&all, &[sheet, sphere]));
    h.measure("shallow.terrain_overlapping", || time(&all, &[spheres]));
    h.measure("shallow.terrain_box", || time(&middle, &[sheet, sphere, spheres]));
}

/// Times casts of the triangles of terrains through a box of cells: the slowest of them.
fn time(cells: &Range<usize>, terrains: &[&(&str, TriMesh)]) -> (f64, String) {
    let (mut worst, mut note) = (0.0, format!("{:?}", cpu_level()));
    for (which, mesh) in terrains {
        let (cast, moved) = timed(mesh, [cells.clone(), cells.clone()]);
        worst = f64::max(worst, cast);
        let count = mesh.triangles.len();
        note +=
            &format!(" {which}, {count} triangles: {cast:.3} ms, {moved:.3} ms for liquid to move along;");
    }
    (worst, note.trim_end_matches(';').to_string())
}

/// Lines through random solids.
fn against_windings() -> (f64, String) {
    let (mut differ, mut lines, mut layers, mut ties) = (0, 0, [0; 6], 0);
    for seed in 0..SOLIDS {
        let mut dice = Dice(100_000 + seed);
        let cell = [0.25, 0.1][dice.below(2)];
        let mesh = random(&mut dice, cell);
        // Powers of two, so that the middle of each unit is a number.
        let reach = [4.0, 0.25][dice.below(2)];
        let heights = Heights::between(-reach, reach).expect("a range");
        let grid = Grid { cell, origin: [-8.0 * cell; 2], size: [16, 16] };
        let found = triangles::solids(&mesh.positions, &mesh.triangles, grid, heights).expect("solids");
        for _ in 0..LINES {
            let cell = [2 + dice.below(12), 2 + dice.below(12)];
            let (solids, at) = (found.cell(grid.index(cell)), grid.centre(cell));
            differ += usize::from(!wrong(&mesh, at, &heights, solids).is_empty());
            lines += 1;
            layers[solids.len().min(5)] += 1;
            ties += usize::from(mesh.positions.iter().any(|p| [p.x, p.z].map(f64::from) == at));
        }
    }
    let note = format!(
        "{SOLIDS} scenes of up to 6 solids, {lines} lines, {ties} through a vertex; with 0, 1, ... layers, and 5 or more: {layers:?}"
    );
    (f64::from(u32::try_from(differ).expect("few lines")), note)
}

/// Terrains of 50,000 triangles over the whole domain.
fn terrains() -> [(&'static str, TriMesh); 3] {
    let half = (0.5 * EDGE as f64 * CELL) as f32;
    let sphere = shapes::globe(0.98 * half, 250, 101);
    let mut dice = Dice(1);
    let mut spheres = TriMesh::default();
    for _ in 0..50 {
        let middle = dice.vector(0.7 * f64::from(half)).cast::<f32>();
        let mut one = shapes::globe(0.3 * half, 20, 26);
        one.positions
            .iter_mut()
            .for_each(|position| *position += Vec3::new(middle.x, 0.5 * middle.y, middle.z));
        spheres.append(&one);
    }
    [("an even sheet", sheet(half)), ("a sphere", sphere), ("50 spheres", spheres)]
}

/// A rolling sheet of 158 x 158 squares, a little larger than the domain.
fn sheet(half: f32) -> TriMesh {
    let count = 158;
    let vertex = |index: usize| {
        let [x, z] =
            [index % (count + 1), index / (count + 1)].map(|at| 2.02 * (at as f32 / count as f32 - 0.5));
        let height = 0.02 * (libm::sinf(9.0 * x) + libm::cosf(11.0 * z));
        Vec3::new(half * x, half * height, half * z)
    };
    let squares = |z: usize| {
        (0..count).flat_map(move |x| {
            let [a, b] = [z * (count + 1) + x, (z + 1) * (count + 1) + x].map(|index| index as u32);
            [[a, b, b + 1], [a, b + 1, a + 1]]
        })
    };
    TriMesh {
        positions: (0..(count + 1) * (count + 1)).map(vertex).collect(),
        triangles: (0..count).flat_map(squares).collect(),
    }
}

/// Median times of a cast and of the change of the liquid's terrain (ms). Triangles move by up to a cell from one to the next.
fn timed(mesh: &TriMesh, cells: [Range<usize>; 2]) -> (f64, f64) {
    let half = 0.5 * EDGE as f64 * CELL;
    let grid = Grid { cell: CELL, origin: [-half; 2], size: [EDGE; 2] };
    let heights = Heights::between(-2.0 * half, 2.0 * half).expect("a range");
    let solids = triangles::solids(&mesh.positions, &mesh.triangles, grid, heights).expect("solids");
    let mut liquid = Shallow::new(&context(), &solids, Params::default()).expect("a liquid");
    for column in liquid.columns().indices().collect::<Vec<_>>() {
        liquid.pour(column, 1e-3);
    }
    let mut caster = Caster::new(grid, heights).expect("a caster");
    let mut positions = mesh.positions.clone();
    let mut dice = Dice(2);
    let [mut casts, mut moves] = [Vec::new(), Vec::new()];
    for turn in 0..=CASTS {
        let by = dice.vector(CELL).cast::<f32>();
        positions.iter_mut().zip(&mesh.positions).for_each(|(to, from)| *to = from + by);
        let start = thread_seconds();
        caster.cast(&positions, &mesh.triangles, cells.clone()).expect("a cast");
        let cast = thread_seconds();
        liquid.update_cells(cells.clone(), |cell| caster.at(cell)).expect("a terrain");
        let moved = thread_seconds();
        // The first allocates.
        if turn > 0 {
            casts.push(1e3 * (cast - start));
            moves.push(1e3 * (moved - cast));
        }
    }
    assert_eq!(liquid.balance().error, 0, "liquid is missing");
    (median(casts), median(moves))
}
