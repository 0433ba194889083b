//! What tests of flowing shallow liquids share: frames, ground by cells, liquid in cells of two sizes, CPU levels and damaged states.

use std::ops::Range;
use std::process::Command;

use frazil::Context;
use frazil::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use frazil::shallow::sources::{FlowPoint, Kind};
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Detail, Shallow};
use xxhash_rust::xxh3::xxh3_128;

use super::bodies::Dice;
use super::shallow::{Turn, floors, waves};

/// A frame (s).
pub const FRAME: f64 = 1.0 / 60.0;
/// Bottom of a solid that reaches down for ever (m).
pub const DOWN: f64 = f64::NEG_INFINITY;

/// What is stepped frame by frame.
pub trait Frames {
    /// So many frames of a length (s), all of which must work.
    fn frames(&mut self, ctx: &Context, length: f64, count: usize);
}

impl Frames for Shallow {
    fn frames(&mut self, ctx: &Context, length: f64, count: usize) {
        for _ in 0..count {
            self.step(ctx, length).expect("a frame");
        }
    }
}

impl Frames for Detail {
    fn frames(&mut self, ctx: &Context, length: f64, count: usize) {
        for _ in 0..count {
            self.step(ctx, length).expect("a frame");
        }
    }
}

/// Pours a depth (m; negative: takes it) into every column, given by its cell.
pub fn pour_each(liquid: &mut Shallow, mut depth: impl FnMut([usize; 2]) -> f64) {
    for column in liquid.columns().indices().collect::<Vec<_>>() {
        liquid.pour(column, depth(liquid.columns().cell(column)));
    }
}

/// Solids (m) of each cell of a grid, from the bottom up.
pub fn stacked(
    grid: Grid,
    [low, high]: [f64; 2],
    mut solids: impl FnMut([usize; 2]) -> Vec<[f64; 2]>,
) -> Solids {
    let heights = Heights::between(low, high).expect("a range");
    let units = |[bottom, top]: [f64; 2]| {
        [if bottom == DOWN { BOTTOMLESS } else { heights.round(bottom) }, heights.round(top)]
    };
    let [nx, _] = grid.size;
    let cell = |index: usize| solids([index % nx, index / nx]).into_iter().map(units).collect();
    Solids::new(grid, heights, (0..grid.cells()).map(cell))
}

/// Cells of an edge (m) from the corner at the origin.
pub fn from_corner(cell: f64, size: [usize; 2]) -> Grid {
    Grid { cell, origin: [0.0; 2], size }
}

/// A flow point that does not pulsate.
pub fn point(kind: Kind, at: [f64; 3], radius: f64, rate: f64) -> FlowPoint {
    FlowPoint { kind, at, radius, rate, pulse: None }
}

/// Rough ground of cells of 1 mm and a bridge over it, lifted (m) by their positions along x (m).
pub fn bridged(size: [usize; 2], lift: impl Fn(f64) -> f64) -> Solids {
    let cell = 0.001;
    floors(size, cell, [-0.02, 0.1], 2, |at @ [x, z], floor| {
        let top = 0.012 * floor as f64 + 2e-3 * waves(at, cell) + lift(x);
        (floor == 0 || x.abs() < 0.006 && z.abs() < 0.012).then_some([top - 0.003, top])
    })
}

/// Two sources, a drain and gauze on such ground, as far along x and z from its middle (m).
pub fn four_points([x, z]: [f64; 2]) -> Vec<FlowPoint> {
    let point = |kind, at| point(kind, at, 0.003, 3e-6);
    vec![
        point(Kind::Source, [0.0, 0.01, 0.0]),
        point(Kind::Source, [-x, 0.01, 0.012]),
        point(Kind::Drain, [x, 0.0, -0.01]),
        point(Kind::Absorber(2e-7), [0.0, 0.0, z]),
    ]
}

/// Ranges of even cells by chance, to be fine.
pub fn near_cells(dice: &mut Dice, size: [usize; 2]) -> [Range<usize>; 2] {
    size.map(|count| {
        let first = 2 * dice.below(count / 2);
        first..first + 2 + 2 * dice.below((count - first) / 2)
    })
}

/// Where a box of cells of a domain goes.
pub fn turned_box(turn: Turn, [a, b]: [[usize; 2]; 2], size: [usize; 2]) -> [Range<usize>; 2] {
    let ends = [turn.cell(a, size), turn.cell([b[0] - 1, b[1] - 1], size)];
    [0, 1].map(|axis| ends[0][axis].min(ends[1][axis])..ends[0][axis].max(ends[1][axis]) + 1)
}

/// Fails if liquids that are turned as [`Turn::ALL`] have other depths than the first.
pub fn assert_same_depths(depths: &[Vec<i32>], what: &str) {
    for (turn, turned) in Turn::ALL.iter().zip(depths) {
        let differ = turned.iter().zip(&depths[0]).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "{what}, {turn:?}: columns that differ");
    }
}

/// What a test prints in a process of its own at each CPU level, of the lines that begin with `liquid`: it finds the variable set there, and
/// only prints.
pub fn at_all_levels(test: &str, variable: &str) -> [Vec<String>; 3] {
    ["baseline", "avx2", "avx512"].map(|level| {
        let mut run = Command::new(std::env::current_exe().expect("this program"));
        run.args(["--exact", test, "--nocapture"]).env("FRAZIL_CPU", level).env(variable, "1");
        let text = String::from_utf8(run.output().expect("a run").stdout).expect("text");
        text.lines().filter(|line| line.starts_with("liquid ")).map(str::to_string).collect()
    })
}

/// The hash at the end of a state put right.
pub fn seal(bytes: &mut [u8]) {
    let (body, seal) = bytes.split_at_mut(bytes.len() - 16);
    seal.copy_from_slice(&xxh3_128(body).to_le_bytes());
}

/// A state with some of its bytes changed, often among the first of them, or cut.
pub fn damaged(saved: &[u8], first: usize, dice: &mut Dice) -> Vec<u8> {
    let mut bytes = saved.to_vec();
    if dice.one_in(4) {
        bytes.truncate(dice.below(saved.len()));
        return bytes;
    }
    for _ in 0..=dice.below(3) {
        let end = if dice.one_in(2) { first } else { saved.len() };
        let at = dice.below(end.min(saved.len()));
        bytes[at] = match dice.below(4) {
            0 => 0,
            1 => 255,
            2 => bytes[at] ^ 1 << dice.below(8),
            _ => dice.below(256) as u8,
        };
    }
    bytes
}
