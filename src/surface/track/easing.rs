//! Easing of topology changes (suggested in thesis 2.8): vertices that a change will remove move towards what will replace them, a fraction
//! of the displacement in each of the frames before it, so that a bridge does not pop up. This affects only the displayed mesh, not the
//! tracked one.

use rayon::prelude::*;

use crate::context::Context;
use crate::error::Result;
use crate::geometry::check::deviation::NearestTree;
use crate::geometry::check::topology::{components, neighbour_sums};
use crate::geometry::mesh::compact;
use crate::geometry::{DVec3, TriMesh, Vec3};
use crate::mesh_repair::{Source, weights};
use crate::surface::topology::change::Change;

/// Positions per task.
const GRAIN: usize = 256;
/// Number of iterations in which new positions pull the old surface towards them.
const PULLS: usize = 16;
/// Maximum displacement to what replaces a vertex (spacings): anything farther away is another surface that appears.
const MAX_DISPLACEMENT: f64 = 4.0;
/// A part of the old surface is not eased if no new position near it is farther away than this (spacings): there is no jump to hide.
const NEAR: f64 = 0.25;
/// Number of iterations in which vertices without a pull take the mean displacement of their neighbours.
const SPREAD: usize = 8;
/// Pulls on a vertex are ignored if their weights add up to less than this.
const MIN_WEIGHT: f64 = 1e-3;

/// Where the vertices that a step removes should move before it.
#[derive(Debug, Clone, Default)]
pub struct EasingTargets {
    /// Vertices that are removed, ascending, with their displacements (m) to what replaces them.
    displacements: Vec<(u32, DVec3)>,
    /// For each vertex after the step, the vertex that it was before.
    origins: Origins,
}

impl EasingTargets {
    /// The targets of a change of a mesh that had these triangles; particles are `spacing` (m) apart.
    ///
    /// # Errors
    /// Cancel.
    pub fn of(ctx: &Context, change: &Change, triangles: &[[u32; 3]], spacing: f64) -> Result<Self> {
        let displacements = ctx.phase("ease", || easing_displacements(ctx, change, triangles, spacing))?;
        Ok(Self { displacements, origins: Some(change.origins.clone()) })
    }

    /// For a mesh that is replaced by an unrelated one of this many vertices: nothing is eased.
    pub fn unrelated(vertices: usize) -> Self {
        Self { displacements: Vec::new(), origins: Some(vec![None; vertices]) }
    }

    /// The index that a vertex had before the step; none: it is new.
    pub fn before(&self, vertex: u32) -> Option<u32> {
        origin(&self.origins, vertex)
    }

    /// Whether a vertex before the step is removed, and moves towards its replacement.
    pub fn is_replaced(&self, vertex: u32) -> bool {
        self.displacements.binary_search_by_key(&vertex, |(vertex, _)| *vertex).is_ok()
    }

    /// The combination of two successive steps.
    pub fn then(mut self, next: &Self) -> Self {
        let displacements = next
            .displacements
            .iter()
            .filter_map(|(vertex, displacement)| Some((origin(&self.origins, *vertex)?, *displacement)));
        self.displacements.extend(displacements);
        self.displacements.sort_unstable_by_key(|(vertex, _)| *vertex);
        self.origins = composed(self.origins, &next.origins);
        self
    }
}

/// For each vertex, the vertex that it was before, or none if it is new; none: all are unchanged.
type Origins = Option<Vec<Option<u32>>>;

fn origin(origins: &Origins, vertex: u32) -> Option<u32> {
    origins.as_ref().map_or(Some(vertex), |origins| origins[vertex as usize])
}

/// Origins through two steps.
fn composed(first: Origins, second: &Origins) -> Origins {
    let Some(second) = second else { return first };
    Some(second.iter().map(|at| at.and_then(|at| origin(&first, at))).collect())
}

