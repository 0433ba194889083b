//! The Laplace equation of the topology matching, and its two solvers (thesis 2.4.1).
//!
//! Nodes are red or black, by the parity of x + y + z, so that all neighbours of a red node are black and the reverse: nodes of one colour
//! do not depend on each other, and can be updated in any order, by any number of threads, with the same result bit for bit.

use rayon::prelude::*;

use super::PIECE;
use crate::context::Context;
use crate::error::Result;

/// Sentinel: no node.
pub const NONE: u32 = u32::MAX;

/// The equation of a free node: its psi times the count of nodes that it depends on, minus the sum of psi of the free ones among them,
/// equals the load.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// The free nodes before and behind it on x, y and z, as indices of rows; [`NONE`]: there is none.
    pub beside: [u32; 6],
    /// Count of neighbours whose psi is given.
    pub given: u32,
    /// Sum of their psi (cells).
    pub load: f64,
    /// Whether x + y + z is odd.
    pub is_odd: bool,
    /// Whether a neighbour is not solved for because it is too far from all flagged nodes.
    pub is_rim: bool,
}

/// Values (cells) of the red nodes and of the black ones.
type Field = [Vec<f64>; 2];

/// The nodes of one colour.
#[derive(Default)]
struct Colour {
    /// Row of each node.
    rows: Vec<u32>,
    /// The free neighbours of each node, of the other colour; [`NONE`]: there is none.
    beside: Vec<[u32; 6]>,
    /// Count of the nodes that each one depends on: alpha_ii of the thesis.
    counts: Vec<f64>,
    /// Load of each node (cells).
    loads: Vec<f64>,
}

/// The equations of all nodes connected to given values. Where there are none, any constant would be a solution, and psi is 0.
pub struct System {
    colours: [Colour; 2],
    /// Count of rows.
    count: usize,
    /// Maximum number of consecutive free nodes on any axis.
    widest: u32,
}

/// psi of all rows.
pub struct Solution {
    /// psi of each row (cells).
    pub psi: Vec<f64>,
    /// Count of iterations.
    pub iterations: usize,
    /// Maximum difference between a psi and the mean psi of the nodes that it depends on (cells).
    pub residual: f64,
}

impl System {
    pub fn new(rows: &[Row]) -> Self {
        let is_connected = connected_to_given(rows);
        let mut colours = [Colour::default(), Colour::default()];
        let mut slots = vec![NONE; rows.len()];
        for (at, row) in rows.iter().enumerate().filter(|(at, _)| is_connected[*at]) {
            let colour = &mut colours[usize::from(row.is_odd)];
            slots[at] = colour.rows.len() as u32;
            let free = row.beside.iter().filter(|beside| **beside != NONE).count();
            colour.rows.push(at as u32);
            colour.counts.push((row.given as usize + free) as f64);
            colour.loads.push(row.load);
        }
        let slot = |row: u32| if row == NONE { NONE } else { slots[row as usize] };
        for colour in &mut colours {
            colour.beside = colour.rows.iter().map(|at| rows[*at as usize].beside.map(slot)).collect();
        }
        Self { colours, count: rows.len(), widest: widest(rows, &is_connected) }
    }

    /// The best relaxation factor for a cube with sides of N nodes (Yang & Gobbert 2009), N being the maximum number of consecutive free
    /// nodes on any axis: the width of the space between fixed nodes, not the size of the grid, which would make the factor too large.
    pub fn omega(&self) -> f64 {
        2.0 / (1.0 + libm::sin(std::f64::consts::PI / (f64::from(self.widest) + 1.0)))
    }

    /// Solves by successive over-relaxation (Eq. 2.5) with a factor `omega` until no psi changes by `tolerance` (cells), or for
    /// `max_iterations` iterations.
    ///
    /// # Errors
    /// Cancel.
    pub fn over_relaxed(
        &self,
        ctx: &Context,
        omega: f64,
        tolerance: f64,
        max_iterations: usize,
    ) -> Result<Solution> {
        let mut psi = self.zeros();
        let mut iterations = 0;
        while self.has_nodes() && iterations < max_iterations {
            ctx.check()?;
            let [red, black] = &mut psi;
            let changes =
                [self.colours[0].relax(omega, black, red), self.colours[1].relax(omega, red, black)];
            iterations += 1;
            if changes[0].max(changes[1]) < tolerance {
                break;
            }
        }
        Ok(self.solution(&psi, iterations))
    }

