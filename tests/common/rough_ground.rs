//! Ground as marching through a distance field makes it: a mesh that is not aligned with the cells of a liquid.

use std::collections::HashMap;

use frazil::geometry::Vec3;
use frazil::shallow::columns::Columns;
use frazil::shallow::columns::grid::{Grid, Heights};
use frazil::shallow::terrain::triangles;

use super::bodies::Dice;

/// Edge of a cell (m).
pub const CELL: f64 = 1.0 / 1024.0;

/// A mesh, and the columns on it.
pub struct Rough {
    pub positions: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
    pub columns: Columns,
}

/// What ground is like: all lengths in cells.
#[derive(Clone, Copy)]
pub struct Kind {
    /// Cells along an edge.
    pub edge: usize,
    /// Slope, along some direction.
    pub slope: f64,
    /// Height of bumps of 3 to 8 cells.
    pub bumps: f64,
    /// Height of a few steps that a cell or less is enough for.
    pub step: f64,
    /// Whether a slab hangs over a part of it.
    pub slab: bool,
}

impl Kind {
    /// A sloping, bumpy one with steps of up to a cell; from seed 36 on under a slab, from 48 on with cliffs.
    pub fn of(seed: u64) -> Self {
        let of = |each: usize, list: &[f64]| list[seed as usize / each % list.len()];
        let step = if seed < 48 { of(12, &[0.0, 0.5, 1.0, 0.3]) } else { of(3, &[2.0, 4.0]) };
        let (bumps, slope) = (of(1, &[0.15, 0.4, 0.8]), of(3, &[0.0, 0.1, 0.5, 1.0]));
        Self { edge: 40, slope, bumps, step, slab: (36..48).contains(&seed) }
    }
}

/// Ground by chance.
pub fn rough(seed: u64, kind: Kind) -> Rough {
    let mut dice = Dice(seed ^ 0x5eed);
    let half = 0.5 * kind.edge as f64;
    let way = |dice: &mut Dice| {
        let angle = dice.between(0.0, std::f64::consts::TAU);
        [libm::cos(angle), libm::sin(angle)]
    };
    let down = way(&mut dice);
    let waves: Vec<_> = (0..12)
        .map(|_| {
            let length = dice.between(3.0, 8.0);
            (way(&mut dice), dice.between(-0.5, 0.5), std::f64::consts::TAU / length, dice.between(0.0, 6.3))
        })
        .collect();
    let steps: Vec<_> =
        (0..3).map(|_| (way(&mut dice), dice.between(-0.8, 0.8) * half, dice.between(0.3, 1.0))).collect();
    // Below 0 in the ground; cells.
    let field = |[x, y, z]: [f64; 3]| {
        let mut top = kind.slope * (down[0] * x + down[1] * z);
        for (way, lean, rate, phase) in &waves {
            let along = way[0] * x + way[1] * z + lean * y;
            top += kind.bumps / 6.0 * libm::sin(rate * along + phase);
        }
        for (way, at, width) in &steps {
            top += kind.step * ((way[0] * x + way[1] * z - at) / width).clamp(0.0, 1.0);
        }
        let slab = (y - top - 4.0).abs() - 0.8;
        let reach = libm::hypot(x - 0.2 * half, z + 0.1 * half) - 0.6 * half;
        if kind.slab { (y - top).min(slab.max(reach)) } else { y - top }
    };
    let turn = way(&mut dice);
    let spacing = dice.between(0.7, 1.3);
    let shift = [(); 3].map(|()| dice.between(0.0, 1.0));
    let (positions, faces) = march(
        field,
        turn,
        spacing,
        shift,
        half + 3.0,
        2.0 * half * (kind.slope + 0.1) + 6.0 + 3.0 * kind.step,
    );
    let positions: Vec<Vec3> =
        positions.iter().map(|at| Vec3::from(at.map(|length| (length * CELL) as f32))).collect();
    let size = [kind.edge; 2];
    let origin = [-half * CELL; 2];
    let reach = CELL * (4.0 * half * (kind.slope + 0.1) + 20.0 + 3.0 * kind.step);
    let heights = Heights::between(-reach, reach).expect("a range");
    let grid = Grid { cell: CELL, origin, size };
    let solids = triangles::solids(&positions, &faces, grid, heights).expect("solids");
    Rough { positions, faces, columns: Columns::new(&solids) }
}

/// The mesh where a field is 0, by tetrahedra of a lattice that is turned about the vertical; triangles face to where it is greater.
fn march(
    field: impl Fn([f64; 3]) -> f64,
    turn: [f64; 2],
    spacing: f64,
    shift: [f64; 3],
    reach: f64,
    height: f64,
) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let across = (reach * 1.5 / spacing) as i64;
    let up = (height / spacing) as i64;
    let at = |[x, y, z]: [i64; 3]| {
        let [x, y, z] =
            [(x, shift[0]), (y, shift[1]), (z, shift[2])].map(|(n, shift)| (n as f64 + shift) * spacing);
        [turn[0] * x - turn[1] * z, y, turn[1] * x + turn[0] * z]
    };
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let mut of_edge = HashMap::new();
    let mut values = HashMap::new();
    let mut value = |node: [i64; 3]| *values.entry(node).or_insert_with(|| field(at(node)));
    for x in -across..across {
        for z in -across..across {
            let [px, _, pz] = at([x, 0, z]);
            if px.abs().max(pz.abs()) > reach {
                continue;
            }
            for y in -up..up {
                let corner =
                    |bits: usize| [x + (bits & 1) as i64, y + (bits >> 1 & 1) as i64, z + (bits >> 2) as i64];
                let inside = (0..8).filter(|&bits| value(corner(bits)) < 0.0).count();
                if inside == 0 || inside == 8 {
                    continue;
                }
                // Six tetrahedra around the diagonal.
                for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                    let four = [0, a, b, 7].map(corner);
                    let (low, high): (Vec<_>, Vec<_>) = four.into_iter().partition(|node| value(*node) < 0.0);
                    let mut vertex = |from: [i64; 3], to: [i64; 3]| {
                        *of_edge.entry((from, to)).or_insert_with(|| {
                            let (f, g) = (value(from), value(to));
                            // Off the nodes, as snapping marchers keep it.
                            let part = (f / (f - g)).clamp(0.02, 0.98);
                            let (p, q) = (at(from), at(to));
                            positions.push([0, 1, 2].map(|n| p[n] + (q[n] - p[n]) * part));
                            positions.len() as u32 - 1
                        })
                    };
                    let mut around: Vec<u32> = match (low.len(), high.len()) {
                        (1, 3) => high.iter().map(|&to| vertex(low[0], to)).collect(),
                        (3, 1) => low.iter().map(|&from| vertex(from, high[0])).collect(),
                        (2, 2) => {
                            [[0, 0], [0, 1], [1, 1], [1, 0]].map(|[i, j]| vertex(low[i], high[j])).to_vec()
                        }
                        _ => continue,
                    };
                    let position = |vertex: u32| positions[vertex as usize];
                    let [p, q, r] = [0, 1, 2].map(|n| position(around[n]));
                    let [u, v] = [q, r].map(|to| [0, 1, 2].map(|n| to[n] - p[n]));
                    let along =
                        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
                    let (from, to) = (at(low[0]), at(high[0]));
                    if (0..3).map(|n| along[n] * (to[n] - from[n])).sum::<f64>() < 0.0 {
                        around.reverse();
                    }
                    faces.extend((2..around.len()).map(|n| [around[0], around[n - 1], around[n]]));
                }
            }
        }
    }
    (positions, faces)
}
