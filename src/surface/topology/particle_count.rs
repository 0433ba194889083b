//! Count of particles in closed parts of a surface: drops, crumbs.
//!
//! The surface of a small drop passes close to its particles, and some of them lie outside it: of 20 at random positions 10 to 14 lie
//! inside, and nearly all others less than half a spacing outside. So if any lies inside, those beside the part count too.

use crate::geometry::check::deviation::NearestTree;
use crate::geometry::coords::{between, cell_of};
use crate::geometry::spatial::bvh::Bvh;
use crate::geometry::{Coord, DVec3, TriMesh};

/// A direction along which no edges of modelled meshes run.
const ASLANT: DVec3 = DVec3::new(0.5773, 0.6533, 0.4896);
/// Maximum distance of a particle that is beside a part (spacings).
const BESIDE: f64 = 0.5;
/// Maximum ratio of the lengths of parts that are listed in bins of the same size.
const SPREAD: f64 = 4.0;

/// Minimum and maximum position of a part.
pub type Bounds = [DVec3; 2];

/// The test whether parts of a surface contain a minimum count of particles.
#[derive(Debug, Clone, Copy)]
pub struct ParticleCountTest<'a> {
    /// Positions of the particles (m).
    pub positions: &'a [DVec3],
    /// Initial distance between particles (m).
    pub spacing: f64,
    /// Minimum count in a part, at least 1.
    pub min_count: usize,
}

impl ParticleCountTest<'_> {
    /// Count of particles in each of some closed parts, given by their bounds (m), up to [`ParticleCountTest::min_count`]: 0 if none lies
    /// inside, else those inside and beside it. `mesh` returns a part's triangles, oriented outward, with positions relative to its minimum
    /// corner; it is called only for parts with particles in or near their bounds.
    pub fn counts(&self, parts: &[Bounds], mesh: impl Fn(usize) -> TriMesh) -> Vec<usize> {
        let mut trees: Vec<Option<Bvh>> = Vec::new();
        trees.resize_with(parts.len(), || None);
        let mut counts =
            count(parts, self.positions, &vec![self.min_count; parts.len()], |part, position| {
                let tree = trees[part].get_or_insert_with(|| Bvh::new(&mesh(part)));
                tree.winding_number(position - parts[part][0], ASLANT) > 0
            });
        let limits = |count: &usize| if *count == 0 { 0 } else { self.min_count - count };
        let limits: Vec<usize> = counts.iter().map(limits).collect();
        let margin = BESIDE * self.spacing;
        let wider: Vec<Bounds> = parts
            .iter()
            .map(|[low, high]| [low - DVec3::repeat(margin), high + DVec3::repeat(margin)])
            .collect();
        let mut surfaces: Vec<Option<NearestTree>> = Vec::new();
        surfaces.resize_with(parts.len(), || None);
        let beside = count(&wider, self.positions, &limits, |part, position| {
            let seen = position - parts[part][0];
            let surface = surfaces[part].get_or_insert_with(|| NearestTree::new(&mesh(part)));
            let is_near = surface.nearest(seen).is_some_and(|nearest| nearest.distance <= margin);
            is_near && trees[part].as_ref().is_some_and(|tree| tree.winding_number(seen, ASLANT) <= 0)
        });
        counts.iter_mut().zip(beside).for_each(|(count, beside)| *count += beside);
        counts
    }
}

/// Counts the positions within the bounds of each part that belong to it, up to its limit.
fn count(
    parts: &[Bounds],
    positions: &[DVec3],
    limits: &[usize],
    mut is_of: impl FnMut(usize, DVec3) -> bool,
) -> Vec<usize> {
    let mut counts = vec![0; parts.len()];
    let mut all = Bins::of(parts, (0..parts.len()).filter(|part| limits[*part] > 0).collect());
    for position in positions {
        if all.is_empty() {
            break;
        }
        for bins in &mut all {
            let mut full = 0;
            for part in bins.near(position) {
                if counts[part] < limits[part] && is_within(&parts[part], position) && is_of(part, *position)
                {
                    counts[part] += 1;
                    full += usize::from(counts[part] == limits[part]);
                }
            }
            bins.open -= full;
            if 2 * bins.open <= bins.parts {
                bins.listed.retain(|(_, part)| counts[*part] < limits[*part]);
                bins.parts = bins.open;
            }
        }
        all.retain(|bins| bins.open > 0);
    }
    counts
}