/// A vertex that is displaced ahead of a change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eased {
    /// Its index.
    pub vertex: u32,
    /// Displacement now (m).
    pub now: DVec3,
    /// Displacement after the first of the coming steps (m).
    pub next: DVec3,
}

/// The vertices, ascending, that are displaced ahead of the steps in `coming` (the first step first), and by how much. Displacement starts
/// `ahead` steps before the step that removes a vertex, grows with each step, and is complete when that step is done.
pub fn eased<'a>(coming: impl IntoIterator<Item = &'a EasingTargets>, ahead: usize) -> Vec<Eased> {
    let (mut origins, mut moved) = (None, Vec::new());
    for (step, targets) in (1..=ahead + 1).zip(coming) {
        let [now, next] = [step, step - 1].map(|steps| weight(steps, ahead));
        for (vertex, displacement) in &targets.displacements {
            if let Some(vertex) = origin(&origins, *vertex) {
                moved.push(Eased { vertex, now: displacement * now, next: displacement * next });
            }
        }
        origins = composed(origins, &targets.origins);
    }
    moved.sort_by_key(|eased| eased.vertex);
    moved
}

/// Fraction of the displacement, `steps` steps before the change is done: a smoothstep.
fn weight(steps: usize, ahead: usize) -> f64 {
    let gone = 1.0 - (steps as f64 / (ahead + 1) as f64).min(1.0);
    gone * gone * (3.0 - 2.0 * gone)
}

/// The displacements (m) of the vertices that a change removes, by their index before it; `spacing` (m) is the unit of the limits.
fn easing_displacements(
    ctx: &Context,
    change: &Change,
    triangles: &[[u32; 3]],
    spacing: f64,
) -> Result<Vec<(u32, DVec3)>> {
    let Some(old) = Patch::old(change, triangles) else { return Ok(Vec::new()) };
    let new = Patch::new(change);
    if new.triangles.is_empty() {
        return Ok(Vec::new());
    }
    // Positions are relative to one of them: far from the origin 32 bits are not precise enough.
    let origin = change.before[old.indices[0] as usize];
    let begin: Vec<DVec3> = old.indices.iter().map(|index| change.before[*index as usize] - origin).collect();
    let ends: Vec<DVec3> =
        new.indices.iter().map(|index| change.vertices[*index as usize] - origin).collect();
    let made = ends.iter().zip(&new.is_loose).filter(|(_, made)| **made).map(|(position, _)| *position);
    let made = old.positions_at_jumps(
        &begin,
        made.collect(),
        [NEAR, MAX_DISPLACEMENT].map(|length| length * spacing),
    );
    if made.is_empty() {
        return Ok(Vec::new());
    }
    let mut positions = begin.clone();
    let mut is_pulled = vec![false; positions.len()];
    for _ in 0..PULLS {
        ctx.check()?;
        let tree = old.tree(&positions);
        let near: Vec<_> =
            made.par_iter().with_min_len(GRAIN).map(|position| tree.nearest(*position)).collect();
        let mut pulls = vec![(DVec3::zeros(), 0.0); positions.len()];
        for (position, near) in made.iter().zip(near) {
            let Some(near) = near else { continue };
            let corners = old.triangles[near.triangle];
            let shares = weights(&corners.map(|at| positions[at as usize]), near.position);
            for (corner, share) in corners.into_iter().zip(shares) {
                let pull = &mut pulls[corner as usize];
                *pull = (pull.0 + (position - near.position) * share, pull.1 + share);
            }
        }
        for (at, (pull, share)) in pulls.into_iter().enumerate() {
            if old.is_loose[at] && share > MIN_WEIGHT {
                positions[at] += pull / share;
                is_pulled[at] = true;
            }
        }
    }
    let mut displacements: Vec<DVec3> = positions.iter().zip(&begin).map(|(to, from)| to - from).collect();
    old.spread(&mut displacements, &is_pulled);
    let limit = MAX_DISPLACEMENT * spacing;
    let moved = (0..displacements.len())
        .filter(|at| displacements[*at] != DVec3::zeros() && displacements[*at].norm() <= limit);
    Ok(moved.map(|at| (old.indices[at], displacements[at])).collect())
}

