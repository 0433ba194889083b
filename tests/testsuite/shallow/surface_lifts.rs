//! Minimum heights of the surface over a terrain's mesh.

use super::surface_mesh::{Mesh, build_with, columns, ground, pool, units};
use crate::common::bodies::Dice;
use crate::common::rough_ground::{Kind, rough};
use frazil::geometry::Vec3;
use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, TOP};
use frazil::shallow::columns::{Columns, NONE};
use frazil::shallow::surface::heights::minimum_heights::{Distance, Fitted, MinimumHeights};
use frazil::shallow::surface::{Depths, Layout, Surface};
use frazil::shallow::terrain::Solids;

/// Cells of 0.5 m, of which the first has its centre at (-0.75, 2.25).
const CELL: f64 = 0.5;
const EXACT: Distance = Distance { least: 0.0, margin: 0.0, rim: 0.0 };

/// A small triangle that faces up, or down, of which one vertex counts: the others lie beyond the domain.
fn spike(x: f64, height: f64, z: f64, faces_up: bool) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at = [-0.75 + x * CELL, height, 2.25 + z * CELL].map(|length| length as f32);
    let positions = vec![Vec3::from(at), Vec3::new(-900.0, 0.0, 900.0), Vec3::new(900.0, 0.0, 900.0)];
    (positions, vec![if faces_up { [0, 1, 2] } else { [0, 2, 1] }])
}

fn lifts_of(columns: &Columns, x: f64, height: f64, z: f64, distance: Distance) -> (MinimumHeights, Fitted) {
    let (positions, faces) = spike(x, height, z, true);
    let mut lifts = MinimumHeights::default();
    let fitted = lifts.find(columns, &positions, &faces, distance).unwrap();
    (lifts, fitted)
}

/// Minimum heights (m) of the cells of a row, of the lowest layer.
fn metres(columns: &Columns, lengths: &[i32], z: usize) -> Vec<f64> {
    let [nx, _] = columns.grid.size;
    let length = |x: usize| lengths[columns.column([x, z], 0).unwrap()];
    (0..nx).map(|x| columns.heights.unit * f64::from(length(x))).collect()
}

fn assert_near(found: &[f64], expected: &[f64]) {
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6;
    assert!(found.iter().zip(expected).all(is_near), "{found:?} is not {expected:?}");
}

#[test]
fn a_vertex_over_a_level_quartet_lifts_as_lagrange_says() {
    let columns = columns([3, 3], |_, _| vec![ground(1.0)]);
    // In the quartet of cells (0, 0) to (1, 1), 0.2 m over its bases. Weights are the same, so l = d c / sum c^2. Along one diagonal it is in
    // the triangle with the corner (1, 0): c = (1 - 0.5, 0.5 - 0.25, 0.25); along the other in that with (0, 0): c = (0.25, 0.5, 0.25).
    let (lifts, fitted) = lifts_of(&columns, 0.5, 1.2, 0.25, EXACT);
    assert_eq!(fitted, Fitted { upward: 1, discarded: 0, capped: 0 });
    let share = 0.2 / (0.25 + 0.0625 + 0.0625);
    assert_near(&metres(&columns, lifts.least(), 0), &[0.5 * share, 0.5 * share, 0.0]);
    assert_near(&metres(&columns, lifts.least(), 1), &[0.25 * share, 0.25 * share, 0.0]);
    assert_near(&metres(&columns, lifts.least(), 2), &[0.0; 3]);
    // With the margin and the least of the thesis the constraint is the same, and none is under the least.
    let distance = Distance::default();
    let (lifts, _) = lifts_of(&columns, 0.5, 1.2, 0.25, distance);
    let share = (0.2 + 0.01 * CELL) / 0.375;
    assert_near(&metres(&columns, lifts.least(), 0), &[0.5 * share, 0.5 * share, 0.05 * CELL]);
}

#[test]
fn columns_at_the_foot_of_a_slope_are_lifted_most() {
    // Bases of 1.0 and 1.3 m; a vertex of 1.35 m in the middle of the northern edge: c = (0.5, 0.5), 1 / w = (0.35, 0.05) / dx.
    let columns = columns([2, 2], |x, _| vec![ground(if x == 0 { 1.0 } else { 1.3 })]);
    let (lifts, _) = lifts_of(&columns, 0.5, 1.35, 0.0, EXACT);
    let pull = 0.2 / (0.25 * (0.35 + 0.05));
    assert_near(&metres(&columns, lifts.least(), 0), &[0.5 * 0.35 * pull, 0.5 * 0.05 * pull]);
    assert_near(&metres(&columns, lifts.least(), 1), &[0.0; 2]);
}