/// Parts of similar length, listed in the bins that their bounds touch: up to 8 for each part.
struct Bins {
    /// Edge of a bin (m): as long as the longest part.
    edge: f64,
    /// Bins with the parts in them, ascending.
    listed: Vec<(Coord, usize)>,
    /// Count of listed parts.
    parts: usize,
    /// Count of those that have not reached their limit.
    open: usize,
}

impl Bins {
    /// Sets of bins for these parts, from short to long ones.
    fn of(bounds: &[Bounds], mut parts: Vec<usize>) -> Vec<Self> {
        let length = |part: usize| (bounds[part][1] - bounds[part][0]).max();
        parts.sort_by(|a, b| length(*a).total_cmp(&length(*b)));
        let mut all = Vec::new();
        let mut rest = &parts[..];
        while let [first, ..] = rest {
            let max_length = SPREAD * length(*first);
            // At least one, even if lengths are not finite.
            let count = rest.partition_point(|part| length(*part) <= max_length).max(1);
            let (own, longer) = rest.split_at(count);
            let edge = length(own[count - 1]);
            let bin = |position: DVec3| cell_of(&(position / edge));
            let mut listed: Vec<(Coord, usize)> = own
                .iter()
                .flat_map(|part| {
                    let [low, high] = bounds[*part].map(bin);
                    between(low, high).map(move |bin| (bin, *part))
                })
                .collect();
            listed.sort_unstable();
            all.push(Self { edge, listed, parts: count, open: count });
            rest = longer;
        }
        all
    }

    /// The parts in the bin of a position, among them all whose bounds contain it.
    fn near(&self, position: &DVec3) -> impl Iterator<Item = usize> {
        // Division is monotone: a position between two others stays between them.
        let bin = cell_of(&(position / self.edge));
        let first = self.listed.partition_point(|(other, _)| *other < bin);
        self.listed[first..].iter().take_while(move |(other, _)| *other == bin).map(|(_, part)| *part)
    }
}

/// Which positions (m) lie inside any of some closed parts, given by their bounds (m); `mesh` as for [`ParticleCountTest::counts`].
pub fn are_inside(positions: &[DVec3], parts: &[Bounds], mesh: impl Fn(usize) -> TriMesh) -> Vec<bool> {
    let mut are = vec![false; positions.len()];
    for (part, bounds) in parts.iter().enumerate() {
        let mut tree: Option<Bvh> = None;
        for (position, is_inside) in positions.iter().zip(&mut are) {
            if !*is_inside && is_within(bounds, position) {
                let tree = tree.get_or_insert_with(|| Bvh::new(&mesh(part)));
                *is_inside = tree.winding_number(position - bounds[0], ASLANT) > 0;
            }
        }
    }
    are
}

/// Whether a position lies within bounds.
pub fn is_within([low, high]: &Bounds, position: &DVec3) -> bool {
    (0..3).all(|axis| (low[axis]..=high[axis]).contains(&position[axis]))
}

