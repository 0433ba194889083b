//! The full check for topology errors (thesis 2.8, "at every frame"), including those that no vertex detects: places where the distance
//! between the mesh and the particles' surface exceeds the detail, although each vertex was projected.
//!
//! A projected vertex is at its kept distance from phi = 0. So such an error lies between vertices, has no vertices, or is at vertices that
//! never had a distance to keep:
//!
//! | what | found by |
//! |---|---|
//! | liquid without a mesh, a mesh without liquid | nodes inside only one of the two, farther from phi = 0 than the vertices nearby |
//! | needles, and films across a gap | positions on triangles that are farther from phi = 0 than the kept distances of the corners |
//! | hollows of the mesh that contain liquid | closed parts with a volume below 0, in regions where phi is negative |
//!
//! Bubbles and drops that the mesh does not cover are known already (`topology/uncovered_parts.rs`).

use std::collections::{BTreeMap, HashSet};

use rayon::prelude::*;

use super::mesh_distance::{far, node};
use super::particle_count::{Bounds, is_within};
use crate::context::Context;
use crate::distance::lattice::Lattice;
use crate::error::Result;
use crate::geometry::check::topology::{components, parts};
use crate::geometry::coords::{around, between, cell_of, cells_at, is_between, nodes_of, plus};
use crate::geometry::shape::{longest_first, six_volumes};
use crate::geometry::{Coord, DVec3};
use crate::mesh_repair::{CellSet, Shape};
use crate::numeric::blocks::{VOXELS, offset};
use crate::surface::level_set::band::Distances;
use crate::surface::level_set::implicit::Implicit;
use crate::surface::level_set::sampler::Sampler;
use crate::surface::pieces::in_pieces;

/// How much farther from phi = 0 than its detail the mesh must be to be flagged (spacings; a cell at least).
const SLACK: f64 = 0.5;
/// Triangles between two checks for a cancel.
const GRAIN: usize = 2048;
/// A triangle in more blocks than this is not listed in them, but tested against each block.
const LARGE: i64 = 512;
/// Upper bound on the rounding of vertices (cells).
const ROUNDED: f64 = 0.01;
/// Maximum number of steps in which a triangle is sampled, in each direction.
const POSITIONS: f64 = 4096.0;

/// The check of the whole mesh.
pub struct FullCheck<'a> {
    /// The distance that each vertex keeps (m); NaN: it has none.
    pub delta: &'a [f32],
    /// Initial distance between particles (cells).
    pub spacing: f64,
    /// Bounds (cells) of drops that get no mesh.
    pub specks: &'a [Bounds],
}

impl FullCheck<'_> {
    /// Adds the cells in which a mesh does not fit though no vertex is flagged. Vertices have these positions (cells from the lattice's
    /// origin); `phi` and its distances are on the same grid.
    ///
    /// # Errors
    /// Cancel.
    pub fn flag(
        &self,
        ctx: &Context,
        shape: &Shape,
        (in_cells, lattice): (&[DVec3], &Lattice),
        (phi, distances): (&Implicit, &Distances),
        set: &mut CellSet,
    ) -> Result<()> {
        let cell = distances.cell() as f32;
        // NaN becomes 0.
        let detail = self.delta.iter().map(|delta| (delta.abs() / cell).max(0.0)).collect();
        let slack = (SLACK * self.spacing).max(1.0) as f32;
        let origin = lattice.origin;
        let mesh = Compared { shape, in_cells, delta: self.delta, detail, slack, origin, phi, distances };
        for node in mesh.differing(ctx)? {
            let position = DVec3::from(plus(node, origin).map(f64::from));
            if !self.specks.iter().any(|speck| is_within(speck, &position)) {
                cells_at(node).into_iter().for_each(|cell| _ = set.add(cell));
            }
        }
        mesh.stray(ctx)?.into_iter().for_each(|cell| _ = set.add(cell));
        mesh.hollows(ctx, set)
    }
}