#[test]
fn columns_under_the_least_have_it_and_leave_the_rest_to_the_others() {
    // A vertex close to the centre of cell (0, 0): c = (0.9, 0.1) along the edge, and least lifts of 0.1 m.
    let columns = columns([2, 2], |_, _| vec![ground(1.0)]);
    let (lifts, _) = lifts_of(&columns, 0.1, 1.2, 0.0, Distance { least: 0.2, ..EXACT });
    assert_near(&metres(&columns, lifts.least(), 0), &[(0.2 - 0.1 * 0.1) / 0.9, 0.1]);
    // What the least covers lifts nothing.
    let (lifts, _) = lifts_of(&columns, 0.1, 1.0999, 0.0, Distance { least: 0.2, ..EXACT });
    assert_near(&metres(&columns, lifts.least(), 0), &[0.1, 0.1]);
}

#[test]
fn vertices_that_face_down_or_need_too_much_lift_nothing() {
    let columns = columns([2, 2], |_, _| vec![ground(1.0)]);
    let (positions, faces) = spike(0.5, 1.2, 0.5, false);
    let mut lifts = MinimumHeights::default();
    assert_eq!(lifts.find(&columns, &positions, &faces, EXACT).unwrap(), Fitted::default());
    assert!(lifts.least().iter().all(|lift| *lift == 0));
    // In the middle of an edge each column takes all of it: a cell and no more.
    for (height, discarded) in [(1.49, 0), (1.51, 1)] {
        let (lifts, fitted) = lifts_of(&columns, 0.5, height, 0.0, EXACT);
        assert_eq!(fitted, Fitted { upward: 1, discarded, capped: 0 }, "{height}");
        assert_eq!(lifts.uncovered().len(), discarded);
        assert_eq!(lifts.least().iter().any(|lift| *lift > 0), discarded == 0, "{height}");
    }
}

#[test]
fn dry_columns_go_down_for_a_vertex_that_is_lower() {
    let columns = columns([2, 2], |_, _| vec![ground(1.0)]);
    let (lifts, _) = lifts_of(&columns, 0.5, 0.8, 0.0, EXACT);
    assert_near(&metres(&columns, lifts.sunk(), 0), &[0.2, 0.2]);
    assert!(lifts.least().iter().all(|lift| *lift == 0));
    // At most to the underside of their solid.
    let slab = self::columns([2, 2], |_, _| vec![ground(0.2), [units(0.9), units(1.0)]]);
    let (lifts, _) = lifts_of(&slab, 0.5, 0.95, 0.0, Distance { rim: 1.0, ..EXACT });
    for index in slab.indices() {
        let least = slab.bases()[index] - lifts.sunk()[index];
        assert!(least > slab.unders()[index], "{least}");
    }
}

/// A surface with lifts.
fn lifted(columns: &Columns, lifts: &MinimumHeights, depth: &[i32], fade: f64) -> Mesh {
    let depths = Depths { depth, least: lifts.least(), sunk: lifts.sunk(), ..Depths::default() };
    let layout = Layout { fade_depth: fade, ..Layout::default() };
    build_with(&mut Surface::default(), columns, &depths, &layout)
}

#[test]
fn no_lift_reaches_through_a_ceiling_or_changes_triangles() {
    for seed in 0..20 {
        let mut dice = Dice(seed);
        // A low passage under a roof, open to both sides, with bumps that nearly fill it.
        let columns = columns([24, 12], |x, z| {
            let top = 1.0 + 0.05 * ((7 * x + 5 * z) % 4) as f64;
            let roof = [units(1.16 + 0.01 * ((x + z) % 5) as f64), units(2.5)];
            if (6..18).contains(&x) { vec![ground(top), roof] } else { vec![ground(top)] }
        });
        let mut positions = Vec::new();
        for _ in 0..400 {
            let (x, z) = (dice.between(0.0, 23.0), dice.between(0.0, 11.0));
            let (spike, _) = spike(x, dice.between(1.0, 1.5), z, true);
            positions.extend(spike);
        }
        let faces: Vec<[u32; 3]> = (0..400).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        let mut lifts = MinimumHeights::default();
        let fitted = lifts.find(&columns, &positions, &faces, Distance::default()).unwrap();
        assert!(
            fitted.capped > 0 && lifts.uncovered().len() == fitted.capped + fitted.discarded,
            "{fitted:?}"
        );
        let mut depth = vec![0; columns.len()];
        for index in columns.indices() {
            let room = columns.ceilings()[index] - columns.bases()[index];
            depth[index] = [0, 1, units(0.001), units(0.1).min(room), room.min(units(0.5))][dice.below(5)];
        }
        let plain = self::lifted(&columns, &MinimumHeights::default(), &depth, 0.0);
        for fade in [0.0, 0.01] {
            let mesh = self::lifted(&columns, &lifts, &depth, fade);
            assert_eq!((&mesh.triangles, &mesh.columns), (&plain.triangles, &plain.columns));
            for (position, &column) in mesh.positions.iter().zip(&mesh.columns).filter(|of| *of.1 != NONE) {
                let column = column as usize;
                let ceiling = columns.heights.metres(columns.ceilings()[column]);
                assert!(f64::from(position[1]) <= ceiling + 1e-6, "seed {seed}: {position:?} over {ceiling}");
                let shown = columns.heights.metres(columns.bases()[column] + depth[column]);
                let is_high = f64::from(position[1]) >= shown - 1e-6;
                assert!(is_high || depth[column] < units(0.01), "seed {seed}: {position:?} under {shown}");
            }
        }
    }
}

