//! A moving body, prepared for the chain: closed triangles, and poses at suitable times.

use std::sync::Arc;

use rayon::prelude::*;
use xxhash_rust::xxh3::Xxh3;

use super::refine::{edge_error, refine};
use super::topology::{Simplex, Topology};
use crate::context::Context;
use crate::distance::Face;
use crate::distance::lattice::{Fixed, Lattice, UNITS};
use crate::error::{Error, Result, fail_if};
use crate::geometry::DVec3;
use crate::geometry::check::orientation::{Closing, Orientation};
use crate::geometry::mesh::weld::{Boundary, STEPS, Weld};
use crate::geometry::mesh::{coincident, spacing};
use crate::geometry::shape::bounds;
use crate::motion::Motion;
use crate::sweep::chain::{Weights, boundary};
use crate::sweep::window::Window;

/// Multiplies the number of steps with which a vertex's path in one step would be as long as the pieces that edges are split into; in
/// measurements, this value gave the fewest faces and the shortest time.
const STEP_FACTOR: f64 = 1.5;
/// The faces that edges sweep get at most as many steps as make each path this long (cells), or [`MAX_OVER_ARCS`] times as many as arcs
/// need, whichever is more; also measured.
const MIN_PATH: f64 = 4.0;
const MAX_OVER_ARCS: f64 = 1.5;
/// Maximum number of steps in an interval between two breaks of a motion.
const MAX_STEPS: f64 = 1024.0;
/// Maximum rotation (radians) in an interval for which five poses show the deviation from straight paths: a quarter turn.
const INTERVAL_ROTATION: f64 = std::f64::consts::FRAC_PI_2;
/// Maximum rotation in a frame (radians): 64 turns.
const MAX_ROTATION: f64 = 64.0 * std::f64::consts::TAU;
/// Bytes per vertex of a pose: in cells, in fixed point, and its share of the faces.
const BYTES_PER_POSITION: usize = 100;
/// Vertices or edges per task.
const GRAIN: usize = 2048;

/// A motion with its topology, prepared once and used for many intervals.
pub struct Body {
    motion: Box<dyn Motion>,
    shape: Arc<Shape>,
    longest_edge: f64,
    has_noise: bool,
    name: Option<String>,
}

/// The part of a body that does not change while its vertices move: topology and orientation.
pub struct Shape {
    /// Hash of the triangles.
    triangles: u128,
    /// For each vertex, the first vertex at the same position; itself if there is none before it.
    exact: Vec<u32>,
    /// The boundary of the mesh after vertices at the same position are joined.
    boundary: Boundary,
    /// Which vertices form one corner, including those within rounding of one another.
    weld: Weld,
    /// Maximum distance (m) between welded vertices that are not at the same position.
    slack: f64,
    /// The reoriented triangles, if they differ from the motion's own.
    oriented: Option<Vec<[u32; 3]>>,
    topology: Topology,
    contradictions: usize,
    /// A sentence about the part of its orientation that is ambiguous.
    doubts: Option<String>,
}

impl Body {
    /// Prepares a motion from its pose at `time` (s): welds vertices that coincide or, on open edges, lie within rounding of each other
    /// ([`Weld`]), omits duplicate triangles, orients closed components outward (see [`crate::geometry::check::orientation`]) and closes
    /// open loops; open components are flipped if the whole solid would otherwise have a negative volume.
    ///
    /// # Errors
    /// When the motion has no triangles, or its pose cannot be computed.
    pub fn new(motion: Box<dyn Motion>, time: f64) -> Result<Self> {
        Self::shaped(motion, time, None)
    }