    /// Solves by conjugate gradients until no psi changes by `tolerance` (cells), or for `max_iterations` iterations.
    ///
    /// The preconditioner is one symmetric pass of Gauss-Seidel (SSOR with a factor of 1): red, black, red. The thesis' incomplete Cholesky
    /// factors would need fewer iterations, but must be applied node by node.
    ///
    /// # Errors
    /// Cancel.
    pub fn by_gradients(&self, ctx: &Context, tolerance: f64, max_iterations: usize) -> Result<Solution> {
        let mut psi = self.zeros();
        let mut residual: Field = [self.colours[0].loads.clone(), self.colours[1].loads.clone()];
        let [mut guess, mut image] = [self.zeros(), self.zeros()];
        self.precondition(&residual, &mut guess);
        let mut direction = guess.clone();
        let mut now = product(&residual, &guess);
        let mut iterations = 0;
        while iterations < max_iterations {
            ctx.check()?;
            self.apply(&direction, &mut image);
            let energy = product(&direction, &image);
            // Both are 0 if all given values are 0, or if the residual has vanished.
            if !(now > 0.0 && energy > 0.0) {
                break;
            }
            let step = now / energy;
            combine(&mut psi, 1.0, step, &direction);
            iterations += 1;
            if step * max_abs(&direction) < tolerance {
                break;
            }
            combine(&mut residual, 1.0, -step, &image);
            self.precondition(&residual, &mut guess);
            let next = product(&residual, &guess);
            combine(&mut direction, next / now, 1.0, &guess);
            now = next;
        }
        Ok(self.solution(&psi, iterations))
    }

    fn has_nodes(&self) -> bool {
        self.colours.iter().any(|colour| !colour.rows.is_empty())
    }

    fn zeros(&self) -> Field {
        self.colours.each_ref().map(|colour| vec![0.0; colour.rows.len()])
    }

    fn solution(&self, psi: &Field, iterations: usize) -> Solution {
        let mut means = self.zeros();
        for colour in 0..2 {
            self.colours[colour].means(&self.colours[colour].loads, &psi[1 - colour], &mut means[colour]);
        }
        combine(&mut means, 1.0, -1.0, psi);
        let mut all = vec![0.0; self.count];
        for (colour, psi) in self.colours.iter().zip(psi) {
            colour.rows.iter().zip(psi).for_each(|(row, psi)| all[*row as usize] = *psi);
        }
        Solution { psi: all, iterations, residual: max_abs(&means) }
    }

    /// The preconditioner's estimate of the error behind a residual.
    fn precondition(&self, residual: &Field, guess: &mut Field) {
        let [red, black] = guess;
        // The first pass ignores the black nodes.
        self.colours[0].means(&residual[0], &[], red);
        self.colours[1].means(&residual[1], red, black);
        self.colours[0].means(&residual[0], black, red);
    }

    /// The matrix times a field.
    fn apply(&self, field: &Field, out: &mut Field) {
        for colour in 0..2 {
            self.colours[colour].apply(&field[colour], &field[1 - colour], &mut out[colour]);
        }
    }
}

impl Colour {
    /// Sum of the other colour's values over a node's neighbours.
    fn sum(&self, node: usize, other: &[f64]) -> f64 {
        // The index NONE is out of range.
        self.beside[node].iter().map(|at| other.get(*at as usize).copied().unwrap_or(0.0)).sum()
    }

    /// Over-relaxes all nodes of the colour. Returns the maximum change (cells).
    fn relax(&self, omega: f64, other: &[f64], psi: &mut [f64]) -> f64 {
        let piece = |(piece, psi): (usize, &mut [f64])| {
            let mut max = 0.0f64;
            for (psi, node) in psi.iter_mut().zip(piece * PIECE..) {
                let mean = (self.loads[node] + self.sum(node, other)) / self.counts[node];
                let change = omega * (mean - *psi);
                *psi += change;
                max = max.max(change.abs());
            }
            max
        };
        psi.par_chunks_mut(PIECE).enumerate().map(piece).reduce(|| 0.0, f64::max)
    }

    /// The value of each node by its own equation, with these loads.
    fn means(&self, loads: &[f64], other: &[f64], out: &mut [f64]) {
        out.par_chunks_mut(PIECE).enumerate().for_each(|(piece, out)| {
            for (out, node) in out.iter_mut().zip(piece * PIECE..) {
                *out = (loads[node] + self.sum(node, other)) / self.counts[node];
            }
        });
    }

    /// The rows of the colour times a field.
    fn apply(&self, own: &[f64], other: &[f64], out: &mut [f64]) {
        out.par_chunks_mut(PIECE).enumerate().for_each(|(piece, out)| {
            for (out, node) in out.iter_mut().zip(piece * PIECE..) {
                *out = self.counts[node] * own[node] - self.sum(node, other);
            }
        });
    }
}