#[test]
fn vertices_of_wet_and_dry_columns_meet() {
    let columns = columns([20, 3], |x, _| vec![ground(1.0 + 0.1 * (x % 3) as f64)]);
    let mut depth = pool(&columns, 0, 0.0);
    for z in 0..3 {
        (0..10).for_each(|x| depth[columns.column([x, z], 0).unwrap()] = units(0.3));
    }
    let layout = Layout { least_depth: 0.05, fade_depth: 0.02, ..Layout::default() };
    let height = |depth: &[i32], cell: [usize; 2]| {
        let depths = Depths { depth, ..Depths::default() };
        let mesh = build_with(&mut Surface::default(), &columns, &depths, &layout);
        let column = columns.column(cell, 0).unwrap() as u32;
        let vertex = mesh.columns.iter().position(|of| *of == column);
        f64::from(mesh.positions[vertex.expect("a vertex")][1])
    };
    // Beside the liquid, whose height is over the ground there: under it by the least depth.
    let base = 1.0 + 0.1 * (10 % 3) as f64;
    let edge = columns.column([10, 1], 0).unwrap();
    assert_near(&[height(&depth, [10, 1])], &[base - 0.05]);
    let of = |metres: f64| {
        let mut depth = depth.clone();
        depth[edge] = units(metres).max(1);
        height(&depth, [10, 1])
    };
    assert_near(
        &[of(0.0), of(0.01), of(0.02), of(0.04), of(0.2)],
        &[base - 0.05, base, base + 0.05, base + 0.05, base + 0.2],
    );
}

#[test]
fn lifts_turn_and_mirror_with_the_ground() {
    for seed in 0..6 {
        let ground = rough(3 * seed, Kind { edge: 20, ..Kind::of(3 * seed + 36) });
        let mut lifts = MinimumHeights::default();
        lifts.find(&ground.columns, &ground.positions, &ground.faces, Distance::default()).unwrap();
        let columns = &ground.columns;
        let n = columns.grid.size[0];
        // A quarter turn, (x, z) to (-z, x), and a mirror, (x, z) to (-x, z).
        type Moved = (fn([f32; 3]) -> [f32; 3], fn([usize; 2], usize) -> [usize; 2], bool);
        let moves: [Moved; 2] = [
            (|[x, y, z]| [-z, y, x], |[x, z], n| [n - 1 - z, x], false),
            (|[x, y, z]| [-x, y, z], |[x, z], n| [n - 1 - x, z], true),
        ];
        for (position, cell, is_mirror) in moves {
            let mut cells = vec![Vec::new(); n * n];
            for index in columns.indices() {
                let [x, z] = cell(columns.cell(index), n);
                cells[z * n + x].push([columns.unders()[index], columns.bases()[index]]);
            }
            cells.iter_mut().for_each(|cell| cell.sort_unstable());
            let moved = Columns::new(&Solids::new(columns.grid, columns.heights, cells));
            let positions: Vec<Vec3> =
                ground.positions.iter().map(|at| Vec3::from(position((*at).into()))).collect();
            let face = |[a, b, c]: [u32; 3]| if is_mirror { [a, c, b] } else { [a, b, c] };
            let faces: Vec<[u32; 3]> = ground.faces.iter().map(|corners| face(*corners)).collect();
            let mut other = MinimumHeights::default();
            other.find(&moved, &positions, &faces, Distance::default()).unwrap();
            for index in columns.indices() {
                let to = moved.column(cell(columns.cell(index), n), columns.layer(index)).unwrap();
                assert_eq!(other.least()[to], lifts.least()[index], "seed {seed}, {is_mirror}");
                assert_eq!(other.sunk()[to], lifts.sunk()[index], "seed {seed}, {is_mirror}");
            }
        }
    }
}

/// Ground with a slab here and there, and a mesh of its own vertices, of which some boxes change.
struct Changing {
    heights: Vec<f64>,
    slabs: Vec<bool>,
    positions: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
}

const SIZE: [usize; 2] = [50, 23];