/// A mesh and the particles' surface, to be compared.
struct Compared<'a> {
    shape: &'a Shape,
    /// Positions of vertices (cells from the lattice's origin).
    in_cells: &'a [DVec3],
    /// See [`FullCheck::delta`].
    delta: &'a [f32],
    /// Magnitude of delta (cells); 0 if it is NaN.
    detail: Vec<f32>,
    /// Cells.
    slack: f32,
    /// The lattice's origin.
    origin: Coord,
    phi: &'a Implicit,
    distances: &'a Distances,
}

/// A triangle in many blocks: the minimum and maximum block, and the maximum detail of its corners (cells).
struct Large {
    low: Coord,
    high: Coord,
    detail: f32,
}

impl Large {
    /// Whether a block is within `by` blocks of it.
    fn is_near(&self, block: Coord, by: i32) -> bool {
        is_between(block, self.low.map(|at| at - by), self.high.map(|at| at + by))
    }
}

/// The blocks that triangles pass through.
#[derive(Default)]
struct Passed {
    /// Maximum detail of corners of triangles in a block (cells).
    detail: BTreeMap<Coord, f32>,
    large: Vec<Large>,
}

impl Compared<'_> {
    /// Nodes inside the mesh where phi is positive, or the reverse, farther from phi = 0 than the detail there.
    fn differing(&self, ctx: &Context) -> Result<Vec<Coord>> {
        let passed = self.passed(ctx)?;
        let origin = self.origin.map(|at| at >> 3);
        let known = self.distances.coords().iter().map(|block| plus(*block, origin.map(|at| -at)));
        let mut blocks: Vec<Coord> = known.chain(passed.detail.keys().copied()).collect();
        blocks.sort_unstable();
        blocks.dedup();
        in_pieces(ctx, &blocks, 1, |_, blocks| self.differing_in(blocks[0], &passed))
    }

    fn differing_in(&self, block: Coord, passed: &Passed) -> Vec<Coord> {
        let near = around(block).into_iter().filter_map(|block| passed.detail.get(&block).copied());
        let large = passed.large.iter().filter(|large| large.is_near(block, 1)).map(|large| large.detail);
        let allowed = self.slack + near.chain(large).fold(0.0, f32::max);
        let there = plus(block, self.origin.map(|at| at >> 3));
        let reach = self.distances.reach_in(there);
        if allowed >= reach {
            return Vec::new();
        }
        let known = self.distances.find(there).map(|slot| self.distances.values(slot));
        let is_passed =
            passed.detail.contains_key(&block) || passed.large.iter().any(|large| large.is_near(block, 0));
        // Where no triangle passes, all nodes are on the same side of the mesh.
        let first = self.is_inside(node(block, 0));
        let differs = |at: usize| {
            let node = node(block, at);
            let phi = known.map_or_else(|| far(self.phi, reach, there, at), |values| values[at]);
            let is_inside = || if is_passed { self.is_inside(node) } else { first };
            (phi.abs() > allowed && is_inside() != (phi < 0.0)).then_some(node)
        };
        (0..VOXELS).filter_map(differs).collect()
    }

    /// The blocks that contain triangles.
    fn passed(&self, ctx: &Context) -> Result<Passed> {
        let in_blocks = |triangles: &[[u32; 3]]| {
            ctx.check()?;
            let mut out = Passed::default();
            for triangle in triangles {
                let [a, b, c] = self.corners(triangle);
                let side = |position: DVec3, by: f64| {
                    [0, 1, 2].map(|axis| ((position[axis] + by).floor() as i32) >> 3)
                };
                let low = side(a.inf(&b).inf(&c), -ROUNDED);
                let high = side(a.sup(&b).sup(&c), ROUNDED);
                let detail = self.max_detail(triangle);
                let size = (0..3).map(|axis| i64::from(high[axis] - low[axis]) + 1).product::<i64>();
                if size > LARGE {
                    out.large.push(Large { low, high, detail });
                } else {
                    between(low, high).for_each(|block| raise(&mut out.detail, block, detail));
                }
            }
            Ok(out)
        };
        let parts: Vec<Passed> =
            self.shape.triangles.par_chunks(GRAIN).map(in_blocks).collect::<Result<_>>()?;
        let mut all = Passed::default();
        for part in parts {
            part.detail.into_iter().for_each(|(block, detail)| raise(&mut all.detail, block, detail));
            all.large.extend(part.large);
        }
        Ok(all)
    }

    /// Cells with positions on triangles that are farther from phi = 0 than the detail of the corners.
    fn stray(&self, ctx: &Context) -> Result<Vec<Coord>> {
        let in_cells = |sampler: &mut Sampler<'_>, triangles: &[[u32; 3]]| {
            ctx.check()?;
            let mut out = Vec::new();
            for triangle in triangles {
                let [a, b, c] = longest_first(self.corners(triangle));
                // A short triangle is nowhere much farther from phi = 0 than its corners, if these were projected.
                let is_known = triangle.iter().all(|vertex| !self.delta[*vertex as usize].is_nan());
                if is_known && (b - a).norm() <= 2.0 * f64::from(self.slack) {
                    continue;
                }
                let allowed = self.slack + self.max_detail(triangle);
                each_position([a, b, c], |position| {
                    if self.phi_at(sampler, position).abs() > allowed {
                        out.push(cell_of(&position));
                    }
                });
            }
            Ok(out)
        };
        let lists: Vec<Vec<Coord>> = self
            .shape
            .triangles
            .par_chunks(GRAIN)
            .map_init(|| Sampler::new(self.distances), in_cells)
            .collect::<Result<_>>()?;
        Ok(lists.concat())
    }

    /// Adds the cells of hollows of the mesh that lie where phi is negative, and of their interior.
    fn hollows(&self, ctx: &Context, set: &mut CellSet) -> Result<()> {
        let triangles = &self.shape.triangles;
        if parts(self.in_cells.len(), triangles) < 2 {
            return Ok(());
        }
        let mut sampler = Sampler::new(self.distances);
        for part in components(triangles) {
            ctx.check()?;
            let corners = || part.iter().map(move |triangle| self.corners(&triangles[*triangle as usize]));
            let Some([first, ..]) = corners().next() else { continue };
            let six = corners().map(|corners| six_volumes(&corners, &first));
            let is_hollow = six.sum::<f64>() < 0.0;
            if is_hollow
                && corners().flatten().all(|position| self.phi_at(&mut sampler, position) < -self.slack)
            {
                let cells = part.iter().flat_map(|triangle| self.shape.cells_of(*triangle)).collect();
                self.fill(cells, set);
            }
        }
        Ok(())
    }

    /// Adds the cells of a hollow's surface and the cells with nodes in it.
    fn fill(&self, surface: Vec<Coord>, set: &mut CellSet) {
        let of = |pick: fn(i32, i32) -> i32| {
            surface.iter().copied().reduce(|a, b| [0, 1, 2].map(|axis| pick(a[axis], b[axis])))
        };
        let (Some(low), Some(high)) = (of(i32::min), of(i32::max)) else { return };
        let mut due: Vec<Coord> = Vec::new();
        for cell in surface {
            set.add(cell);
            due.extend(nodes_of(cell));
        }
        let mut seen: HashSet<Coord> = HashSet::new();
        while let Some(node) = due.pop() {
            let is_there = is_between(node, low, high.map(|at| at + 1));
            if !is_there || !seen.insert(node) || self.is_inside(node) || self.phi_of(node) >= -self.slack {
                continue;
            }
            cells_at(node).into_iter().for_each(|cell| _ = set.add(cell));
            for axis in 0..3 {
                for by in [-1, 1] {
                    let mut beside = node;
                    beside[axis] += by;
                    due.push(beside);
                }
            }
        }
    }

    /// Whether a node is inside the mesh.
    fn is_inside(&self, node: Coord) -> bool {
        self.shape.pierces.winding(node) > 0
    }

    /// phi at a node (cells).
    fn phi_of(&self, node: Coord) -> f32 {
        let node = plus(node, self.origin);
        let block = node.map(|at| at >> 3);
        let [x, y, z] = node.map(|at| (at & 7) as usize);
        match self.distances.find(block) {
            Some(slot) => self.distances.values(slot)[offset(x, y, z)],
            None => far(self.phi, self.distances.reach(), block, offset(x, y, z)),
        }
    }

    /// phi at a position (cells).
    fn phi_at(&self, sampler: &mut Sampler<'_>, position: DVec3) -> f32 {
        match sampler.at(position + DVec3::from(self.origin.map(f64::from))) {
            Some((phi, _)) => phi,
            None => self.phi_of(cell_of(&position)),
        }
    }

    fn corners(&self, triangle: &[u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| self.in_cells[vertex as usize])
    }

    /// Maximum detail of the corners of a triangle (cells).
    fn max_detail(&self, triangle: &[u32; 3]) -> f32 {
        triangle.iter().map(|vertex| self.detail[*vertex as usize]).fold(0.0, f32::max)
    }
}