/// Triangles that a change removes, or that it creates.
struct Patch {
    /// Indices of the mesh's vertices, ascending.
    indices: Vec<u32>,
    /// Whether each vertex is removed, or new; the others stay.
    is_loose: Vec<bool>,
    /// Triangles of these vertices.
    triangles: Vec<[u32; 3]>,
}

impl Patch {
    /// The triangles that are removed or changed; none if no vertex is removed.
    fn old(change: &Change, triangles: &[[u32; 3]]) -> Option<Self> {
        let mut is_removed = vec![true; change.before.len()];
        change.origins.iter().flatten().for_each(|at| is_removed[*at as usize] = false);
        if !is_removed.contains(&true) {
            return None;
        }
        let mut is_old = vec![true; triangles.len()];
        for source in &change.sources {
            if let Source::Whole(at) = source {
                is_old[*at as usize] = false;
            }
        }
        let old = triangles.iter().zip(&is_old).filter(|(_, is_old)| **is_old).map(|(indices, _)| *indices);
        let patch = Self::of(is_removed.len(), old.collect(), |index| is_removed[index as usize]);
        (!patch.triangles.is_empty()).then_some(patch)
    }

    /// The triangles that are new, or parts of others.
    fn new(change: &Change) -> Self {
        let made = change.sources.iter().zip(&change.triangles);
        let made =
            made.filter(|(source, _)| !matches!(source, Source::Whole(_))).map(|(_, indices)| *indices);
        Self::of(change.vertices.len(), made.collect(), |index| change.origins[index as usize].is_none())
    }

    fn of(vertices: usize, triangles: Vec<[u32; 3]>, is_loose: impl Fn(u32) -> bool) -> Self {
        let (indices, triangles) = compact(vertices, &triangles);
        Self { is_loose: indices.iter().map(|index| is_loose(*index)).collect(), indices, triangles }
    }

    /// The new positions (`made`) at parts of the patch where the surface jumps: each belongs to the nearest part (whose vertices lie at
    /// `begin`), and a part jumps if one of its positions is farther away than `near`. Positions farther than `longest` from all parts
    /// belong to another surface, and are left out.
    fn positions_at_jumps(&self, begin: &[DVec3], made: Vec<DVec3>, [near, longest]: [f64; 2]) -> Vec<DVec3> {
        let mut part_of = vec![0; self.triangles.len()];
        let parts = components(&self.triangles);
        for (part, triangles) in parts.iter().enumerate() {
            triangles.iter().for_each(|triangle| part_of[*triangle as usize] = part);
        }
        let tree = self.tree(begin);
        let mut is_jump = vec![false; parts.len()];
        let mut found = Vec::with_capacity(made.len());
        let feet: Vec<_> =
            made.par_iter().with_min_len(GRAIN).map(|position| tree.nearest(*position)).collect();
        for (position, at) in made.into_iter().zip(feet) {
            let Some(at) = at.filter(|at| at.distance <= longest) else { continue };
            let part = part_of[at.triangle];
            is_jump[part] |= at.distance > near;
            found.push((position, part));
        }
        found.into_iter().filter(|(_, part)| is_jump[*part]).map(|(position, _)| position).collect()
    }

    /// Gives removed vertices that were not pulled the mean displacement of their neighbours, several times; vertices that stay have none.
    fn spread(&self, displacements: &mut [DVec3], is_pulled: &[bool]) {
        for _ in 0..SPREAD {
            let sums = neighbour_sums(displacements.len(), &self.triangles, |vertex| {
                Some(displacements[vertex as usize])
            });
            for (at, (sum, count)) in sums.into_iter().enumerate() {
                if self.is_loose[at] && !is_pulled[at] && count > 0 {
                    displacements[at] = sum / f64::from(count);
                }
            }
        }
    }