impl Changing {
    fn new(dice: &mut Dice) -> Self {
        let count = SIZE[0] * SIZE[1];
        let mut out = Self {
            heights: (0..count).map(|_| dice.between(0.5, 0.8)).collect(),
            slabs: (0..count).map(|_| dice.one_in(9)).collect(),
            positions: Vec::new(),
            faces: Vec::new(),
        };
        for cell in 0..count {
            out.positions.push(Vec3::zeros());
            out.move_vertex(dice, cell);
        }
        // Each with two beyond the domain, so that a box has all of what changes in it.
        out.positions.extend([Vec3::new(-900.0, 0.0, 900.0), Vec3::new(900.0, 0.0, 900.0)]);
        out.faces = (0..count as u32).map(|n| [n, count as u32, count as u32 + 1]).collect();
        out
    }

    fn move_vertex(&mut self, dice: &mut Dice, cell: usize) {
        let [x, z] = [(cell % SIZE[0]) as f64, (cell / SIZE[0]) as f64];
        let position =
            |along: f64, origin: f64, dice: &mut Dice| origin + (along + dice.between(0.0, 1.0)) * CELL;
        let at =
            [position(x, -1.0, dice), self.heights[cell] + dice.between(-0.1, 0.2), position(z, 2.0, dice)];
        self.positions[cell] = Vec3::from(at.map(|length| length as f32));
    }

    fn columns(&self) -> Columns {
        columns(SIZE, |x, z| {
            let cell = z * SIZE[0] + x;
            let ground = ground(self.heights[cell]);
            if self.slabs[cell] { vec![ground, [units(0.9), units(0.95)]] } else { vec![ground] }
        })
    }
}

#[test]
fn a_box_that_changes_is_as_if_all_were_found_anew() {
    for seed in 0..20 {
        let mut dice = Dice(seed);
        let mut scene = Changing::new(&mut dice);
        let distance = Distance::default();
        let mut lifts = MinimumHeights::default();
        lifts.find(&scene.columns(), &scene.positions, &scene.faces, distance).unwrap();
        for change in 0..12 {
            let cells = [0, 1].map(|axis| {
                let start = dice.below(SIZE[axis]);
                start..(start + dice.below(9)).min(SIZE[axis])
            });
            for z in cells[1].clone() {
                for x in cells[0].clone() {
                    let cell = z * SIZE[0] + x;
                    scene.heights[cell] = dice.between(0.5, 0.8);
                    scene.slabs[cell] = dice.one_in(1 + change % 4);
                    scene.move_vertex(&mut dice, cell);
                }
            }
            let columns = scene.columns();
            lifts.update(&columns, &scene.positions, &scene.faces, distance, cells.clone()).unwrap();
            let mut anew = MinimumHeights::default();
            anew.find(&columns, &scene.positions, &scene.faces, distance).unwrap();
            assert_eq!(lifts.least(), anew.least(), "seed {seed}, {cells:?}");
            assert_eq!(lifts.sunk(), anew.sunk(), "seed {seed}, {cells:?}");
        }
    }
}

#[test]
fn what_makes_no_sense_is_an_error() {
    let columns = columns([4, 3], |_, _| vec![ground(1.0)]);
    let (positions, faces) = spike(0.5, 1.2, 0.5, true);
    let fails = |positions: &[Vec3], faces: &[[u32; 3]], distance: Distance, message: &str| {
        let error =
            MinimumHeights::default().update(&columns, positions, faces, distance, [0..4, 0..3]).unwrap_err();
        assert_eq!(error.to_string(), message);
    };
    let usual = Distance::default();
    fails(&positions, &[[0, 1, 3]], usual, "triangle 0 of the terrain has a corner beyond its 3 vertices");
    fails(&[Vec3::new(0.0, f32::NAN, 0.0)], &[], usual, "vertex 0 of the terrain is not finite");
    let bad = Distance { margin: -1.0, ..usual };
    fails(&positions, &faces, bad, "a distance of -1 cells is negative or not finite");
    let error =
        MinimumHeights::default().update(&columns, &positions, &faces, usual, [0..5, 0..3]).unwrap_err();
    assert_eq!(error.to_string(), "cells 0..5 x 0..3 are not a box within 4 x 3 cells");
    let depth = vec![0; columns.len()];
    let depths = Depths { depth: &depth, least: &[1], ..Depths::default() };
    let error = Surface::default().count(&columns, &depths).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("1 least depths for {} indices: one each is needed", columns.len())
    );
    // One row of cells has no quartet.
    let grid = Grid { size: [4, 1], ..columns.grid };
    let row = Columns::new(&Solids::new(grid, columns.heights, vec![vec![[BOTTOMLESS, TOP / 2]]; 4]));
    let mut lifts = MinimumHeights::default();
    assert_eq!(lifts.find(&row, &positions, &faces, usual).unwrap(), Fitted::default());
}
