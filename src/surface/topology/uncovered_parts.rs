//! Parts of the particles' surface that the mesh does not cover: drops that have flown off, bubbles inside. They have no vertices.

use rayon::prelude::*;

use super::particle_count::{Bounds, ParticleCountTest, are_inside, seen_from};
use crate::geometry::Coord;
use crate::geometry::DVec3;
use crate::surface::level_set::implicit::Implicit;
use crate::surface::level_set::isosurface::Isosurface;
use crate::surface::particles::grid::cell_of;

/// A part of the particles' surface on which no vertex of the mesh lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncoveredPart {
    /// Centre: the mean of its corners (m).
    pub position: DVec3,
    /// Enclosed volume (m3); negative: a bubble.
    pub volume: f64,
    /// Count of its triangles.
    pub triangles: usize,
}

/// Which of the uncovered parts a mesh should cover.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// Drops: those that hold enough of these particles; if one is enough, all.
    pub crowd: ParticleCountTest<'a>,
    /// Bubbles: those of at least this volume (cells^3), but none in drops that are too small; infinite: none at all.
    pub bubble: f64,
}

/// Missing parts of a mesh.
#[derive(Debug, Default)]
pub struct MissingParts {
    /// Positions (cells) on the particles' surface.
    pub positions: Vec<DVec3>,
    /// Bounds (cells) of drops that it should not cover, as they are too small.
    pub specks: Vec<Bounds>,
}

/// The connected parts of the particles' surface, and which of them the mesh covers.
pub struct Parts {
    /// The part of each vertex.
    of_vertex: Vec<u32>,
    /// Whether a foot lies on each part.
    is_covered: Vec<bool>,
}

impl Parts {
    /// Finds the parts; those with one of the feet on them are covered. `feet` are cells of phi's grid.
    pub fn new(phi: &Implicit, surface: &Isosurface, mut feet: Vec<Coord>) -> Self {
        feet.par_sort_unstable();
        feet.dedup();
        let of_vertex = connected(surface);
        let count = of_vertex.iter().map(|part| *part as usize + 1).max().unwrap_or(0);
        let mut is_covered = vec![false; count];
        for (vertex, part) in (0..).zip(&of_vertex) {
            let part = *part as usize;
            if !is_covered[part] {
                is_covered[part] = is_near(&feet, cell_of(&surface.in_cells(phi, vertex)));
            }
        }
        Self { of_vertex, is_covered }
    }

    /// Whether a vertex of the surface belongs to a part that the mesh covers.
    pub fn is_covered(&self, vertex: u32) -> bool {
        self.is_covered[self.of_vertex[vertex as usize] as usize]
    }

    /// The uncovered parts that the mesh should cover.
    pub fn lacking(&self, phi: &Implicit, surface: &Isosurface, wanted: &Wanted<'_>) -> MissingParts {
        if self.is_covered.iter().all(|covered| *covered) {
            return MissingParts::default();
        }
        let mut six = vec![0.0f64; self.is_covered.len()];
        let mut firsts: Vec<Option<DVec3>> = vec![None; six.len()];
        for triangle in surface.runs().flat_map(|(_, triangles)| triangles) {
            let part = self.of_vertex[triangle[0] as usize] as usize;
            if !self.is_covered[part] {
                let [a, b, c] = triangle.map(|vertex| surface.in_cells(phi, vertex));
                let origin = *firsts[part].get_or_insert(a);
                six[part] += (a - origin).dot(&(b - origin).cross(&(c - origin)));
            }
        }
        let mut is_wanted: Vec<bool> = self
            .is_covered
            .iter()
            .zip(&six)
            .map(|(covered, six)| !covered && (*six > 0.0 || -six / 6.0 >= wanted.bubble))
            .collect();
        let mut specks = Vec::new();
        if wanted.crowd.least > 1 {
            let (drops, bubbles): (Vec<usize>, Vec<usize>) =
                (0..six.len()).filter(|part| is_wanted[*part]).partition(|part| six[*part] > 0.0);
            let first = |part: usize| firsts[part].map(|position| (part, position * phi.cell()));
            let bubbles: Vec<(usize, DVec3)> = bubbles.into_iter().filter_map(first).collect();
            let (unwanted, bounds) = self.specks(phi, surface, (&drops, &bubbles), &wanted.crowd);
            unwanted.into_iter().for_each(|part| is_wanted[part] = false);
            specks = bounds;
        }
        let vertices = (0..).zip(&self.of_vertex).filter(|(_, part)| is_wanted[**part as usize]);
        let positions = vertices.map(|(vertex, _)| surface.in_cells(phi, vertex)).collect();
        MissingParts { positions, specks }
    }

