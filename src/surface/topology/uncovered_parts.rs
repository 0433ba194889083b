//! Connected parts of the particles' surface on which no vertex has its foot: drops that have flown off, bubbles inside.

use rayon::prelude::*;

use super::particle_count::{Bounds, ParticleCountTest, are_inside, seen_from};
use crate::geometry::check::topology::Sets;
use crate::geometry::coords::cell_of;
use crate::geometry::shape::{bounds, six_volumes};
use crate::geometry::{Coord, DVec3};
use crate::surface::level_set::implicit::Implicit;
use crate::surface::level_set::isosurface::Isosurface;

/// A connected part of the particles' surface on which no vertex of the mesh has its foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncoveredPart {
    /// Centre: the mean of its triangles' corners (m).
    pub position: DVec3,
    /// Enclosed volume (m3); negative: a bubble.
    pub volume: f64,
    /// Count of its triangles.
    pub triangles: usize,
}

/// Which of the uncovered parts a mesh should cover.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// Drops: those with at least the minimum count of particles; if that is 1, all.
    pub particle_count: ParticleCountTest<'a>,
    /// Bubbles: those of at least this volume (cells^3), but none in drops that are too small; infinite: none at all.
    pub min_bubble: f64,
}

/// Missing parts of a mesh.
#[derive(Debug, Default)]
pub struct MissingParts {
    /// Positions (cells) on the particles' surface.
    pub positions: Vec<DVec3>,
    /// Bounds (cells) of drops that it should not cover, as they are too small.
    pub specks: Vec<Bounds>,
}

/// Sums over the triangles of a part: their count, the first corner (cells), the sum of corners, and six times the volume.
#[derive(Clone, Default)]
struct Sum {
    triangles: usize,
    first: DVec3,
    corners: DVec3,
    six: f64,
}

/// The connected parts of the particles' surface, and which of them the mesh covers.
pub struct Parts {
    /// The part of each vertex.
    of_vertex: Vec<u32>,
    /// Whether a foot lies on each part.
    is_covered: Vec<bool>,
}