/// Whether each row is connected to a given value through free nodes.
fn connected_to_given(rows: &[Row]) -> Vec<bool> {
    let mut is_connected: Vec<bool> = rows.iter().map(|row| row.given > 0).collect();
    let mut due: Vec<u32> = (0..rows.len() as u32).filter(|at| is_connected[*at as usize]).collect();
    while let Some(at) = due.pop() {
        for next in rows[at as usize].beside.into_iter().filter(|next| *next != NONE) {
            if !std::mem::replace(&mut is_connected[next as usize], true) {
                due.push(next);
            }
        }
    }
    is_connected
}

/// Maximum number of consecutive connected nodes on any axis.
fn widest(rows: &[Row], is_connected: &[bool]) -> u32 {
    // Length of the run that ends at each node: rows ascend by position, so that earlier ones are known.
    let mut runs = vec![[0u32; 3]; rows.len()];
    let mut max = 0u32;
    for (at, row) in rows.iter().enumerate().filter(|(at, _)| is_connected[*at]) {
        for axis in 0..3 {
            let before = row.beside[2 * axis];
            let run = 1 + if before == NONE { 0 } else { runs[before as usize][axis] };
            runs[at][axis] = run;
            max = max.max(run);
        }
    }
    max
}

/// to = keep to + share from.
fn combine(to: &mut Field, keep: f64, share: f64, from: &Field) {
    for (to, from) in to.iter_mut().zip(from) {
        to.par_chunks_mut(PIECE).zip(from.par_chunks(PIECE)).for_each(|(to, from)| {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = keep * *to + share * from);
        });
    }
}

/// Scalar product, summed in a fixed order.
fn product(a: &Field, b: &Field) -> f64 {
    let of_colour = |colour: usize| -> f64 {
        let pieces = a[colour].par_chunks(PIECE).zip(b[colour].par_chunks(PIECE));
        let of_piece = |(a, b): (&[f64], &[f64])| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let sums: Vec<f64> = pieces.map(of_piece).collect();
        sums.iter().sum()
    };
    of_colour(0) + of_colour(1)
}

/// Maximum absolute value.
fn max_abs(field: &Field) -> f64 {
    let of_piece = |piece: &[f64]| piece.iter().fold(0.0f64, |max, value| max.max(value.abs()));
    let of_colour = |colour: &Vec<f64>| colour.par_chunks(PIECE).map(of_piece).reduce(|| 0.0, f64::max);
    field.iter().map(of_colour).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::context;

    /// Free nodes in a line on x, with given values beside some.
    fn line(loads: &[Option<f64>]) -> Vec<Row> {
        let row = |(at, load): (usize, &Option<f64>)| {
            let mut beside = [NONE; 6];
            if at > 0 {
                beside[0] = at as u32 - 1;
            }
            if at + 1 < loads.len() {
                beside[1] = at as u32 + 1;
            }
            let given = u32::from(load.is_some());
            Row { beside, given, load: load.unwrap_or(0.0), is_odd: at % 2 == 1, is_rim: false }
        };
        loads.iter().enumerate().map(row).collect()
    }

    #[test]
    fn nodes_that_no_given_value_reaches_are_zero_and_count_for_nothing() {
        let mut rows = line(&[None, None, Some(1.0), None, None, None, None, None]);
        // Cut into three and five.
        rows[2].beside[1] = NONE;
        rows[3].beside[0] = NONE;
        let system = System::new(&rows);
        assert_eq!(system.widest, 3);
        let ctx = context(1);
        let solutions = [
            system.over_relaxed(&ctx, system.omega(), 1e-12, 1000).unwrap(),
            system.by_gradients(&ctx, 1e-12, 1000).unwrap(),
        ];
        for Solution { psi, residual, .. } in solutions {
            assert!(psi[..3].iter().all(|psi| (psi - 1.0).abs() < 1e-9), "{psi:?}");
            assert_eq!(psi[3..], [0.0; 5]);
            assert!(residual < 1e-9, "{residual}");
        }
    }

    #[test]
    fn iterations_end_at_their_limit_and_the_residual_tells() {
        let mut loads = vec![None; 64];
        loads[0] = Some(1.0);
        let system = System::new(&line(&loads));
        let ctx = context(1);
        for solution in [
            system.over_relaxed(&ctx, system.omega(), 1e-12, 3).unwrap(),
            system.by_gradients(&ctx, 1e-12, 3).unwrap(),
        ] {
            assert_eq!(solution.iterations, 3);
            assert!(solution.residual > 1e-3, "{}", solution.residual);
        }
        let empty = System::new(&[]);
        assert_eq!(empty.over_relaxed(&ctx, empty.omega(), 1e-2, 9).unwrap().iterations, 0);
        assert_eq!(empty.by_gradients(&ctx, 1e-2, 9).unwrap().iterations, 0);
    }
}