    /// Those of `drops` (ascending) that hold too few particles, and those of `bubbles` (each with a position (m) on it) that lie in such a
    /// drop; also the bounds (cells) of these drops. The particles in the meshes that they would get are counted in the same way.
    fn specks(
        &self,
        phi: &Implicit,
        surface: &Isosurface,
        (drops, bubbles): (&[usize], &[(usize, DVec3)]),
        crowd: &ParticleCountTest<'_>,
    ) -> (Vec<usize>, Vec<Bounds>) {
        let mut triangles: Vec<Vec<[DVec3; 3]>> = vec![Vec::new(); drops.len()];
        for triangle in surface.runs().flat_map(|(_, triangles)| triangles) {
            let part = self.of_vertex[triangle[0] as usize] as usize;
            if let Ok(slot) = drops.binary_search(&part) {
                triangles[slot].push(triangle.map(|vertex| surface.in_cells(phi, vertex) * phi.cell()));
            }
        }
        let bounds: Vec<Bounds> = triangles
            .iter()
            .map(|triangles| {
                let corners = triangles.as_flattened();
                let first = corners.first().copied().unwrap_or_default();
                corners
                    .iter()
                    .fold([first; 2], |[low, high], position| [low.inf(position), high.sup(position)])
            })
            .collect();
        let mesh = |slot: usize| seen_from(bounds[slot][0], &triangles[slot]);
        let counts = crowd.held(&bounds, mesh);
        let few: Vec<usize> = (0..drops.len()).filter(|slot| counts[*slot] < crowd.least).collect();
        let few_bounds: Vec<Bounds> = few.iter().map(|slot| bounds[*slot]).collect();
        let positions: Vec<DVec3> = bubbles.iter().map(|(_, position)| *position).collect();
        let are_in = are_inside(&positions, &few_bounds, |at| mesh(few[at]));
        let bubbles = bubbles.iter().zip(are_in).filter(|(_, is_in)| *is_in).map(|((part, _), _)| *part);
        let parts = few.iter().map(|slot| drops[*slot]).chain(bubbles).collect();
        let in_cells = |bounds: Bounds| bounds.map(|position| position / phi.cell());
        (parts, few_bounds.into_iter().map(in_cells).collect())
    }

    /// The parts that the mesh does not cover, the largest first.
    pub fn apart(&self, phi: &Implicit, surface: &Isosurface) -> Vec<UncoveredPart> {
        if self.is_covered.iter().all(|covered| *covered) {
            return Vec::new();
        }
        // Sums of corners and their count, six times the volume relative to the first corner, triangles.
        let mut sums = vec![(DVec3::zeros(), 0usize, 0.0f64, 0usize); self.is_covered.len()];
        let mut firsts: Vec<Option<DVec3>> = vec![None; sums.len()];
        for triangle in surface.runs().flat_map(|(_, triangles)| triangles) {
            let part = self.of_vertex[triangle[0] as usize] as usize;
            if self.is_covered[part] {
                continue;
            }
            let [a, b, c] = triangle.map(|vertex| surface.in_cells(phi, vertex));
            let origin = *firsts[part].get_or_insert(a);
            let sum = &mut sums[part];
            sum.0 += a + b + c;
            sum.1 += 3;
            sum.2 += (a - origin).dot(&(b - origin).cross(&(c - origin)));
            sum.3 += 1;
        }
        let cell = phi.cell();
        let told =
            sums.into_iter().filter(|sum| sum.3 > 0).map(|(corners, count, six, triangles)| UncoveredPart {
                position: corners / count as f64 * cell,
                volume: six / 6.0 * cell.powi(3),
                triangles,
            });
        let mut out: Vec<UncoveredPart> = told.collect();
        out.sort_by(|a, b| b.volume.abs().total_cmp(&a.volume.abs()));
        out
    }
}

/// Whether one of the feet, in ascending cells, lies in a cell or in one of the 26 around it.
pub fn is_near(feet: &[Coord], cell: Coord) -> bool {
    (-1..=1).any(|x| {
        (-1..=1).any(|y| {
            // Three neighbours along z are contiguous in the order.
            let low = [cell[0] + x, cell[1] + y, cell[2] - 1];
            let at = feet.partition_point(|foot| *foot < low);
            feet.get(at).is_some_and(|foot| foot[..2] == low[..2] && foot[2] <= cell[2] + 1)
        })
    })
}

/// The part of each vertex, numbered in the order of the parts' first vertices.
fn connected(surface: &Isosurface) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..surface.vertices() as u32).collect();
    fn root(parent: &mut [u32], mut at: u32) -> u32 {
        while parent[at as usize] != at {
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    }
    for [a, b, c] in surface.runs().flat_map(|(_, triangles)| triangles) {
        for other in [b, c] {
            let [from, to] = [a, other].map(|vertex| root(&mut parent, *vertex));
            // The lower one is the root: it comes first.
            parent[from.max(to) as usize] = from.min(to);
        }
    }
    let mut numbers = vec![u32::MAX; parent.len()];
    let mut count = 0;
    for vertex in 0..parent.len() as u32 {
        let root = root(&mut parent, vertex) as usize;
        if numbers[root] == u32::MAX {
            numbers[root] = count;
            count += 1;
        }
        numbers[vertex as usize] = numbers[root];
    }
    numbers
}
