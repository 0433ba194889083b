//! Removes slivers from the triangles that a repair created: pieces of a cut as thin as rounding, points beside vertices or at the same
//! position, corners almost on the opposite edge. A new vertex is merged into a neighbour, or an edge is flipped ([`editable_mesh`]).
//!
//! Quality is the altitude of a triangle on its longest edge, divided by that edge's length: 0.87 at most. Edges shorter than [`SHORT`]
//! count as that long: triangles among almost coincident points may look well shaped by chance, but degenerate once their positions have
//! 32 bits.

mod editable_mesh;

use std::collections::VecDeque;

use super::{Draft, Source};
use crate::geometry::DVec3;
use crate::geometry::fans::flipped;
use crate::geometry::shape::{altitude, normal};
use editable_mesh::{Change, VertexRings};

/// Quality below which a triangle is a sliver: the 1e-4 guaranteed for a repaired mesh, with a margin.
const MIN_QUALITY: f64 = 4e-4;
/// Triangles of at least this quality are left alone.
const GOOD: f64 = 0.05;
/// Length up to which edges are short (cells).
const SHORT: f64 = 1e-3;
/// Largest displacement of a vertex in one change (cells).
const MAX_DISPLACEMENT: f64 = 0.5;
/// Largest displacement of the surface where an edge flips (cells): where large triangles meet in a ridge it would be large.
const BEVEL: f64 = 0.1;
/// Maximum number of times a triangle is queued in a sweep.
const TRIES: u8 = 8;
/// Maximum number of sweeps by one rule before the next rule is applied.
const SWEEPS: usize = 4;
/// Maximum number of rounds over all rules.
const ROUNDS: usize = 3;

/// Which triangles are improved, and the constraints on a change.
struct Rule {
    /// Triangles below this quality are improved.
    below: f64,
    /// True: a change must reduce the number of slivers; false: it must improve the worst triangle without adding slivers.
    by_count: bool,
    /// Largest displacement of a vertex (cells).
    max_displacement: f64,
    /// Edges may be flipped, not only collapsed.
    may_flip: bool,
    /// A collapse may invert triangles.
    may_invert: bool,
    /// A flip may fold its two triangles.
    may_fold: bool,
}

/// Against slivers alone.
const SLIVERS_ONLY: Rule = Rule {
    below: MIN_QUALITY,
    by_count: true,
    max_displacement: MAX_DISPLACEMENT,
    may_flip: true,
    may_invert: false,
    may_fold: false,
};

/// Applied in order: almost coincident points are merged before a flip can separate them; then triangles are improved; the slivers that are
/// left are removed by ever less careful rules.
const RULES: [Rule; 5] = [
    Rule { max_displacement: SHORT, may_flip: false, ..SLIVERS_ONLY },
    Rule { below: GOOD, by_count: false, ..SLIVERS_ONLY },
    SLIVERS_ONLY,
    Rule { may_invert: true, ..SLIVERS_ONLY },
    Rule { may_invert: true, may_fold: true, ..SLIVERS_ONLY },
];

/// Removes slivers from the created triangles, then drops new vertices that no triangle uses; all others keep their order. The mesh must be
/// a closed 2-manifold by index in which only created triangles use new vertices, and stays one. Returns how many created triangles are left
/// whose smallest altitude is below [`MIN_QUALITY`] of their longest edge, however short that is.
pub(super) fn tidy(draft: &mut Draft) -> usize {
    let mut tidy = Tidy::new(draft);
    for _ in 0..ROUNDS {
        for rule in &RULES {
            for _ in 0..SWEEPS {
                if !tidy.sweep(rule) {
                    break;
                }
            }
        }
        if !tidy.created.iter().any(|&triangle| tidy.is_below(triangle, MIN_QUALITY)) {
            break;
        }
    }
    let left = tidy.slivers();
    tidy.rings.finish();
    left
}