impl Parts {
    /// Finds the parts; those with one of the feet on them are covered. `feet` are the cells of phi's grid in which feet lie.
    pub fn new(phi: &Implicit, surface: &Isosurface, mut feet: Vec<Coord>) -> Self {
        feet.par_sort_unstable();
        feet.dedup();
        let mut sets = Sets::new(surface.vertex_count());
        for &[a, b, c] in surface.runs().flat_map(|(_, triangles)| triangles) {
            sets.join(a, b);
            sets.join(a, c);
        }
        let (of_vertex, count) = sets.numbered();
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
    pub fn missing(&self, phi: &Implicit, surface: &Isosurface, wanted: &Wanted<'_>) -> MissingParts {
        if self.is_covered.iter().all(|covered| *covered) {
            return MissingParts::default();
        }
        let sums = self.sums(phi, surface);
        let is_in = |sum: &Sum| sum.triangles > 0 && (sum.six > 0.0 || -sum.six / 6.0 >= wanted.min_bubble);
        let mut is_wanted: Vec<bool> = sums.iter().map(is_in).collect();
        let mut specks = Vec::new();
        if wanted.particle_count.min_count > 1 {
            let (drops, bubbles): (Vec<usize>, Vec<usize>) =
                (0..sums.len()).filter(|part| is_wanted[*part]).partition(|part| sums[*part].six > 0.0);
            let bubbles: Vec<(usize, DVec3)> =
                bubbles.into_iter().map(|part| (part, sums[part].first * phi.cell())).collect();
            let (unwanted, bounds) = self.specks(phi, surface, (&drops, &bubbles), &wanted.particle_count);
            unwanted.into_iter().for_each(|part| is_wanted[part] = false);
            specks = bounds;
        }
        let vertices = (0..).zip(&self.of_vertex).filter(|(_, part)| is_wanted[**part as usize]);
        let positions = vertices.map(|(vertex, _)| surface.in_cells(phi, vertex)).collect();
        MissingParts { positions, specks }
    }

    /// Those of `drops` (ascending) that contain too few particles, and those of `bubbles` (each with a position (m) on it) that lie in
    /// such a drop; also the bounds (cells) of these drops. `Change::drop_dry` counts in the same way, so that a
    /// newly made part is not removed again immediately.
    fn specks(
        &self,
        phi: &Implicit,
        surface: &Isosurface,
        (drops, bubbles): (&[usize], &[(usize, DVec3)]),
        particle_count: &ParticleCountTest<'_>,
    ) -> (Vec<usize>, Vec<Bounds>) {
        let mut triangles: Vec<Vec<[DVec3; 3]>> = vec![Vec::new(); drops.len()];
        for triangle in surface.runs().flat_map(|(_, triangles)| triangles) {
            let part = self.of_vertex[triangle[0] as usize] as usize;
            if let Ok(slot) = drops.binary_search(&part) {
                triangles[slot].push(triangle.map(|vertex| surface.in_cells(phi, vertex) * phi.cell()));
            }
        }
        let bounds: Vec<Bounds> =
            triangles.iter().map(|triangles| bounds(triangles.as_flattened()).into()).collect();
        let mesh = |slot: usize| seen_from(bounds[slot][0], &triangles[slot]);
        let counts = particle_count.counts(&bounds, mesh);
        let few: Vec<usize> =
            (0..drops.len()).filter(|slot| counts[*slot] < particle_count.min_count).collect();
        let few_bounds: Vec<Bounds> = few.iter().map(|slot| bounds[*slot]).collect();
        let positions: Vec<DVec3> = bubbles.iter().map(|(_, position)| *position).collect();
        let are_in = are_inside(&positions, &few_bounds, |at| mesh(few[at]));
        let bubbles = bubbles.iter().zip(are_in).filter(|(_, is_in)| *is_in).map(|((part, _), _)| *part);
        let parts = few.iter().map(|slot| drops[*slot]).chain(bubbles).collect();
        let in_cells = |bounds: Bounds| bounds.map(|position| position / phi.cell());
        (parts, few_bounds.into_iter().map(in_cells).collect())
    }

    /// The sums of each part; those of a covered part are empty.
    fn sums(&self, phi: &Implicit, surface: &Isosurface) -> Vec<Sum> {
        let mut sums = vec![Sum::default(); self.is_covered.len()];
        for triangle in surface.runs().flat_map(|(_, triangles)| triangles) {
            let part = self.of_vertex[triangle[0] as usize] as usize;
            if self.is_covered[part] {
                continue;
            }
            let [a, b, c] = triangle.map(|vertex| surface.in_cells(phi, vertex));
            let sum = &mut sums[part];
            if sum.triangles == 0 {
                sum.first = a;
            }
            sum.corners += a + b + c;
            sum.six += six_volumes(&[a, b, c], &sum.first);
            sum.triangles += 1;
        }
        sums
    }

    /// The parts that the mesh does not cover, the largest first.
    pub fn uncovered(&self, phi: &Implicit, surface: &Isosurface) -> Vec<UncoveredPart> {
        if self.is_covered.iter().all(|covered| *covered) {
            return Vec::new();
        }
        let cell = phi.cell();
        let sums = self.sums(phi, surface).into_iter().filter(|sum| sum.triangles > 0);
        let parts = sums.map(|Sum { corners, six, triangles, .. }| UncoveredPart {
            position: corners / (3 * triangles) as f64 * cell,
            volume: six / 6.0 * cell.powi(3),
            triangles,
        });
        let mut out: Vec<UncoveredPart> = parts.collect();
        out.sort_by(|a, b| b.volume.abs().total_cmp(&a.volume.abs()));
        out
    }
}

/// Whether any of `feet` (cells, sorted in ascending order) is this cell or one of the 26 around it.
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