/// Triangles as a mesh, with positions relative to `position`; each triangle has vertices of its own.
pub fn seen_from(position: DVec3, triangles: &[[DVec3; 3]]) -> TriMesh {
    TriMesh::soup(triangles.as_flattened().iter().map(|corner| (corner - position).cast()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts of particles in a hundred cubes with an edge of 1 along a line, and in a box that contains them all.
    fn in_cubes(positions: &[DVec3], spacing: f64, min_count: usize) -> Vec<usize> {
        let mut parts: Vec<Bounds> = (0..100)
            .map(|n| DVec3::new(3.0 * f64::from(n), 0.0, 0.0))
            .map(|low| [low, low + DVec3::repeat(1.0)])
            .collect();
        parts.push([DVec3::repeat(-1.0), DVec3::new(400.0, 2.0, 2.0)]);
        let mesh = |part: usize| match part {
            100 => TriMesh::cuboid([0.0; 3], [401.0, 3.0, 3.0]),
            _ => TriMesh::cuboid([0.0; 3], [1.0; 3]),
        };
        ParticleCountTest { positions, spacing, min_count }.counts(&parts, mesh)
    }

    fn middle(n: u32) -> DVec3 {
        DVec3::new(3.0 * f64::from(n) + 0.5, 0.45, 0.55)
    }

    #[test]
    fn particles_are_counted_in_parts_of_all_lengths() {
        // One in every second cube, another in every tenth; one between cubes, one outside all.
        let mut positions: Vec<DVec3> = (0..100).filter(|n| n % 2 == 0).map(middle).collect();
        positions.extend((0..100).filter(|n| n % 10 == 0).map(|n| middle(n) + DVec3::repeat(0.1)));
        positions.extend([DVec3::new(1.6, 0.5, 0.5), DVec3::new(0.5, 9.0, 0.5)]);
        for min_count in [1, 2, 100] {
            for (n, count) in in_cubes(&positions, 1.0, min_count).into_iter().enumerate() {
                let all = if n == 100 { 61 } else { usize::from(n % 2 == 0) + usize::from(n % 10 == 0) };
                assert_eq!(count, all.min(min_count), "part {n} up to {min_count}");
            }
        }
    }

    #[test]
    fn counts_are_those_of_looking_at_each() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut any = |most: f64| DVec3::new(most * next(), most * next(), most * next());
        let sizes = [0.5, 2.0, 9.0, 30.0];
        let parts: Vec<Bounds> = (0..300)
            .map(|n| (any(40.0) - DVec3::repeat(20.0), any(sizes[n % 4])))
            .map(|(low, size)| [low, low + size])
            .collect();
        // Some exactly on the bounds.
        let mut positions: Vec<DVec3> = (0..3000).map(|_| any(44.0) - DVec3::repeat(22.0)).collect();
        positions.extend(parts.as_flattened());
        let limits: Vec<usize> = (0..parts.len()).map(|n| n % 3 * 5).collect();
        let counts = count(&parts, &positions, &limits, |part, _| part != 7);
        for (n, bounds) in parts.iter().enumerate() {
            let all = positions.iter().filter(|position| n != 7 && is_within(bounds, position)).count();
            assert_eq!(counts[n], all.min(limits[n]), "part {n}: {bounds:?}");
        }
    }

    #[test]
    fn positions_in_any_part_are_told() {
        let parts = [DVec3::zeros(), DVec3::new(5.0, 0.0, 0.0)].map(|low| [low, low + DVec3::repeat(1.0)]);
        // The mesh of the second fills only a part of its bounds.
        let mesh = |part: usize| TriMesh::cuboid([0.0; 3], [1.0, [1.0, 0.5][part], 1.0]);
        let positions = [0.3, 5.3, 3.0].map(|x| DVec3::new(x, 0.7, 0.6));
        assert_eq!(are_inside(&positions, &parts, mesh), [true, false, false]);
        let lower = positions.map(|position| position - DVec3::new(0.0, 0.4, 0.0));
        assert_eq!(are_inside(&lower, &parts, mesh), [true, true, false]);
    }

    #[test]
    fn those_beside_count_where_one_is_inside() {
        // Above the first cube and above the second; inside the first only.
        let above = |n: u32, by: f64| middle(n) + DVec3::new(0.0, 0.55 + by, 0.0);
        let positions = [above(0, 0.4), middle(0), above(0, 0.6), above(1, 0.4), above(0, 0.1)];
        let counts = in_cubes(&positions, 1.0, 8);
        assert_eq!([counts[0], counts[1], counts[2]], [3, 0, 0]);
        assert_eq!(in_cubes(&positions, 0.5, 8)[0], 2);
        assert_eq!(in_cubes(&positions, 1.0, 2)[0], 2);
    }
}