/// Distance between the two diagonals of a quadrangle, a b and c d (cells).
fn diagonal_distance([a, b, c, d]: [DVec3; 4]) -> f64 {
    let across = (b - a).cross(&(d - c));
    let length = across.norm();
    // Collinear diagonals have no distance, and parallel ones bound no area.
    if length > 0.0 { (c - a).dot(&across).abs() / length } else { 0.0 }
}

/// Quality of a triangle: see the top of this file.
fn quality(corners: &[DVec3; 3]) -> f64 {
    altitude(corners, SHORT)
}

/// The triangles that a change touches, before or after it.
#[derive(Clone, Copy)]
struct Score {
    /// Lowest quality.
    worst: f64,
    slivers: usize,
}

impl Score {
    const EMPTY: Self = Self { worst: f64::INFINITY, slivers: 0 };

    fn count(&mut self, quality: f64) {
        self.worst = self.worst.min(quality);
        self.slivers += usize::from(quality < MIN_QUALITY);
    }
}

/// A change that a rule allows, and its outcome.
#[derive(Clone, Copy)]
struct Outcome {
    change: Change,
    /// Lowest quality after it, capped at [`GOOD`]: more is not worth a longer displacement.
    worst: f64,
    /// Displacement of the surface (cells).
    displacement: f64,
}

impl Outcome {
    fn is_better_than(&self, other: &Self) -> bool {
        self.worst > other.worst || (self.worst >= other.worst && self.displacement < other.displacement)
    }
}

/// A mesh from which slivers are being removed.
struct Tidy<'a> {
    rings: VertexRings<'a>,
    /// Created triangles, ascending; collapses may have removed some.
    created: Vec<u32>,
    /// Triangles still to be looked at, each once.
    queue: VecDeque<u32>,
    is_queued: Vec<bool>,
    /// How often each triangle was queued in this sweep.
    tries: Vec<u8>,
}

impl<'a> Tidy<'a> {
    fn new(draft: &'a mut Draft) -> Self {
        let count = draft.triangles.len();
        let created = (0..).zip(&draft.sources).filter(|(_, source)| !matches!(source, Source::Whole(_)));
        Self {
            created: created.map(|(triangle, _)| triangle).collect(),
            rings: VertexRings::of(draft),
            queue: VecDeque::new(),
            is_queued: vec![false; count],
            tries: vec![0; count],
        }
    }

    /// Looks at all created triangles, and again at those that changed; returns whether any did.
    fn sweep(&mut self, rule: &Rule) -> bool {
        for at in 0..self.created.len() {
            let triangle = self.created[at];
            self.tries[triangle as usize] = 0;
            self.queue(triangle, rule);
        }
        let mut has_changed = false;
        while let Some(triangle) = self.queue.pop_front() {
            self.is_queued[triangle as usize] = false;
            if self.is_below(triangle, rule.below)
                && let Some(change) = self.best(triangle, rule)
            {
                has_changed = true;
                for touched in self.rings.make(change) {
                    self.queue(touched, rule);
                }
            }
        }
        has_changed
    }

    fn queue(&mut self, triangle: u32, rule: &Rule) {
        let at = triangle as usize;
        if !self.is_queued[at] && self.tries[at] < TRIES && self.is_below(triangle, rule.below) {
            self.is_queued[at] = true;
            self.tries[at] += 1;
            self.queue.push_back(triangle);
        }
    }

    /// Count of created triangles whose smallest altitude is below [`MIN_QUALITY`] of their longest edge.
    fn slivers(&self) -> usize {
        let remaining = self.created.iter().filter(|&&triangle| self.rings.is_created(triangle));
        remaining.filter(|&&triangle| altitude(&self.positions(triangle), 0.0) < MIN_QUALITY).count()
    }

    /// Whether a triangle was created, still exists, and is below a quality.
    fn is_below(&self, triangle: u32, bound: f64) -> bool {
        self.rings.is_created(triangle) && quality(&self.positions(triangle)) < bound
    }