/// Raises the maximum of a block.
fn raise(all: &mut BTreeMap<Coord, f32>, block: Coord, detail: f32) {
    let max = all.entry(block).or_default();
    *max = max.max(detail);
}

/// Calls `see` with positions on a triangle whose first edge is its longest, at most a cell apart.
fn each_position([a, b, c]: [DVec3; 3], mut see: impl FnMut(DVec3)) {
    let length = (b - a).norm();
    let height = if length > 0.0 { (b - a).cross(&(c - a)).norm() / length } else { 0.0 };
    let parts = |length: f64| length.ceil().clamp(1.0, POSITIONS);
    let rows = parts(height);
    for row in 0..=rows as u32 {
        let share = f64::from(row) / rows;
        let (from, to) = (a + (c - a) * share, b + (c - b) * share);
        let steps = parts((to - from).norm());
        for step in 0..=steps as u32 {
            see(from + (to - from) * (f64::from(step) / steps));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::check::faults::Faults;
    use crate::geometry::{TriMesh, Vec3};
    use crate::surface::test_particles::{context, numbered, own_surface, shell, two_balls};
    use crate::surface::{Params, Tracker};

    /// A mesh tracked along particles that stay where they are.
    fn followed(ctx: &Context, mesh: &TriMesh, positions: &[DVec3], every: bool) -> Tracker {
        let particles = numbered(positions.to_vec());
        let params = Params { rebuild: true, every, ..Params::for_spacing(1.0) };
        let mut tracker = Tracker::new(ctx, params, mesh, &particles).unwrap();
        for step in 0..3 {
            let report = tracker.step(ctx, &particles, &particles, 1.0 / 24.0).unwrap();
            assert!(step > 0 || report.flagged() == 0, "a vertex is flagged");
            assert!(every || report.change.is_none(), "step {step}");
        }
        tracker
    }

    fn parts(mesh: &TriMesh) -> usize {
        let faults = Faults::of(mesh);
        assert!(faults.by_index.is_watertight(), "{faults:?}");
        faults.parts
    }

    #[test]
    fn a_hollow_with_liquid_in_it_is_filled() {
        let ctx = context(2);
        let positions = shell(DVec3::zeros(), 0.0, 6.5);
        let mut mesh = own_surface(&ctx, &positions);
        let hollow = own_surface(&ctx, &shell(DVec3::new(2.5, 0.3, 0.2), 0.0, 2.0));
        let whole = mesh.volume();
        mesh.append(&hollow.clone().reversed());
        assert!(followed(&ctx, &mesh, &positions, false).triangles() == mesh.triangles);
        let filled = followed(&ctx, &mesh, &positions, true).mesh();
        let off = (filled.volume() - whole).abs();
        assert!(parts(&filled) == 1 && off < 0.1 * hollow.volume(), "{off} m3 of {}", hollow.volume());
    }

    #[test]
    fn a_bubble_of_the_liquid_is_meshed() {
        let ctx = context(2);
        let places = shell(DVec3::zeros(), 5.0, 8.5);
        let whole = own_surface(&ctx, &places);
        let of_part = |part: Vec<u32>| {
            let triangles = part.iter().map(|triangle| whole.triangles[*triangle as usize]).collect();
            TriMesh { positions: whole.positions.clone(), triangles }.without_unused()
        };
        let all: Vec<TriMesh> = components(&whole.triangles).into_iter().map(of_part).collect();
        let outer = all.iter().max_by(|a, b| a.volume().total_cmp(&b.volume())).unwrap();
        let bubble = outer.volume() - whole.volume();
        assert!(all.len() == 2 && bubble > 100.0, "{} parts, {bubble} m3", all.len());
        assert!(followed(&ctx, outer, &places, false).triangles() == outer.triangles);
        let meshed = followed(&ctx, outer, &places, true).mesh();
        let off = (meshed.volume() - whole.volume()).abs();
        assert!(parts(&meshed) == 2 && off < 0.1 * bubble, "{off} m3 of {bubble}");
    }

    #[test]
    fn a_needle_across_a_gap_is_cut() {
        let ctx = context(2);
        let positions = two_balls(3.5, DVec3::new(-7.0, 0.0, 0.0)).positions;
        let mut mesh = own_surface(&ctx, &positions);
        // The tip of a triangle that faces the other ball is pulled up to it.
        let x = |name: u32| mesh.positions[name as usize].x;
        let middle = |triangle: &usize| mesh.triangles[*triangle].map(x).iter().sum::<f32>();
        let left = (0..mesh.triangles.len()).filter(|triangle| middle(triangle) < 0.0);
        let nearest = left.max_by(|a, b| middle(a).total_cmp(&middle(b))).unwrap();
        let right = mesh.positions.iter().filter(|position| position.x > 0.0);
        let tip = right.min_by(|a, b| a.x.total_cmp(&b.x)).unwrap() - Vec3::new(0.4, 0.0, 0.0);
        let [a, b, c] = mesh.triangles.swap_remove(nearest);
        let at = mesh.positions.len() as u32;
        mesh.positions.push(tip);
        mesh.triangles.extend([[a, b, at], [b, c, at], [c, a, at]]);
        let longest = |tracker: &Tracker| {
            let positions = tracker.vertices();
            let corners = tracker.triangles().iter().map(|names| names.map(|name| positions[name as usize]));
            corners
                .map(|[a, b, c]| (a - b).norm().max((b - c).norm()).max((c - a).norm()))
                .fold(0.0, f64::max)
        };
        let without = longest(&followed(&ctx, &mesh, &positions, false));
        let tracker = followed(&ctx, &mesh, &positions, true);
        assert_eq!(parts(&tracker.mesh()), 2);
        let with = longest(&tracker);
        assert!(without > 4.0 && with < 2.5, "{without} m, {with} m");
    }

    #[test]
    fn detail_stays_as_it_is() {
        let ctx = context(2);
        let positions = shell(DVec3::zeros(), 0.0, 6.5);
        let mut mesh = own_surface(&ctx, &positions);
        // A bump of 2 m on one side, a dent of 1.5 m on the other.
        for position in &mut mesh.positions {
            let off = (position.x * position.x + position.z * position.z) / 9.0;
            let share = (1.0 - off).max(0.0) * (1.0 - off).max(0.0);
            let up = position.normalize() * (share * if position.y > 0.0 { 2.0 } else { -1.5 });
            *position += up;
        }
        let tracker = followed(&ctx, &mesh, &positions, true);
        assert!(tracker.triangles() == mesh.triangles);
        let now = tracker.mesh().positions;
        let far = now.iter().zip(&mesh.positions).map(|(a, b)| (a - b).norm());
        assert!(far.fold(0.0, f32::max) < 1e-3);
    }
}