    /// As [`Body::new`]; `known` is the shape of an earlier body, which is shared if it fits this body and gives it a volume that is not
    /// negative.
    ///
    /// # Errors
    /// As [`Body::new`].
    pub fn shaped(motion: Box<dyn Motion>, time: f64, known: Option<Arc<Shape>>) -> Result<Self> {
        fail_if(motion.triangles().is_empty(), || Error::argument("an object has no triangles"))?;
        let mut pose = Vec::new();
        motion.pose(time, &mut pose)?;
        let triangles = hash_of(motion.triangles());
        let exact = if motion.is_welded() {
            (0..pose.len() as u32).collect()
        } else {
            coincident(pose.iter().copied())
        };
        let known = match known.filter(|known| known.triangles == triangles && known.exact == exact) {
            Some(known) if known.has_same_weld(&*motion, time)? => {
                known.topology.complete(&mut pose);
                (volume(&known.topology, &pose) >= 0.0).then_some(known)
            }
            _ => None,
        };
        let shape = match known {
            Some(known) => known,
            None => {
                pose.truncate(exact.len());
                let shape = Shape::new(&*motion, time, &pose, triangles, exact)?;
                shape.topology.complete(&mut pose);
                Arc::new(shape)
            }
        };
        let length = |&[i, j]: &[u32; 2]| (pose[i as usize] - pose[j as usize]).norm();
        let edges = shape.topology.edges.par_iter().with_min_len(GRAIN);
        let longest_edge = edges.map(length).reduce(|| 0.0, f64::max);
        Ok(Self { motion, shape, longest_edge, has_noise: true, name: None })
    }

    /// Its topology and orientation, to share with later bodies.
    pub fn shape(&self) -> &Arc<Shape> {
        &self.shape
    }

    /// Sets whether its imprints have ragged edges (by default they do).
    pub fn with_noise(self, has_noise: bool) -> Self {
        Self { has_noise, ..self }
    }

    /// Sets its name, for messages.
    pub fn with_name(self, name: String) -> Self {
        Self { name: Some(name), ..self }
    }

    /// Its name, if set.
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Number of open loops that were closed; loops that share a vertex count once.
    pub fn closed_loops(&self) -> usize {
        self.shape.topology.derived.len()
    }

    /// Number of edges whose triangles disagree about inside and outside: two or more run along the edge in one direction without a
    /// counterpart.
    pub fn contradictions(&self) -> usize {
        self.shape.contradictions
    }

    /// For each vertex of its motion, the first vertex of the same corner; itself if there is none before it.
    pub fn corners(&self) -> &[u32] {
        &self.shape.weld.firsts
    }

    /// A warning about corners that are ambiguous within rounding; none if there are none.
    pub fn weld_warning(&self) -> Option<String> {
        self.shape.weld.warning()
    }