    fn positions(&self, triangle: u32) -> [DVec3; 3] {
        self.rings.corners(triangle).map(|corner| self.rings.position(corner))
    }

    /// The best change that a rule allows for a triangle; the first of equal ones.
    fn best(&self, triangle: u32, rule: &Rule) -> Option<Change> {
        let mut best: Option<Outcome> = None;
        for change in self.rings.changes(triangle) {
            if let Some(outcome) = self.outcome(change, rule)
                && best.is_none_or(|best| outcome.is_better_than(&best))
            {
                best = Some(outcome);
            }
        }
        best.map(|best| best.change)
    }

    /// The outcome of a change; none if a rule forbids it.
    fn outcome(&self, change: Change, rule: &Rule) -> Option<Outcome> {
        let displacement = match change {
            Change::Collapse { from, position, .. } => (position - self.rings.position(from)).norm(),
            Change::Flip { corners, .. } => {
                diagonal_distance(corners.map(|corner| self.rings.position(corner)))
            }
        };
        let max_displacement = if let Change::Flip { .. } = change {
            rule.max_displacement.min(BEVEL)
        } else {
            rule.max_displacement
        };
        if displacement > max_displacement {
            return None;
        }
        let [before, after] = match change {
            Change::Collapse { from, to, position } => self.collapsed(from, to, position, rule)?,
            Change::Flip { triangles, corners } if rule.may_flip => self.flipped(triangles, corners, rule)?,
            Change::Flip { .. } => return None,
        };
        let are_fewer = after.slivers < before.slivers;
        let is_gain = if rule.by_count {
            are_fewer
        } else if are_fewer {
            after.worst >= before.worst
        } else {
            after.slivers == before.slivers && after.worst > before.worst
        };
        is_gain.then_some(Outcome { change, worst: after.worst.min(GOOD), displacement })
    }

    /// The triangles around a collapse, before and after it.
    fn collapsed(&self, from: u32, to: u32, position: DVec3, rule: &Rule) -> Option<[Score; 2]> {
        let [mut before, mut after] = [Score::EMPTY; 2];
        for triangle in self.rings.moving(from, to, position) {
            if !self.rings.is_created(triangle) {
                return None;
            }
            let (corners, old) = (self.rings.corners(triangle), self.positions(triangle));
            let old_quality = quality(&old);
            before.count(old_quality);
            if corners.contains(&from) && corners.contains(&to) {
                continue;
            }
            let moved = |at: u32| if at == from || at == to { position } else { self.rings.position(at) };
            let new = corners.map(moved);
            // The normal of a sliver is meaningless.
            let turns = old_quality >= MIN_QUALITY && normal(&old).dot(&normal(&new)) <= 0.0;
            if turns && !rule.may_invert {
                return None;
            }
            after.count(quality(&new));
        }
        Some([before, after])
    }

    /// The two triangles of a flip, before and after it.
    fn flipped(&self, triangles: [u32; 2], corners: [u32; 4], rule: &Rule) -> Option<[Score; 2]> {
        let [mut before, mut after] = [Score::EMPTY; 2];
        let mut sum = DVec3::zeros();
        for triangle in triangles {
            let old = self.positions(triangle);
            before.count(quality(&old));
            sum += normal(&old);
        }
        for corners in flipped(corners) {
            let new = corners.map(|corner| self.rings.position(corner));
            if normal(&new).dot(&sum) <= 0.0 && !rule.may_fold {
                return None;
            }
            after.count(quality(&new));
        }
        Some([before, after])
    }
}

#[cfg(test)]
mod tests {
    use super::editable_mesh::tests::{split, split_edge, torus};
    use super::*;
    use crate::geometry::check::topology::Topology;

