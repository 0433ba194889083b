//! How many particles closed parts of a surface hold: drops, crumbs.
//!
//! The particles' surface passes close to those of small drops, and outside of some: of 20 at random places 10 to 14 lie inside, nearly
//! all others less than half a spacing from it. So those beside a part count too, if any lies inside.

use crate::base::bvh::Bvh;
use crate::base::deviation::NearestTree;
use crate::base::{DVec3, TriMesh};

/// A direction along which no edges of made meshes run.
const ASLANT: DVec3 = DVec3::new(0.5773, 0.6533, 0.4896);
/// How near to a part a particle is beside it (spacings).
const BESIDE: f64 = 0.5;
/// Parts up to so many times as long as half of them are found by where they begin on the first axis; others are looked at one by one.
const NARROW: f64 = 4.0;

/// Least and greatest place of a part.
pub type Bounds = [DVec3; 2];

/// Particles, of which a part must hold some.
#[derive(Debug, Clone, Copy)]
pub struct Crowd<'a> {
    /// Their places (m).
    pub places: &'a [DVec3],
    /// Initial distance between them (m).
    pub spacing: f64,
    /// How many a part must hold, at least 1.
    pub least: usize,
}

impl Crowd<'_> {
    /// How many particles each of some closed parts holds, of which these are the bounds (m), counted up to [`Crowd::least`]: 0 if none
    /// lies inside, else those inside and beside it. `mesh` gives a part's triangles, outward, their places seen from its least one; it
    /// is asked where particles come near.
    pub fn held(&self, parts: &[Bounds], mesh: impl Fn(usize) -> TriMesh) -> Vec<usize> {
        let mut trees: Vec<Option<Bvh>> = Vec::new();
        trees.resize_with(parts.len(), || None);
        let mut counts = count(parts, self.places, &vec![self.least; parts.len()], |part, place| {
            let tree = trees[part].get_or_insert_with(|| Bvh::new(&mesh(part)));
            tree.surrounding(place - parts[part][0], ASLANT) > 0
        });
        let lacking = |count: &usize| if *count == 0 { 0 } else { self.least - count };
        let lacking: Vec<usize> = counts.iter().map(lacking).collect();
        let margin = BESIDE * self.spacing;
        let wider: Vec<Bounds> = parts
            .iter()
            .map(|[low, high]| [low - DVec3::repeat(margin), high + DVec3::repeat(margin)])
            .collect();
        let mut surfaces: Vec<Option<NearestTree>> = Vec::new();
        surfaces.resize_with(parts.len(), || None);
        let beside = count(&wider, self.places, &lacking, |part, place| {
            let seen = place - parts[part][0];
            let surface = surfaces[part].get_or_insert_with(|| NearestTree::new(&mesh(part)));
            let is_near = surface.nearest(seen).is_some_and(|nearest| nearest.distance <= margin);
            is_near && trees[part].as_ref().is_some_and(|tree| tree.surrounding(seen, ASLANT) <= 0)
        });
        counts.iter_mut().zip(beside).for_each(|(count, beside)| *count += beside);
        counts
    }
}

/// Counts the places within each of some bounds that are of the part, up to as many as it lacks.
fn count(
    parts: &[Bounds],
    places: &[DVec3],
    lacking: &[usize],
    mut is_of: impl FnMut(usize, DVec3) -> bool,
) -> Vec<usize> {
    let mut counts = vec![0; parts.len()];
    let mut open: Vec<usize> = (0..parts.len()).filter(|part| lacking[*part] > 0).collect();
    if open.is_empty() {
        return counts;
    }
    open.sort_by(|a, b| parts[*a][0].x.total_cmp(&parts[*b][0].x));
    let length = |part: usize| parts[part][1].x - parts[part][0].x;
    let mut lengths: Vec<f64> = open.iter().map(|part| length(*part)).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    let reach = NARROW * lengths[lengths.len() / 2];
    let mut left = open.len();
    let (narrow, mut wide): (Vec<usize>, Vec<usize>) =
        open.into_iter().partition(|part| length(*part) <= reach);
    for place in places {
        // A little farther back: differences are rounded.
        let first = narrow.partition_point(|part| parts[*part][0].x < place.x - 1.01 * reach);
        let near = narrow[first..].iter().take_while(|part| parts[**part][0].x <= place.x);
        let before = left;
        for &part in wide.iter().chain(near) {
            if counts[part] < lacking[part] && is_within(&parts[part], place) && is_of(part, *place) {
                counts[part] += 1;
                left -= usize::from(counts[part] == lacking[part]);
            }
        }
        if left == 0 {
            break;
        }
        if left < before {
            wide.retain(|part| counts[*part] < lacking[*part]);
        }
    }
    counts
}