    /// Its triangles, including the caps of its open loops, counter-clockwise seen from outside; [`Body::closed_pose`] has their vertices.
    pub fn closed_triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.shape.topology.simplices.iter().map(Simplex::triangle)
    }

    /// The pose (m) at a time (s), followed by the centre vertices of its caps.
    ///
    /// # Errors
    /// When the pose cannot be computed.
    pub fn closed_pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.motion.pose(time, out)?;
        self.shape.topology.complete(out);
        Ok(())
    }

    /// Share of its surface that consists of caps, 0..=1, at a pose of [`Body::closed_pose`].
    pub fn share_of_caps(&self, pose: &[DVec3]) -> f64 {
        let topology = &self.shape.topology;
        let area = |simplex: &Simplex| simplex.doubled_area(pose);
        let all: f64 = topology.simplices.iter().map(area).sum();
        if all > 0.0 { topology.caps().map(area).sum::<f64>() / all } else { 0.0 }
    }

    /// Its motion's triangles, oriented outward and without duplicates.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.shape.oriented.as_deref().unwrap_or(self.motion.triangles())
    }

    /// A sentence about the part of its orientation that is ambiguous, without the body's name.
    pub fn doubts(&self) -> Option<&str> {
        self.shape.doubts.as_deref()
    }

    /// A warning that its orientation is ambiguous, or that its triangles disagree about inside and outside: a sentence without the body's
    /// name.
    pub fn warning(&self) -> Option<String> {
        let edges = self.contradictions();
        let disagree = || {
            format!(
                "its triangles disagree about inside and outside at {edges} edges, which `frazil mesh check` lists; holes are \
                 closed by cones, look at the result"
            )
        };
        self.doubts().map(String::from).or_else(|| (edges > 0).then(disagree))
    }

    /// Whether its imprints have ragged edges.
    pub fn has_noise(&self) -> bool {
        self.has_noise
    }

    /// The motion itself.
    pub fn motion(&self) -> &dyn Motion {
        &*self.motion
    }

    /// Boundary of the chain that the body sweeps from `from` to `to` (s), or of the pose itself if they are equal. `tolerance` (cells)
    /// bounds the error against true arcs and flat moving triangles.
    ///
    /// # Errors
    /// When a pose cannot be computed or a vertex is too far away for the lattice.
    pub fn faces(
        &self,
        ctx: &Context,
        from: f64,
        to: f64,
        lattice: &Lattice,
        tolerance: f64,
        window: &Window,
    ) -> Result<Vec<Face>> {
        let near = WindowTest::new(window, self.longest_edge / lattice.voxel);
        let mut poses = self.poses(ctx, from, to, lattice, tolerance, &near)?;
        ctx.check()?;
        let are_separate = self.do_welds_separate(&poses, lattice);
        let separate;
        let topology = if are_separate {
            let identity: Vec<u32> = (0..self.motion.vertex_count() as u32).collect();
            separate = Topology::new(self.triangles(), identity.len(), &identity, true);
            &separate
        } else {
            &self.shape.topology
        };
        poses.iter_mut().for_each(|pose| topology.complete(pose));
        let refined = refine(ctx, topology, &mut poses, tolerance, |step, edge| near.sees(step, &edge))?;
        ctx.check()?;
        let levels: Vec<Vec<Fixed>> = poses
            .par_iter()
            .map(|pose| pose.iter().map(|&cells| lattice.fix(cells)).collect())
            .collect::<Result<_>>()?;
        let weights = Weights { solid: 1, swept: 1 };
        boundary(ctx, refined.as_ref().unwrap_or(topology), &levels, weights, window)
    }

    /// Poses (cells), dense enough in time that straight steps stay within `tolerance` of the motion.
    fn poses(
        &self,
        ctx: &Context,
        from: f64,
        to: f64,
        lattice: &Lattice,
        tolerance: f64,
        near: &WindowTest,
    ) -> Result<Vec<Vec<DVec3>>> {
        let at = |time: f64| -> Result<Vec<DVec3>> {
            ctx.check()?;
            let mut pose = Vec::new();
            self.motion.pose(time, &mut pose)?;
            pose.iter_mut().for_each(|position| *position = lattice.to_cells(*position));
            // Check the extent before allocating anything proportional to it.
            pose.iter().try_for_each(|&cells| lattice.fix(cells).map(drop))?;
            Ok(pose)
        };
        let mut poses = vec![at(from)?];
        if to <= from {
            return Ok(poses);
        }
        let ends = self.interval_ends(from, to)?;
        let mut begin = from;
        for end in ends {
            let first = poses.last().expect("the first pose is there").clone();
            let last = at(end)?;
            let quarter = |&t: &f64| at(begin + t * (end - begin));
            let quarters: Vec<Vec<DVec3>> =
                [0.25, 0.5, 0.75].par_iter().map(quarter).collect::<Result<_>>()?;
            let steps =
                self.step_count(&[&first, &quarters[0], &quarters[1], &quarters[2], &last], tolerance, near);
            let count = poses.len() + steps;
            let bytes = (count * self.shape.topology.vertex_count() * BYTES_PER_POSITION) as u64;
            ctx.allow("the poses of a body (a shorter motion or larger cells need fewer)", bytes)?;
            let step = |step: usize| at(begin + (end - begin) * step as f64 / steps as f64);
            poses.extend((1..steps).into_par_iter().map(step).collect::<Result<Vec<_>>>()?);
            poses.push(last);
            begin = end;
        }
        Ok(poses)
    }

    /// Upper bound on its rotation (radians) from `from` to `to` (s).
    ///
    /// # Errors
    /// More than 64 turns.
    pub fn turning(&self, from: f64, to: f64) -> Result<f64> {
        let turning = self.motion.turning(from, to);
        if turning > MAX_ROTATION {
            return Err(Error::argument(format!(
                "{} turns by {:.0} degrees in a step, more than {:.0}",
                self.name().unwrap_or("an object"),
                turning.to_degrees(),
                MAX_ROTATION.to_degrees()
            )));
        }
        Ok(turning)
    }

    /// Ends of the sub-intervals in which steps are chosen: the motion's breaks, and times between which it rotates so little that five
    /// poses show how far its paths deviate from straight lines.
    fn interval_ends(&self, from: f64, to: f64) -> Result<Vec<f64>> {
        self.turning(from, to)?;
        let mut ends = Vec::new();
        let mut begin = from;
        for end in self.motion.breaks(from, to).into_iter().chain([to]) {
            let parts = (self.motion.turning(begin, end) / INTERVAL_ROTATION).ceil().max(1.0);
            ends.extend((1..parts as usize).map(|part| begin + (end - begin) * part as f64 / parts));
            ends.push(end);
            begin = end;
        }
        Ok(ends)
    }

    /// Number of equal steps an interval needs, from five poses at its quarters.
    fn step_count(&self, probes: &[&Vec<DVec3>; 5], tolerance: f64, near: &WindowTest) -> usize {
        let bend = |vertex: usize| -> f64 {
            let path = probes.map(|probe| probe[vertex]);
            if !near.reaches(&path) {
                return 0.0;
            }
            let off = |(index, t): (usize, f64)| (path[index] - path[0].lerp(&path[4], t)).norm_squared();
            [(1, 0.25), (2, 0.5), (3, 0.75)].map(off).into_iter().fold(0.0, f64::max)
        };
        let vertices = (0..probes[0].len()).into_par_iter().with_min_len(GRAIN);
        let bend = vertices.map(bend).reduce(|| 0.0, f64::max);
        let arcs = (bend.sqrt() / tolerance).sqrt();
        let ends = [&probes[0][..], &probes[4][..]];
        let own = self.shape.topology.own_vertices as u32;
        // Enough steps that the faces swept by edges are well shaped once the edges are split.
        let twist = |edge: &[u32; 2]| {
            let error = if edge[1] < own { edge_error(ends, *edge) } else { 0.0 };
            if error <= tolerance || !near.sees(ends, edge) {
                return 0.0;
            }
            let [i, j] = edge.map(|vertex| vertex as usize);
            let path_length = (ends[1][i] - ends[0][i]).norm().max((ends[1][j] - ends[0][j]).norm());
            let length = (ends[0][i] - ends[0][j]).norm().max((ends[1][i] - ends[1][j]).norm());
            let steps = STEP_FACTOR * (error / tolerance * path_length / length).sqrt();
            steps.min((path_length / MIN_PATH).max(MAX_OVER_ARCS * arcs))
        };
        let twists =
            self.shape.topology.edges.par_iter().with_min_len(GRAIN).map(twist).reduce(|| 0.0, f64::max);
        arcs.max(twists).ceil().clamp(1.0, MAX_STEPS) as usize
    }

    /// Whether welded vertices move apart in the poses (cells) by more than the rounding of their coordinates.
    fn do_welds_separate(&self, poses: &[Vec<DVec3>], lattice: &Lattice) -> bool {
        let Shape { weld, slack, .. } = &*self.shape;
        let origin = DVec3::from(lattice.origin.map(f64::from));
        let rounding = |cells: &DVec3| {
            let farthest = (cells + origin).amax() * lattice.voxel;
            (slack + f64::from(STEPS as i32) * 3f64.sqrt() * spacing(farthest)) / lattice.voxel
        };
        let is_apart = |(vertex, &first): (usize, &u32)| {
            let first = first as usize;
            let differ = |pose: &Vec<DVec3>| {
                pose[vertex] != pose[first] && (pose[vertex] - pose[first]).norm() > rounding(&pose[vertex])
            };
            first != vertex && poses.iter().any(differ)
        };
        weld.firsts.iter().enumerate().any(is_apart)
    }
}