    fn is_watertight(draft: &Draft) -> bool {
        let arrays =
            [(draft.is_made.len(), draft.positions.len()), (draft.sources.len(), draft.triangles.len())];
        arrays.iter().all(|(one, other)| one == other)
            && Topology::of(draft.positions.len(), &draft.triangles).is_watertight()
    }

    fn corners(draft: &Draft, triangle: usize) -> [DVec3; 3] {
        draft.triangles[triangle].map(|corner| draft.positions[corner as usize])
    }

    fn volume(draft: &Draft) -> f64 {
        let six = |triangle: usize| {
            let [a, b, c] = corners(draft, triangle);
            a.dot(&b.cross(&c))
        };
        (0..draft.triangles.len()).map(six).sum::<f64>() / 6.0
    }

    /// Tidies a changed mesh, and checks what holds however many slivers are left; returns their number. The volume changes by less than a
    /// share.
    fn tidied(draft: &mut Draft, first: &Draft, share: f64) -> usize {
        let own = |draft: &Draft| -> Vec<DVec3> {
            let all = draft.positions.iter().zip(&draft.is_made);
            all.filter(|(_, is_made)| !**is_made).map(|(position, _)| *position).collect()
        };
        let whole = |draft: &Draft| -> Vec<(Source, [DVec3; 3])> {
            let all = (0..draft.triangles.len()).map(|at| (draft.sources[at], corners(draft, at)));
            all.filter(|(source, _)| matches!(source, Source::Whole(_))).collect()
        };
        assert!(is_watertight(draft));
        let before = (own(draft), whole(draft), volume(draft));
        let left = tidy(draft);
        assert!(is_watertight(draft));
        assert!(own(draft) == before.0, "a vertex of the mesh's own was touched");
        assert!(whole(draft) == before.1, "a whole triangle was touched");
        let after = volume(draft);
        assert!((after / before.2 - 1.0).abs() < share, "{after} is not {}", before.2);
        for at in 0..draft.triangles.len() {
            if let Source::Part(of) = draft.sources[at] {
                let plane = corners(first, of as usize);
                let up = normal(&plane).normalize();
                let is_in_plane = |position: DVec3| (position - plane[0]).dot(&up).abs() < 1e-9;
                assert!(corners(draft, at).into_iter().all(is_in_plane), "triangle {at} is no part of {of}");
            }
        }
        let slivers = (0..draft.triangles.len())
            .filter(|&at| !matches!(draft.sources[at], Source::Whole(_)))
            .filter(|&at| altitude(&corners(draft, at), 0.0) < MIN_QUALITY);
        assert_eq!(left, slivers.count());
        left
    }

    /// Numbers from 0 to 1 by a linear congruence.
    struct Random(u64);

    impl Random {
        fn share(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn below(&mut self, count: usize) -> usize {
            (self.share() * count as f64) as usize
        }
    }

    #[test]
    fn points_at_vertices_beside_them_and_almost_on_edges_go() {
        let first = torus(1.0);
        for weights in [[1.0, 0.0, 0.0], [1.0, 1e-9, 1e-9], [1.0, 1.0, 1e-9], [1e-9, 1.0, 1e-12]] {
            let mut draft = torus(1.0);
            (0..30).for_each(|n| split(&mut draft, 20 * n, weights));
            assert_eq!(tidied(&mut draft, &first, 1e-4), 0, "{weights:?}");
            assert_eq!(
                (draft.positions.len(), draft.triangles.len()),
                (first.positions.len(), first.triangles.len())
            );
            let is_part = |source: &&Source| matches!(source, Source::Part(_));
            assert_eq!(draft.sources.iter().filter(is_part).count(), 30, "{weights:?}");
        }
        let mut draft = torus(1.0);
        for (n, share) in [0.0, 1e-12, 1e-9, 1e-5, 0.999_999, 1.0].into_iter().cycle().take(30).enumerate() {
            split_edge(&mut draft, 20 * n, share);
        }
        assert_eq!(tidied(&mut draft, &first, 1e-4), 0);
        assert_eq!(draft.triangles.len(), first.triangles.len());
    }