/// Whether a place lies within bounds.
pub fn is_within([low, high]: &Bounds, place: &DVec3) -> bool {
    (0..3).all(|axis| (low[axis]..=high[axis]).contains(&place[axis]))
}

/// Triangles as a mesh, their places seen from another; each has corners of its own.
pub fn seen_from(place: DVec3, triangles: &[[DVec3; 3]]) -> TriMesh {
    let positions = triangles.as_flattened().iter().map(|corner| (corner - place).cast()).collect();
    let triangles = (0..triangles.len() as u32).map(|at| [3 * at, 3 * at + 1, 3 * at + 2]).collect();
    TriMesh { positions, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many particles are held by a hundred cubes of an edge of 1 along a line, and by a box that holds them all.
    fn held(places: &[DVec3], spacing: f64, least: usize) -> Vec<usize> {
        let mut parts: Vec<Bounds> = (0..100)
            .map(|n| DVec3::new(3.0 * f64::from(n), 0.0, 0.0))
            .map(|low| [low, low + DVec3::repeat(1.0)])
            .collect();
        parts.push([DVec3::repeat(-1.0), DVec3::new(400.0, 2.0, 2.0)]);
        let mesh = |part: usize| match part {
            100 => TriMesh::cuboid([0.0; 3], [401.0, 3.0, 3.0]),
            _ => TriMesh::cuboid([0.0; 3], [1.0; 3]),
        };
        Crowd { places, spacing, least }.held(&parts, mesh)
    }

    fn middle(n: u32) -> DVec3 {
        DVec3::new(3.0 * f64::from(n) + 0.5, 0.45, 0.55)
    }

    #[test]
    fn particles_are_counted_in_parts_of_all_lengths() {
        // One in every second cube, another in each tenth; one between cubes, one outside of all.
        let mut places: Vec<DVec3> = (0..100).filter(|n| n % 2 == 0).map(middle).collect();
        places.extend((0..100).filter(|n| n % 10 == 0).map(|n| middle(n) + DVec3::repeat(0.1)));
        places.extend([DVec3::new(1.6, 0.5, 0.5), DVec3::new(0.5, 9.0, 0.5)]);
        for least in [1, 2, 100] {
            for (n, count) in held(&places, 1.0, least).into_iter().enumerate() {
                let all = if n == 100 { 61 } else { usize::from(n % 2 == 0) + usize::from(n % 10 == 0) };
                assert_eq!(count, all.min(least), "part {n} up to {least}");
            }
        }
    }

    #[test]
    fn those_beside_count_where_one_is_inside() {
        // Above the first cube and above the second; inside of the first alone.
        let above = |n: u32, by: f64| middle(n) + DVec3::new(0.0, 0.55 + by, 0.0);
        let places = [above(0, 0.4), middle(0), above(0, 0.6), above(1, 0.4), above(0, 0.1)];
        let counts = held(&places, 1.0, 8);
        assert_eq!([counts[0], counts[1], counts[2]], [3, 0, 0]);
        assert_eq!(held(&places, 0.5, 8)[0], 2);
        assert_eq!(held(&places, 1.0, 2)[0], 2);
    }
}