/// Tests whether moving vertices and edges can touch the window.
struct WindowTest {
    low: DVec3,
    high: DVec3,
    longest: f64,
}

impl WindowTest {
    fn new(window: &Window, longest: f64) -> Self {
        let cells = |p: Fixed| DVec3::from(p.map(|value| f64::from(value) / f64::from(UNITS)));
        Self { low: cells(window.min), high: cells(window.max), longest }
    }

    fn touches(&self, path: impl Iterator<Item = DVec3>, margin: f64) -> bool {
        let (low, high) = bounds(path);
        (0..3).all(|a| high[a] + margin >= self.low[a] && low[a] - margin <= self.high[a])
    }

    /// Whether a face at a vertex on this path can touch the window.
    fn reaches(&self, path: &[DVec3]) -> bool {
        self.touches(path.iter().copied(), self.longest)
    }

    /// Whether the patch that an edge sweeps in a step can touch the window.
    fn sees(&self, step: [&[DVec3]; 2], edge: &[u32; 2]) -> bool {
        self.touches(step.into_iter().flat_map(|pose| edge.map(|vertex| pose[vertex as usize])), 1.0)
    }
}

impl Shape {
    /// The shape of a motion with this pose at a time (s), given the hash of its triangles and its vertices at equal positions.
    fn new(motion: &dyn Motion, time: f64, pose: &[DVec3], triangles: u128, exact: Vec<u32>) -> Result<Self> {
        let own = motion.triangles();
        let (mut boundary, mut weld) =
            (Boundary::default(), Weld { firsts: exact.clone(), ..Weld::default() });
        if !motion.is_welded() && Topology::new(own, pose.len(), &exact, false).has_lone_triangles() {
            boundary = Boundary::of(own, &exact);
            weld = welded(motion, time, &exact, &boundary)?;
        }
        let apart = |&vertex: &u32| {
            let first = weld.firsts[vertex as usize];
            (pose[vertex as usize] - pose[first as usize]).norm()
        };
        let slack = weld.near.iter().map(apart).fold(0.0, f64::max);
        let mut orientation = Orientation::of(pose, own, &weld.firsts, Closing::Caps);
        let of = |orientation: &Orientation| {
            let oriented = (!orientation.is_unchanged()).then(|| orientation.applied(own));
            let topology = Topology::new(oriented.as_deref().unwrap_or(own), pose.len(), &weld.firsts, false);
            let contradictions = topology.contradictions();
            (oriented, topology, contradictions)
        };
        let (mut oriented, mut topology, mut contradictions) = of(&orientation);
        topology.close();
        if orientation.has_open() {
            // The volume with all triangles as the motion has them, open components included.
            let mut closed = pose.to_vec();
            topology.complete(&mut closed);
            let [before, now] = orientation.volumes();
            if volume(&topology, &closed) - now + before < 0.0 {
                orientation.turn_open();
                (oriented, topology, contradictions) = of(&orientation);
                topology.close();
            }
        }
        let doubts = orientation.warning();
        Ok(Self { triangles, exact, boundary, weld, slack, oriented, topology, contradictions, doubts })
    }