    #[test]
    fn an_edge_flips_where_both_its_triangles_were_created() {
        let first = torus(1.0);
        let mut draft = torus(1.0);
        for n in 0..30 {
            split(&mut draft, 20 * n, [1.0, 1.0, 1e-9]);
            split(&mut draft, 20 * n + 1, [1.0; 3]);
        }
        let count = draft.triangles.len();
        assert_eq!(tidied(&mut draft, &first, 1e-4), 0);
        assert_eq!((draft.positions.len(), draft.triangles.len()), (first.positions.len() + 60, count));
        assert_eq!(draft.sources.iter().filter(|source| **source == Source::New).count(), 60);
    }

    #[test]
    fn no_vertex_moves_far() {
        let (first, mut draft) = (torus(10.0), torus(10.0));
        (0..30).for_each(|n| split(&mut draft, 20 * n, [1.0, 1.0, 1e-9]));
        assert_eq!(tidied(&mut draft, &first, 1e-4), 30);
        assert_eq!(draft.triangles.len(), first.triangles.len() + 60);
    }

    #[test]
    fn slivers_within_slivers_go() {
        let first = torus(1.0);
        for seed in 0..4 {
            let (mut draft, mut random) = (torus(1.0), Random(seed));
            for _ in 0..600 {
                let triangle = random.below(40);
                if random.below(3) == 0 {
                    let share = [0.0, 1e-12, 1e-7, 0.3, 0.999_999, 1.0][random.below(6)];
                    split_edge(&mut draft, triangle, share);
                } else {
                    let weight = |_: usize| [1e-15, 1e-9, 1e-5, 0.1, 1.0][random.below(5)];
                    split(&mut draft, triangle, std::array::from_fn(weight));
                }
            }
            assert_eq!(tidied(&mut draft, &first, 1e-4), 0, "seed {seed}");
        }
    }

    #[test]
    fn clusters_of_points_become_one() {
        let first = torus(1.0);
        for (made, noise) in [(1.0, 0.0), (1.0, 1e-9), (0.7, 1e-9)] {
            let (mut draft, mut random) = (torus(1.0), Random(1));
            for vertex in 0..draft.positions.len() {
                if random.share() < made {
                    draft.is_made[vertex] = true;
                    draft.positions[vertex] =
                        draft.positions[vertex].map(|x| x.round() + noise * (random.share() - 0.5));
                }
            }
            for (corners, source) in draft.triangles.iter().zip(&mut draft.sources) {
                if corners.iter().any(|&corner| draft.is_made[corner as usize]) {
                    *source = Source::New;
                }
            }
            assert_eq!(tidied(&mut draft, &first, 5e-3), 0, "{made} of them, by {noise}");
        }
    }

    #[test]
    fn the_smallest_bodies_stay_closed() {
        let body = |positions: &[[f64; 3]], triangles: &[[u32; 3]]| Draft {
            positions: positions.iter().map(|position| DVec3::from(*position)).collect(),
            is_made: vec![true; positions.len()],
            triangles: triangles.to_vec(),
            sources: vec![Source::New; triangles.len()],
        };
        let needle = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1e-9, 0.0], [0.5, 0.0, 1e-9]];
        let mut tetrahedron = body(&needle, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
        assert_eq!(tidy(&mut tetrahedron), 4);
        assert!(is_watertight(&tetrahedron) && tetrahedron.positions.len() == 4);
        // Two pyramids, base to base: the tip of one lies almost on an edge of the base.
        let flat = [[0.0; 3], [0.4, 0.0, 0.0], [0.2, 0.3, 0.0], [0.2, 1e-9, 1e-9], [0.2, 0.1, -0.1]];
        let sides = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4]];
        let mut doubled = body(&flat, &sides);
        assert_eq!(tidy(&mut doubled), 0);
        assert!(is_watertight(&doubled));
    }
}