    fn tree(&self, positions: &[DVec3]) -> NearestTree {
        let positions: Vec<Vec3> = positions.iter().map(|position| position.cast()).collect();
        NearestTree::new(&TriMesh { positions, triangles: self.triangles.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::{context, rebuilt, two_balls};

    #[test]
    fn the_old_surface_leads_to_the_bridge_that_comes() {
        let ctx = context(2);
        let balls = |away: f64| two_balls(4.2, DVec3::new(away, 0.1, 0.0));
        let mut from = balls(6.5);
        let mut tracker = rebuilt(&ctx, &from);
        let farthest = |positions: &[DVec3], triangles: &[[u32; 3]], change: &Change| {
            let positions = positions.iter().map(|position| position.cast()).collect();
            let tree = NearestTree::new(&TriMesh { positions, triangles: triangles.to_vec() });
            let made = change.vertices.iter().zip(&change.origins).filter(|(_, origin)| origin.is_none());
            made.map(|(position, _)| tree.nearest(*position).unwrap().distance).fold(0.0, f64::max)
        };
        let mut seen = 0;
        for step in 1..=16 {
            let to = balls(6.5 - 0.2 * f64::from(step));
            let triangles = tracker.triangles().to_vec();
            let report = tracker.step(&ctx, &from, &to, 0.04).unwrap();
            from = to;
            let Some(change) = report.change else { continue };
            let far = farthest(&change.before, &triangles, &change);
            if far < 0.5 {
                continue;
            }
            let mut positions = change.before.clone();
            let targets = EasingTargets::of(&ctx, &change, &triangles, 1.0).unwrap();
            eased([&targets], 0).iter().for_each(|eased| positions[eased.vertex as usize] += eased.next);
            assert!(farthest(&positions, &triangles, &change) < 0.35 * far, "{step}");
            // Vertices that stay are not displaced.
            let stay: Vec<u32> = change.origins.iter().copied().flatten().collect();
            assert!(stay.len() > 100, "{step}: {} stay", stay.len());
            for at in stay {
                assert_eq!(positions[at as usize], change.before[at as usize]);
            }
            seen += 1;
        }
        assert!(seen > 0);
    }

    #[test]
    fn a_vertex_is_moved_more_the_nearer_its_change_is_by_the_name_that_it_has() {
        // The second step removes vertex 1, which was vertex 2 before the first.
        let displacement = DVec3::new(1.0, 2.0, 3.0);
        let first = EasingTargets { displacements: Vec::new(), origins: Some(vec![Some(0), Some(2), None]) };
        let second = EasingTargets {
            displacements: vec![(1, displacement), (2, displacement)],
            origins: Some(vec![Some(0)]),
        };
        let still = EasingTargets::default();
        let moved = |coming: &[&EasingTargets]| eased(coming.iter().copied(), 3);
        assert!(moved(&[&still, &still]).is_empty());
        let [one] = moved(&[&first, &second])[..] else { panic!("one vertex is moved") };
        assert!(
            one.vertex == 2 && one.now == displacement * 0.5 && one.next == displacement * 0.84375,
            "{one:?}"
        );
        let both = first.clone().then(&second);
        assert_eq!(
            (both.displacements.clone(), both.origins.clone()),
            (vec![(2, displacement)], Some(vec![Some(0)]))
        );
        let [one] = moved(&[&still, &still, &still, &both])[..] else { panic!("one vertex is moved") };
        assert!(one.now == DVec3::zeros() && one.next == displacement * 0.15625, "{one:?}");
        assert!(moved(&[&still, &still, &still, &still, &both]).is_empty());
        assert!(moved(&[&EasingTargets::unrelated(3), &second]).is_empty());
        let [one, two] = eased([&second], 0)[..] else { panic!("two vertices are moved") };
        assert_eq!((one.vertex, two.vertex), (1, 2));
        assert!([one, two].iter().all(|eased| eased.now == DVec3::zeros() && eased.next == displacement));
    }
}