    /// Whether a motion with the same triangles and the same vertices at equal positions has the same corners at a time (s).
    fn has_same_weld(&self, motion: &dyn Motion, time: f64) -> Result<bool> {
        Ok(self.boundary.is_empty() || welded(motion, time, &self.exact, &self.boundary)? == self.weld)
    }
}

/// The corners of a motion at a time (s), by the rounding of its coordinates as they were read.
fn welded(motion: &dyn Motion, time: f64, exact: &[u32], boundary: &Boundary) -> Result<Weld> {
    let mut read = Vec::new();
    motion.pose_as_read(time, &mut read)?;
    Ok(Weld::with_boundary(&read, motion.triangles(), exact.to_vec(), boundary))
}

fn hash_of(triangles: &[[u32; 3]]) -> u128 {
    let mut hash = Xxh3::new();
    let mut bytes = [0; 12 * 256];
    for part in triangles.chunks(256) {
        let indices = part.as_flattened();
        let used = bytes.chunks_exact_mut(4).zip(indices);
        used.for_each(|(to, index)| to.copy_from_slice(&index.to_le_bytes()));
        hash.update(&bytes[..4 * indices.len()]);
    }
    hash.digest128()
}

/// Volume of the solid (m3), summed in an order that does not depend on threads.
fn volume(topology: &Topology, pose: &[DVec3]) -> f64 {
    let six = |simplex: &super::topology::Simplex| {
        let [a, b, c] = simplex.v.map(|vertex| pose[vertex as usize]);
        a.dot(&b.cross(&c)) * f64::from(simplex.sign)
    };
    let parts: Vec<f64> =
        topology.simplices.par_chunks(GRAIN).map(|part| part.iter().map(six).sum()).collect();
    parts.iter().sum::<f64>() / 6.0
}
